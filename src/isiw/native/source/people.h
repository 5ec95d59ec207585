/* What particles and trials are to the engine: a record of fields each. The order of both is that of the module
`isiw.models.particles.records`, and a test compares them. */

#ifndef ISIW_PEOPLE_H
#define ISIW_PEOPLE_H

#include "vectors.h"

enum { LEVELS = 8 }; /* intensities at which pulses were given alone, at most */

/* Fields of a particle: what its latents mean. Logarithms are natural, amplitudes in EMG floors. */
enum {
    NOISE,      /* kind of the noise */
    SHAPE,      /* kind of the profile */
    PRESENT,    /* 1 where there is an enhancement */
    START,      /* of the profile's span [ms] */
    WIDTH,      /* [ms] */
    FORM,       /* in -1..1 */
    LOG_FLOOR,  /* of the median EMG floor [mV] */
    FLOOR_SD,   /* log SD of the floor from trial to trial */
    LOG_RATIO,  /* of the largest evoked MEP, or the expected one at the best ISI, over the floor */
    SPREAD,     /* SD of the noise on the input [logits], or the CV */
    OUTPUT_SD,  /* log SD of the noise on the output */
    BOOST,      /* shift of the drive at the best ISI [logits] */
    REST,       /* drive without a tap [logits] */
    ONSET,      /* the sigmoid at the threshold, 0 where there is none */
    MOST,       /* probability of a response at the best ISI */
    LEAST,      /* and without a tap */
    DRIFT,      /* by how much the log of evoked MEPs will have changed after many trials */
    STARTLED,   /* how strongly the first trials startle */
    SLOPE,      /* of the drive by intensity [logits per % RMT] */
    LOW_START,  /* of a depression [ms] */
    LOW_WIDTH,  /* [ms] */
    DEPTH,      /* in units of the largest facilitation, 0 where there is none */
    CHANGED,    /* how many trials come before a change */
    STEP,       /* log of what everything evoked is multiplied by from then on */
    STEP_DRIVE, /* by how much the drive grows from then on [logits] */
    FADING,     /* by how many halves the enhancement fades from trial to trial; negative where it grows */
    STEP_SCALE, /* log of what all amplitudes are multiplied by from then on */
    LEVEL_AT,   /* of a law by levels: how much stronger their pulses were than the pairs' [% RMT], ascending, */
    LEVEL_MEAN = LEVEL_AT + LEVELS, /* mean log MEP [log mV], */
    LEVEL_SD = LEVEL_MEAN + LEVELS, /* and its SD */
    FIELDS = LEVEL_SD + LEVELS
};

/* Columns of a trial. */
enum {
    ISI,          /* [ms]; not a number is TMS alone */
    ISI_SD,       /* [ms] */
    LOW,          /* lower end of the log MEP [log mV] */
    HIGH,         /* upper end; the same where the amplitude is known */
    ORDER,        /* how many trials came before */
    KNOWN,        /* a part of the amplitude that is not the pulse's [mV] */
    KNOWN_SD,     /* from trial to trial [mV] */
    KNOWN_LOG_SD, /* of a factor that trials of nearly the same ISI share */
    SHIFT,        /* by how much the pulse is stronger [% RMT] */
    BY_CURVES,    /* log density for kinds of noise that know no other intensity; not a number where they know it */
    COUNTS,       /* as how much of a trial it counts: the power of its likelihood */
    COLUMNS
};

enum { CONSTANT_CV, MISSING, RECRUITMENT, ALL_OR_NONE, RECTIFIED, BY_LEVELS };        /* NoiseKind */
enum { GAUSSIAN, SKEWED, PLATEAU, TWO_PEAK };                                         /* ShapeKind */
enum { NO_CHANGE, LEVEL_CHANGE, INTENSITY_CHANGE, ENHANCEMENT_CHANGE, SCALE_CHANGE }; /* ChangeKind */
enum { OF_SHAPE, OF_NOISE, OF_PRESENT, OF_DEPRESSED, OF_CHANGE, KINDS };              /* kinds of a particle */

/* Some particles, a lane each. */
typedef struct {
    Reals of[FIELDS];
} Particles;

/* A trial, ready to be compared. */
typedef struct {
    float of[COLUMNS];
    float startle, relaxed; /* the two parts of its gain, see gain_of */
    float tapped;           /* 0 for TMS alone, else 1 */
    int of_curves;          /* whether recruitment curves alone have a law of it */
} Trial;

/* How a trial after so many others startles, and how far amplitudes have wandered by then. */
INLINE void gain_of(float order, float *startle, float *relaxed) {
    *startle = order == 0.0f ? 0.29f : order == 1.0f ? 0.20f : 0.0f;
    *relaxed = 1.0f - exp_1(-0.030459207f * order); /* log 0.97 */
}

/* Whether it knows what pulses of another intensity evoke. */
INLINE int is_curved(const float *fields) {
    return fields[NOISE] == RECRUITMENT || fields[NOISE] == RECTIFIED || fields[NOISE] == BY_LEVELS;
}

/* The share of the enhancement that there is after so many trials, where it fades or grows. */
INLINE float enhancement_after(float fading, float order) {
    float age = fading > 0.0f ? order : most_1(40.0f - order, 0.0f);
    return exp2_1(-fabsf(fading) * age);
}

/* Let a particle be as it is after so many trials, without any further change. */
static void settle(float *fields, float order) {
    if (order >= fields[CHANGED]) {
        fields[LOG_RATIO] += fields[STEP];
        fields[REST] += fields[STEP_DRIVE];
        fields[LOG_FLOOR] += fields[STEP_SCALE];
        for (int level = 0; level < LEVELS && fields[NOISE] == (float)BY_LEVELS; level++)
            fields[LEVEL_MEAN + level] += fields[STEP_SCALE];
    }
    if (fields[FADING] != 0.0f) {
        float share = enhancement_after(fields[FADING], order), kind = fields[NOISE];
        fields[BOOST] *= share;
        if (kind == CONSTANT_CV || kind == MISSING) fields[LOG_RATIO] += log_1(share);
        if (kind == MISSING) fields[MOST] *= root_1(share);
        if (kind == ALL_OR_NONE) fields[MOST] = fields[LEAST] + (fields[MOST] - fields[LEAST]) * share;
    }
    fields[STEP] = fields[STEP_DRIVE] = fields[STEP_SCALE] = fields[FADING] = 0.0f;
}

#endif
