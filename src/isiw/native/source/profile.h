/* The facilitation of particles by ISI, in 0-1; negative where the tap depresses.

One peak: exp(-2 d^2), d being the distance from the peak in flanks, so that the span reaches from exp(-2) to exp(-2).
*/

#ifndef ISIW_PROFILE_H
#define ISIW_PROFILE_H

#include "people.h"

#define FIRST_PEAK 0.27f /* of two, as a share of the span */
#define SECOND_PEAK 0.73f
#define TOGETHER 0.75f /* up to which form two peaks are one window */

enum { FURTHEST = 34 }; /* squares of the distance from the peak: behind it facilitation is below 1e-29 */

/* Where a profile of one peak has it, as a share of the span. */
INLINE float peak_at(const float *fields) { return fields[SHAPE] == SKEWED ? 0.5f + 0.33f * fields[FORM] : 0.5f; }

/* What does not depend on the ISI. */
typedef struct {
    Reals peak_ms, rise, fall, power, start_ms, per_width, per_sd, first, second, low_ms, per_low, depth;
    Wholes nowhere, flat, double_peaked;
    int any_flat, any_double, any_low;
} Profiles;

static Profiles profiles_of(const Particles *particles) {
    const Reals *of = particles->of;
    Profiles made;
    Reals at = pick(of[SHAPE] == (float)SKEWED, 0.5f + 0.33f * of[FORM], all(0.5f));
    made.start_ms = of[START], made.per_width = 1.0f / of[WIDTH];
    made.peak_ms = of[START] + at * of[WIDTH];
    made.rise = -made.per_width / at, made.fall = made.per_width / (1.0f - at);
    made.nowhere = of[PRESENT] == 0.0f;
    made.flat = of[SHAPE] == (float)PLATEAU, made.double_peaked = of[SHAPE] == (float)TWO_PEAK;
    made.any_flat = any(made.flat), made.any_double = any(made.double_peaked), made.any_low = any(of[DEPTH] > 0.0f);
    made.power = exp_v(0.75f * (of[FORM] + 1.0f));
    Reals form = absolute(of[FORM]);
    Wholes apart = form > TOGETHER;
    made.per_sd = pick(apart, all(12.0f), all(7.5f));
    Reals lower = 1.0f - 0.7f * pick(apart, (form - TOGETHER) * (1.0f / (1.0f - TOGETHER)), form * (1.0f / TOGETHER));
    made.first = pick(of[FORM] < 0.0f, lower, all(1.0f)), made.second = pick(of[FORM] < 0.0f, all(1.0f), lower);
    made.low_ms = of[LOW_START] + 0.5f * of[LOW_WIDTH], made.per_low = 2.0f / of[LOW_WIDTH];
    made.depth = of[DEPTH];
    return made;
}

/* exp(-2 d^2) by the square of the distance. */
INLINE Reals fallen(Reals square) { return exp2_v(-2.885390081777927f * least_v(square, all(FURTHEST))); }

/* Facilitations at an ISI each [ms]. */
INLINE Reals facilitation(const Profiles *profiles, Reals isi_ms) {
    Reals away_ms = isi_ms - profiles->peak_ms;
    Reals away = most_v(away_ms * profiles->rise, away_ms * profiles->fall), square = away * away;
    if (profiles->any_flat) {
        Reals within = least_v(most_v(square, all(1e-12f)), all(1e6f));
        square = pick(profiles->flat, exp_v(profiles->power * log_v(within)), square);
    }
    Reals level = fallen(square);
    if (profiles->any_double) {
        Reals share = (isi_ms - profiles->start_ms) * profiles->per_width;
        Reals first = bell_v((share - FIRST_PEAK) * profiles->per_sd);
        Reals second = bell_v((share - SECOND_PEAK) * profiles->per_sd);
        level = pick(profiles->double_peaked, profiles->first * first + profiles->second * second, level);
    }
    level = pick(profiles->nowhere, all(0.0f), level);
    if (profiles->any_low) {
        Reals low = (isi_ms - profiles->low_ms) * profiles->per_low;
        level -= profiles->depth * fallen(low * low);
    }
    return level;
}

/* The same particle in all lanes. */
INLINE Particles alike(const float *fields) {
    Particles made;
    int known = fields[NOISE] == (float)BY_LEVELS ? FIELDS : LEVEL_AT;
    for (int field = 0; field < known; field++) made.of[field] = all(fields[field]);
    return made;
}

/* Facilitations of one particle at some ISIs [ms]. */
static void facilitations_at(const float *fields, const float *isi_ms, int64_t count, float *level) {
    Particles particle = alike(fields);
    Profiles profile = profiles_of(&particle);
    for (int64_t i = 0; i < count; i += LANES)
        stored(facilitation(&profile, loaded(isi_ms + i, count - i)), level + i, count - i);
}

#endif
