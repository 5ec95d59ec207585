/* Random draws by counter: each particle of each sweep has a stream of its own (SplitMix64: Steele et al., OOPSLA
2014), so that its draws depend on the seed of its person and on its number, not on who is beside it. */

#ifndef ISIW_DRAWS_H
#define ISIW_DRAWS_H

#include "vectors.h"

#define GOLDEN 0x9E3779B97F4A7C15u

INLINE uint64_t mixed(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* Where the stream of a particle begins. */
INLINE uint64_t stream_of(uint64_t sweep, int64_t particle) {
    return mixed(sweep + mixed((uint64_t)particle + GOLDEN));
}

INLINE uint64_t random_bits(uint64_t *dice) { return mixed(*dice += GOLDEN); }

/* A draw between 0 and 1; never 1. */
INLINE float uniform(uint64_t *dice) { return (float)(random_bits(dice) >> 40) * 0x1p-24f; }

/* A draw from the standard normal law (Box and Muller). */
INLINE float normal(uint64_t *dice) {
    uint64_t bits = random_bits(dice);
    float turned = (float)(bits & 0xFFFFFFFFu) * 0x1p-32f - 0.5f;
    float x = 3.14159265f * turned, square = x * x;
    float sine =
        square * (8.3333333e-3f + square * (-1.9841270e-4f + square * (2.7557319e-6f - square * 2.5052108e-8f)));
    sine = x * (1.0f + square * (-0.16666667f + sine));
    return root_1(-2.0f * log_1(((float)(bits >> 32) + 1.0f) * 0x1p-32f)) * (2.0f * sine * sine - 1.0f);
}

/* A symmetric draw of mean 0 and SD 1, nearly normal: the sum of four uniform ones. */
INLINE float blur(uint64_t *dice) {
    uint64_t bits = random_bits(dice);
    uint64_t sum = (bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF) + (bits >> 48);
    return ((float)sum - 131070.0f) * (1.7320508f / 65536.0f);
}

/* One of so many, fewer than 2^32. */
INLINE int64_t one_of(uint64_t *dice, int64_t count) {
    return (int64_t)((random_bits(dice) >> 32) * (uint64_t)count >> 32);
}

/* Which of some alternatives a draw is of, by the sums of the probabilities of earlier ones. */
INLINE int64_t which(float quantile, const float *edges, int64_t count) {
    int64_t drawn = 0;
    for (int64_t i = 0; i < count; i++) drawn += quantile >= edges[i];
    return drawn;
}

#endif
