/* Picks the engine for this processor. */

#include <stddef.h>
#include <string.h>

#include "engine.h"

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

/* Which levels were compiled, hatch_build.py says: ISIW_HAS_v3 and the like. */
#if defined(ISIW_HAS_base)
const Engine *isiw_engine_base(void);

static const Engine *engine_of(const char *level) { return strcmp(level, "base") == 0 ? isiw_engine_base() : NULL; }
#else
#include <cpuid.h>

#define LZCNT (1u << 5) /* which compilers name differently */

const Engine *isiw_engine_v2(void);
const Engine *isiw_engine_v3(void);
const Engine *isiw_engine_v4(void);

/* Which registers the operating system keeps for each thread: bits 1 and 2 are of AVX, 5 to 7 of AVX-512. */
static unsigned kept_registers(void) {
    unsigned low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

static int has(unsigned found, unsigned bits) { return (found & bits) == bits; }

/* The highest level of the processor, 0 below x86-64-v2. Asked of the processor itself: what __builtin_cpu_supports
reads is not filled in where zig links the library. */
static int highest(void) {
    unsigned eax, ebx, ecx, edx, extended, features;
    if (!__get_cpuid(1, &eax, &ebx, &ecx, &edx)) return 0;
    if (!has(ecx, bit_SSE3 | bit_SSSE3 | bit_SSE4_1 | bit_SSE4_2 | bit_POPCNT | bit_CMPXCHG16B)) return 0;
    unsigned kept = has(ecx, bit_OSXSAVE) ? kept_registers() : 0;
    int avx = has(kept, 0x6) && has(ecx, bit_AVX | bit_FMA | bit_F16C | bit_MOVBE);
    if (!avx || !__get_cpuid_count(7, 0, &eax, &features, &ecx, &edx)) return 2;
    if (!__get_cpuid(0x80000001, &eax, &ebx, &extended, &edx)) return 2;
    if (!has(features, bit_AVX2 | bit_BMI | bit_BMI2) || !has(extended, LZCNT)) return 2;
    return has(kept, 0xe6) && has(features, bit_AVX512F | bit_AVX512BW | bit_AVX512CD | bit_AVX512DQ | bit_AVX512VL)
               ? 4
               : 3;
}

static const Engine *engine_of(const char *level) {
    int most = highest();
#if defined(ISIW_HAS_v4)
    if (most >= 4 && strcmp(level, "x86-64-v4") == 0) return isiw_engine_v4();
#endif
#if defined(ISIW_HAS_v3)
    if (most >= 3 && strcmp(level, "x86-64-v3") == 0) return isiw_engine_v3();
#endif
#if defined(ISIW_HAS_v2)
    if (most >= 2 && strcmp(level, "x86-64-v2") == 0) return isiw_engine_v2();
#endif
    return NULL;
}
#endif

/* The engine of a level, by its name; NULL where this processor does not have it, or there is no such level. */
EXPORTED const Engine *isiw_engine(const char *level);
EXPORTED const Engine *isiw_engine(const char *level) { return engine_of(level); }
