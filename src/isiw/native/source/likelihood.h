/* The likelihood of trials under particles, a particle a lane.

    mep / floor = floor noise + known part + ratio * gain_n * sigmoid(drive + spread_q) * output noise

with weights w_q of the nodes q of the noise on the input; what lies between two nodes is passed on along the slope of
the curve, so that each node is a log-normal of matched mean and variance. A recruitment curve has a drive that is
linear in the facilitation; other kinds of noise are the same formula far below saturation, with the log of the
facilitation as the drive and log-gamma noise. See docs/model.md. */

#ifndef ISIW_LIKELIHOOD_H
#define ISIW_LIKELIHOOD_H

#include <stdlib.h>

#include "profile.h"

enum { NODES = LEVELS, FACTOR_NODES = 5, GROUPS = 64 };

#define NODE_REACH 2.6
#define BETWEEN_NODES (0.4 * 2.0 * NODE_REACH / (NODES - 1)) /* SD of what lies between the nodes */
#define ON_NODES 0.9548330338069476                          /* SD of the nodes: the root of 1 - BETWEEN_NODES^2 */
#define FAR_BELOW 15.0f                                      /* how far below saturation noise of constant CV sits */
#define LOWEST_DRIVE (-50.0f)
#define LOWEST_NOISE (-36.0f)
#define CORNER 0.05f       /* how much of the variance between nodes rounds the corner at a threshold */
#define STEEPEST_ROOT 0.2f /* where the log-gamma noise is steeper, its slope is cut */
#define OUTLIERS 0.03f     /* probability of artefacts, log-uniform between 2 and 200 floors */
#define LOG_2 0.69314718f
#define LOG_200 5.2983174f
#define OUTLIER_DENSITY (1.0f / (LOG_200 - LOG_2))
#define LEAST_MASS 1e-9f          /* no interval of an amplitude is less probable */
#define ROOT_PER_TURN 0.39894228f /* 1 / root of 2 pi */
#define EVER 40.0f                /* a power of e that stands in for infinity */

#define FIRST_GROUP_MS (-150.0f)
#define GROUP_MS 15.0f

/* Nodes of the noise on the input, evenly spaced, and their weights; filled when the library is loaded. */
static float node_at[NODES], node_weight[NODES];
static float factor_weight[FACTOR_NODES]; /* of a factor of known parts, at -2 to 2 SDs */

static void fill_nodes(void) {
    double sum = 0.0, density[NODES];
    for (int q = 0; q < NODES; q++) {
        double at = NODE_REACH * (2.0 * q / (NODES - 1) - 1.0);
        node_at[q] = (float)(at * ON_NODES);
        sum += density[q] = exp(-0.5 * at * at);
    }
    for (int q = 0; q < NODES; q++) node_weight[q] = (float)(density[q] / sum);
    double factors = 0.0, of_factor[FACTOR_NODES];
    for (int k = 0; k < FACTOR_NODES; k++) factors += of_factor[k] = exp(-0.5 * (k - 2) * (k - 2));
    for (int k = 0; k < FACTOR_NODES; k++) factor_weight[k] = (float)(of_factor[k] / factors);
}

/* exp(-drive): sigmoid(a + b) = 1 / (1 + exp(-a) exp(-b)). Limits keep a product of two within single precision, and
lie where a sigmoid is 0 or 1 for all that an MEP shows. */
INLINE Reals odds_against(Reals drive, float lowest) {
    return exp2_within_v(-1.4426950408889634f * least_v(most_v(drive, all(lowest)), all(40.0f)));
}

/* The same without a recruitment curve, whose drive is the log of the facilitation. */
INLINE Reals odds_of_level(Reals level) { return per_v(most_v(level, all(1e-9f))); }

/* A curve as its nodes have it, or a law by levels, of which one is in the place of each node. */
typedef struct {
    Reals odds[NODES];    /* of the noise on the input, see odds_against; of a level what it evokes, in floors */
    Reals between[NODES]; /* variance of what lies between, where the sigmoid is steepest; of a level that of log MEPs */
} Curve;

