/* What a trial teaches particles: they are weighed, resampled where few of them carry the posterior, and moved
(resample-move: Gilks and Berzuini, J. R. Stat. Soc. B 63, 2001). Weights are in double precision. */

#ifndef ISIW_LEARNING_H
#define ISIW_LEARNING_H

#include "moves.h"

/* A window or none, a depression or none, and what changes. */
enum { CHANGE_KINDS = SCALE_CHANGE + 1, HYPOTHESES = 4 * CHANGE_KINDS };

#define LEAST_SHARE 0.03       /* of the particles, that resampling leaves to a hypothesis, so that it can come back */
#define PREDICTS 4             /* one particle in so many foretells an amplitude; all would say nearly the same */
#define LEAST_PROBABILITY 1e-9 /* less probable hypotheses are left fewer particles */

static int64_t hypothesis_of(const int64_t *kinds) {
    return CHANGE_KINDS * (2 * kinds[OF_PRESENT] + kinds[OF_DEPRESSED]) + kinds[OF_CHANGE];
}

/* Let weights sum to 1; the log of their sum before. */
static double normalise(double *log_weights, int64_t count) {
    double most = -INFINITY, sum = 0.0;
    for (int64_t i = 0; i < count; i++) most = fmax(most, log_weights[i]);
    for (int64_t i = 0; i < count; i++) sum += exp(log_weights[i] - most);
    double log_sum = most + log(sum);
    for (int64_t i = 0; i < count; i++) log_weights[i] -= log_sum;
    return log_sum;
}

/* Effective sample size, as a share of the particles. */
static double ess_of(const double *log_weights, int64_t count) {
    double squares = 0.0;
    for (int64_t i = 0; i < count; i++) squares += exp(2.0 * log_weights[i]);
    return 1.0 / squares / (double)count;
}

/* Evenly spaced picks of weighted particles, in order: systematic resampling. */
static void systematic(const double *log_weights, int64_t count, int64_t size, int64_t *picks) {
    double most = -INFINITY, whole = 0.0, below = 0.0;
    for (int64_t i = 0; i < count; i++) most = fmax(most, log_weights[i]);
    for (int64_t i = 0; i < count; i++) whole += exp(log_weights[i] - most);
    for (int64_t i = 0, next = 0; i < count && next < size; i++) {
        below += exp(log_weights[i] - most);
        while (next < size && (below >= whole * ((double)next + 0.5) / (double)size || i == count - 1))
            picks[next++] = i;
    }
}

/* The particles of a person, and what they weigh. */
typedef struct {
    float *values, *log_likelihood, *densities;
    int64_t *kinds;
    double *log_weights;
} Crowd;

/* Room for resampling. */
typedef struct {
    float *fields, *likelihood;
    int64_t *picks;
    double *log_favour;
    uint8_t *some;
    Trial *trials;
    Crowd fresh;
} Room;

/* Log of how much more often a particle is picked than its weight says: 0 where no hypothesis is too rare. */
static void favour_rare(const Crowd *crowd, int64_t particles, double *log_favour) {
    double probability[HYPOTHESES] = {0.0};
    for (int64_t i = 0; i < particles; i++)
        probability[hypothesis_of(crowd->kinds + i * KINDS)] += exp(crowd->log_weights[i]);
    for (int64_t i = 0; i < particles; i++) {
        double share = fmax(probability[hypothesis_of(crowd->kinds + i * KINDS)], LEAST_PROBABILITY);
        log_favour[i] = fmax(log(LEAST_SHARE / share), 0.0);
    }
}

