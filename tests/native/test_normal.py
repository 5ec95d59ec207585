"""The normal probability between two ends, as the engine has it, against mpmath."""

import mpmath
import numpy as np

from native.drawn import elementary

LEAST_MASS = 1e-9
"""That of likelihood.h."""


def exact(low: float, high: float) -> float:
    """Log of the probability between two ends, or of the least."""
    with mpmath.workdps(40):
        if low > 0:
            low, high = -high, -low
        return float(mpmath.log(max(mpmath.ncdf(high) - mpmath.ncdf(low), LEAST_MASS)))


def test_the_engine_has_the_probability_between_two_ends_wherever_its_log_is_taken() -> None:
    rng = np.random.default_rng(1)
    ends = rng.uniform(-60.0, 60.0, 300) * rng.random(300) ** 2
    low, high = (x.astype(np.float32) for x in (ends, ends + 10.0 ** rng.uniform(-2.0, 2.0, 300)))
    found = elementary("between", low, high)
    expected = [exact(float(a), float(b)) for a, b in zip(low, high, strict=True)]
    np.testing.assert_allclose(np.log(np.maximum(found, LEAST_MASS)), expected, atol=1e-3)
