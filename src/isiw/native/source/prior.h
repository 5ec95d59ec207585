/* The prior over people: what latents mean, how probable they are, and draws of them. */

#ifndef ISIW_PRIOR_H
#define ISIW_PRIOR_H

#include <stdlib.h>

#include "draws.h"
#include "engine.h"
#include "people.h"

/* Latents by what they mean, in the order of `Tables.at`. A curve and a rectified one have six each, in one order. */
enum {
    START_MS,
    LOG_WIDTH_MS,
    FORM_SCORE,
    LOG_FLOOR_MV,
    LOG_FLOOR_SD,
    DRIFT_SIZE,
    STARTUP,
    LOG_GAIN,
    LOG_CV,
    RELIABILITY,
    SWITCHED_ON,
    SWITCHED_OFF,
    LOG_SIZE,
    LOG_SIZE_CV,
    CURVE_LATENTS,
    RECTIFIED_LATENTS = CURVE_LATENTS + 6,
    LOG_ONSET = RECTIFIED_LATENTS + 6,
    LOG_CHANGED_AFTER,
    CHANGE_SIZE,
    LOW_START_MS,
    LOW_LOG_WIDTH_MS,
    LOW_LOG_SHIFT,
    MEANINGS
};
enum { LOG_CEILING, LOG_SLOPE, LOG_INPUT_SD, LOG_SIGMA_Y, LOG_BOOST, REST_PCT }; /* of a curve */

#define NEVER (-1e30f)      /* log density of what cannot be */
#define UNKNOWN 1e30f       /* in place of a log density that was not worked out yet */
#define MOST_ONSET 0.9f     /* a threshold further up a curve would leave nothing of it */
#define INTENSITY_PCT 9.0f  /* by how much the intensity changes at a size of 1 [% RMT] */
#define FADING_HALVES 0.04f /* by how many halves the enhancement changes from trial to trial at a size of 1 */

/* What latents mean. Those that a model does not have are read as 0, from behind the last: z has room for one more. */
static void meaning_of(const Tables *tables, const float *z, const int64_t *kinds, float *fields) {
    const int64_t *at = tables->at;
    int64_t noise = kinds[OF_NOISE], change = kinds[OF_CHANGE];
    fields[NOISE] = (float)noise, fields[SHAPE] = (float)kinds[OF_SHAPE], fields[PRESENT] = (float)kinds[OF_PRESENT];
    fields[START] = z[at[START_MS]], fields[WIDTH] = exp_1(z[at[LOG_WIDTH_MS]]);
    fields[FORM] = kinds[OF_SHAPE] ? erff(z[at[FORM_SCORE]] * 0.70710678f) : 0.0f;
    fields[LOG_FLOOR] = z[at[LOG_FLOOR_MV]], fields[FLOOR_SD] = exp_1(z[at[LOG_FLOOR_SD]]);
    fields[DRIFT] = z[at[DRIFT_SIZE]], fields[STARTLED] = z[at[STARTUP]];
    fields[MOST] = 1.0f, fields[LEAST] = 0.0f;
    fields[ONSET] = fields[BOOST] = fields[REST] = fields[SLOPE] = 0.0f;
    if (noise == RECRUITMENT || noise == RECTIFIED) {
        const int64_t *of = at + (noise == RECTIFIED ? RECTIFIED_LATENTS : CURVE_LATENTS);
        float slope = exp_1(z[of[LOG_SLOPE]]);
        fields[LOG_RATIO] = z[of[LOG_CEILING]], fields[SPREAD] = exp_1(z[of[LOG_INPUT_SD]]);
        fields[OUTPUT_SD] = exp_1(z[of[LOG_SIGMA_Y]]), fields[SLOPE] = slope;
        fields[BOOST] = slope * exp_1(z[of[LOG_BOOST]]), fields[REST] = slope * z[of[REST_PCT]];
        if (noise == RECTIFIED) { /* the rest counts from the threshold */
            float onset = least_1(exp_1(z[at[LOG_ONSET]]), MOST_ONSET);
            fields[ONSET] = onset, fields[REST] += log_1(onset) - log_1(1.0f - onset);
        }
    } else {
        int switches = noise == ALL_OR_NONE;
        fields[LOG_RATIO] = z[at[switches ? LOG_SIZE : LOG_GAIN]];
        fields[SPREAD] = exp_1(z[at[switches ? LOG_SIZE_CV : LOG_CV]]), fields[OUTPUT_SD] = 1.0f;
        fields[MOST] = 1.0f / (1.0f + exp_1(-z[at[switches ? SWITCHED_ON : RELIABILITY]]));
        fields[LEAST] = 1.0f / (1.0f + exp_1(-z[at[SWITCHED_OFF]]));
    }
    fields[LOW_START] = 0.0f, fields[LOW_WIDTH] = 1.0f, fields[DEPTH] = 0.0f;
    if (kinds[OF_DEPRESSED]) {
        fields[LOW_START] = z[at[LOW_START_MS]], fields[LOW_WIDTH] = exp_1(z[at[LOW_LOG_WIDTH_MS]]);
        fields[DEPTH] = exp_1(z[at[LOW_LOG_SHIFT]] - z[at[CURVE_LATENTS + LOG_BOOST]]);
    }
    float size = z[at[CHANGE_SIZE]];
    fields[CHANGED] = exp_1(z[at[LOG_CHANGED_AFTER]]);
    fields[STEP] = fields[STEP_DRIVE] = fields[FADING] = fields[STEP_SCALE] = 0.0f;
    if (change == ENHANCEMENT_CHANGE)
        fields[FADING] = FADING_HALVES * size;
    else if (change == SCALE_CHANGE)
        fields[STEP_SCALE] = size;
    else if (change == INTENSITY_CHANGE && fields[SLOPE] > 0.0f)
        fields[STEP_DRIVE] = fields[SLOPE] * INTENSITY_PCT * size;
    else if (change != NO_CHANGE) /* without a recruitment curve an intensity is a level */
        fields[STEP] = size;
}

