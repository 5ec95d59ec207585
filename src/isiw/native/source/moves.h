/* Markov chain moves of particles that leave the posterior of the trials so far unchanged.

Half of the particles move at a time: by differences within the other half, or by a jump that draws some of their kinds
and latents again. A move is accepted with probability min(1, exp(likelihood ratio + prior ratio + ratio of proposals))
(Hastings, Biometrika 57, 1970).

Whether it is, is decided in two steps (Christen and Fox, J. Comput. Graph. Stat. 14, 2005): with a(x, y) by a part of
the trials, then with min(1, r a(y, x) / a(x, y)) by all of them, r being the ratio of a single step. Here a is
min(1, exp(leeway) times the ratio that the part lets expect), so that a proposal is as likely to be accepted as in a
single step unless the part is further off than the leeway, and the posterior is the same however far off it is. */

#ifndef ISIW_MOVES_H
#define ISIW_MOVES_H

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
#define LEEWAY 4.0            /* of the first step of a decision, natural log */
#define ANOTHER_KIND 0.25f    /* how often a change that moves a little becomes one of another kind */

enum { PART = 3, LEAST_TRIALS = 8 }; /* one trial in so many is of the part; shorter histories are not parted */
INLINE int is_of_part(int64_t n) { return n % PART == 1; }

