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
const Engine *isiw_engine_v2(void);
const Engine *isiw_engine_v3(void);
const Engine *isiw_engine_v4(void);

static const Engine *engine_of(const char *level) {
    __builtin_cpu_init();
    int v2 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
    int v3 = v2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
    int v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#if defined(ISIW_HAS_v4)
    if (v4 && strcmp(level, "x86-64-v4") == 0) return isiw_engine_v4();
#endif
#if defined(ISIW_HAS_v3)
    if (v3 && strcmp(level, "x86-64-v3") == 0) return isiw_engine_v3();
#endif
#if defined(ISIW_HAS_v2)
    if (v2 && strcmp(level, "x86-64-v2") == 0) return isiw_engine_v2();
#endif
    return (void)v4, NULL;
}
#endif

/* The engine of a level, by its name; NULL where this processor does not have it, or there is no such level. */
EXPORTED const Engine *isiw_engine(const char *level);
EXPORTED const Engine *isiw_engine(const char *level) { return engine_of(level); }
