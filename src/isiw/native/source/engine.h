/* What Python calls: the law of particles over arrays. Sizes come with the arrays, and Python checks them before.

Every function writes into the arrays that it is given, and returns 0, or -1 where there is no memory for what it needs
in between, or NO_PARTICLES where kinds of particles are none that there are. Single precision; indices are 64 bits.
Arrays lie in C order: (b, p, d) are people, particles, latents. */

#ifndef ISIW_ENGINE_H
#define ISIW_ENGINE_H

#include <stdint.h>

enum { NO_PARTICLES = 1 };

/* What is known of a model's prior and of its moves; see `isiw.models.particles.compiled.Tables`. */
typedef struct {
    int64_t latents, blocks, width, knots, place_count, states, part_count, jump_count, kind_values, points, outcomes;
    const int64_t *at;         /* of the latent of each meaning; `latents` where the model has none, (MEANINGS,) */
    const float *spreads;      /* usual SD of each latent, (latents,) */
    const int64_t *first;      /* latent of each block, (blocks,) */
    const int64_t *size;       /* how many latents it has, (blocks,) */
    const int64_t *components; /* of its mixture, (blocks,); 0 for a start, negative for start and width with places */
    const float *log_shares;   /* of the components, less the logs of their SDs, (blocks, width) */
    const float *below;        /* sums of the shares of earlier components, from the second on, likewise */
    const float *means;        /* of the latents in each component, (latents, width) */
    const float *sds;          /* likewise */
    const float *per_sds;      /* 1 / SD, as dividers are slow */
    const float *start_ms;     /* knots of the density of a start, evenly spaced, (knots,) */
    const float *density;      /* at the knots */
    const float *quantiles;    /* probability of an earlier start, at the knots */
    const float *places; /* log share less logs of SDs, mean and SD of start, then of log width, (place_count, 5) */
    const float *place_below;  /* sums of the shares of earlier places, (place_count,) */
    float place_share;         /* probability of all places */
    int32_t apart;             /* enhancement and depression may not overlap */
    const int64_t *state_of;   /* weights of the kinds in the number of a particle's state, (KINDS,) */
    const uint8_t *shifted;    /* which latents a difference moves, (states, part_count, latents in whole vectors) */
    const float *parts;        /* sums of the probabilities of earlier parts, (part_count - 1,) */
    const float *jumps;        /* likewise of earlier jumps, (jump_count - 1,) */
    const uint8_t *redrawn;    /* which latents each jump draws again, (jump_count, latents) */
    const uint8_t *renewed;    /* which kinds each jump draws again, (jump_count, KINDS) */
    const uint8_t *of_profile; /* the jump concerns nothing but a profile, (jump_count,) */
    const float *kinds;        /* sums of the probabilities of earlier values of each kind, (KINDS, kind_values) */
    const float *grid_ms;      /* ISIs of the space [ms], ascending, (points,) */
    const float *cells;        /* where outcomes end, as shares of the range of the log MEP, (outcomes + 1,) */
    int64_t changed;           /* block of the latent that says when something changes; that of its size is the next */
    int64_t rows;              /* of tables by facilitation */
    int64_t fine;              /* the ISIs are so close to each other that a window's peak is in all of their range */
} Tables;

