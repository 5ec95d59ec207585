"""The design space: its grid, its nearest ISI, and what it refuses."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.acquisition.fixed import stops_ms
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.devices.allowed import require_isi
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError, LimitExceededError, OutOfSpaceError
from isiw.strategy.choice import candidate_isis

spaces = st.builds(
    lambda low, step, count: DesignSpace(low, low + step * count, step_ms=step, reference="impact"),
    st.integers(-200, 200),
    st.sampled_from([0.1, 0.25, 0.5, 1.0, 2.5, 5.0]),
    st.integers(1, 400),
)
isis = st.floats(-1e4, 1e4)


def test_the_grid_holds_both_ends() -> None:
    assert DesignSpace(10, 20, step_ms=2.5, reference="impact").grid_ms.tolist() == [10.0, 12.5, 15.0, 17.5, 20.0]


@pytest.mark.parametrize(
    "bounds",
    [(20, 120.3, 0.1), (0, 100.3, 0.1), (0, 4.1, 0.1), (-7.3, 1.1, 0.7), (0, 100, 33.3333333334), (0.1, 1.7, 0.2)],
)
def test_rounding_puts_no_isi_beyond_the_bounds(bounds: tuple[float, float, float]) -> None:
    space = DesignSpace(*bounds, reference="impact")
    assert (space.grid_ms[0], space.grid_ms[-1]) == (space.low_ms, space.high_ms)
    assert (np.diff(space.grid_ms) > 0).all()
    assert space.snap(1e4) == space.high_ms
    assert Limits.of_space(space).high_ms >= space.snap(float(candidate_isis(space)[-1]))


def test_a_grid_of_whole_milliseconds_is_exact() -> None:
    assert DesignSpace(-20, 500, reference="impact").grid_ms.tolist() == [float(isi_ms) for isi_ms in range(-20, 501)]


@given(spaces)
def test_the_grid_is_evenly_spaced(space: DesignSpace) -> None:
    assert space.grid_ms[0] == space.low_ms
    assert space.grid_ms[-1] == pytest.approx(space.high_ms, abs=1e-6)
    np.testing.assert_allclose(np.diff(space.grid_ms), space.step_ms, atol=1e-9)


@given(spaces, isis)
def test_snapping_lands_on_the_grid_and_does_so_once(space: DesignSpace, isi_ms: float) -> None:
    snapped = space.snap(isi_ms)
    assert snapped in space.grid_ms
    assert space.snap(snapped) == snapped


@given(spaces, isis)
def test_no_grid_point_is_nearer_than_the_snapped_one(space: DesignSpace, isi_ms: float) -> None:
    nearest = np.abs(space.grid_ms - isi_ms).min()
    assert abs(space.snap(isi_ms) - isi_ms) == pytest.approx(nearest, abs=1e-9)


@pytest.mark.parametrize("isi_ms", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_neither_snapped_nor_realised(isi_ms: float) -> None:
    with pytest.raises(InvalidValueError, match="finite"):
        IMPACT_SPACE.snap(isi_ms)
    with pytest.raises(InvalidValueError, match="finite"):
        IMPACT_SPACE.check_realised(isi_ms)


@pytest.mark.parametrize("isi_ms", [-10.0, -0.5, 0.0, 123.4, 330.0])
def test_a_realised_isi_within_the_tolerance_passes_unchanged(isi_ms: float) -> None:
    assert IMPACT_SPACE.check_realised(isi_ms) == isi_ms


@pytest.mark.parametrize("isi_ms", [-10.001, 330.001])
def test_a_realised_isi_beyond_the_tolerance_is_refused_with_the_reference(isi_ms: float) -> None:
    with pytest.raises(OutOfSpaceError, match="check the reference") as caught:
        IMPACT_SPACE.check_realised(isi_ms)
    assert "the impact" in str(caught.value)


@pytest.mark.parametrize("name", ["low_ms", "high_ms", "step_ms", "tolerance_ms"])
@pytest.mark.parametrize("value", [math.nan, math.inf, "5", None, True])
def test_a_field_that_is_no_finite_number_is_named(name: str, value: object) -> None:
    wrong: dict[str, Any] = {name: value}
    with pytest.raises(InvalidValueError, match=name):
        dataclasses.replace(VALVE_SPACE, **wrong)


@pytest.mark.parametrize(
    "fields",
    [
        {"low_ms": 10, "high_ms": 10},
        {"low_ms": 10, "high_ms": 5},
        {"low_ms": 0, "high_ms": 10, "step_ms": 0},
        {"low_ms": 0, "high_ms": 10, "step_ms": -1},
        {"low_ms": 0, "high_ms": 10, "tolerance_ms": -1},
        {"low_ms": 0, "high_ms": 10, "step_ms": 3},
        {"low_ms": 0, "high_ms": 10, "reference": "pulse"},
    ],
)
def test_a_space_that_cannot_be_is_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        DesignSpace(**{"reference": "impact"} | fields)


def test_a_space_without_a_reference_is_refused_with_both_and_what_they_mean() -> None:
    words = r'reference="impact", the impact of the hammer.*reference="valve", the command that opens the valve'
    with pytest.raises(InvalidValueError, match=words):
        DesignSpace(0, 320)


def test_a_space_is_printed_with_the_event_that_its_isis_count_from() -> None:
    assert str(DesignSpace(0, 500, reference="valve")) == "0–500 ms after the valve command, every 1 ms"
    assert str(DesignSpace(10, 50, 2.5, reference="impact")) == "10–50 ms after the impact, every 2.5 ms"


def test_a_space_in_seconds_is_named() -> None:
    with pytest.raises(InvalidValueError, match=r"low_ms=0, high_ms=320"):
        DesignSpace(0, 0.32, reference="impact")


def test_the_grid_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        VALVE_SPACE.grid_ms[0] = 1.0


def test_the_two_ready_spaces_are_those_of_the_dissertation() -> None:
    assert (VALVE_SPACE.low_ms, VALVE_SPACE.high_ms, VALVE_SPACE.reference) == (0, 500, "valve")
    assert (IMPACT_SPACE.low_ms, IMPACT_SPACE.high_ms, IMPACT_SPACE.reference) == (0, 320, "impact")


@pytest.mark.parametrize("listed", [[0, 1e308], [-1e300, 20, 30], [20, 60_001]])
def test_a_list_with_an_isi_beyond_a_minute_is_refused_in_words(listed: list[float]) -> None:
    with pytest.raises(InvalidValueError, match=r"no ISI of a design space is so long.*Divide by 1000"):
        DesignSpace.of(listed, reference="impact")


@pytest.mark.parametrize("wrong", [{"high_ms": 1e308, "step_ms": 1e308}, {"tolerance_ms": 1e300}])
def test_a_step_or_a_tolerance_beyond_a_minute_is_refused_in_words(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="no ISI of a design space is so long"):
        DesignSpace(**{"low_ms": 0.0, "high_ms": 500.0, **wrong}, reference="impact")


@pytest.mark.parametrize("space", [(0, 1e6, 1.0), (0, 500, 1e-3), (0, 1e15, 1e-9), (-1.7e308, 1.7e308, 1.0)])
def test_a_space_with_more_isis_than_anybody_needs_is_refused(space: tuple[float, float, float]) -> None:
    with pytest.raises(InvalidValueError, match=r"too many ISIs"):
        DesignSpace(*space, reference="impact")


def test_a_second_in_steps_of_a_tenth_of_a_millisecond_is_a_space() -> None:
    assert len(DesignSpace(0, 1000, 0.1, reference="impact").grid_ms) == 10_001


LISTED = DesignSpace.of([30, 10, 20, 15, 50], reference="impact")


def test_a_space_can_be_a_list_of_isis_in_any_order() -> None:
    assert LISTED.grid_ms.tolist() == [10, 15, 20, 30, 50]
    assert (LISTED.low_ms, LISTED.high_ms) == (10, 50)
    assert str(LISTED) == "10, 15, 20, 30 and 50 ms after the impact"
    assert [LISTED.snap(isi_ms) for isi_ms in (0, 12, 13, 41, 99)] == [10, 10, 15, 50, 50]
    assert stops_ms(LISTED, 10).tolist() == [10, 20, 30, 50]
    assert DesignSpace.of([10, 15, 20, 30, 50], reference="impact") == LISTED


def test_the_limits_of_a_list_allow_its_isis_alone() -> None:
    limits = Limits.of_space(LISTED)
    require_isi(limits, 30)
    for isi_ms in (25, 60):
        with pytest.raises(LimitExceededError):
            require_isi(limits, isi_ms)


@pytest.mark.parametrize(("isis_ms", "reference"), [([10], "impact"), ([10, math.nan], "impact"), ([10, 20], "")])
def test_a_list_that_makes_no_space_is_refused(isis_ms: list[float], reference: Any) -> None:
    with pytest.raises(InvalidValueError):
        DesignSpace.of(isis_ms, reference=reference)


def test_a_list_whose_range_says_otherwise_is_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"DesignSpace\.of"):
        dataclasses.replace(LISTED, high_ms=60)


def test_a_sweep_of_a_list_leaves_out_what_is_nearer_than_its_step() -> None:
    assert stops_ms(DesignSpace.of([10, 19, 20, 30], reference="impact"), 10).tolist() == [10, 20, 30]


def test_a_long_list_is_shown_by_its_first_twelve_and_its_last() -> None:
    listed = {count: str(DesignSpace.of(range(1, count + 1), reference="impact")) for count in (13, 14)}
    assert listed[13].startswith("1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12 and 13 ms")
    assert listed[14].startswith("1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, … and 14 ms")


def test_a_range_in_seconds_is_refused_with_what_it_is_in_milliseconds() -> None:
    with pytest.raises(InvalidValueError, match="low_ms=10, high_ms=300"):
        DesignSpace(0.01, 0.3, reference="impact")
