/* Elementary functions in single precision, as polynomials: loops over those of a library are no vector instructions.

Included twice by vectors.h, for one number and for a vector of them; no include guard. Relative errors are in the
tests: below 3e-6, and 2e-5 for ndtr. */

INLINE REAL NAME(exp2_within)(REAL x) { /* within 126 of 0 */
    REAL shifted = x + 12582912.0f;     /* 1.5 * 2^23: its last bits are the whole number next to x */
    REAL f = x - (shifted - 12582912.0f);
    REAL power = 0.0096715126f + f * 0.0013264727f;
    power = 1.0f + f * (0.6931469776f + f * (0.2402224209f + f * (0.0555073374f + f * power)));
    return NAME(float_of)(NAME(bits_of)(power) + NAME(to_exponent)(NAME(bits_of)(shifted)));
}

/* Power of 2; beyond 126 as at 126. */
INLINE REAL NAME(exp2)(REAL x) {
    return NAME(exp2_within)(NAME(least)(NAME(most)(x, (REAL){0} - 126.0f), (REAL){0} + 126.0f));
}

/* Power of e. */
INLINE REAL NAME(exp)(REAL x) { return NAME(exp2)(x * 1.4426950408889634f); }

/* exp(-z^2 / 2); what is as good as 0 stays a normal number, which is much faster. */
INLINE REAL NAME(bell)(REAL z) {
    return NAME(exp2_within)(NAME(most)(z * z * -0.7213475204444817f, (REAL){0} - 87.2830499736f));
}

/* Natural logarithm of a positive number. */
INLINE REAL NAME(log)(REAL x) {
    WHOLE bits = NAME(bits_of)(NAME(most)(x, (REAL){0} + 1.1754944e-38f));
    WHOLE exponent = (bits - 0x3F3504F3) >> 23;
    REAL m = NAME(float_of)(bits - NAME(to_exponent)(exponent)) - 1.0f; /* from the root of 1/2 to that of 2, less 1 */
    REAL tail = 0.1990688319f + m * (-0.1724322495f + m * (0.1618050093f + m * -0.1008237725f));
    tail = -0.5000032344f + m * (0.3333471491f + m * (-0.2497122849f + m * tail));
    return m + m * m * tail + NAME(whole)(exponent) * 0.6931471805599453f;
}

/* 1 / x of a positive number, as dividers are slow: a step of Newton's method from a guess, and one of Halley's. */
INLINE REAL NAME(per)(REAL x) {
    REAL y = NAME(float_of)(0x7EF32E00 - NAME(bits_of)(x));
    y = y * (2.0013f - x * y);
    REAL off = 1.0f - x * y;
    return y + y * (off + off * off);
}

/* 1 / root of a positive number, likewise. */
INLINE REAL NAME(per_root)(REAL x) {
    REAL y = NAME(float_of)(0x5F1FFFF9 - (NAME(bits_of)(x) >> 1));
    y = y * (1.6819144f - 0.703952253f * x * y * y);
    REAL off = 1.0f - x * y * y;
    return y + y * (off * (0.5f + 0.375f * off));
}

/* Probability that a standard normal variable is below -z, for z of at least 0 (Chebyshev fit of erfc and its tail). */
INLINE REAL NAME(beyond)(REAL z) {
    z = NAME(least)(z, (REAL){0} + 9.0f) * 0.70710678f;
    REAL t = NAME(per)(1.0f + 0.5f * z);
    REAL tail = -0.82215223f + t * 0.17087277f;
    tail = 0.27886807f + t * (-1.13520398f + t * (1.48851587f + t * tail));
    tail = 0.37409196f + t * (0.09678418f + t * (-0.18628806f + t * tail));
    return 0.5f * t * NAME(exp)(t * (1.00002368f + t * tail) - (z * z + 1.26551223f));
}
