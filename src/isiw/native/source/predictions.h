/* What particles predict: expected MEPs, and the distribution of the next one, in tables by facilitation.

Here the lanes are the rows of a table, or the outcomes. */

#ifndef ISIW_PREDICTIONS_H
#define ISIW_PREDICTIONS_H

#include "likelihood.h"

/* Facilitations of the rows: squares of equal steps, or equal steps from the deepest depression. */
static void table_rows(int64_t samples, int64_t rows, const float *fields, float *levels) {
    for (int64_t i = 0; i < samples; i++) {
        float depth = fields[i * FIELDS + DEPTH];
        for (int64_t row = 0; row < rows; row++) {
            float share = (float)row / (float)(rows - 1);
            levels[i * rows + row] = depth > 0.0f ? share * (1.0f + depth) - depth : share * share;
        }
    }
}

/* Where a facilitation lies among the rows of a table. */
INLINE float position_of(float level, float depth, int64_t rows) {
    float share = depth > 0.0f ? (level + depth) / (1.0f + depth) : root_1(least_1(most_1(level, 0.0f), 1.0f));
    return least_1(most_1(share, 0.0f), 1.0f) * (float)(rows - 1);
}

/* The row below a position; no number is no row either. */
INLINE int64_t row_below(float position, int64_t rows) {
    if (!(position > 0.0f)) return 0;
    return position < (float)(rows - 2) ? (int64_t)position : rows - 2;
}

/* Probability of a response at facilitations. */
INLINE Reals responses(const float *fields, Reals level) {
    level = most_v(level, all(0.0f));
    if (fields[NOISE] == MISSING) return fields[MOST] * root_v(level);
    if (fields[NOISE] == ALL_OR_NONE) return fields[LEAST] + (fields[MOST] - fields[LEAST]) * level;
    return all(1.0f);
}

/* Expected MEPs above the floor: nodes that have all of the variance of the noise are enough for an expectation. */
static int evoked_means(int64_t samples, int64_t rows, const float *fields, float *levels, float *means) {
    table_rows(samples, rows, fields, levels);
    for (int64_t i = 0; i < samples; i++) {
        const float *one = fields + i * FIELDS;
        int by_levels = one[NOISE] == BY_LEVELS, curved = is_curved(one) && !by_levels, whole = one[NOISE] == ALL_OR_NONE;
        float ratio = exp_1(one[LOG_RATIO]);
        if (curved) ratio *= exp_1(0.5f * one[OUTPUT_SD] * one[OUTPUT_SD]) / (1.0f - one[ONSET]);
        for (int64_t row = 0; row < rows; row += LANES) {
            Reals level = loaded(levels + i * rows + row, rows - row), mean = whole ? all(1.0f) : level;
            if (by_levels) {
                Particles particle = alike(one);
                Curve law = levels_of(&particle);
                Reals share[LEVELS];
                mean = all(-1.0f);
                shares_of_levels(particle.of, one[REST] + one[BOOST] * level, share);
                for (int at = 0; at < LEVELS; at++)
                    mean += share[at] * (1.0f + law.odds[at]) * exp_v(0.5f * law.between[at]);
            } else if (curved) {
                mean = all(0.0f);
                for (int q = 0; q < NODES; q++) {
                    Reals drive = one[REST] + one[SPREAD] * node_at[q] * (float)(1.0 / ON_NODES) + one[BOOST] * level;
                    Reals over = per_v(1.0f + exp_v(-drive)) - one[ONSET];
                    mean += node_weight[q] * most_v(over, all(0.0f));
                }
            }
            stored(mean * ratio * responses(one, level), means + i * rows + row, rows - row);
        }
    }
    return 0;
}