static void resample(const Tables *tables, Crowd *crowd, int64_t particles, const Room *room, uint64_t *dice) {
    size_t latents = (size_t)tables->latents, blocks = (size_t)kept_of(tables), count = (size_t)particles;
    const Crowd *fresh = &room->fresh;
    int64_t *picks = room->picks;
    favour_rare(crowd, particles, room->log_favour);
    for (int64_t i = 0; i < particles; i++) crowd->log_weights[i] += room->log_favour[i];
    systematic(crowd->log_weights, particles, particles, picks);
    for (int64_t i = particles - 1; i > 0; i--) { /* shuffled, both halves represent the posterior */
        int64_t other = one_of(dice, i + 1), pick = picks[i];
        picks[i] = picks[other], picks[other] = pick;
    }
    for (size_t i = 0; i < count; i++) {
        size_t pick = (size_t)picks[i];
        memcpy(fresh->values + i * latents, crowd->values + pick * latents, latents * sizeof(float));
        memcpy(fresh->densities + i * blocks, crowd->densities + pick * blocks, blocks * sizeof(float));
        memcpy(fresh->kinds + i * KINDS, crowd->kinds + pick * KINDS, KINDS * sizeof(int64_t));
        fresh->log_likelihood[i] = crowd->log_likelihood[pick];
        crowd->log_weights[i] = -room->log_favour[pick];
    }
    memcpy(crowd->values, fresh->values, count * latents * sizeof(float));
    memcpy(crowd->densities, fresh->densities, count * blocks * sizeof(float));
    memcpy(crowd->kinds, fresh->kinds, count * KINDS * sizeof(int64_t));
    memcpy(crowd->log_likelihood, fresh->log_likelihood, count * sizeof(float));
    normalise(crowd->log_weights, particles);
}

/* Probabilities of amplitudes below the ends of a trial's, and the weights of those who predict them, summed. Of a
pulse at another intensity recruitment curves alone do. */
static void foretell(const Crowd *crowd, int64_t particles, Trial trial, const Room *room, double *found) {
    float ends[2] = {trial.of[LOW], trial.of[HIGH]};
    for (int64_t i = 0; i < particles; i++)
        room->some[i] = i % PREDICTS == 0 && (!trial.of_curves || is_curved(room->fields + i * FIELDS));
    trial.of[LOW] = -INFINITY, trial.of_curves = 0;
    found[0] = found[1] = found[2] = 0.0;
    for (int end = 0; end < 2; end++) {
        trial.of[HIGH] = ends[end];
        if (!end || ends[0] != ends[1])
            person_likelihood(room->fields, particles, room->some, &trial, 1, trial.of[KNOWN_LOG_SD] > 0.0f,
                              room->likelihood);
        for (int64_t i = 0; i < particles; i += PREDICTS)
            if (room->some[i]) found[end] += exp(crowd->log_weights[i] + room->likelihood[i]);
    }
    for (int64_t i = 0; i < particles; i += PREDICTS)
        if (room->some[i]) found[2] += exp(crowd->log_weights[i]);
}

/* Weigh particles by the last trial; the log of its likelihood under all of them, and what was foretold of it. */
static double weigh(const Tables *tables, Crowd *crowd, int64_t particles, const float *columns, int64_t count,
                    const Room *room, double *foretold) {
    meanings(tables, 1, particles, crowd->values, crowd->kinds, -1, room->fields);
    int shares = trials_of(columns, count, room->trials); /* then all trials depend on each other */
    foretell(crowd, particles, room->trials[count - 1], room, foretold);
    const Trial *from = shares ? room->trials : room->trials + count - 1;
    person_likelihood(room->fields, particles, NULL, from, shares ? count : 1, shares, room->likelihood);
    for (int64_t i = 0; i < particles; i++) {
        float gain = shares ? room->likelihood[i] - crowd->log_likelihood[i] : room->likelihood[i];
        crowd->log_weights[i] += gain, crowd->log_likelihood[i] += gain;
        /* what is unknown stays so: it is too large to change */
        if (is_of_part(count - 1)) crowd->densities[i * kept_of(tables) + tables->blocks] += gain;
    }
    return normalise(crowd->log_weights, particles);
}

enum { OF_A_TRIAL = 9 }; /* numbers that are found, see engine.h */

