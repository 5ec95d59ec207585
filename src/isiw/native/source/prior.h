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
    OF_LEVELS /* LEVEL_AT and what follows it among the fields, which particles carry along and never move */
};
enum { LOG_CEILING, LOG_SLOPE, LOG_INPUT_SD, LOG_SIGMA_Y, LOG_BOOST, REST_PCT }; /* of a curve */

enum { MOST_OF_BLOCK = 32 }; /* how many latents a block has */
#define NEVER (-1e30f)      /* log density of what cannot be */
#define UNKNOWN 1e30f       /* in place of a log density that was not worked out yet */
#define MOST_ONSET 0.9f     /* a threshold further up a curve would leave nothing of it */
#define LOG_NO_SD (-7.0f)   /* log SD of a floor that does not vary: levels have all that varies */
#define INTENSITY_PCT 9.0f  /* by how much the intensity changes at a size of 1 [% RMT] */
#define FADING_HALVES 0.04f /* by how many halves the enhancement changes from trial to trial at a size of 1 */

/* How many numbers are kept with a particle: the log densities of its blocks, and its log likelihood by a part of the
trials, which moves screen proposals by. */
INLINE int64_t kept_of(const Tables *tables) { return tables->blocks + 1; }

/* How many fields particles have: those of levels where some may have a law by them. */
INLINE int fields_of(const Tables *tables) { return tables->at[OF_LEVELS] < tables->latents ? FIELDS : LEVEL_AT; }

/* Whether kinds (p, KINDS) are some that there are. */
static int known_kinds(const Tables *tables, int64_t particles, const int64_t *kinds) {
    uint64_t changes = (uint64_t)tables->kind_values, beyond = 0;
    uint64_t noise = fields_of(tables) == FIELDS ? BY_LEVELS : RECTIFIED;
    const uint64_t last[KINDS] = {TWO_PEAK, noise, 1, 1, changes < SCALE_CHANGE ? changes : SCALE_CHANGE};
    for (int64_t i = 0; i < particles; i++)
        for (int kind = 0; kind < KINDS; kind++) beyond |= (uint64_t)kinds[i * KINDS + kind] > last[kind];
    return !beyond;
}

/* Latents of particles side by side: where those of each lane begin, and its kinds. */
typedef struct {
    const float *z[LANES];
    const int64_t *kinds[LANES];
} Lanes;

/* Some of numbered particles, (p, stride) and (p, KINDS); lanes that are left over repeat the last. */
INLINE Lanes lanes_of(const float *values, int64_t stride, const int64_t *kinds, const int64_t *numbers, int64_t left) {
    Lanes made;
    for (int64_t lane = 0; lane < LANES; lane++) {
        int64_t number = numbers[lane < left ? lane : left - 1];
        made.z[lane] = values + number * stride, made.kinds[lane] = kinds + number * KINDS;
    }
    return made;
}

/* A latent by its meaning, 0 where the model has none. */
INLINE float latent_of(const Tables *tables, const float *z, int64_t meaning) {
    int64_t at = tables->at[meaning];
    return at < tables->latents ? z[at] : 0.0f;
}