/* Density of a start, 0 where none can be; straight between the knots. */
static float start_density(const Tables *tables, float start_ms) {
    const float *knots = tables->start_ms;
    int64_t last = tables->knots - 1;
    if (!(knots[0] <= start_ms && start_ms <= knots[last])) return 0.0f;
    float place = (start_ms - knots[0]) * ((float)last / (knots[last] - knots[0]));
    int64_t left = (int64_t)place < last - 1 ? (int64_t)place : last - 1;
    float before = tables->density[left], behind = tables->density[left + 1];
    return most_1(before + (place - (float)left) * (behind - before), 1e-30f);
}

/* The start at a quantile of the prior [ms]. */
static float start_at(const Tables *tables, float quantile) {
    int64_t low = 0, high = tables->knots - 1;
    while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        if (tables->quantiles[middle] < quantile)
            low = middle;
        else
            high = middle;
    }
    float run = most_1(tables->quantiles[high] - tables->quantiles[low], 1e-12f);
    float share = least_1(most_1((quantile - tables->quantiles[low]) / run, 0.0f), 1.0f);
    return tables->start_ms[low] + share * (tables->start_ms[high] - tables->start_ms[low]);
}

/* Log density of the latents of a place: of start and log width. */
INLINE float log_place(const Tables *tables, int64_t place, const float *z) {
    const float *law = tables->places + 5 * place;
    float a = (z[0] - law[1]) / law[2], b = (z[1] - law[3]) / law[4];
    return law[0] - 0.5f * (a * a + b * b);
}

/* Log densities of the latents first to behind under some components of a block's mixture, which are lanes. */
INLINE Reals log_components(const Tables *tables, int64_t block, int64_t k, int64_t first, int64_t behind,
                            const float *z) {
    Reals squares = all(0.0f);
    for (int64_t latent = first; latent < behind; latent++) {
        Reals distance = z[latent] - loaded(tables->means + latent * tables->width + k, LANES);
        distance *= loaded(tables->per_sds + latent * tables->width + k, LANES);
        squares += distance * distance;
    }
    return loaded(tables->log_shares + block * tables->width + k, LANES) - 0.5f * squares;
}

/* Log of a sum of exponentials, of which the largest is not known beforehand. */
typedef struct {
    float most, sum;
} LogSum;

static void add_log(LogSum *to, float part) {
    float most = most_1(to->most, part);
    to->sum = to->sum * exp_1(to->most - most) + exp_1(part - most), to->most = most;
}