/* The share of each level in the law at an intensity between them: the nearer of two the more (docs/model.md). */
INLINE void shares_of_levels(const Reals *fields, Reals stronger, Reals *share) {
    Reals beyond = all(1.0f);
    for (int level = 0; level < LEVELS; level++) {
        Reals next = all(0.0f), from = fields[LEVEL_AT + level];
        if (level + 1 < LEVELS) {
            Reals way = (stronger - from) / (fields[LEVEL_AT + level + 1] - from);
            next = least_v(most_v(way, all(0.0f)), all(1.0f));
        }
        share[level] = beyond - next, beyond = next;
    }
}

static Curve levels_of(const Particles *particles) {
    const Reals *of = particles->of;
    Curve made;
    for (int level = 0; level < LEVELS; level++) {
        made.odds[level] = exp_v(of[LEVEL_MEAN + level] - of[LOG_FLOOR]) - 1.0f;
        made.between[level] = of[LEVEL_SD + level] * of[LEVEL_SD + level];
    }
    return made;
}

/* Noise of a recruitment curve is normal on the input; of the other kinds it is log-gamma, by Wilson and Hilferty's
root (PNAS 17, 1931), with its mean at 1. */
static Curve curve_of(const Particles *particles, int curved) {
    Reals spread = particles->of[SPREAD];
    Curve made;
    if (curved) {
        for (int q = 0; q < NODES; q++) {
            made.odds[q] = odds_against(spread * node_at[q], LOWEST_NOISE);
            made.between[q] = spread * spread * (float)(BETWEEN_NODES * BETWEEN_NODES);
        }
        return made;
    }
    Reals mean = all(0.0f), at[NODES];
    for (int q = 0; q < NODES; q++) {
        Reals root = 1.0f - spread * spread * (1.0f / 9.0f) + spread * (node_at[q] / 3.0f);
        Reals slope = (float)BETWEEN_NODES * spread / most_v(root, all(STEEPEST_ROOT));
        at[q] = 3.0f * log_v(most_v(root, all(0.02f)));
        made.between[q] = slope * slope;
        mean += node_weight[q] * exp_v(at[q] + 0.5f * made.between[q]);
    }
    Reals below = log_v(mean) + FAR_BELOW;
    for (int q = 0; q < NODES; q++) made.odds[q] = odds_against(at[q] - below, LOWEST_NOISE);
    return made;
}

/* What one trial is to the particles. */
typedef struct {
    Reals odds, scale, responds, known, floor_variance, output, start;
    Reals share[NODES]; /* of the levels */
} Situation;

/* How particles respond: along a curve, along one with a threshold, or by levels. */
enum { ALONG, FROM_A_THRESHOLD, LEVEL_BY_LEVEL };

/* Nodes are computed four at a time, each step for all four: the next step of one waits for its outcome, which takes
longer than the steps of the others. */
enum { TOGETHER_NODES = 4 };
#define EACH_NODE _Pragma("GCC unroll 4") for (int q = 0; q < TOGETHER_NODES; q++)

/* Means and inverse SDs of the log MEP over the floor at four nodes: the variance is that of each part by its share. */
INLINE void components(const Situation *trial, const Reals *odds, const Reals *between, int how, Reals *mean,
                       Reals *inverse_sd) {
    Reals share[TOGETHER_NODES], variance[TOGETHER_NODES], sum[TOGETHER_NODES];
    if (how == LEVEL_BY_LEVEL) {
        EACH_NODE {
            sum[q] = 1.0f + odds[q] * trial->scale + trial->known;
            inverse_sd[q] = per_root_v(between[q] + trial->floor_variance * per_v(sum[q] * sum[q]));
        }
        EACH_NODE mean[q] = log_v(sum[q]);
        return;
    }
    EACH_NODE share[q] = per_v(1.0f + trial->odds * odds[q]);
    if (how == FROM_A_THRESHOLD) { /* what lies between the nodes rounds the corner of the curve at its threshold */
        Reals rescaled = trial->scale * 0.5f * per_v(1.0f - trial->start), reach[TOGETHER_NODES];
        EACH_NODE {
            Reals steep = share[q] * (1.0f - share[q]);
            variance[q] = steep * steep * between[q], share[q] -= trial->start;
            reach[q] = most_v(share[q] * share[q] + CORNER * variance[q], all(1e-12f));
        }
        EACH_NODE variance[q] *= per_v(reach[q]);
        EACH_NODE share[q] = (root_v(reach[q]) + share[q]) * rescaled;
    } else {
        EACH_NODE {
            Reals flat = 1.0f - share[q];
            variance[q] = flat * flat * between[q], share[q] *= trial->scale;
        }
    }
    EACH_NODE {
        variance[q] = share[q] * share[q] * (variance[q] + trial->output) + trial->floor_variance;
        sum[q] = 1.0f + share[q] + trial->known;
    }
    EACH_NODE inverse_sd[q] = sum[q] * per_root_v(variance[q]);
    EACH_NODE mean[q] = log_v(sum[q]);
}

