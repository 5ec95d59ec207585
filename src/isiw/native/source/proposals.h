/* Where particles may move to: by differences within others, or by a jump that draws some of their kinds and latents
again. */

#ifndef ISIW_PROPOSALS_H
#define ISIW_PROPOSALS_H

#include "likelihood.h"
#include "prior.h"

#define JUMPS 0.4f            /* how often a move is a jump */
#define WHOLE_DIFFERENCE 0.1f /* how often a difference is added as it is, which leads from mode to mode */
#define BLUR 0.02f            /* SD of what is added to a difference, as a share of the usual SD of each latent */
#define RECENT 0.8f           /* how often the trial of another change is proposed among those so far */
#define NEARLY 2.0f           /* SDs of the moves of a change: by how many trials, */
#define A_LITTLE 0.3f         /* and at most by what size */
#define OF_STEPS 0.7f         /* how often a size is proposed near the step of the amplitudes at its trial, */
#define STEP_SD 0.3f          /* and how near, natural log */
#define ANOTHER_KIND 0.25f    /* how often a change that moves a little becomes one of another kind */

/* What the moves of a person have in common. */
typedef struct {
    const Tables *tables;
    const float *steps;  /* of the mean log MEP at each trial, see steps_of, (count + 1,) */
    int64_t count;       /* of trials */
    float *redrawn;      /* room for latents that are drawn again, (latents,) */
    uint64_t *touched;   /* blocks that a part moves, by state, (states, part_count), then of each jump, as bits */
    const Trial *trials; /* those of the part first */
    int64_t part;        /* how many these are; 0 where decisions are of one step */
    int shares;          /* whether trials share a factor of their known parts */
    float last;          /* before which of them all are, as their order has it */
} Chain;

/* The blocks of which any latent is flagged, as bits. */
static uint64_t blocks_of(const Tables *tables, const uint8_t *flagged) {
    uint64_t found = 0;
    for (int64_t block = 0; block < tables->blocks; block++)
        for (int64_t latent = tables->first[block]; latent < tables->first[block] + tables->size[block]; latent++)
            if (flagged[latent]) found |= (uint64_t)1 << block;
    return found;
}

static void touched_of(const Tables *tables, uint64_t *touched) {
    int64_t parts = tables->states * tables->part_count, padded = in_lanes(tables->latents);
    for (int64_t i = 0; i < parts; i++) touched[i] = blocks_of(tables, tables->shifted + i * padded);
    for (int64_t i = 0; i < tables->jump_count; i++)
        touched[parts + i] = blocks_of(tables, tables->redrawn + i * tables->latents);
}

/* The number of the lowest bit, which is taken away. */
INLINE int64_t next_of(uint64_t *bits) {
    int64_t number = __builtin_ctzll(*bits);
    *bits &= *bits - 1;
    return number;
}

/* By how much the mean log MEP is larger from each trial on than before it; 0 for all and none, (count + 1,). */
static void steps_of(const float *columns, int64_t count, float *steps) {
    double all_of = 0.0, before = 0.0;
    for (int64_t n = 0; n <= count; n++) {
        steps[n] = (float)all_of;
        if (n == count) break;
        float low = columns[n * COLUMNS + LOW], high = columns[n * COLUMNS + HIGH];
        all_of += isfinite(low) ? low : isfinite(high) ? high : 0.0f;
    }
    for (int64_t n = 1; n < count; n++) {
        before = steps[n];
        steps[n] = (float)((all_of - before) / (double)(count - n) - before / (double)n);
    }
    steps[count] = 0.0f;
}

/* The step of the amplitudes at the trial before which a change comes. */
static double step_at(const Chain *chain, double after) {
    double place = fmin(ceil(after), (double)chain->count);
    return chain->steps[place > 0.0 ? (int64_t)place : 0];
}

/* Log density of when something changes, and of by how much. */
INLINE float log_when(const Chain *chain, const float *z) {
    Reals when = all(z[chain->tables->first[chain->tables->changed]]);
    return log_block(chain->tables, chain->tables->changed, &when)[0];
}
INLINE float log_size(const Chain *chain, const float *z) {
    Reals size = all(z[chain->tables->first[chain->tables->changed + 1]]);
    return log_block(chain->tables, chain->tables->changed + 1, &size)[0];
}

INLINE const float *change_edges(const Tables *tables) { return tables->kinds + OF_CHANGE * tables->kind_values; }

