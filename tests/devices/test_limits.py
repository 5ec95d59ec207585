from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest

from isiw.design import DesignSpace
from isiw.devices.allowed import earliest_s, require_isi, require_state
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.session.stated import require_limits

LIMITS = Limits(low_ms=0, high_ms=200, min_iti_s=5.0, max_pulses=3)


@pytest.mark.parametrize(
    "values",
    [
        {"low_ms": math.nan},
        {"high_ms": math.inf},
        {"low_ms": 300},
        {"step_ms": 0.0},
        {"min_iti_s": -1},
        {"max_pulses": 0},
        {"max_block_pulses": 0},
        {"rest_s": 0.0},
        {"max_period_pulses": 1.5},
        {"period_s": math.inf},
        {"max_coil_c": math.nan},
        {"intensity_pct_mso": -1.0},
        {"max_consecutive_mistrials": 0},
        {"max_intensity_pct_rmt": 0.0},
    ],
)
def test_limits_that_limit_nothing_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Limits(**({"low_ms": 0, "high_ms": 200} | values))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"max_block_pulses": 3, "rest_s": 2.0}, "rest_s above 5"),
        ({"max_block_pulses": 3, "rest_s": 5.0}, "rest_s above 5"),
        ({"max_period_pulses": 3, "period_s": 1.0}, "period_s above 15"),
        ({"max_period_pulses": 3, "period_s": 15.0}, "period_s above 15"),
        ({"max_period_pulses": 720}, "period_s above 3600"),
    ],
)
def test_a_rest_or_a_period_that_limits_nothing_is_refused_where_it_is_stated(
    values: dict[str, Any], words: str
) -> None:
    limits = Limits(0, 200, **values)  # an earlier log with such limits is read
    with pytest.raises(InvalidValueError, match=words):
        require_limits(limits)
    assert waits_s(limits) == {5.0}


def test_an_interval_in_milliseconds_is_refused_where_it_is_stated(space: DesignSpace) -> None:
    limits = Limits.of_space(space, min_iti_s=5000.0)  # which an earlier log may have
    with pytest.raises(InvalidValueError, match=r"min_iti_s.*Is it in ms"):
        require_limits(limits)


@pytest.mark.parametrize("values", [{"max_block_pulses": 3, "rest_s": 5.1}, {"max_period_pulses": 3, "period_s": 15.1}])
def test_a_rest_or_a_period_that_makes_a_session_wait_is_none_that_limits_nothing(values: dict[str, Any]) -> None:
    limits = Limits(0, 200, **values)
    require_limits(limits)
    assert max(waits_s(limits)) > 5.0


def waits_s(limits: Limits) -> set[float]:
    """How long is waited before each of thirty stimuli that come as soon as they may [s]."""
    times_s: list[float] = []
    for _ in range(30):
        times_s.append(earliest_s(limits, times_s, 0.0))
    return {after - before for before, after in pairwise(times_s)}


def test_limits_of_a_space_hold_exactly_its_isis(space: DesignSpace) -> None:
    limits = Limits.of_space(space, max_pulses=7)
    assert (limits.low_ms, limits.high_ms, limits.max_pulses) == (space.low_ms, space.high_ms, 7)


@pytest.mark.parametrize("isi_ms", [10.0, 12.5, 200.0])
def test_isis_on_the_grid_are_allowed(isi_ms: float) -> None:
    require_isi(Limits(10.0, 200.0, step_ms=2.5), isi_ms)


def test_many_steps_of_a_rounded_length_stay_on_the_grid() -> None:
    limits = Limits(0.1, 1000.1, step_ms=0.1)
    for step in (1, 3, 7_777, 9_999):
        require_isi(limits, 0.1 + step * 0.1)


@pytest.mark.parametrize("isi_ms", [11.0, 12.4999, 199.0])
def test_an_isi_off_the_grid_is_refused(isi_ms: float) -> None:
    with pytest.raises(LimitExceededError, match="not on the grid"):
        require_isi(Limits(10.0, 200.0, step_ms=2.5), isi_ms)


def test_nothing_came_before_the_first_stimulus() -> None:
    assert earliest_s(LIMITS, [], 100.0) == 105.0


def test_after_a_whole_block_the_next_stimulus_waits_for_a_rest() -> None:
    limits = Limits(0, 200, min_iti_s=5.0, max_block_pulses=3, rest_s=60.0)
    assert earliest_s(limits, [0.0, 5.0], -100.0) == 10.0
    assert earliest_s(limits, [0.0, 5.0, 10.0], -100.0) == 70.0
    assert earliest_s(limits, [0.0, 5.0, 10.0, 70.0], -100.0) == 75.0
    assert earliest_s(limits, [0.0, 60.0, 65.0], -100.0) == 70.0  # the block began at 60 s


def test_no_period_holds_more_stimuli_than_its_limit() -> None:
    limits = Limits(0, 200, min_iti_s=5.0, max_period_pulses=3, period_s=100.0)
    assert earliest_s(limits, [0.0, 5.0], -100.0) == 10.0
    assert earliest_s(limits, [0.0, 5.0, 10.0], -100.0) == 100.0
    assert earliest_s(limits, [0.0, 5.0, 10.0, 100.0], -100.0) == 105.0


@pytest.mark.parametrize(("coil_c", "way_on"), [(None, "report coil_c"), (40.1, "coil cool"), (99.0, "coil cool")])
def test_a_coil_that_is_hot_or_not_measured_is_refused_with_the_way_on(coil_c: float | None, way_on: str) -> None:
    with pytest.raises(LimitExceededError, match=f"{way_on}, then resume"):
        require_state(Limits(0, 200, max_coil_c=40.0), coil_c)


@pytest.mark.parametrize(
    ("intensity", "way_on"), [(None, "report intensity_pct_mso"), (54.9, "intensity back"), (56.0, "intensity back")]
)
def test_another_or_an_unknown_intensity_is_refused_with_the_way_on(intensity: float | None, way_on: str) -> None:
    with pytest.raises(LimitExceededError, match=f"{way_on}, then resume"):
        require_state(Limits(0, 200, intensity_pct_mso=55.0), intensity_pct_mso=intensity)


def test_a_state_within_the_limits_is_accepted() -> None:
    require_state(Limits(0, 200, max_coil_c=40.0, intensity_pct_mso=55.0), 40.0, 55.0)
    require_state(Limits(0, 200))


@pytest.mark.parametrize("max_coil_c", [4000.0, 104.0])
def test_a_coil_that_nobody_could_bear_is_no_limit_where_it_is_stated(max_coil_c: float) -> None:
    limits = Limits(0.0, 100.0, max_coil_c=max_coil_c)  # as in an earlier log
    with pytest.raises(InvalidValueError, match="such as 40"):
        require_limits(limits)
    require_limits(Limits(0.0, 100.0, max_coil_c=43.0))