INLINE Reals weight_of(const Situation *trial, int how, int node) {
    return how == LEVEL_BY_LEVEL ? trial->share[node] : all(node_weight[node]);
}

/* Density of a log MEP over the floor. */
INLINE Reals density(const Situation *trial, const Curve *curve, int how, Reals log_mep) {
    Reals evoked = all(0.0f);
    for (int first = 0; first < NODES; first += TOGETHER_NODES) {
        Reals mean[TOGETHER_NODES], inverse_sd[TOGETHER_NODES], bell[TOGETHER_NODES];
        components(trial, curve->odds + first, curve->between + first, how, mean, inverse_sd);
        EACH_NODE bell[q] = bell_v((mean[q] - log_mep) * inverse_sd[q]);
        EACH_NODE evoked += weight_of(trial, how, first + q) * inverse_sd[q] * bell[q];
    }
    Reals still = (1.0f + trial->known) * per_root_v(trial->floor_variance);
    Reals silent = still * bell_v((log_v(1.0f + trial->known) - log_mep) * still);
    Reals mixed = trial->responds * evoked + (1.0f - trial->responds) * silent;
    Reals outlier = pick((log_mep > LOG_2) & (log_mep < LOG_200), all(OUTLIER_DENSITY), all(0.0f)) + 1e-6f;
    return (1.0f - OUTLIERS) * ROOT_PER_TURN * mixed + OUTLIERS * outlier;
}

/* Probability that a standard normal variable is between two ends, exact in either tail. */
INLINE Reals normal_between(Reals low, Reals high) {
    Wholes right = low > 0.0f; /* by symmetry, what is above the middle is looked at from below */
    Reals first = pick(right, -high, low), last = pick(right, -low, high);
    Reals before = beyond_v(absolute(first)), until = beyond_v(absolute(last));
    return pick(last < 0.0f, until, 1.0f - until) - pick(first < 0.0f, before, 1.0f - before);
}

/* Probability that a log MEP over the floor lies between two ends. */
INLINE Reals mass_between(const Situation *trial, const Curve *curve, int how, Reals low, Reals high) {
    Reals evoked = all(0.0f);
    for (int first = 0; first < NODES; first += TOGETHER_NODES) {
        Reals mean[TOGETHER_NODES], inverse_sd[TOGETHER_NODES];
        components(trial, curve->odds + first, curve->between + first, how, mean, inverse_sd);
        EACH_NODE {
            Reals inside = normal_between((low - mean[q]) * inverse_sd[q], (high - mean[q]) * inverse_sd[q]);
            evoked += weight_of(trial, how, first + q) * inside;
        }
    }
    Reals still = (1.0f + trial->known) * per_root_v(trial->floor_variance), mean = log_v(1.0f + trial->known);
    Reals silent = normal_between((low - mean) * still, (high - mean) * still);
    Reals mixed = trial->responds * evoked + (1.0f - trial->responds) * silent, one = all(1.0f), none = all(0.0f);
    Reals first = least_v(most_v((low - LOG_2) * OUTLIER_DENSITY, none), one);
    Reals last = least_v(most_v((high - LOG_2) * OUTLIER_DENSITY, none), one);
    return most_v((1.0f - OUTLIERS) * mixed + OUTLIERS * (last - first), all(LEAST_MASS));
}

/* What does not depend on the trial. */
typedef struct {
    const Particles *particles;
    Profiles profiles;
    Curve curve;
    Wholes switches, missing;
    int curved, how, any_step, any_fading, any_scale, any_missing, any_switch;
    Reals per_floor, per_scale, floor_variance, output, log_ratio, fading;
} Group;