/* Log of the prior of a change, or of none, by how other_change proposes it: p(change) / q(change). */
static double favour(const Chain *chain, const float *z, int64_t kind) {
    const Tables *tables = chain->tables;
    double none = change_edges(tables)[0], span = fmax(1.0, (double)chain->count), recent = 0.0;
    if (kind == NO_CHANGE) return log(2.0 * none);
    float log_after = z[tables->at[LOG_CHANGED_AFTER]], size = z[tables->at[CHANGE_SIZE]];
    double after = exp(log_after);
    if (after < span) {
        double apart = (size - step_at(chain, after)) / STEP_SD;
        double near = exp(-0.5 * apart * apart - log(STEP_SD) - log_size(chain, z));
        /* densities of mixtures lack the constant 1 / root of 2 pi, that of a trial among those so far has none */
        recent = exp(log_after - log(span) - log_when(chain, z)) * 2.5066282746310002;
        recent *= 1.0 - OF_STEPS + OF_STEPS * near;
    }
    return log((1.0 - none) / (RECENT * recent + 1.0 - RECENT));
}

/* Move a change a little, or to another trial; the log ratio of prior to proposal. */
static double moved_change(const Chain *chain, uint64_t *dice, float *z, int64_t *kinds) {
    const Tables *tables = chain->tables;
    float *when = z + tables->at[LOG_CHANGED_AFTER], *size = z + tables->at[CHANGE_SIZE];
    double span = fmax(1.0, (double)chain->count), after = exp(*when);
    /* by the density of the trial, not of its log */
    double before = (double)log_when(chain, z) + log_size(chain, z) - *when;
    if (uniform(dice) < 0.5f)
        after = after < span ? span * uniform(dice) : after;
    else
        after += NEARLY * normal(dice);
    if (after <= 0.0) return -INFINITY;
    float share = uniform(dice), none = change_edges(tables)[0];
    *when = (float)log(after), *size += A_LITTLE * share * share * normal(dice);
    if (uniform(dice) < ANOTHER_KIND)
        kinds[OF_CHANGE] = which(none + (1.0f - none) * uniform(dice), change_edges(tables), tables->kind_values);
    return (double)log_when(chain, z) + log_size(chain, z) - *when - before;
}

/* Let a particle have another change, or none; the log ratio of prior to proposal. */
static double other_change(const Chain *chain, uint64_t *dice, float *z, int64_t *kinds) {
    const Tables *tables = chain->tables;
    double span = fmax(1.0, (double)chain->count), before = favour(chain, z, kinds[OF_CHANGE]);
    float none = change_edges(tables)[0];
    float *when = z + tables->at[LOG_CHANGED_AFTER], *size = z + tables->at[CHANGE_SIZE];
    draw_block(tables, tables->changed, dice, z);
    draw_block(tables, tables->changed + 1, dice, z);
    int another = uniform(dice) >= 0.5f;
    float quantile = none + (1.0f - none) * uniform(dice);
    kinds[OF_CHANGE] = another ? which(quantile, change_edges(tables), tables->kind_values) : NO_CHANGE;
    if (kinds[OF_CHANGE] != NO_CHANGE && uniform(dice) < RECENT) {
        double after = fmax(span * uniform(dice), 1e-3);
        *when = (float)log(after);
        if (uniform(dice) < OF_STEPS) *size = (float)step_at(chain, after) + STEP_SD * normal(dice);
    }
    return favour(chain, z, kinds[OF_CHANGE]) - before;
}

/* Draw some latents and kinds of a particle again: which jump it is, and the log ratio of prior to proposal. What is
drawn from the prior cancels. */
static int64_t jump(const Chain *chain, uint64_t *dice, float *z, int64_t *kinds, double *ratio) {
    const Tables *tables = chain->tables;
    int64_t number = which(uniform(dice), tables->jumps, tables->jump_count - 1);
    const uint8_t *redrawn = tables->redrawn + number * tables->latents, *renewed = tables->renewed + number * KINDS;
    if (kinds[OF_NOISE] == BY_LEVELS && redrawn[tables->at[CURVE_LATENTS]]) { /* what pulses have taught is kept */
        *ratio = -INFINITY;
        return number;
    }
    for (uint64_t wanted = chain->touched[tables->states * tables->part_count + number]; wanted;) {
        int64_t block = next_of(&wanted), first = tables->first[block], behind = first + tables->size[block];
        draw_block(tables, block, dice, chain->redrawn);
        for (int64_t latent = first; latent < behind; latent++)
            if (redrawn[latent]) z[latent] = chain->redrawn[latent];
    }
    for (int kind = 0; kind < OF_CHANGE; kind++)
        if (renewed[kind])
            kinds[kind] = which(uniform(dice), tables->kinds + kind * tables->kind_values, tables->kind_values);
    *ratio = 0.0;
    if (renewed[OF_CHANGE]) {
        int moves = kinds[OF_CHANGE] != NO_CHANGE && uniform(dice) < 0.5f;
        *ratio = moves ? moved_change(chain, dice, z, kinds) : other_change(chain, dice, z, kinds);
    }
    return number;
}