static int learn(const Tables *tables, int64_t people, int64_t particles, int64_t count, const float *columns,
                 double min_ess, int64_t kept, int64_t resampled, uint64_t *dice, float *values, int64_t *kinds,
                 double *log_weights, float *log_likelihood, float *densities, double *found) {
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    size_t each = (size_t)particles;
    int64_t latents = tables->latents, blocks = kept_of(tables);
    Room room = {.fields = malloc(each * FIELDS * sizeof(float)),
                 .likelihood = malloc(each * sizeof(float)),
                 .picks = malloc(each * sizeof(int64_t)),
                 .log_favour = malloc(each * sizeof(double)),
                 .some = malloc(each),
                 .trials = malloc((size_t)count * sizeof(Trial)),
                 .fresh = {.values = malloc(each * (size_t)latents * sizeof(float)),
                           .log_likelihood = malloc(each * sizeof(float)),
                           .densities = malloc(each * (size_t)blocks * sizeof(float)),
                           .kinds = malloc(each * KINDS * sizeof(int64_t))}};
    Crowd *fresh = &room.fresh;
    int failed = !(room.fields && room.likelihood && room.picks && room.log_favour && room.some && room.trials &&
                   fresh->values && fresh->log_likelihood && fresh->densities && fresh->kinds);
    for (int64_t person = 0; !failed && person < people; person++) {
        int64_t at = person * particles;
        const float *told = columns + person * count * COLUMNS;
        Crowd crowd = {values + at * latents, log_likelihood + at, densities + at * blocks, kinds + at * KINDS,
                       log_weights + at};
        double *of_person = found + person * OF_A_TRIAL;
        float counts[4] = {0.0f};
        of_person[0] = weigh(tables, &crowd, particles, told, count, &room, of_person + 6);
        of_person[1] = ess_of(crowd.log_weights, particles);
        int worn = of_person[1] < min_ess;
        if (worn) resample(tables, &crowd, particles, &room, dice + person);
        int64_t number = worn ? resampled : kept;
        if (number)
            failed = sweeps(tables, 1, particles, count, &number, told, dice + person, crowd.values, crowd.kinds,
                            crowd.log_likelihood, crowd.densities, counts);
        for (int i = 0; i < 4; i++) of_person[2 + i] = counts[i];
    }
    free(room.fields), free(room.likelihood), free(room.picks), free(room.log_favour), free(room.some);
    free(room.trials);
    free(fresh->values), free(fresh->log_likelihood), free(fresh->densities), free(fresh->kinds);
    return failed ? -1 : 0;
}

static int usual_weights(const Tables *tables, const Tables *usual, int64_t people, int64_t particles,
                         const float *values, const int64_t *kinds, const float *densities, const double *log_weights,
                         double *found) {
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    for (int64_t first = 0, count = people * particles; first < count; first += LANES) {
        int64_t numbers[LANES], left = count - first;
        const float *known[LANES];
        for (int64_t lane = 0; lane < LANES; lane++) {
            numbers[lane] = first + lane;
            known[lane] = densities + (first + (lane < left ? lane : left - 1)) * kept_of(tables);
        }
        Lanes lanes = lanes_of(values, tables->latents, kinds, numbers, left);
        Reals own = log_usual(tables, &lanes, known), others = log_usual(usual, &lanes, NULL);
        for (int64_t lane = 0; lane < LANES && lane < left; lane++)
            found[first + lane] = log_weights[first + lane] + others[lane] - own[lane];
    }
    for (int64_t person = 0; person < people; person++) normalise(found + person * particles, particles);
    return 0;
}

static int represent(const Tables *tables, int64_t people, int64_t particles, int64_t size, int64_t trials,
                     const float *values, const int64_t *kinds, const double *log_weights, int64_t *picks,
                     float *fields) {
    if (!known_kinds(tables, people * particles, kinds)) return NO_PARTICLES;
    float *room = malloc((size_t)particles * FIELDS * sizeof *room);
    if (!room) return -1;
    for (int64_t person = 0; person < people; person++) {
        int64_t *own = picks + person * size, first = person * particles;
        systematic(log_weights + first, particles, size, own);
        meanings_of(tables, values + first * tables->latents, tables->latents, kinds + first * KINDS, own, size, room);
        for (int64_t i = 0; i < size; i++) {
            float *meant = fields + (person * size + i) * FIELDS;
            memcpy(meant, room + own[i] * FIELDS, (size_t)fields_of(tables) * sizeof *meant);
            settle(meant, (float)trials);
        }
    }
    free(room);
    return 0;
}

#endif
