/* What particles answer after each trial: which ISI tells most, and where the window is. */

#ifndef ISIW_ANSWERS_H
#define ISIW_ANSWERS_H

#include "information.h"
#include "learning.h"
#include "windows.h"

/* Windows of particles on the grid of a space, at some ISIs of its range, as runs of indices, (s, 4). */
static int windows_of(const Tables *tables, int64_t samples, const float *fields, const float *means, int64_t isis,
                      const float *isi_ms, float *levels, int32_t *runs) {
    int64_t rows = tables->rows, points = tables->points;
    int failed = edge_levels(samples, rows, points, (int32_t)tables->fine, fields, means, tables->grid_ms, levels);
    return failed ? failed : window_runs(samples, isis, fields, levels, isi_ms, runs);
}

#define LEAST_LEVEL 1e-10f /* a smaller facilitation is none: 2e-4 of the way to the next of 24 rows */

/* Add what a sample foresees at some ISIs to all sums; its table has the rows between which that lies. */
static void foresee(Sums *sums, const Tables *tables, const float *fields, int64_t order, const float *levels,
                    const float *cells, const float *isi_ms, const float *window, float *room) {
    int64_t rows = tables->rows, outcomes = tables->outcomes, from = sums->isis, to = 0;
    float *table = room + 2 * NODES * rows, *rest = table + rows * outcomes, *at = rest + outcomes;
    float *mass = at + sums->isis, depth = fields[DEPTH];
    uint8_t *needed = (uint8_t *)(mass + sums->isis * outcomes);
    facilitations_at(fields, isi_ms, sums->isis, at);
    memset(needed, 0, (size_t)rows);
    for (int64_t t = -1; t < sums->isis; t++) {
        int64_t row = row_below(position_of(t < 0 ? 0.0f : at[t], depth, rows), rows);
        needed[row] = needed[row + 1] = 1;
        if (t < 0 || fabsf(at[t]) < LEAST_LEVEL) continue;
        from = t < from ? t : from, to = t + 1;
    }
    table_of(fields, order, levels, rows, needed, cells, outcomes, room, table);
    between_rows(table, rows, outcomes, depth, 0.0f, rest);
    for (int64_t t = from; t < to; t++) between_rows(table, rows, outcomes, depth, at[t], mass + t * outcomes);
    add_sample(sums, window, rest, from < to ? from : 0, to, mass);
}

static int scores(const Tables *tables, int64_t people, int64_t samples, int64_t order, int64_t isis, int64_t points,
                  const float *fields, const float *isi_ms, const float *masks, float *found) {
    int64_t rows = tables->rows, outcomes = tables->outcomes, each = (rows + 1 + isis) * outcomes + 2 * NODES * rows;
    each += isis + rows; /* as numbers of flags */
    float ends[2], *room = malloc((size_t)(each + samples * (2 * rows + 1) + 2 * outcomes) * sizeof *room);
    int failed = !room;
    for (int64_t person = 0; !failed && person < people; person++) {
        const float *own = fields + person * samples * FIELDS, *windows = masks + person * samples * points;
        float *levels = room + each, *means = levels + samples * rows, *sorted = means + samples * rows;
        float *cells = sorted + samples;
        Sums sums;
        evoked_means(samples, rows, own, levels, means);
        ends_of(samples, rows, own, means, sorted, ends);
        outcomes_between(ends, tables->cells, outcomes, cells);
        failed = !begin(&sums, isis, outcomes, points);
        for (int64_t s = 0; !failed && s < samples; s++, own += FIELDS, levels += rows, windows += points)
            foresee(&sums, tables, own, order, levels, cells, isi_ms, windows, room);
        failed = failed || reduced(&sums, samples, found + person * isis);
        free(sums.rest);
    }
    free(room);
    return failed ? -1 : 0;
}

