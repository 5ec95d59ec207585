/* Windows of particles: where facilitation crosses the level of an edge, as runs of ISIs. */

#ifndef ISIW_WINDOWS_H
#define ISIW_WINDOWS_H

#include "predictions.h"

#define EDGE_LEVEL 0.135f /* of the largest enhancement, at a window's edge */
#define MIN_EXCESS_MV 0.002f
#define MIN_EXCESS_OF_BASELINE 0.10f
#define NOWHERE 2.0f

/* Largest facilitation at some ISIs; where these are close to each other, in all of their range: profiles fall off on
both sides of their peaks. */
static float highest(const float *fields, const float *isi_ms, int64_t isis, int fine, float *room) {
    float at[3] = {peak_at(fields), FIRST_PEAK, SECOND_PEAK}, most = 0.0f;
    int64_t count = fine ? 3 : isis;
    for (int i = 0; i < 3; i++)
        at[i] = least_1(most_1(fields[START] + at[i] * fields[WIDTH], isi_ms[0]), isi_ms[isis - 1]);
    facilitations_at(fields, fine ? at : isi_ms, count, room);
    for (int64_t i = 0; i < count; i++) most = most_1(most, room[i]);
    return fine ? least_1(most, 1.0f) : most;
}

/* Facilitation at a window's edge by the least-excess rule; 2 where there is no window. */
static float edge_level(const float *fields, const float *evoked, int64_t rows, float most) {
    float floor_mv = exp_1(fields[LOG_FLOOR]), position = position_of(most, 0.0f, rows);
    int64_t row = row_below(position, rows), right = 1;
    float peak = evoked[row] + (position - (float)row) * (evoked[row + 1] - evoked[row]) - evoked[0];
    float peak_mv = floor_mv * peak;
    float baseline_mv = floor_mv * (evoked[0] + exp_1(0.5f * fields[FLOOR_SD] * fields[FLOOR_SD]));
    if (fields[PRESENT] == 0.0f || peak_mv < most_1(MIN_EXCESS_OF_BASELINE * baseline_mv, MIN_EXCESS_MV))
        return NOWHERE;
    float least_mv = EDGE_LEVEL * peak_mv;
    while (right < rows - 1 && floor_mv * (evoked[right] - evoked[0]) < least_mv) right++;
    float low_mv = floor_mv * (evoked[right - 1] - evoked[0]), high_mv = floor_mv * (evoked[right] - evoked[0]);
    float place = ((float)(right - 1) + (least_mv - low_mv) / most_1(high_mv - low_mv, 1e-12f)) / (float)(rows - 1);
    return place * place;
}

static int edge_levels(int64_t samples, int64_t rows, int64_t isis, int32_t fine, const float *fields,
                       const float *evoked, const float *isi_ms, float *found) {
    float *room = malloc((size_t)(isis + 3) * sizeof *room);
    if (!room) return -1;
    for (int64_t i = 0; i < samples; i++) {
        const float *one = fields + i * FIELDS;
        found[i] = edge_level(one, evoked + i * rows, rows, highest(one, isi_ms, isis, fine, room));
    }
    free(room);
    return 0;
}