/* What the moves of a person have in common. */
typedef struct {
    const Tables *tables;
    const float *steps; /* of the mean log MEP at each trial, see steps_of, (count + 1,) */
    int64_t count;      /* of trials */
    float *redrawn;     /* room for latents that are drawn again, (latents,) */
    uint64_t *touched;  /* blocks that a part moves, by state, (states, part_count), then those of each jump, as bits */
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
    int64_t *numbers; /* room for numbers of some of them, (half,) */
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

/* Log densities of a block of numbered particles, each at its number, (p, blocks). */
static void densities_of(const Tables *tables, int64_t block, const float *values, const int64_t *kinds,
                         const int64_t *numbers, int64_t count, float *found) {
    for (int64_t first = 0; first < count; first += LANES) {
        Lanes lanes = lanes_of(values, tables->latents, kinds, numbers + first, count - first);
        Reals of = log_block_of(tables, block, &lanes);
        for (int lane = 0; lane < LANES && first + lane < count; lane++)
            found[numbers[first + lane] * kept_of(tables) + block] = of[lane];
    }
}

/* Work out the ratio of prior densities of what differences moved. Densities of the particles themselves are kept. */
static void weigh_shifts(const Tables *tables, const Proposals *to, int64_t size, const float *old,
                         const int64_t *kinds, float *densities) {
    int64_t *numbers = to->numbers;
    for (int64_t block = 0; block < tables->blocks; block++) {
        int64_t count = 0, unknown = 0;
        for (int64_t i = 0; i < size; i++)
            if (to->moved[i] >> block & 1 && densities[i * kept_of(tables) + block] == UNKNOWN) numbers[unknown++] = i;
        densities_of(tables, block, old, kinds, numbers, unknown, densities);
        for (int64_t i = 0; i < size; i++)
            if (to->moved[i] >> block & 1) numbers[count++] = i;
        densities_of(tables, block, to->z, to->kinds, numbers, count, to->found);
        for (int64_t n = 0; n < count; n++) {
            int64_t at = numbers[n] * kept_of(tables) + block;
            to->ratio[numbers[n]] += (double)to->found[at] - densities[at];
        }
    }
}

/* The particles of a person, in place. */
typedef struct {
    float *values, *log_likelihood, *densities, *counts;
    int64_t *kinds;
} State;

/* Work out what those mean whose likelihood is wanted. */
static void meanings_wanted(const Tables *tables, const Proposals *to, int64_t size) {
    int64_t wanted = 0;
    for (int64_t i = 0; i < size; i++)
        if (to->wanted[i]) to->numbers[wanted++] = i;
    meanings_of(tables, to->z, tables->latents, to->kinds, to->numbers, wanted, to->fields);
}

static void accept(const Tables *tables, const Proposals *to, int64_t i, State *state, int64_t particle) {
    float *log_likelihood = state->log_likelihood + particle, *densities = state->densities + particle * kept_of(tables);
    int sort = to->jumped[i] ? 2 : 0;
    state->counts[sort] += 1.0f;
    if (!(to->log_u[i] < (double)to->after[i] - *log_likelihood + to->ratio[i])) return;
    state->counts[sort + 1] += 1.0f;
    *log_likelihood = to->after[i];
    memcpy(state->values + particle * tables->latents, to->z + i * tables->latents,
           (size_t)tables->latents * sizeof(float));
    memcpy(state->kinds + particle * KINDS, to->kinds + i * KINDS, KINDS * sizeof(int64_t));
    for (int64_t block = 0; to->jumped[i] && block < tables->blocks; block++) densities[block] = UNKNOWN;
    for (uint64_t moved = to->moved[i]; moved;) {
        int64_t block = next_of(&moved);
        densities[block] = to->found[i * kept_of(tables) + block];
    }
    densities[tables->blocks] = to->part[i];
}

/* Reject what a part of the trials is enough to reject, see above. */
static void screen(const Chain *chain, const Proposals *to, int64_t size, const float *old, const int64_t *kinds,
                   float *densities) {
    const Tables *tables = chain->tables;
    int64_t unknown = 0;
    for (int64_t i = 0; i < size; i++) {
        to->unknown[i] = to->wanted[i] && densities[i * kept_of(tables) + tables->blocks] == UNKNOWN;
        if (to->unknown[i]) to->numbers[unknown++] = i;
    }
    meanings_of(tables, old, tables->latents, kinds, to->numbers, unknown, to->fields);
    person_likelihood(to->fields, size, to->unknown, chain->trials, chain->part, 0, to->part);
    for (int64_t n = 0; n < unknown; n++)
        densities[to->numbers[n] * kept_of(tables) + tables->blocks] = to->part[to->numbers[n]];
    meanings_wanted(tables, to, size);
    person_likelihood(to->fields, size, to->wanted, chain->trials, chain->part, 0, to->part);
    float trials = (float)chain->count / (float)chain->part;
    for (int64_t i = 0; i < size; i++) {
        if (!to->wanted[i]) continue;
        float own = densities[i * kept_of(tables) + tables->blocks];
        double expected = to->ratio[i] + trials * (to->part[i] - own), there = fmin(0.0, LEEWAY + expected);
        to->log_u[i] -= (float)there, to->ratio[i] += fmin(0.0, LEEWAY - expected) - there;
        to->wanted[i] = to->log_u[i] < 0.0f;
        if (!to->wanted[i]) to->ratio[i] = -INFINITY;
    }
}

/* Move the particles first to behind by differences within those from theirs on. */
static void move_half(const Chain *chain, const Proposals *to, State *state, uint64_t sweep, int64_t first,
                      int64_t behind, int64_t theirs, int64_t others) {
    const Tables *tables = chain->tables;
    int64_t latents = tables->latents, size = behind - first;
    const float *old = state->values + first * latents;
    const int64_t *kinds = state->kinds + first * KINDS;
    float *densities = state->densities + first * kept_of(tables);
    for (int64_t i = 0; i < size; i++) {
        to->dice[i] = stream_of(sweep, first + i);
        propose(chain, to, i, old + i * latents, kinds + i * KINDS, state->values + theirs * latents, others);
        to->log_u[i] = log_1(most_1(uniform(to->dice + i), 1e-30f));
    }
    weigh_shifts(tables, to, size, old, kinds, densities);
    for (int64_t i = 0; i < size; i++) {
        if (tables->apart && overlap(tables, to->z + i * latents)) to->ratio[i] = -INFINITY;
        to->after[i] = state->log_likelihood[first + i], to->part[i] = densities[i * kept_of(tables) + tables->blocks];
        to->wanted[i] &= to->ratio[i] > -INFINITY;
    }
    if (chain->part)
        screen(chain, to, size, old, kinds, densities);
    else
        meanings_wanted(tables, to, size);
    person_likelihood(to->fields, size, to->wanted, chain->trials + chain->part, chain->count - chain->part,
                      chain->shares, to->after);
    for (int64_t i = 0; i < size; i++) {
        if (to->wanted[i]) chain->part ? (to->after[i] += to->part[i]) : (to->part[i] = UNKNOWN);
        accept(tables, to, i, state, first + i);
    }
}

/* The trials of the part, then the others; how many are of the part. */
static int64_t parted(const Trial *trials, int64_t count, int shares, Trial *ordered) {
    int64_t part = 0, rest = 0;
    for (int64_t n = 0; n < count; n++) part += is_of_part(n);
    if (shares || count < LEAST_TRIALS) part = 0;
    for (int64_t n = 0, first = 0; n < count; n++)
        ordered[part && is_of_part(n) ? first++ : part + rest++] = trials[n];
    return part;
}

static int sweeps(const Tables *tables, int64_t people, int64_t particles, int64_t count, const int64_t *numbers,
                  const float *columns, uint64_t *dice, float *values, int64_t *kinds, float *log_likelihood,
                  float *densities, float *counts) {
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    int64_t half = particles / 2, most = particles - half, latents = tables->latents, kept = kept_of(tables);
    size_t each = (size_t)most;
    Trial *trials = malloc((size_t)(count + 1) * 2 * sizeof *trials), *ordered = trials + count;
    float *steps = malloc((size_t)(count + 1) * sizeof *steps);
    Proposals to = {.z = malloc(each * (size_t)latents * sizeof(float)),
                    .found = malloc(each * (size_t)kept * sizeof(float)),
                    .fields = malloc(each * FIELDS * sizeof(float)),
                    .part = malloc(each * sizeof(float)),
                    .after = malloc(each * sizeof(float)),
                    .log_u = malloc(each * sizeof(float)),
                    .ratio = malloc(each * sizeof(double)),
                    .kinds = malloc(each * KINDS * sizeof(int64_t)),
                    .numbers = malloc(each * sizeof(int64_t)),
                    .dice = malloc(each * sizeof(uint64_t)),
                    .moved = malloc(each * sizeof(uint64_t)),
                    .jumped = malloc(each),
                    .wanted = malloc(each),
                    .unknown = malloc(each)};
    float *redrawn = malloc((size_t)latents * sizeof *redrawn);
    uint64_t *touched = malloc((size_t)(tables->states * tables->part_count + tables->jump_count) * sizeof *touched);
    int there = trials && steps && to.z && to.found && to.fields && to.after && to.ratio && to.kinds && to.numbers &&
                to.dice && to.moved && to.jumped && to.wanted && to.unknown && to.part && to.log_u && redrawn && touched;
    if (there) touched_of(tables, touched);
    for (int64_t person = 0; there && person < people; person++) {
        int shares = trials_of(columns + person * count * COLUMNS, count, trials);
        int64_t part = parted(trials, count, shares, ordered);
        Chain chain = {tables, steps, count, redrawn, touched, ordered, part, shares, 0.0f};
        for (int64_t n = 0; n < count; n++) chain.last = most_1(chain.last, trials[n].of[ORDER]);
        steps_of(columns + person * count * COLUMNS, count, steps);
        int64_t at = person * particles;
        State state = {values + at * latents, log_likelihood + at, densities + at * kept, counts + 4 * person,
                       kinds + at * KINDS};
        for (int64_t sweep = 0; sweep < numbers[person]; sweep++) {
            uint64_t stream = random_bits(dice + person);
            move_half(&chain, &to, &state, stream, 0, half, half, most);
            move_half(&chain, &to, &state, stream, half, particles, 0, half);
        }
    }
    free(trials), free(steps), free(redrawn), free(touched), free(to.z), free(to.found), free(to.fields);
    free(to.after), free(to.ratio), free(to.kinds), free(to.numbers), free(to.dice), free(to.moved), free(to.jumped);
    free(to.wanted), free(to.unknown), free(to.part), free(to.log_u);
    return there ? 0 : -1;
}

#define REDRAWS 20 /* how often segments that overlap are drawn again; next to none do then */

/* Particles of the prior, each from a stream of its own. */
static int draws(const Tables *tables, int64_t people, int64_t particles, const uint64_t *seeds, float *values,
                 int64_t *kinds) {
    for (int64_t i = 0; i < people * particles; i++) {
        uint64_t dice = stream_of(seeds[i / particles], i % particles);
        float *z = values + i * tables->latents;
        for (int kind = 0; kind < KINDS; kind++)
            kinds[i * KINDS + kind] =
                which(uniform(&dice), tables->kinds + kind * tables->kind_values, tables->kind_values);
        int time = 0;
        do {
            for (int64_t block = 0; block < tables->blocks; block++) draw_block(tables, block, &dice, z);
        } while (tables->apart && overlap(tables, z) && time++ < REDRAWS);
    }
    return 0;
}

#endif