/* A particle's log-normal at each node and row: means, inverse SDs and weights, (NODES, rows) each. */
static void components_of(const float *fields, float gain, const float *levels, int64_t rows, float *means,
                          float *sds, float *weights) {
    Particles particle = alike(fields);
    int curved = is_curved(fields), whole = fields[NOISE] == ALL_OR_NONE;
    int how = fields[NOISE] == BY_LEVELS ? LEVEL_BY_LEVEL : fields[ONSET] > 0.0f ? FROM_A_THRESHOLD : ALONG;
    Curve curve = how == LEVEL_BY_LEVEL ? levels_of(&particle) : curve_of(&particle, curved);
    Situation made = {.start = particle.of[ONSET],
                      .known = all(0.0f),
                      .responds = all(1.0f),
                      .floor_variance = particle.of[FLOOR_SD] * particle.of[FLOOR_SD],
                      .output = curved ? particle.of[OUTPUT_SD] * particle.of[OUTPUT_SD] : all(0.0f),
                      .scale = exp_v(particle.of[LOG_RATIO] + (gain + (curved ? 0.0f : FAR_BELOW)))};
    for (int64_t row = 0; row < rows; row += LANES) {
        Reals level = loaded(levels + row, rows - row);
        if (how == LEVEL_BY_LEVEL)
            shares_of_levels(particle.of, particle.of[REST] + particle.of[BOOST] * level, made.share);
        made.odds = curved  ? odds_against(particle.of[REST] + particle.of[BOOST] * level, LOWEST_DRIVE)
                    : whole ? all(1.0f)
                            : odds_of_level(level);
        for (int first = 0; first < NODES; first += TOGETHER_NODES) {
            Reals mean[TOGETHER_NODES], inverse_sd[TOGETHER_NODES];
            components(&made, curve.odds + first, curve.between + first, how, mean, inverse_sd);
            for (int q = 0; q < TOGETHER_NODES; q++) {
                stored(mean[q], means + (first + q) * rows + row, rows - row);
                stored(inverse_sd[q], sds + (first + q) * rows + row, rows - row);
                stored(weight_of(&made, how, first + q), weights + (first + q) * rows + row, rows - row);
            }
        }
    }
}

/* Probabilities of outcomes (y,) by their log MEPs and widths in one row. */
static void outcomes_of(const float *fields, float responds, const float *means, int64_t rows, const float *log_mep,
                        const float *widths, int64_t outcomes, float *found) {
    const float *sds = means + NODES * rows, *weights = sds + NODES * rows;
    float silent_sd = 1.0f / fields[FLOOR_SD];
    for (int64_t y = 0; y < outcomes; y += LANES) {
        Reals over = loaded(log_mep + y, outcomes - y) - fields[LOG_FLOOR], evoked = all(0.0f);
        for (int first = 0; first < NODES; first += TOGETHER_NODES) {
            const float *mean = means + first * rows, *sd = sds + first * rows, *weight = weights + first * rows;
            Reals bell[TOGETHER_NODES];
            EACH_NODE bell[q] = bell_v((over - mean[q * rows]) * sd[q * rows]);
            EACH_NODE evoked += weight[q * rows] * sd[q * rows] * bell[q];
        }
        if (responds < 1.0f)
            evoked = responds * evoked + (1.0f - responds) * silent_sd * bell_v(over * silent_sd);
        Reals outlier = pick((over > LOG_2) & (over < LOG_200), all(OUTLIER_DENSITY), all(0.0f)) + 1e-6f;
        Reals mass = (1.0f - OUTLIERS) * ROOT_PER_TURN * evoked + OUTLIERS * outlier;
        stored(mass * loaded(widths + y, outcomes - y), found + y, outcomes - y);
    }
    float per_sum = 1.0f / total(found, outcomes);
    for (int64_t y = 0; y < outcomes; y++) found[y] *= per_sum;
}

static int by_size(const void *one, const void *other) {
    float a = *(const float *)one, b = *(const float *)other;
    return (a > b) - (a < b);
}

/* A quantile of some numbers, which it sorts. */
static float quantile(float *values, int64_t count, double share) {
    double place = share * (double)(count - 1);
    int64_t below = (int64_t)place, above = below + 1 < count ? below + 1 : below;
    qsort(values, (size_t)count, sizeof *values, by_size);
    return values[below] + (float)(place - (double)below) * (values[above] - values[below]);
}