/* How many of some ascending ISIs are below an edge. */
static int64_t below(const float *isi_ms, int64_t isis, float edge_ms) {
    int64_t low = 0, high = isis;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (isi_ms[middle] < edge_ms)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The runs of two peaks: at most two. */
static void runs_above(const float *level, int64_t isis, float least, int32_t *runs) {
    int place = 0, inside = 0;
    for (int64_t t = 0; t < isis; t++)
        if ((level[t] >= least) != inside) {
            inside = !inside;
            runs[place < 3 ? place : 3] = (int32_t)t;
            place++;
        }
    if (inside) runs[place < 3 ? place : 3] = (int32_t)isis;
}

/* The run of one peak, solved for the crossings. */
static void run_of_peak(const float *fields, const float *isi_ms, int64_t isis, float level, int32_t *runs) {
    float away = root_1(-0.5f * log_1(level)), at = peak_at(fields); /* in flanks */
    if (fields[SHAPE] == PLATEAU) away = exp_1(log_1(most_1(away, 1e-12f)) * exp_1(-0.75f * (fields[FORM] + 1.0f)));
    float away_ms = away * fields[WIDTH], peak_ms = fields[START] + at * fields[WIDTH];
    float last_ms = peak_ms + (1.0f - at) * away_ms;
    int64_t first = below(isi_ms, isis, peak_ms - at * away_ms), behind = below(isi_ms, isis, last_ms);
    while (behind < isis && isi_ms[behind] == last_ms) behind++;
    if (behind > first) runs[0] = (int32_t)first, runs[1] = (int32_t)behind;
}

static int window_runs(int64_t samples, int64_t isis, const float *fields, const float *levels, const float *isi_ms,
                       int32_t *runs) {
    float *room = malloc((size_t)(isis + 1) * sizeof *room);
    if (!room) return -1;
    memset(runs, 0, (size_t)samples * 4 * sizeof *runs);
    for (int64_t i = 0; i < samples; i++) {
        const float *one = fields + i * FIELDS;
        if (one[SHAPE] == TWO_PEAK && levels[i] != NOWHERE) {
            facilitations_at(one, isi_ms, isis, room);
            runs_above(room, isis, levels[i], runs + 4 * i);
        } else if (one[SHAPE] != TWO_PEAK && levels[i] <= 1.0f) {
            run_of_peak(one, isi_ms, isis, levels[i], runs + 4 * i);
        }
    }
    free(room);
    return 0;
}

/* Expected F1 of a set of ISIs with sampled windows, by how many of the set are before each ISI, (isis + 1,). */
static double expected_f1(const int32_t *runs, int64_t samples, int64_t most_runs, const int64_t *before,
                          int64_t isis) {
    double sum = 0.0;
    int64_t windows = 0;
    for (int64_t s = 0; s < samples; s++) {
        int64_t size = 0, overlap = 0;
        for (const int32_t *run = runs + s * most_runs * 2, *end = run + most_runs * 2; run < end; run += 2)
            size += run[1] - run[0], overlap += before[run[1]] - before[run[0]];
        if (!size) continue;
        sum += (double)overlap / (double)(before[isis] + size), windows++;
    }
    return 2.0 * (sum / (double)windows);
}

/* The set of ISIs of largest expected F1, of those in at least some shares of as many windows as any is in. */
static int best_window(int64_t samples, int64_t most_runs, int64_t isis, int64_t cuts, const int32_t *runs,
                       const double *shares, uint8_t *inside, double *f1) {
    int64_t *before = calloc((size_t)(2 * isis + 2), sizeof *before), windows = 0, within = 0;
    if (!before) return -1;
    int64_t *members = before + isis + 1, most = 0;
    for (int64_t s = 0; s < samples; s++) {
        const int32_t *own = runs + s * most_runs * 2;
        windows += own[0] < own[1];
        for (int64_t i = 0; i < 2 * most_runs; i += 2) members[own[i]]++, members[own[i + 1]]--;
    }
    for (int64_t t = 0; t < isis; t++) {
        within = members[t] += within, inside[t] = 0;
        most = within > most ? within : most;
    }
    *f1 = 0.0;
    for (int64_t cut = 0; windows && cut < cuts; cut++) {
        double per = (double)windows, least = shares[cut] * ((double)most / per);
        for (int64_t t = 0; t < isis; t++) before[t + 1] = before[t] + ((double)members[t] / per >= least);
        double found = expected_f1(runs, samples, most_runs, before, isis);
        if (cut && found <= *f1) continue;
        *f1 = found;
        for (int64_t t = 0; t < isis; t++) inside[t] = (uint8_t)(before[t + 1] - before[t]);
    }
    free(before);
    return 0;
}

#endif
