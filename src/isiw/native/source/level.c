/* Placeholder: a sum, compiled once for each level of the processor. */

#define JOINED(a, b) a##b
#define NAMED(level) JOINED(isiw_sum_, level)

double NAMED(ISIW_LEVEL)(const double *values, long long count);

double NAMED(ISIW_LEVEL)(const double *values, long long count) {
    double sum = 0;
    for (long long i = 0; i < count; i++) sum += values[i];
    return sum;
}