/* Between which log MEPs the outcomes of some samples lie. */
static void ends_of(int64_t samples, int64_t rows, const float *fields, const float *means, float *room, float *ends) {
    for (int64_t i = 0; i < samples; i++) room[i] = fields[i * FIELDS + LOG_FLOOR];
    ends[0] = quantile(room, samples, 0.05) - 1.0f;
    for (int64_t i = 0; i < samples; i++) {
        float most = 0.0f;
        for (int64_t row = 0; row < rows; row++) most = most_1(most, means[i * rows + row]);
        room[i] = fields[i * FIELDS + LOG_FLOOR] + log_1(1.0f + most);
    }
    ends[1] = quantile(room, samples, 0.95) + 1.5f;
}

/* What outcomes of a person's next trial are: middles in log MEPs, then widths, (2, y), by cells between two ends. */
static void outcomes_between(const float *ends, const float *cells, int64_t outcomes, float *found) {
    for (int64_t y = 0; y < outcomes; y++) {
        found[y] = ends[0] + 0.5f * (cells[y] + cells[y + 1]) * (ends[1] - ends[0]);
        found[outcomes + y] = cells[y + 1] - cells[y];
    }
}

/* A particle's table after so many trials, at least the rows that are needed; room is for 3 NODES rows. */
static void table_of(const float *fields, int64_t order, const float *levels, int64_t rows, const uint8_t *needed,
                     const float *cells, int64_t outcomes, float *room, float *table) {
    float startle, relaxed, *sds = room + NODES * rows;
    gain_of((float)order, &startle, &relaxed);
    float gain = fields[DRIFT] * relaxed + fields[STARTLED] * startle;
    components_of(fields, gain, levels, rows, room, sds, sds + NODES * rows);
    for (int64_t row = 0; row < rows; row++)
        if (!needed || needed[row])
            outcomes_of(fields, responses(fields, all(levels[row]))[0], room + row, rows, cells, cells + outcomes,
                        outcomes, table + row * outcomes);
}

static int outcome_tables(int64_t people, int64_t samples, int64_t rows, int64_t outcomes, int64_t order,
                          const float *fields, const float *levels, const float *means, const float *cells,
                          float *ends, float *table) {
    int64_t of_rows = 3 * NODES * rows;
    float *room = malloc((size_t)(of_rows + samples + 2 * outcomes) * sizeof *room);
    if (!room) return -1;
    float *between = room + of_rows + samples;
    for (int64_t i = 0; i < people * samples; i++) {
        if (i % samples == 0) {
            float *own = ends + i / samples * 2;
            ends_of(samples, rows, fields + i * FIELDS, means + i * rows, room, own);
            outcomes_between(own, cells, outcomes, between);
        }
        table_of(fields + i * FIELDS, order, levels + i * rows, rows, NULL, between, outcomes, room,
                 table + i * rows * outcomes);
    }
    free(room);
    return 0;
}

/* What lies between the rows of a table (rows, y) at a facilitation, (y,). */
INLINE void between_rows(const float *table, int64_t rows, int64_t outcomes, float depth, float level, float *found) {
    float position = position_of(level, depth, rows);
    int64_t row = row_below(position, rows);
    const float *first = table + row * outcomes, *second = first + outcomes;
    float share = position - (float)row;
    for (int64_t y = 0; y < outcomes; y += LANES) {
        Reals low = loaded(first + y, outcomes - y), high = loaded(second + y, outcomes - y);
        stored(low + share * (high - low), found + y, outcomes - y);
    }
}

static int rows_between(int64_t samples, int64_t rows, int64_t isis, int64_t outcomes, const float *fields,
                        const float *table, const float *levels, float *found) {
    for (int64_t i = 0; i < samples; i++)
        for (int64_t t = 0; t < isis; t++)
            between_rows(table + i * rows * outcomes, rows, outcomes, fields[i * FIELDS + DEPTH], levels[i * isis + t],
                         found + (i * isis + t) * outcomes);
    return 0;
}

static int facilitations(int64_t samples, int64_t isis, const float *fields, const float *isi_ms, float *found) {
    for (int64_t i = 0; i < samples; i++) facilitations_at(fields + i * FIELDS, isi_ms, isis, found + i * isis);
    return 0;
}

#endif
