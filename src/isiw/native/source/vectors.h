/* Particles side by side, as lanes of a vector: the compiler's own vectors, and what it has no word for. */

#ifndef ISIW_VECTORS_H
#define ISIW_VECTORS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__)
#include <immintrin.h>
enum { LANES = 16 };
#elif defined(__AVX2__)
#include <immintrin.h>
enum { LANES = 8 };
#else
#if defined(__SSE4_1__)
#include <smmintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif
enum { LANES = 4 };
#endif

typedef float Reals __attribute__((vector_size(4 * LANES)));
typedef int32_t Wholes __attribute__((vector_size(4 * LANES)));
typedef uint32_t Naturals __attribute__((vector_size(4 * LANES)));

#define INLINE static inline __attribute__((always_inline))

INLINE Reals all(float x) { return x - (Reals){0}; }

INLINE Wholes bits_of_v(Reals x) { return (Wholes)x; }
INLINE Reals float_of_v(Wholes bits) { return (Reals)bits; }
INLINE Wholes to_exponent_v(Wholes number) { return (Wholes)((Naturals)number << 23); }
INLINE int32_t to_exponent_1(int32_t number) { return (int32_t)((uint32_t)number << 23); }
INLINE int32_t bits_of_1(float x) {
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
INLINE float float_of_1(int32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

INLINE Reals whole_v(Wholes number) { return __builtin_convertvector(number, Reals); }
INLINE float whole_1(int32_t number) { return (float)number; }

/* One of two numbers, lane by lane, by what a comparison found. */
INLINE Reals pick(Wholes where, Reals yes, Reals no) { return (Reals)((where & (Wholes)yes) | (~where & (Wholes)no)); }

INLINE float least_1(float a, float b) { return a < b ? a : b; }
INLINE float most_1(float a, float b) { return a > b ? a : b; }
INLINE float root_1(float x) { return sqrtf(x); }

#if defined(__AVX512F__)
INLINE Reals least_v(Reals a, Reals b) { return (Reals)_mm512_min_ps((__m512)a, (__m512)b); }
INLINE Reals most_v(Reals a, Reals b) { return (Reals)_mm512_max_ps((__m512)a, (__m512)b); }
INLINE Reals root_v(Reals x) { return (Reals)_mm512_sqrt_ps((__m512)x); }
#elif defined(__AVX2__)
INLINE Reals least_v(Reals a, Reals b) { return (Reals)_mm256_min_ps((__m256)a, (__m256)b); }
INLINE Reals most_v(Reals a, Reals b) { return (Reals)_mm256_max_ps((__m256)a, (__m256)b); }
INLINE Reals root_v(Reals x) { return (Reals)_mm256_sqrt_ps((__m256)x); }
#elif defined(__SSE4_1__)
INLINE Reals least_v(Reals a, Reals b) { return (Reals)_mm_min_ps((__m128)a, (__m128)b); }
INLINE Reals most_v(Reals a, Reals b) { return (Reals)_mm_max_ps((__m128)a, (__m128)b); }
INLINE Reals root_v(Reals x) { return (Reals)_mm_sqrt_ps((__m128)x); }
#elif defined(__ARM_NEON)
INLINE Reals least_v(Reals a, Reals b) { return (Reals)vminq_f32((float32x4_t)a, (float32x4_t)b); }
INLINE Reals most_v(Reals a, Reals b) { return (Reals)vmaxq_f32((float32x4_t)a, (float32x4_t)b); }
INLINE Reals root_v(Reals x) { return (Reals)vsqrtq_f32((float32x4_t)x); }
#else
INLINE Reals least_v(Reals a, Reals b) { return pick(a < b, a, b); }
INLINE Reals most_v(Reals a, Reals b) { return pick(a > b, a, b); }
INLINE Reals root_v(Reals x) {
    for (int lane = 0; lane < LANES; lane++) x[lane] = sqrtf(x[lane]);
    return x;
}
#endif

INLINE int any(Wholes where) {
    int found = 0;
    for (int lane = 0; lane < LANES; lane++) found |= where[lane];
    return found != 0;
}

/* The elementary functions of one number (exp_1) and of a vector (exp_v) are one text. */
#define REAL float
#define WHOLE int32_t
#define NAME(name) name##_1
#include "elementary.h"
#undef REAL
#undef WHOLE
#undef NAME
#define REAL Reals
#define WHOLE Wholes
#define NAME(name) name##_v
#include "elementary.h"
#undef REAL
#undef WHOLE
#undef NAME

INLINE Reals absolute(Reals x) { return most_v(x, -x); }

#if defined(__AVX2__) && !defined(__AVX512F__)
/* A mask of the first lanes, so many, for loads and stores of a part of a vector. */
INLINE __m256i first_lanes(int64_t count) {
    return _mm256_cmpgt_epi32(_mm256_set1_epi32((int)count), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}
#endif

/* Some of an array's numbers as lanes, 0 behind the last of those that are left; and back. */
INLINE Reals loaded(const float *values, int64_t left) {
    Reals some = {0};
    if (left >= LANES)
        memcpy(&some, values, sizeof some);
    else
#if defined(__AVX512F__)
        some = (Reals)_mm512_maskz_loadu_ps((__mmask16)((1u << left) - 1u), values);
#elif defined(__AVX2__)
        some = (Reals)_mm256_maskload_ps(values, first_lanes(left));
#else
        for (int lane = 0; lane < left; lane++) some[lane] = values[lane];
#endif
    return some;
}
INLINE void stored(Reals some, float *values, int64_t left) {
    if (left >= LANES)
        memcpy(values, &some, sizeof some);
    else
#if defined(__AVX512F__)
        _mm512_mask_storeu_ps(values, (__mmask16)((1u << left) - 1u), (__m512)some);
#elif defined(__AVX2__)
        _mm256_maskstore_ps(values, first_lanes(left), (__m256)some);
#else
        for (int lane = 0; lane < left; lane++) values[lane] = some[lane];
#endif
}

/* Which of a vector's bytes are not 0, as a comparison would say it. */
INLINE Wholes flags(const uint8_t *bytes) {
    typedef int8_t Bytes __attribute__((vector_size(LANES)));
    Bytes some;
    memcpy(&some, bytes, sizeof some);
    return __builtin_convertvector(some, Wholes) != 0;
}

/* A number of numbers that fills vectors of any processor. */
INLINE int64_t in_lanes(int64_t count) { return (count + 15) / 16 * 16; }

/* Sum of the lanes, four at a time. */
INLINE float lanes_sum(Reals some) {
    typedef float Four __attribute__((vector_size(16)));
    Four parts[LANES / 4];
    memcpy(parts, &some, sizeof parts);
    for (int part = 1; part < LANES / 4; part++) parts[0] += parts[part];
    return (parts[0][0] + parts[0][2]) + (parts[0][1] + parts[0][3]);
}

/* Sum of the first numbers. */
INLINE float total(const float *values, int64_t count) {
    Reals lanes = {0};
    for (int64_t i = 0; i < count; i += LANES) lanes += loaded(values + i, count - i);
    return lanes_sum(lanes);
}

#endif
