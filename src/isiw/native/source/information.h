/* What the next MEP is expected to tell: about all unknowns, and about which ISIs are in the window. */

#ifndef ISIW_INFORMATION_H
#define ISIW_INFORMATION_H

#include <stdlib.h>

#include "vectors.h"

/* Negative entropies of distributions next to each other, summed [nat]. */
static float negative_entropy(const float *mass, int64_t count) {
    Reals sum = all(0.0f);
    for (int64_t i = 0; i < count; i += LANES) {
        Reals given = loaded(mass + i, count - i);
        sum += given * log_v(most_v(given, all(1e-30f)));
    }
    return lanes_sum(sum);
}

/* Add some numbers times a factor to others. */
INLINE void added(float factor, const float *values, int64_t count, float *to) {
    for (int64_t i = 0; i < count; i += LANES)
        stored(loaded(to + i, count - i) + factor * loaded(values + i, count - i), to + i, count - i);
}

/* What samples foresee at all ISIs, summed: where nothing else is known of an ISI it is what they foresee at rest. */
typedef struct {
    int64_t isis, outcomes, points;
    float *rest, *more; /* (1 + points, y), and (1 + points, t, y): of all, and what changes from point to point */
    float *inside;      /* how many windows each point is in, (points,) */
    float *entropies;   /* negative ones, less those at rest, (t,) */
    double at_rest;     /* negative entropies */
} Sums;

/* Sums of nothing; whether there is memory for them. */
static int begin(Sums *sums, int64_t isis, int64_t outcomes, int64_t points) {
    int64_t blocks = (1 + points) * outcomes;
    *sums = (Sums){.isis = isis, .outcomes = outcomes, .points = points};
    sums->rest = calloc((size_t)(blocks * (1 + isis) + points + isis), sizeof(float));
    if (!sums->rest) return 0;
    sums->more = sums->rest + blocks, sums->inside = sums->more + blocks * isis;
    sums->entropies = sums->inside + points;
    return 1;
}

/* Add a sample: its window (points,), what it foresees at rest (y,), and at some of the ISIs (t, y), which changes. */
static void add_sample(Sums *sums, const float *window, const float *rest, int64_t from, int64_t to, float *mass) {
    int64_t outcomes = sums->outcomes, block = sums->isis * outcomes, first = from * outcomes;
    float still = sums->points ? 0.0f : negative_entropy(rest, outcomes), before = 0.0f;
    sums->at_rest += still;
    for (int64_t t = from; t < to; t++) {
        float *at = mass + t * outcomes;
        if (!sums->points) sums->entropies[t] += negative_entropy(at, outcomes) - still;
        added(-1.0f, rest, outcomes, at);
    }
    added(1.0f, rest, outcomes, sums->rest);
    added(1.0f, mass + first, (to - from) * outcomes, sums->more + first);
    for (int64_t g = 0; g < sums->points; before = window[g++]) {
        sums->inside[g] += window[g];
        if (window[g] == before) continue;
        added(window[g] - before, rest, outcomes, sums->rest + (1 + g) * outcomes);
        added(window[g] - before, mass + first, (to - from) * outcomes, sums->more + (1 + g) * block + first);
    }
}

/* Entropy of the mean of distributions less their mean entropy at each ISI; or, where there are points, the variance of
each one's membership less that expected after an outcome, summed. */
static int reduced(const Sums *sums, int64_t samples, float *found) {
    int64_t outcomes = sums->outcomes, points = sums->points, block = sums->isis * outcomes;
    float share = 1.0f / (float)samples, *mean = malloc((size_t)outcomes * sizeof *mean);
    if (!mean) return -1;
    for (int64_t t = 0; t < sums->isis; t++) {
        Reals explained = all(0.0f);
        for (int64_t y = 0, left = outcomes; y < outcomes; y += LANES, left -= LANES) {
            const float *rest = sums->rest + y, *more = sums->more + t * outcomes + y;
            Reals whole = loaded(rest, left) + loaded(more, left), inside = all(0.0f), squares = all(0.0f);
            stored(share * whole, mean + y, left);
            for (int64_t g = 0; g < points; g++) {
                rest += outcomes, more += block;
                inside += loaded(rest, left) + loaded(more, left);
                Reals apart = inside - share * sums->inside[g] * whole;
                squares += apart * apart;
            }
            explained += squares / most_v(whole, all(1e-12f));
        }
        found[t] = points ? share * lanes_sum(explained)
                          : share * (float)(sums->at_rest + sums->entropies[t]) - negative_entropy(mean, outcomes);
    }
    free(mean);
    return 0;
}

static int reductions(int64_t samples, int64_t isis, int64_t outcomes, int64_t points, const float *mass,
                      const float *masks, float *found) {
    Sums sums;
    float *room = calloc((size_t)((1 + isis) * outcomes), sizeof *room);
    int failed = !room || !begin(&sums, isis, outcomes, points);
    for (int64_t s = 0; !failed && s < samples; s++) {
        memcpy(room + outcomes, mass + s * isis * outcomes, (size_t)(isis * outcomes) * sizeof *room);
        add_sample(&sums, masks + s * points, room, 0, isis, room + outcomes);
    }
    if (!failed) failed = reduced(&sums, samples, found), free(sums.rest);
    free(room);
    return failed ? -1 : 0;
}

#endif
