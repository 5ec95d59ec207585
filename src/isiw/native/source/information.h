/* What the next MEP is expected to tell: about all unknowns, and about which ISIs are in the window. */

#ifndef ISIW_INFORMATION_H
#define ISIW_INFORMATION_H

#include <stdlib.h>

#include "predictions.h"

/* Negative entropy of a distribution, and the distribution added to a mean [nat]. */
INLINE float negative_entropy(const float *mass, int64_t outcomes, float share, float *mean) {
    Reals sum = all(0.0f);
    for (int64_t y = 0; y < outcomes; y += LANES) {
        Reals given = loaded(mass + y, outcomes - y);
        sum += given * log_v(most_v(given, all(1e-30f)));
        if (mean) stored(loaded(mean + y, outcomes - y) + share * given, mean + y, outcomes - y);
    }
    return lanes_sum(sum);
}

static int entropy_reductions(int64_t samples, int64_t isis, int64_t outcomes, const float *mass, float *found) {
    float *mean = calloc((size_t)(isis * outcomes + 1), sizeof *mean), share = 1.0f / (float)samples;
    if (!mean) return -1;
    memset(found, 0, (size_t)isis * sizeof *found);
    for (int64_t s = 0; s < samples; s++)
        for (int64_t t = 0; t < isis; t++) {
            const float *given = mass + (s * isis + t) * outcomes;
            found[t] += share * negative_entropy(given, outcomes, share, mean + t * outcomes);
        }
    for (int64_t t = 0; t < isis; t++) found[t] -= negative_entropy(mean + t * outcomes, outcomes, 0.0f, NULL);
    free(mean);
    return 0;
}

/* Where a sampled window begins or ends. */
typedef struct {
    int64_t sample, at;
    float rise;
} Change;

/* Where sampled windows begin and end, and the share of the windows at each point; how many changes there are. */
static int64_t changes_of(const float *masks, int64_t samples, int64_t points, Change *changes, float *mean) {
    int64_t count = 0;
    for (int64_t g = 0; g < points; g++) mean[g] = 0.0f;
    for (int64_t s = 0; s < samples; s++) {
        float before = 0.0f;
        for (int64_t g = 0; g < points; g++) {
            float inside = masks[s * points + g];
            mean[g] += inside;
            if (inside != before) changes[count++] = (Change){s, g, inside - before};
            before = inside;
        }
    }
    for (int64_t g = 0; g < points; g++) mean[g] /= (float)samples;
    return count;
}

/* Add some numbers times a factor to others. */
INLINE void added(float factor, const float *values, int64_t count, float *to) {
    for (int64_t i = 0; i < count; i += LANES)
        stored(loaded(to + i, count - i) + factor * loaded(values + i, count - i), to + i, count - i);
}

/* Expected variance of all points that a trial at one candidate explains, by what changes from point to point. */
static float explained(const float *mass, int64_t samples, int64_t isis, int64_t outcomes, const Change *changes,
                       int64_t count, const float *mean, int64_t points, float *steps, float *all_of) {
    memset(steps, 0, (size_t)(points * outcomes) * sizeof *steps);
    memset(all_of, 0, (size_t)outcomes * sizeof *all_of);
    for (int64_t s = 0; s < samples; s++) added(1.0f, mass + s * isis * outcomes, outcomes, all_of);
    for (int64_t i = 0; i < count; i++)
        added(changes[i].rise, mass + changes[i].sample * isis * outcomes, outcomes, steps + changes[i].at * outcomes);
    Reals found = all(0.0f);
    for (int64_t y = 0; y < outcomes; y += LANES) {
        Reals whole = loaded(all_of + y, outcomes - y), sum = all(0.0f), reduced = all(0.0f);
        for (int64_t g = 0; g < points; g++) {
            sum += loaded(steps + g * outcomes + y, outcomes - y);
            Reals apart = sum - mean[g] * whole;
            reduced += apart * apart;
        }
        found += reduced / most_v(whole, all(1e-12f));
    }
    return lanes_sum(found) / (float)samples;
}

static int variance_reductions(int64_t samples, int64_t isis, int64_t outcomes, int64_t points, const float *mass,
                               const float *masks, float *found) {
    Change *changes = malloc((size_t)(samples * points + 1) * sizeof *changes);
    float *room = malloc((size_t)(points + (points + 1) * outcomes + 1) * sizeof *room);
    int there = changes && room;
    if (there) {
        float *mean = room, *all_of = room + points, *steps = all_of + outcomes;
        int64_t count = changes_of(masks, samples, points, changes, mean);
        for (int64_t t = 0; t < isis; t++)
            found[t] =
                explained(mass + t * outcomes, samples, isis, outcomes, changes, count, mean, points, steps, all_of);
    }
    free(changes), free(room);
    return there ? 0 : -1;
}

#endif