static Group group_of(const Particles *particles, int curved, int how) {
    const Reals *of = particles->of;
    Group made = {.particles = particles, .curved = curved, .how = how};
    made.profiles = profiles_of(particles);
    made.curve = how == LEVEL_BY_LEVEL ? levels_of(particles) : curve_of(particles, curved);
    made.switches = of[NOISE] == (float)ALL_OR_NONE, made.missing = of[NOISE] == (float)MISSING;
    made.any_switch = any(made.switches), made.any_missing = any(made.missing);
    made.any_step = any((of[STEP] != 0.0f) | (of[STEP_DRIVE] != 0.0f)), made.any_scale = any(of[STEP_SCALE] != 0.0f);
    made.any_fading = any(of[FADING] != 0.0f);
    made.per_floor = exp_v(-of[LOG_FLOOR]), made.per_scale = exp_v(-of[STEP_SCALE]);
    made.floor_variance = of[FLOOR_SD] * of[FLOOR_SD];
    made.output = curved ? of[OUTPUT_SD] * of[OUTPUT_SD] : all(0.0f);
    made.log_ratio = curved ? of[LOG_RATIO] : of[LOG_RATIO] + FAR_BELOW;
    return made;
}

/* The situation of a trial, but for what drives it, at a node of the factor of known parts. */
INLINE Situation situation_of(const Group *group, const Trial *trial, float factor_at, Wholes changed) {
    const Reals *of = group->particles->of;
    Situation made = {.output = group->output, .start = of[ONSET], .floor_variance = group->floor_variance};
    Reals gain = group->log_ratio + of[DRIFT] * trial->relaxed + of[STARTLED] * trial->startle;
    if (group->any_step) gain += pick(changed, of[STEP], all(0.0f));
    made.scale = exp_v(gain), made.known = all(0.0f), made.responds = all(1.0f);
    if (trial->of[KNOWN] != 0.0f || trial->of[KNOWN_SD] != 0.0f) {
        float factor = factor_at == 0.0f ? 1.0f : exp_1(factor_at * trial->of[KNOWN_LOG_SD]);
        Reals per_floor = group->per_floor * factor;
        if (group->any_scale) per_floor *= pick(changed, group->per_scale, all(1.0f));
        Reals sd = trial->of[KNOWN_SD] * per_floor;
        made.known = trial->of[KNOWN] * per_floor, made.floor_variance += sd * sd;
    }
    return made;
}

/* What drives a trial, and the probability of a response, at an ISI. */
INLINE void driven_at(const Group *group, const Trial *trial, float isi_ms, Wholes changed, Situation *made) {
    const Reals *of = group->particles->of;
    Reals level = facilitation(&group->profiles, all(isi_ms)) * trial->tapped;
    if (group->any_fading) {
        float number = trial->of[ORDER];
        Reals age = pick(of[FADING] > 0.0f, all(number), all(most_1(40.0f - number, 0.0f)));
        level *= exp2_v(-absolute(of[FADING]) * age);
    }
    if (group->curved) {
        Reals drive = of[REST] + of[BOOST] * level + of[SLOPE] * trial->of[SHIFT];
        if (group->any_step) drive += pick(changed, of[STEP_DRIVE], all(0.0f));
        if (group->how == LEVEL_BY_LEVEL) {
            shares_of_levels(of, drive, made->share);
            return;
        }
        made->odds = odds_against(drive, LOWEST_DRIVE);
        return;
    }
    made->odds = odds_of_level(level);
    if (group->any_switch) {
        made->odds = pick(group->switches, all(1.0f), made->odds);
        made->responds = pick(group->switches, of[LEAST] + (of[MOST] - of[LEAST]) * level, all(1.0f));
    }
    if (group->any_missing)
        made->responds = pick(group->missing, of[MOST] * root_v(most_v(level, all(0.0f))), made->responds);
}

/* Log likelihood of one trial under each particle. The ISI, where it is known with an SD only, is integrated out
(Gauss and Hermite, three nodes). */
INLINE Reals of_trial(const Group *group, const Trial *trial, float factor_at, int how) {
    if (trial->of_curves && !group->curved) return all(trial->of[BY_CURVES]);
    static const float shift[3] = {0.0f, -1.7320508f, 1.7320508f}, share[3] = {2.0f / 3.0f, 1.0f / 6.0f, 1.0f / 6.0f};
    const Reals *of = group->particles->of;
    Wholes changed = trial->of[ORDER] >= of[CHANGED];
    Situation made = situation_of(group, trial, factor_at, changed);
    int uncertain = trial->of[ISI_SD] > 0.0f, interval = trial->of[LOW] != trial->of[HIGH];
    Reals floor = of[LOG_FLOOR], likelihood = all(0.0f);
    if (group->any_scale) floor += pick(changed, of[STEP_SCALE], all(0.0f));
    Reals low = (interval ? most_1(trial->of[LOW], -EVER) : trial->of[LOW]) - floor;
    Reals high = least_1(trial->of[HIGH], EVER) - floor;
    for (int node = 0; node < (uncertain ? 3 : 1); node++) {
        driven_at(group, trial, trial->of[ISI] + shift[node] * trial->of[ISI_SD], changed, &made);
        Reals found = interval ? mass_between(&made, &group->curve, how, low, high)
                               : density(&made, &group->curve, how, low);
        likelihood = uncertain ? likelihood + share[node] * found : found;
    }
    return trial->of[COUNTS] * log_v(likelihood);
}