/* Log density of the latents of a block but for a constant; -inf where there can be none. */
static float log_block(const Tables *tables, int64_t block, const float *z) {
    int64_t first = tables->first[block], behind = first + tables->size[block], components = tables->components[block];
    int64_t count = components < 0 ? -components : components, width = tables->width;
    int64_t places = components < 0 ? tables->place_count : 0;
    float anywhere = 0.0f, usual = tables->log_shares[block * width], sum = 0.0f;
    if (components <= 0) { /* a start, and with places its width */
        float density = start_density(tables, z[first]);
        anywhere = density == 0.0f ? NEVER : log_1(density);
        if (components == 0) return density == 0.0f ? -INFINITY : anywhere;
        first++, behind = first + 1;
    }
    if (count == 1) { /* of one component no lanes are needed */
        float squares = 0.0f;
        for (int64_t latent = first; latent < behind; latent++) {
            float distance = (z[latent] - tables->means[latent * width]) * tables->per_sds[latent * width];
            squares += distance * distance;
        }
        if (!places) return usual - 0.5f * squares + anywhere;
    }
    if (count <= LANES) { /* as shares of the largest share of the first, unless all are next to nothing */
        Reals shares = exp_v(log_components(tables, block, 0, first, behind, z) - usual + anywhere);
        for (int64_t k = 0; k < count; k++) sum += shares[k];
        for (int64_t place = 0; place < places; place++) sum += exp_1(log_place(tables, place, z) - usual);
        if (sum > 1e-30f) return usual + log_1(sum);
    }
    LogSum slow = {NEVER, 0.0f};
    for (int64_t k = 0; k < count; k += LANES) {
        Reals parts = log_components(tables, block, k, first, behind, z) + anywhere;
        for (int64_t lane = 0; lane < LANES && k + lane < count; lane++) add_log(&slow, parts[lane]);
    }
    for (int64_t place = 0; place < places; place++) add_log(&slow, log_place(tables, place, z));
    return slow.most > NEVER * 0.5f ? slow.most + log_1(slow.sum) : -INFINITY;
}

/* Draw the latents of a block from the prior. */
static void draw_block(const Tables *tables, int64_t block, uint64_t *dice, float *z) {
    int64_t first = tables->first[block], size = tables->size[block], components = tables->components[block];
    if (components < 0 && uniform(dice) < tables->place_share) {
        float quantile = uniform(dice);
        int64_t place = 0;
        while (place < tables->place_count - 1 && quantile > tables->place_below[place]) place++;
        const float *law = tables->places + 5 * place;
        z[0] = law[1] + law[2] * normal(dice);
        z[1] = law[3] + law[4] * normal(dice);
        return;
    }
    if (components <= 0) {
        z[first] = start_at(tables, uniform(dice));
        first++, size--;
    }
    int64_t component = which(uniform(dice), tables->below + block * tables->width, tables->width);
    for (int64_t latent = first; latent < first + size; latent++) {
        int64_t at = latent * tables->width + component;
        z[latent] = tables->means[at] + tables->sds[at] * normal(dice);
    }
}

static int meanings(const Tables *tables, int64_t people, int64_t particles, const float *values, const int64_t *kinds,
                    int64_t trials, float *fields) {
    int64_t latents = tables->latents;
    float *z = calloc((size_t)latents + 1, sizeof *z);
    if (!z) return -1;
    for (int64_t i = 0; i < people * particles; i++) {
        memcpy(z, values + i * latents, (size_t)latents * sizeof *z);
        meaning_of(tables, z, kinds + i * KINDS, fields + i * FIELDS);
        if (trials >= 0) settle(fields + i * FIELDS, (float)trials);
    }
    free(z);
    return 0;
}

/* Whether a block is one that ISIs are chosen with another law of, and means anything to a particle. */
static int is_weighed(const Tables *tables, int64_t block, const int64_t *kinds) {
    int64_t first = tables->first[block], noise = kinds[OF_NOISE], change = kinds[OF_CHANGE];
    int stepped = change != NO_CHANGE && change != ENHANCEMENT_CHANGE;
    int curve = (noise == RECRUITMENT && first == tables->at[CURVE_LATENTS]) ||
                (noise == RECTIFIED && first == tables->at[RECTIFIED_LATENTS]);
    return (first < 2 && kinds[OF_PRESENT]) || curve || first == tables->at[DRIFT_SIZE] ||
           (stepped && block == tables->changed);
}

/* The log prior density of what ISIs are chosen with another law of, but for a constant; densities of blocks may be
known. */
static float log_usual(const Tables *tables, const float *z, const int64_t *kinds, const float *densities) {
    const float *edges = tables->kinds + OF_CHANGE * tables->kind_values;
    int64_t change = kinds[OF_CHANGE];
    float share =
        (change < tables->kind_values ? least_1(edges[change], 1.0f) : 1.0f) - (change ? edges[change - 1] : 0.0f);
    float sum = log_1(most_1(share, 1e-30f));
    for (int64_t block = 0; block < tables->blocks; block++) {
        if (!is_weighed(tables, block, kinds)) continue;
        float known = densities ? densities[block] : UNKNOWN;
        sum += known == UNKNOWN ? log_block(tables, block, z) : known;
    }
    return sum;
}

#endif
