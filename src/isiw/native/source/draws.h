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

/* Symmetric draws of mean 0 and SD 1, nearly normal, one for each number from the first on: the sum of four uniform
ones, the bytes of a counter that is mixed (the finalizer of MurmurHash3: Appleby, 2008). */
INLINE Reals blurs(uint64_t bits, int64_t first) {
    Naturals z;
    for (uint32_t lane = 0; lane < LANES; lane++) z[lane] = ((uint32_t)first + lane) * 0x9E3779B9u;
    z = (z + (uint32_t)bits) ^ (uint32_t)(bits >> 32);
    z = (z ^ (z >> 16)) * 0x85EBCA6Bu;
    z = (z ^ (z >> 13)) * 0xC2B2AE35u;
    z ^= z >> 16;
    Naturals sum = (z & 255u) + ((z >> 8) & 255u) + ((z >> 16) & 255u) + (z >> 24);
    return (whole_v((Wholes)sum) - 510.0f) * (1.7320508f / 256.0f);
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
