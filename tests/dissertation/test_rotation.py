from __future__ import annotations

import numpy as np
import pytest

from isiw.dissertation.repeatability import detect_rotations
from isiw.errors import InvalidValueError

RNG = np.random.default_rng(4)
TIMES_MS = np.arange(1500.0)


def angle(begin_ms: float, per_ms: float, top_deg: float = 180.0) -> np.ndarray:
    return np.clip((TIMES_MS - begin_ms) * per_ms, 0, top_deg) + 0.2 * RNG.standard_normal(TIMES_MS.size)


def pressure(begin_ms: float) -> np.ndarray:
    return np.clip(TIMES_MS - begin_ms, 0, 300) + 0.5 * RNG.standard_normal(TIMES_MS.size)


def test_beginning_and_end_of_a_rotation_are_found() -> None:
    found = detect_rotations([angle(580, 0.5)], [pressure(525)], 1000.0)
    assert found.fill_ms[0] == pytest.approx(525, abs=3)
    assert found.motion_ms[0] == pytest.approx(580, abs=3)
    assert found.end_ms[0] == pytest.approx(580 + 178 / 0.5, abs=3)


def test_a_rotation_that_does_not_get_there_has_no_end_and_one_that_does_not_begin_has_neither() -> None:
    found = detect_rotations([angle(580, 0.5, 120), angle(9999, 0.5)], [pressure(525)] * 2, 1000.0)
    assert np.isnan(found.end_ms).all()
    assert np.isnan(found.motion_ms).tolist() == [False, True]


def test_what_was_not_recorded_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="angle is constant"):
        detect_rotations([np.zeros(1500)], [pressure(525)], 1000.0)
