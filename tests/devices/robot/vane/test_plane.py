from __future__ import annotations

import math

import numpy as np
import pytest

from isiw.devices.robot.vane.rotation import Load, Performance, Rotor, Vane, performance
from isiw.errors import InvalidValueError

HEIGHTS_MM = (7.5, 10, 12.5, 15, 17.5, 20, 25, 30, 37.5)


@pytest.fixture(scope="module")
def deep() -> Performance:
    """Actuators of 150 mm depth; at the end, h = 15 mm with the lightest and the heaviest load."""
    vanes = [Vane(Rotor(height_mm, 150)) for height_mm in HEIGHTS_MM]
    loaded = [Vane(Rotor(15, 150), Load(payload_n)) for payload_n in (1.0, 10.0)]
    return performance([*vanes, *loaded], periods=6, step_ms=0.5)


@pytest.mark.slow
def test_the_recommended_heights_reach_the_full_range_and_larger_and_smaller_ones_do_not(deep: Performance) -> None:
    full = deep.range_share[: len(HEIGHTS_MM)] >= 0.999
    assert list(np.array(HEIGHTS_MM)[full]) == [10, 12.5, 15, 17.5]


@pytest.mark.slow
def test_the_recommended_heights_break_away_within_80_to_100_ms(deep: Performance) -> None:
    recommended = deep.delay_ms[1:5]
    assert recommended.min() > 80
    assert recommended.max() < 100


@pytest.mark.slow
def test_the_delay_falls_with_height(deep: Performance) -> None:
    assert (np.diff(deep.delay_ms[: len(HEIGHTS_MM)]) < 0).all()


@pytest.mark.slow
def test_the_payload_hardly_matters(deep: Performance) -> None:
    assert deep.delay_ms[-1] == pytest.approx(deep.delay_ms[-2], rel=0.02)
    assert deep.range_share[-2:] == pytest.approx(1.0)


def test_an_actuator_that_cannot_move_has_no_delay_and_no_range() -> None:
    found = performance([Vane(Rotor(7.5, 12.5))], periods=1, step_ms=0.5)
    assert math.isnan(found.delay_ms[0])
    assert found.range_share[0] == 0


@pytest.mark.parametrize("changed", [{"period_s": 0.0}, {"periods": 0}])
def test_a_wave_that_is_none_is_refused(changed: dict[str, int]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(changed))):
        performance([Vane()], **changed)
