/* What particles answer after each trial: which ISI tells most, and where the window is. */

#ifndef ISIW_ANSWERS_H
#define ISIW_ANSWERS_H

#include "information.h"
#include "learning.h"
#include "windows.h"

#define LEAST_LEVEL 1e-10f /* a smaller facilitation is none: 2e-4 of the way to the next of 24 rows */

/* Windows of particles on the grid of a space, at some ISIs of its range, as runs of indices, (s, 4). */
static int windows_of(const Tables *tables, int64_t samples, const float *fields, const float *means, int64_t isis,
                      const float *isi_ms, float *levels, int32_t *runs) {
    int64_t rows = tables->rows, points = tables->points;
    int failed = edge_levels(samples, rows, points, (int32_t)tables->fine, fields, means, tables->grid_ms, levels);
    return failed ? failed : window_runs(samples, isis, fields, levels, isi_ms, runs);
}

/* Add a sample's window, and what it foresees at some ISIs, to sums; its table has the rows between which that lies. */
static void foresee(Sums *sums, const Tables *tables, const float *fields, int64_t order, const float *levels,
                    const float *cells, const float *isi_ms, const int32_t *runs, float *room) {
    int64_t rows = tables->rows, outcomes = tables->outcomes, isis = sums->isis, from = isis, to = 0;
    float *table = room + 3 * NODES * rows, *rest = table + rows * outcomes, *at = rest + outcomes;
    float *window = at + isis, *mass = window + isis, depth = fields[DEPTH];
    uint8_t *needed = (uint8_t *)(mass + isis * outcomes);
    facilitations_at(fields, isi_ms, isis, at);
    memset(needed, 0, (size_t)rows);
    for (int64_t t = -1; t < isis; t++) {
        int64_t row = row_below(position_of(t < 0 ? 0.0f : at[t], depth, rows), rows);
        needed[row] = needed[row + 1] = 1;
        if (t < 0 || fabsf(at[t]) < LEAST_LEVEL) continue;
        from = t < from ? t : from, to = t + 1;
    }
    table_of(fields, order, levels, rows, needed, cells, outcomes, room, table);
    between_rows(table, rows, outcomes, depth, 0.0f, rest);
    for (int64_t t = from; t < to; t++) between_rows(table, rows, outcomes, depth, at[t], mass + t * outcomes);
    for (int32_t t = 0; t < sums->points; t++)
        window[t] = (runs[0] <= t && t < runs[1]) || (runs[2] <= t && t < runs[3]);
    add_sample(sums, window, rest, from < to ? from : 0, to, mass);
}

static int ask(const Tables *tables, const Tables *usual, int64_t people, int64_t particles, int64_t size,
               int64_t trials, int32_t of_window, double stronger, int64_t isis, const float *values,
               const int64_t *kinds, const float *densities, const double *log_weights, const float *isi_ms,
               float *found) {
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    int64_t rows = tables->rows, outcomes = tables->outcomes, of_all = size * (FIELDS + 2 * rows + 1);
    int64_t of_one = 3 * NODES * rows + (rows + 1 + isis) * outcomes + 2 * isis + rows; /* with flags as numbers */
    float *fields = malloc((size_t)(of_all + 2 * outcomes + of_one) * sizeof *fields);
    double *weights = malloc((size_t)particles * sizeof *weights);
    int64_t *picks = malloc((size_t)size * sizeof *picks);
    int32_t *runs = malloc((size_t)size * 4 * sizeof *runs);
    int failed = !weights || !picks || !fields || !runs;
    for (int64_t first = 0; !failed && first < people * particles; first += particles, found += isis) {
        float *levels = fields + size * FIELDS, *means = levels + size * rows, *sorted = means + size * rows, ends[2];
        float *cells = fields + of_all, *room = cells + 2 * outcomes;
        const float *own = values + first * tables->latents, *known = densities + first * kept_of(tables);
        const double *weighed = log_weights + first;
        Sums sums;
        if (usual) {
            usual_weights(tables, usual, 1, particles, own, kinds + first * KINDS, known, weighed, weights);
            weighed = weights;
        }
        failed = represent(tables, 1, particles, size, trials, own, kinds + first * KINDS, weighed, picks, fields) ||
                 !begin(&sums, isis, outcomes, of_window ? isis : 0);
        if (failed) break;
        evoked_means(size, rows, fields, levels, means);
        if (of_window) failed = windows_of(tables, size, fields, means, isis, isi_ms, sorted, runs);
        for (int64_t i = 0; i < size; i++) fields[i * FIELDS + REST] += fields[i * FIELDS + SLOPE] * (float)stronger;
        if (stronger != 0.0) evoked_means(size, rows, fields, levels, means);
        ends_of(size, rows, fields, means, sorted, ends);
        outcomes_between(ends, tables->cells, outcomes, cells);
        for (int64_t i = 0; !failed && i < size; i++)
            foresee(&sums, tables, fields + i * FIELDS, trials, levels + i * rows, cells, isi_ms, runs + 4 * i, room);
        failed = failed || reduced(&sums, size, found);
        free(sums.rest);
    }
    free(weights), free(picks), free(fields), free(runs);
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