/* What latents mean. */
static Particles meaning_of(const Tables *tables, const Lanes *lanes) {
    Particles made;
    Reals *of = made.of, onset, size;
    Wholes curved, rectified, change;
    memset(&made, 0, LEVEL_AT * sizeof *of); /* levels are read where there are some alone */
    for (int lane = 0; lane < LANES; lane++) {
        const float *z = lanes->z[lane];
        const int64_t *kinds = lanes->kinds[lane];
        int64_t noise = kinds[OF_NOISE];
        of[NOISE][lane] = (float)noise, of[SHAPE][lane] = (float)kinds[OF_SHAPE];
        of[PRESENT][lane] = (float)kinds[OF_PRESENT], change[lane] = (int32_t)kinds[OF_CHANGE];
        rectified[lane] = -(noise == RECTIFIED);
        curved[lane] = -(noise == RECRUITMENT || noise == RECTIFIED || noise == BY_LEVELS);
#define LATENT(meaning) latent_of(tables, z, meaning)
        of[START][lane] = LATENT(START_MS), of[WIDTH][lane] = LATENT(LOG_WIDTH_MS);
        of[FORM][lane] = kinds[OF_SHAPE] ? erff(LATENT(FORM_SCORE) * 0.70710678f) : 0.0f;
        of[LOG_FLOOR][lane] = LATENT(LOG_FLOOR_MV), of[FLOOR_SD][lane] = LATENT(LOG_FLOOR_SD);
        of[DRIFT][lane] = LATENT(DRIFT_SIZE), of[STARTLED][lane] = LATENT(STARTUP);
        of[CHANGED][lane] = LATENT(LOG_CHANGED_AFTER), size[lane] = LATENT(CHANGE_SIZE);
        of[LOW_WIDTH][lane] = 0.0f, of[DEPTH][lane] = -INFINITY; /* no depression */
        if (kinds[OF_DEPRESSED]) {
            of[LOW_START][lane] = LATENT(LOW_START_MS), of[LOW_WIDTH][lane] = LATENT(LOW_LOG_WIDTH_MS);
            of[DEPTH][lane] = LATENT(LOW_LOG_SHIFT) - LATENT(CURVE_LATENTS + LOG_BOOST);
        }
        int64_t curve = noise == RECTIFIED ? RECTIFIED_LATENTS : CURVE_LATENTS, large = noise == ALL_OR_NONE;
        if (noise == BY_LEVELS) { /* whose drive is in % RMT, and whose floor is the lowest level */
            const float *levels = z + tables->at[OF_LEVELS];
            for (int field = LEVEL_AT; field < FIELDS; field++) of[field][lane] = levels[field - LEVEL_AT];
            of[LOG_FLOOR][lane] = of[LEVEL_MEAN][lane], of[FLOOR_SD][lane] = LOG_NO_SD;
            for (int level = 1; level < LEVELS; level++)
                of[LOG_FLOOR][lane] = least_1(of[LOG_FLOOR][lane], of[LEVEL_MEAN + level][lane]);
            of[BOOST][lane] = LATENT(CURVE_LATENTS + LOG_BOOST), onset[lane] = 0.0f;
        } else if (curved[lane]) {
            of[LOG_RATIO][lane] = LATENT(curve + LOG_CEILING), of[SPREAD][lane] = LATENT(curve + LOG_INPUT_SD);
            of[OUTPUT_SD][lane] = LATENT(curve + LOG_SIGMA_Y), of[SLOPE][lane] = LATENT(curve + LOG_SLOPE);
            of[BOOST][lane] = LATENT(curve + LOG_BOOST), of[REST][lane] = LATENT(curve + REST_PCT);
            onset[lane] = LATENT(LOG_ONSET);
        } else {
            of[LOG_RATIO][lane] = LATENT(large ? LOG_SIZE : LOG_GAIN);
            of[SPREAD][lane] = LATENT(large ? LOG_SIZE_CV : LOG_CV);
            of[MOST][lane] = LATENT(large ? SWITCHED_ON : RELIABILITY), of[LEAST][lane] = LATENT(SWITCHED_OFF);
            onset[lane] = 0.0f;
        }
#undef LATENT
    }
    Reals none = all(0.0f);
    of[WIDTH] = exp_v(of[WIDTH]), of[FLOOR_SD] = exp_v(of[FLOOR_SD]), of[SPREAD] = exp_v(of[SPREAD]);
    of[CHANGED] = exp_v(of[CHANGED]), of[LOW_WIDTH] = exp_v(of[LOW_WIDTH]), of[OUTPUT_SD] = exp_v(of[OUTPUT_SD]);
    of[DEPTH] = pick(of[DEPTH] == -INFINITY, none, exp_v(of[DEPTH]));
    of[SLOPE] = pick(curved, exp_v(of[SLOPE]), none);
    of[BOOST] = pick(curved, of[SLOPE] * exp_v(of[BOOST]), none), of[REST] *= of[SLOPE];
    onset = pick(rectified, least_v(exp_v(onset), all(MOST_ONSET)), none);
    of[ONSET] = onset; /* from the threshold on the rest counts */
    of[REST] += pick(rectified, log_v(onset) - log_v(1.0f - onset), none);
    of[MOST] = pick(curved, all(1.0f), 1.0f / (1.0f + exp_v(-of[MOST])));
    of[LEAST] = pick(curved, none, 1.0f / (1.0f + exp_v(-of[LEAST])));
    of[FADING] = pick(change == ENHANCEMENT_CHANGE, FADING_HALVES * size, none);
    of[STEP_SCALE] = pick(change == SCALE_CHANGE, size, none);
    /* without a recruitment curve an intensity is a level */
    Wholes driven = (change == INTENSITY_CHANGE) & (of[SLOPE] > 0.0f);
    of[STEP_DRIVE] = pick(driven, of[SLOPE] * INTENSITY_PCT * size, none);
    of[STEP] = pick((change == LEVEL_CHANGE) | ((change == INTENSITY_CHANGE) & ~driven), size, none);
    return made;
}