/* The group of trials that share a factor of their known parts. */
INLINE int group_of_isi(float isi_ms) {
    float place = (isi_ms - FIRST_GROUP_MS) / GROUP_MS;
    return place <= 0.0f ? 0 : place >= GROUPS - 1 ? GROUPS - 1 : (int)place;
}

/* Log likelihood with a factor of known parts that trials of nearly the same ISI share, integrated out. */
static void sharing_likelihood(const Group *group, const Trial *trials, int64_t count, double *found) {
    static const float factor_at[FACTOR_NODES] = {-2.0f, -1.0f, 0.0f, 1.0f, 2.0f};
    Reals sums[FACTOR_NODES][GROUPS];
    memset(sums, 0, sizeof sums);
    for (int node = 0; node < FACTOR_NODES; node++)
        for (int64_t i = 0; i < count; i++)
            sums[node][group_of_isi(trials[i].of[ISI])] +=
                of_trial(group, trials + i, factor_at[node], group->how);
    for (int lane = 0; lane < LANES; lane++) found[lane] = 0.0;
    for (int at = 0; at < GROUPS; at++)
        for (int lane = 0; lane < LANES; lane++) {
            double most = -INFINITY, least = INFINITY, mixed = 0.0;
            for (int node = 0; node < FACTOR_NODES; node++) {
                most = fmax(most, sums[node][at][lane]), least = fmin(least, sums[node][at][lane]);
            }
            if (least < most) {
                for (int node = 0; node < FACTOR_NODES; node++)
                    mixed += factor_weight[node] * exp(sums[node][at][lane] - most);
                most += log(mixed);
            }
            found[lane] += most;
        }
}

/* Sums in single precision are not longer than this. */
enum { STRETCH = 32 };

INLINE void summed_likelihood(const Group *group, const Trial *trials, int64_t count, int how, double *found) {
    for (int lane = 0; lane < LANES; lane++) found[lane] = 0.0;
    for (int64_t first = 0; first < count; first += STRETCH) {
        Reals sum = all(0.0f);
        for (int64_t i = first; i < count && i < first + STRETCH; i++)
            sum += of_trial(group, trials + i, 0.0f, how);
        for (int lane = 0; lane < LANES; lane++) found[lane] += sum[lane];
    }
}

/* Kinds of noise whose particles are computed side by side. */
enum { PLAIN_CURVES, RECTIFIED_CURVES, IN_LEVELS, OTHER_NOISE, GROUPS_OF_NOISE };

INLINE int noise_group(const float *fields) {
    return fields[NOISE] == RECRUITMENT ? PLAIN_CURVES
           : fields[NOISE] == RECTIFIED ? RECTIFIED_CURVES
           : fields[NOISE] == BY_LEVELS ? IN_LEVELS
                                        : OTHER_NOISE;
}

/* Log likelihood of trials under a lane each of particles whose noise is of one group. */
static void lanes_likelihood(const Particles *particles, int of_noise, const Trial *trials, int64_t count, int shares,
                             double *found) {
    int how = of_noise == RECTIFIED_CURVES ? FROM_A_THRESHOLD : of_noise == IN_LEVELS ? LEVEL_BY_LEVEL : ALONG;
    Group group = group_of(particles, of_noise != OTHER_NOISE, how);
    if (shares)
        sharing_likelihood(&group, trials, count, found);
    else if (how == FROM_A_THRESHOLD)
        summed_likelihood(&group, trials, count, FROM_A_THRESHOLD, found);
    else if (how == LEVEL_BY_LEVEL)
        summed_likelihood(&group, trials, count, LEVEL_BY_LEVEL, found);
    else
        summed_likelihood(&group, trials, count, ALONG, found);
}

