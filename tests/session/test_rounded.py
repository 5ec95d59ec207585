"""Numbers of the log are rounded as texts of four digits are."""

from __future__ import annotations

import numpy as np

from isiw.session.examination import DIGITS, _rounded


def test_numbers_are_rounded_as_texts_of_so_many_digits() -> None:
    rng = np.random.default_rng(0)
    sizes = 10.0 ** rng.uniform(-30, 30, 20_000) * rng.choice([-1.0, 1.0], 20_000)
    special = np.array([0.0, -0.0, np.inf, -np.inf, 1.0, 0.1, 9999.6, 0.99996, 1e-300, 5e-324, 1e300])
    values = np.concatenate([sizes, special])
    assert _rounded(values) == tuple(float(f"{value:.{DIGITS}g}") for value in values)
    assert np.isnan(_rounded(np.array([np.nan]))[0])