/* What numbered particles mean, each at its number, (p, FIELDS). */
static void meanings_of(const Tables *tables, const float *values, int64_t stride, const int64_t *kinds,
                        const int64_t *numbers, int64_t count, float *fields) {
    int known = fields_of(tables);
    for (int64_t first = 0; first < count; first += LANES) {
        Lanes lanes = lanes_of(values, stride, kinds, numbers + first, count - first);
        Particles made = meaning_of(tables, &lanes);
        for (int lane = 0; lane < LANES && first + lane < count; lane++)
            for (int field = 0; field < known; field++)
                fields[numbers[first + lane] * FIELDS + field] = made.of[field][lane];
    }
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

/* Log densities of the latents of a place: of start and log width. */
INLINE Reals log_place(const Tables *tables, int64_t place, const Reals *z) {
    const float *law = tables->places + 5 * place;
    Reals a = (z[0] - law[1]) / law[2], b = (z[1] - law[3]) / law[4];
    return law[0] - 0.5f * (a * a + b * b);
}

/* Log densities of latents under a component of a block's mixture. */
INLINE Reals log_component(const Tables *tables, int64_t block, int64_t k, int64_t first, int64_t count,
                           const Reals *z) {
    Reals squares = all(0.0f);
    for (int64_t i = 0; i < count; i++) {
        int64_t at = (first + i) * tables->width + k;
        Reals distance = (z[i] - tables->means[at]) * tables->per_sds[at];
        squares += distance * distance;
    }
    return tables->log_shares[block * tables->width + k] - 0.5f * squares;
}

/* Log of a sum of exponentials, of which the largest is not known beforehand. */
typedef struct {
    Reals most, sum;
} LogSum;

INLINE void add_log(LogSum *to, Reals part) {
    Reals most = most_v(to->most, part);
    to->sum = to->sum * exp_v(to->most - most) + exp_v(part - most), to->most = most;
}

/* Log densities of the latents of a block (size,) but for a constant; -inf where there can be none. */
static Reals log_block(const Tables *tables, int64_t block, const Reals *z) {
    int64_t first = tables->first[block], size = tables->size[block], components = tables->components[block];
    int64_t count = components < 0 ? -components : components, places = components < 0 ? tables->place_count : 0;
    Reals anywhere = all(0.0f), sum = all(0.0f);
    const Reals *mixed = z;
    if (components <= 0) { /* a start, and with places its width */
        for (int lane = 0; lane < LANES; lane++) anywhere[lane] = start_density(tables, z[0][lane]);
        Wholes never = anywhere == 0.0f;
        anywhere = pick(never, all(components ? NEVER : -INFINITY), log_v(anywhere));
        if (components == 0) return anywhere;
        first++, size = 1, mixed++;
    }
    if (count == 1 && !places) return log_component(tables, block, 0, first, size, mixed) + anywhere;
    float usual = tables->log_shares[block * tables->width];
    /* as shares of the largest share of the first, unless all are next to nothing */
    for (int64_t k = 0; k < count; k++)
        sum += exp_v(log_component(tables, block, k, first, size, mixed) - usual + anywhere);
    for (int64_t place = 0; place < places; place++) sum += exp_v(log_place(tables, place, z) - usual);
    Wholes slow = sum <= 1e-30f;
    Reals found = usual + log_v(sum);
    if (!any(slow)) return found;
    LogSum slowly = {all(NEVER), all(0.0f)};
    for (int64_t k = 0; k < count; k++)
        add_log(&slowly, log_component(tables, block, k, first, size, mixed) + anywhere);
    for (int64_t place = 0; place < places; place++) add_log(&slowly, log_place(tables, place, z));
    Wholes once = slowly.most > NEVER * 0.5f;
    return pick(slow, pick(once, slowly.most + log_v(slowly.sum), all(-INFINITY)), found);
}

/* The same of the particles of lanes. */
static Reals log_block_of(const Tables *tables, int64_t block, const Lanes *lanes) {
    Reals z[MOST_OF_BLOCK];
    for (int64_t i = 0; i < tables->size[block]; i++)
        for (int lane = 0; lane < LANES; lane++) z[i][lane] = lanes->z[lane][tables->first[block] + i];
    return log_block(tables, block, z);
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
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    for (int64_t first = 0, count = people * particles; first < count; first += LANES) {
        int64_t numbers[LANES], left = count - first < LANES ? count - first : LANES;
        for (int64_t lane = 0; lane < LANES; lane++) numbers[lane] = first + lane;
        meanings_of(tables, values, tables->latents, kinds, numbers, left, fields);
        for (int64_t i = first; trials >= 0 && i < first + left; i++) settle(fields + i * FIELDS, (float)trials);
    }
    return 0;
}

/* The particles to which a block means anything that ISIs are chosen with another law of. */
static Wholes weighed_by(const Tables *tables, int64_t block, const Lanes *lanes) {
    int64_t first = tables->first[block];
    int of_curve = first == tables->at[CURVE_LATENTS], of_rectified = first == tables->at[RECTIFIED_LATENTS];
    Wholes found = (Wholes){0} - (first == tables->at[DRIFT_SIZE]);
    if (first >= 2 && !of_curve && !of_rectified && block != tables->changed) return found;
    for (int lane = 0; lane < LANES; lane++) {
        const int64_t *kinds = lanes->kinds[lane];
        int64_t noise = kinds[OF_NOISE], change = kinds[OF_CHANGE];
        int present = first < 2 && kinds[OF_PRESENT];
        int curve = (of_curve && noise == RECRUITMENT) || (of_rectified && noise == RECTIFIED);
        int stepped = block == tables->changed && change != NO_CHANGE && change != ENHANCEMENT_CHANGE;
        found[lane] |= -(present || curve || stepped);
    }
    return found;
}

/* The log prior densities of what ISIs are chosen with another law of, but for a constant; densities of blocks (blocks,)
may be known. */
static Reals log_usual(const Tables *tables, const Lanes *lanes, const float *const *densities) {
    const float *edges = tables->kinds + OF_CHANGE * tables->kind_values;
    Reals sum;
    for (int lane = 0; lane < LANES; lane++) {
        int64_t change = lanes->kinds[lane][OF_CHANGE];
        float until = change < tables->kind_values ? least_1(edges[change], 1.0f) : 1.0f;
        sum[lane] = most_1(until - (change ? edges[change - 1] : 0.0f), 1e-30f);
    }
    sum = log_v(sum);
    for (int64_t block = 0; block < tables->blocks; block++) {
        Wholes weighed = weighed_by(tables, block, lanes);
        if (!any(weighed)) continue;
        Reals found = all(UNKNOWN);
        for (int lane = 0; densities && lane < LANES; lane++) found[lane] = densities[lane][block];
        Wholes unknown = weighed & (found == UNKNOWN);
        if (any(unknown)) found = pick(unknown, log_block_of(tables, block, lanes), found);
        sum += pick(weighed, found, all(0.0f));
    }
    return sum;
}

#endif
