/* What particles answer after each trial: which ISI tells most, and where the window is. */

#ifndef ISIW_ANSWERS_H
#define ISIW_ANSWERS_H

#include "information.h"
#include "learning.h"
#include "windows.h"

/* Windows of particles on the grid of a space, at some ISIs of its range, as runs of indices, (s, 4). */
static int windows_of(const Tables *tables, int64_t samples, const float *fields, const float *means, int64_t isis,
                      const float *isi_ms, float *levels, int32_t *runs) {
    int failed = edge_levels(samples, tables->rows, tables->points, tables->fine, fields, means, tables->grid_ms, levels);
    return failed ? failed : window_runs(samples, isis, fields, levels, isi_ms, runs);
}

static int scores(const Tables *tables, int64_t people, int64_t samples, int64_t order, int64_t isis, int64_t points,
                  const float *fields, const float *isi_ms, const float *masks, float *found) {
    int64_t rows = tables->rows, outcomes = tables->outcomes, each = samples * (rows * (2 + outcomes) + isis);
    float ends[2], *room = malloc((size_t)each * sizeof *room);
    int failed = !room;
    for (int64_t person = 0; !failed && person < people; person++) {
        const float *own = fields + person * samples * FIELDS;
        float *levels = room, *means = levels + samples * rows, *table = means + samples * rows;
        float *at = table + samples * rows * outcomes;
        evoked_means(samples, rows, own, levels, means);
        facilitations(samples, isis, own, isi_ms, at);
        failed = outcome_tables(1, samples, rows, outcomes, order, own, levels, means, tables->cells, ends, table);
        Foreseen of = {samples, rows, isis, outcomes, own, table, at};
        failed = failed || reductions_of(&of, points, masks + person * samples * points, found + person * isis);
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
    for (int64_t i = 0; !failed && i < samples * isis; i++) {
        const int32_t *own = runs + i / isis * 4, t = (int32_t)(i % isis);
        masks[i] = (own[0] <= t && t < own[1]) || (own[2] <= t && t < own[3]);
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
        for (int64_t i = 0; !failed && i < size; i++) fields[i * FIELDS + REST] += fields[i * FIELDS + SLOPE] * (float)stronger;
        if (!failed) failed = scores(tables, 1, size, trials, isis, points, fields, isi_ms, masks, found + person * isis);
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
    if (!failed) evoked_means(size, tables->rows, fields, levels, means);
    failed = failed || windows_of(tables, size, fields, means, tables->points, tables->grid_ms, edges, runs) ||
             best_window(size, 2, tables->points, cuts, runs, shares, inside, f1);
    free(fields);
    return failed ? -1 : 0;
}

#endif
