/* Placeholder: picks the level for this processor. */

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

EXPORTED int isiw_level(void);
EXPORTED double isiw_sum(const double *values, long long count);

#if defined(__x86_64__)
double isiw_sum_v2(const double *values, long long count);
double isiw_sum_v3(const double *values, long long count);
double isiw_sum_v4(const double *values, long long count);

int isiw_level(void) {
    __builtin_cpu_init();
    return __builtin_cpu_supports("avx512vl") ? 4 : __builtin_cpu_supports("avx2") ? 3 : 2;
}

double isiw_sum(const double *values, long long count) {
    int level = isiw_level();
    return level == 4   ? isiw_sum_v4(values, count)
           : level == 3 ? isiw_sum_v3(values, count)
                        : isiw_sum_v2(values, count);
}
#else
double isiw_sum_base(const double *values, long long count);

int isiw_level(void) { return 1; }

double isiw_sum(const double *values, long long count) { return isiw_sum_base(values, count); }
#endif
