/* What the next MEP is expected to tell: about all unknowns, and about which ISIs are in the window. */

#ifndef ISIW_INFORMATION_H
#define ISIW_INFORMATION_H

#include <stdlib.h>

#include "predictions.h"

/* Distributions of the next outcome: given for each sample and ISI, (s, t, y), or with rows, as tables between whose
rows (s, rows, y) they lie at facilitations (s, t). */
typedef struct {
    int64_t samples, rows, isis, outcomes;
    const float *fields, *table, *levels;
} Foreseen;

/* Those at one ISI, (s, y). */
static void foreseen_at(const Foreseen *of, int64_t t, float *found) {
    for (int64_t s = 0; s < of->samples; s++) {
        float *to = found + s * of->outcomes;
        if (of->rows)
            between_rows(of->table + s * of->rows * of->outcomes, of->rows, of->outcomes,
                         of->fields[s * FIELDS + DEPTH], of->levels[s * of->isis + t], to);
        else
            memcpy(to, of->table + (s * of->isis + t) * of->outcomes, (size_t)of->outcomes * sizeof *to);
    }
}

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

/* Expected variance of all points that a trial with these outcomes (s, y) explains, by what changes from point to
point. */
static float explained(const float *mass, int64_t samples, int64_t outcomes, const Change *changes, int64_t count,
                       const float *mean, int64_t points, float *steps, float *all_of) {
    memset(steps, 0, (size_t)(points * outcomes) * sizeof *steps);
    memset(all_of, 0, (size_t)outcomes * sizeof *all_of);
    for (int64_t s = 0; s < samples; s++) added(1.0f, mass + s * outcomes, outcomes, all_of);
    for (int64_t i = 0; i < count; i++)
        added(changes[i].rise, mass + changes[i].sample * outcomes, outcomes, steps + changes[i].at * outcomes);
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

/* Entropy of the mean of distributions less their mean entropy at each ISI; or, with windows (s, points), the variance
of each point's membership less that expected after an outcome, summed. */
static int reductions_of(const Foreseen *of, int64_t points, const float *masks, float *found) {
    int64_t samples = of->samples, outcomes = of->outcomes, count = 0;
    Change *changes = malloc((size_t)(samples * points + 1) * sizeof *changes);
    float *room = malloc((size_t)(points + (points + samples + 1) * outcomes + 1) * sizeof *room);
    int there = changes && room;
    if (there) {
        float *mean = room, *all_of = room + points, *mass = all_of + outcomes, *steps = mass + samples * outcomes;
        float share = 1.0f / (float)samples;
        if (points) count = changes_of(masks, samples, points, changes, mean);
        for (int64_t t = 0; t < of->isis; t++) {
            foreseen_at(of, t, mass);
            if (points) {
                found[t] = explained(mass, samples, outcomes, changes, count, mean, points, steps, all_of);
                continue;
            }
            memset(all_of, 0, (size_t)outcomes * sizeof *all_of);
            for (int64_t s = 0; s < samples; s++) added(share, mass + s * outcomes, outcomes, all_of);
            found[t] = share * negative_entropy(mass, samples * outcomes) - negative_entropy(all_of, outcomes);
        }
    }
    free(changes), free(room);
    return there ? 0 : -1;
}

static int reductions(int64_t samples, int64_t isis, int64_t outcomes, int64_t points, const float *mass,
                      const float *masks, float *found) {
    Foreseen of = {samples, 0, isis, outcomes, NULL, mass, NULL};
    return reductions_of(&of, points, masks, found);
}

#endif