/* Add a scaled difference of two of the others (ter Braak, Stat. Comput. 16, 2006). */
static void shift(const Chain *chain, uint64_t *dice, const float *theirs, int64_t others, const uint8_t *moves,
                  float *z) {
    const Tables *tables = chain->tables;
    int64_t latents = tables->latents;
    const float *one = theirs + latents * one_of(dice, others), *other = theirs + latents * one_of(dice, others);
    float scale = uniform(dice) < WHOLE_DIFFERENCE ? 1.0f : 0.15f + 0.7f * uniform(dice);
    uint64_t bits = random_bits(dice);
    for (int64_t at = 0; at < latents; at += LANES) { /* all latents, as those that move are at no place of their own */
        int64_t left = latents - at;
        Reals apart = scale * (loaded(one + at, left) - loaded(other + at, left));
        apart += BLUR * loaded(tables->spreads + at, left) * blurs(bits, at);
        stored(pick(flags(moves + at), loaded(z + at, left) + apart, loaded(z + at, left)), z + at, left);
    }
}

/* Whether enhancement and depression overlap. */
static int overlap(const Tables *tables, const float *z) {
    const int64_t *at = tables->at;
    float start = z[at[START_MS]], low = z[at[LOW_START_MS]];
    return start + exp_1(z[at[LOG_WIDTH_MS]]) > low && low + exp_1(z[at[LOW_LOG_WIDTH_MS]]) > start;
}

/* Whether a change bears on the trials so far. */
static int is_felt(const Chain *chain, const float *z, const int64_t *kinds) {
    int64_t kind = kinds[OF_CHANGE];
    float after = exp_1(latent_of(chain->tables, z, LOG_CHANGED_AFTER));
    return kind == ENHANCEMENT_CHANGE || (kind != NO_CHANGE && after <= 1.0001f * chain->last);
}

/* Whether a jump is to what all trials so far are as likely under, as far as that is plain. */
static int is_indifferent(const Chain *chain, int64_t number, const float *z, const int64_t *kinds, const float *old,
                          const int64_t *old_kinds) {
    const Tables *tables = chain->tables;
    if (!tables->of_profile[number])
        return !chain->touched[tables->states * tables->part_count + number] &&
               !memcmp(kinds, old_kinds, OF_CHANGE * sizeof *kinds) && !is_felt(chain, z, kinds) &&
               !is_felt(chain, old, old_kinds);
    if (!kinds[OF_PRESENT] && !old_kinds[OF_PRESENT]) return 1;
    return kinds[OF_SHAPE] == GAUSSIAN && old_kinds[OF_SHAPE] == GAUSSIAN && /* which has no form */
           latent_of(tables, z, START_MS) == latent_of(tables, old, START_MS) &&
           latent_of(tables, z, LOG_WIDTH_MS) == latent_of(tables, old, LOG_WIDTH_MS);
}

/* Where the particles of a half may move to. */
typedef struct {
    float *z;         /* (half, latents) */
    float *found;     /* log densities of blocks that a difference moves, (half, blocks) */
    float *fields;    /* what it means, (half, FIELDS) */
    float *part;      /* its log likelihood by a part of the trials, (half,) */
    float *after;     /* and by all of them */
    float *log_u;     /* log of the draw that decides, less that of the first step's probability */
    double *ratio;    /* of prior densities and proposals, natural log */
    int64_t *kinds;   /* (half, KINDS) */
    int64_t *numbers; /* room for numbers of some of them, (2, half) */
    uint64_t *dice;   /* streams of draws */
    uint64_t *moved;  /* blocks that a difference moves, as bits */
    uint8_t *jumped;  /* whether it is a jump */
    uint8_t *wanted;  /* whether its likelihood must be worked out */
    uint8_t *unknown; /* whether the particle's own is unknown, by the part */
} Proposals;

/* Propose a particle in place of one: of another likelihood where it is wanted, of another prior where blocks moved. */
static void propose(const Chain *chain, const Proposals *to, int64_t i, const float *old, const int64_t *kinds,
                    const float *theirs, int64_t others) {
    const Tables *tables = chain->tables;
    float *z = to->z + i * tables->latents;
    int64_t *chosen = to->kinds + i * KINDS, state = 0;
    uint64_t *dice = to->dice + i;
    memcpy(z, old, (size_t)tables->latents * sizeof *z);
    for (int kind = 0; kind < KINDS; kind++) chosen[kind] = kinds[kind], state += tables->state_of[kind] * kinds[kind];
    to->jumped[i] = uniform(dice) < JUMPS;
    to->ratio[i] = 0.0, to->moved[i] = 0;
    if (to->jumped[i]) {
        int64_t number = jump(chain, dice, z, chosen, to->ratio + i);
        to->wanted[i] = !is_indifferent(chain, number, z, chosen, old, kinds);
        return;
    }
    int64_t part = state * tables->part_count + which(uniform(dice), tables->parts, tables->part_count - 1);
    to->moved[i] = chain->touched[part], to->wanted[i] = to->moved[i] != 0;
    if (to->moved[i]) shift(chain, dice, theirs, others, tables->shifted + part * in_lanes(tables->latents), z);
}

#endif