/* Trials from the columns that a history has; whether any share a factor of their known parts. */
static int trials_of(const float *columns, int64_t count, Trial *trials) {
    int shares = 0;
    for (int64_t i = 0; i < count; i++) {
        Trial *trial = trials + i;
        memcpy(trial->of, columns + i * COLUMNS, sizeof trial->of);
        trial->tapped = isnan(trial->of[ISI]) ? 0.0f : 1.0f;
        if (trial->tapped == 0.0f) trial->of[ISI] = 0.0f;
        gain_of(trial->of[ORDER], &trial->startle, &trial->relaxed);
        shares |= trial->of[KNOWN_LOG_SD] > 0.0f;
        trial->of_curves = !isnan(trial->of[BY_CURVES]);
    }
    return shares;
}

/* Shapes of profiles whose particles are computed side by side as far as whole vectors allow: what one of them needs is
worked out for all lanes. */
enum { ONE_PEAK, A_PLATEAU, TWO_PEAKS, GROUPS_OF_SHAPES };

INLINE int shape_group(const float *fields) {
    return fields[SHAPE] == PLATEAU ? A_PLATEAU : fields[SHAPE] == TWO_PEAK ? TWO_PEAKS : ONE_PEAK;
}

/* Log likelihood of a person's trials under at most a vector of particles, whose noise is of one group. */
static void some_likelihood(const float *fields, const int64_t *numbers, int count_of, int of_noise,
                            const Trial *trials, int64_t count, int shares, float *found) {
    Particles some;
    double of_lane[LANES];
    int known = of_noise == IN_LEVELS ? FIELDS : LEVEL_AT;
    for (int lane = 0; lane < LANES; lane++) { /* lanes that are left over repeat the last particle */
        const float *one = fields + numbers[lane < count_of ? lane : count_of - 1] * FIELDS;
        for (int field = 0; field < known; field++) some.of[field][lane] = one[field];
    }
    lanes_likelihood(&some, of_noise, trials, count, shares, of_lane);
    for (int lane = 0; lane < count_of; lane++) found[numbers[lane]] = (float)of_lane[lane];
}

/* Log likelihood of a person's trials under some of their particles (p, FIELDS); wanted says which, NULL is all. */
static void person_likelihood(const float *fields, int64_t particles, const uint8_t *wanted, const Trial *trials,
                              int64_t count, int shares, float *found) {
    int64_t waiting[GROUPS_OF_NOISE][GROUPS_OF_SHAPES][LANES];
    int waits[GROUPS_OF_NOISE][GROUPS_OF_SHAPES] = {{0}};
    for (int64_t i = 0; i < particles; i++) {
        if (wanted && !wanted[i]) continue;
        int noise = noise_group(fields + i * FIELDS), shape = shape_group(fields + i * FIELDS);
        waiting[noise][shape][waits[noise][shape]++] = i;
        if (waits[noise][shape] < LANES) continue;
        some_likelihood(fields, waiting[noise][shape], LANES, noise, trials, count, shares, found);
        waits[noise][shape] = 0;
    }
    for (int noise = 0; noise < GROUPS_OF_NOISE; noise++) {
        int64_t left[LANES];
        int lanes = 0;
        for (int shape = 0; shape < GROUPS_OF_SHAPES; shape++)
            for (int i = 0; i < waits[noise][shape]; i++) {
                left[lanes++] = waiting[noise][shape][i];
                if (lanes < LANES) continue;
                some_likelihood(fields, left, LANES, noise, trials, count, shares, found);
                lanes = 0;
            }
        if (lanes) some_likelihood(fields, left, lanes, noise, trials, count, shares, found);
    }
}

static int likelihoods(int64_t people, int64_t particles, int64_t count, const float *fields, const float *columns,
                       float *found) {
    Trial *trials = malloc((size_t)(count + 1) * sizeof *trials);
    if (!trials) return -1;
    for (int64_t person = 0; person < people; person++) {
        int shares = trials_of(columns + person * count * COLUMNS, count, trials);
        person_likelihood(fields + person * particles * FIELDS, particles, NULL, trials, count, shares,
                          found + person * particles);
    }
    free(trials);
    return 0;
}

#endif