/* Membership of the ISIs in the window of each sample, 0 or 1, (s, isis). */
static int masks_of(const Tables *tables, int64_t samples, const float *fields, int64_t isis, const float *isi_ms,
                    float *masks) {
    float *room = malloc((size_t)(samples * (2 * tables->rows + 1)) * sizeof *room);
    int32_t *runs = malloc((size_t)samples * 4 * sizeof *runs);
    int failed = !room || !runs;
    if (!failed) {
        float *means = room + samples * tables->rows, *edges = means + samples * tables->rows;
        evoked_means(samples, tables->rows, fields, room, means);
        failed = windows_of(tables, samples, fields, means, isis, isi_ms, edges, runs);
    }
    for (int64_t s = 0; !failed && s < samples; s++) {
        const int32_t *own = runs + 4 * s;
        for (int32_t t = 0; t < isis; t++)
            *masks++ = (own[0] <= t && t < own[1]) || (own[2] <= t && t < own[3]);
    }
    free(room), free(runs);
    return failed;
}

static int ask(const Tables *tables, const Tables *usual, int64_t people, int64_t particles, int64_t size,
               int64_t trials, int32_t of_window, double stronger, int64_t isis, const float *values,
               const int64_t *kinds, const float *densities, const double *log_weights, const float *isi_ms,
               float *found) {
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    int64_t points = of_window ? isis : 0;
    double *weights = malloc((size_t)particles * sizeof *weights);
    int64_t *picks = malloc((size_t)size * sizeof *picks);
    float *fields = malloc((size_t)(size * (FIELDS + points)) * sizeof *fields);
    int failed = !weights || !picks || !fields;
    for (int64_t person = 0; !failed && person < people; person++) {
        int64_t first = person * particles;
        const float *own = values + first * tables->latents, *known = densities + first * kept_of(tables);
        const int64_t *own_kinds = kinds + first * KINDS;
        const double *weighed = log_weights + first;
        float *masks = fields + size * FIELDS;
        if (usual) {
            usual_weights(tables, usual, 1, particles, own, own_kinds, known, weighed, weights);
            weighed = weights;
        }
        failed = represent(tables, 1, particles, size, trials, own, own_kinds, weighed, picks, fields);
        if (!failed && points) failed = masks_of(tables, size, fields, isis, isi_ms, masks);
        for (float *one = fields; !failed && one < fields + size * FIELDS; one += FIELDS)
            one[REST] += one[SLOPE] * (float)stronger;
        float *to = found + person * isis;
        failed = failed || scores(tables, 1, size, trials, isis, points, fields, isi_ms, masks, to);
    }
    free(weights), free(picks), free(fields);
    return failed ? -1 : 0;
}

static int estimate(const Tables *tables, int64_t particles, int64_t size, int64_t trials, int64_t cuts,
                    const float *values, const int64_t *kinds, const double *log_weights, const double *shares,
                    int64_t *picks, int32_t *runs, uint8_t *inside, double *f1) {
    if (!known_kinds(tables, particles, kinds)) return NO_PARTICLES;
    float *fields = malloc((size_t)(size * (FIELDS + 2 * tables->rows + 1)) * sizeof *fields);
    if (!fields) return -1;
    float *levels = fields + size * FIELDS, *means = levels + size * tables->rows, *edges = means + size * tables->rows;
    int failed = represent(tables, 1, particles, size, trials, values, kinds, log_weights, picks, fields);
    int64_t others = 0; /* picks are in order, and the same ones have the same window */
    for (int64_t i = 0; !failed && i < size; i++)
        if (!i || picks[i] != picks[i - 1])
            memmove(fields + others++ * FIELDS, fields + i * FIELDS, FIELDS * sizeof *fields);
    if (!failed) evoked_means(others, tables->rows, fields, levels, means);
    failed = failed || windows_of(tables, others, fields, means, tables->points, tables->grid_ms, edges, runs);
    for (int64_t i = size - 1; !failed && i > 0; i--) {
        memmove(runs + 4 * i, runs + 4 * (others - 1), 4 * sizeof *runs);
        others -= picks[i] != picks[i - 1];
    }
    failed = failed || best_window(size, 2, tables->points, cuts, runs, shares, inside, f1);
    free(fields);
    return failed ? -1 : 0;
}

#endif