typedef struct {
    /* The log likelihood of each person's trials (b, n, COLUMNS) under each particle (b, p, FIELDS), (b, p). */
    int (*likelihoods)(int64_t people, int64_t particles, int64_t trials, const float *fields, const float *columns,
                       float *found);
    /* What particles mean after so many trials, or with their changes if it is negative, (b, p, FIELDS). */
    int (*meanings)(const Tables *tables, int64_t people, int64_t particles, const float *values, const int64_t *kinds,
                    int64_t trials, float *fields);
    /* Log weights (b, p) under another prior, which ISIs are chosen with, by those under the particles' own. */
    int (*usual_weights)(const Tables *tables, const Tables *usual, int64_t people, int64_t particles,
                         const float *values, const int64_t *kinds, const float *densities, const double *log_weights,
                         double *found);
    /* Particles after one more trial, the last of the columns (b, n, COLUMNS), in place: weighed, resampled where fewer
    carry the posterior than a share, and moved so often where they were kept and where they were resampled. Found are
    the log likelihood of the trial, the effective sample size as a share, counts of moves as of `sweeps`, and what was
    foretold: probabilities of amplitudes below its two ends times weights, and the weights, summed, (b, 9). */
    int (*learn)(const Tables *tables, int64_t people, int64_t particles, int64_t trials, const float *columns,
                 double min_ess, int64_t kept, int64_t resampled, uint64_t *dice, float *values, int64_t *kinds,
                 double *log_weights, float *log_likelihood, float *densities, double *found);
    /* Particles of equal weight that stand for weighted ones, as they are after so many trials: their numbers (b, s)
    and fields (b, s, FIELDS). */
    int (*represent)(const Tables *tables, int64_t people, int64_t particles, int64_t size, int64_t trials,
                     const float *values, const int64_t *kinds, const double *log_weights, int64_t *picks,
                     float *fields);
    /* Particles of the prior, by the seed of each person, (b, p, latents) and (b, p, KINDS). */
    int (*draws)(const Tables *tables, int64_t people, int64_t particles, const uint64_t *seeds, float *values,
                 int64_t *kinds);
    /* Each person's particles moved so many times, in place; counts are shifts, accepted ones, jumps, accepted ones. */
    int (*sweeps)(const Tables *tables, int64_t people, int64_t particles, int64_t trials, const int64_t *numbers,
                  const float *columns, uint64_t *dice, float *values, int64_t *kinds, float *log_likelihood,
                  float *densities, float *counts);
    /* Facilitations of the rows of tables, and expected MEPs above the floor there, in floors, (b, s, rows) each. */
    int (*evoked_means)(int64_t samples, int64_t rows, const float *fields, float *levels, float *means);
    /* The probability of each outcome of the next trial, after so many, at the facilitations (b, s, rows), where an MEP
    of these means is expected, (b, s, rows, y). Outcomes are cells (y + 1,) between two log MEPs, (b, 2). */
    int (*outcome_tables)(int64_t people, int64_t samples, int64_t rows, int64_t outcomes, int64_t order,
                          const float *fields, const float *levels, const float *means, const float *cells,
                          float *ends, float *table);
    /* What lies between the rows of tables (b, s, rows, y) at other facilitations (b, s, t), (b, s, t, y). */
    int (*rows_between)(int64_t samples, int64_t rows, int64_t isis, int64_t outcomes, const float *fields,
                        const float *table, const float *levels, float *found);
    /* Facilitations at some ISIs (t,), (b, s, t). */
    int (*facilitations)(int64_t samples, int64_t isis, const float *fields, const float *isi_ms, float *found);
    /* Facilitation at each window's edge, 2 where there is no window, (b, s). */
    int (*edge_levels)(int64_t samples, int64_t rows, int64_t isis, int32_t fine, const float *fields,
                       const float *evoked, const float *isi_ms, float *found);
    /* Windows as two runs of indices of ISIs: first, behind the last, (b, s, 4). */
    int (*window_runs)(int64_t samples, int64_t isis, const float *fields, const float *levels, const float *isi_ms,
                       int32_t *runs);
    /* Of windows as so many runs (s, runs, 2): the set of ISIs (t,) of largest expected F1 among those in at least a
    share of as many windows as any is in, by shares (cuts,), and this F1. */
    int (*best_window)(int64_t samples, int64_t most_runs, int64_t isis, int64_t cuts, const int32_t *runs,
                       const double *shares, uint8_t *inside, double *f1);
    /* Entropy of the mean of distributions (s, t, y), less their mean entropy, (t,); or, with windows (s, points), the
    variance of each point's membership less that expected after an outcome, summed. */
    int (*reductions)(int64_t samples, int64_t isis, int64_t outcomes, int64_t points, const float *mass,
                      const float *masks, float *found);
    /* The same by samples of particles, under another prior if there is one, (b, t); their windows at these ISIs are
    those of the pairs' intensity, and the next pulse is so much stronger [% RMT]. */
    int (*ask)(const Tables *tables, const Tables *usual, int64_t people, int64_t particles, int64_t size,
               int64_t trials, int32_t of_window, double stronger, int64_t isis, const float *values,
               const int64_t *kinds, const float *densities, const double *log_weights, const float *isi_ms,
               float *found);
    /* One person's window: the particles that represent all (s,), their windows as runs (s, 4); and `best_window`. */
    int (*estimate)(const Tables *tables, int64_t particles, int64_t size, int64_t trials, int64_t cuts,
                    const float *values, const int64_t *kinds, const double *log_weights, const double *shares,
                    int64_t *picks, int32_t *runs, uint8_t *inside, double *f1);
    /* Elementary functions, for tests: exp, exp2, log, 1 / x, 1 / root x, and the probability that a standard normal
    variable is between x and y, number 0 to 5. */
    int (*elementary)(int32_t number, int64_t count, const float *x, const float *y, float *found);
} Engine;

#endif
