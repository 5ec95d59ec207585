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

#include "proposals.h"

#define LEEWAY 4.0 /* of the first step of a decision, natural log */

enum { PART = 3, LEAST_TRIALS = 8 }; /* one trial in so many is of the part; shorter histories are not parted */
INLINE int is_of_part(int64_t n) { return n % PART == 1; }

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
    int64_t *numbers = to->numbers, *unknowns = numbers + size;
    for (int64_t block = 0; block < tables->blocks; block++) {
        int64_t count = 0, unknown = 0;
        /* Without branches, which the processor would guess wrongly. */
        for (int64_t i = 0; i < size; i++) numbers[count] = i, count += to->moved[i] >> block & 1;
        for (int64_t n = 0; n < count; n++)
            unknowns[unknown] = numbers[n], unknown += densities[numbers[n] * kept_of(tables) + block] == UNKNOWN;
        densities_of(tables, block, old, kinds, unknowns, unknown, densities);
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
    for (int64_t i = 0; i < size; i++) to->numbers[wanted] = i, wanted += to->wanted[i];
    meanings_of(tables, to->z, tables->latents, to->kinds, to->numbers, wanted, to->fields);
}

static void accept(const Tables *tables, const Proposals *to, int64_t i, State *state, int64_t particle) {
    float *log_likelihood = state->log_likelihood + particle;
    float *densities = state->densities + particle * kept_of(tables);
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
        to->log_u[i] = most_1(uniform(to->dice + i), 1e-30f);
    }
    for (int64_t i = 0; i < size; i += LANES)
        stored(log_v(loaded(to->log_u + i, size - i)), to->log_u + i, size - i);
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
                    .numbers = malloc(2 * each * sizeof(int64_t)),
                    .dice = malloc(each * sizeof(uint64_t)),
                    .moved = malloc(each * sizeof(uint64_t)),
                    .jumped = malloc(each),
                    .wanted = malloc(each),
                    .unknown = malloc(each)};
    float *redrawn = malloc((size_t)latents * sizeof *redrawn);
    uint64_t *touched = malloc((size_t)(tables->states * tables->part_count + tables->jump_count) * sizeof *touched);
    int there = trials && steps && to.z && to.found && to.fields && to.after && to.ratio && to.kinds && to.numbers &&
                to.dice && to.moved && to.jumped && to.wanted && to.unknown && to.part && to.log_u && redrawn &&
                touched;
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
