from __future__ import annotations

import math

import pytest

from isiw.errors import InvalidValueError, LimitExceededError
from isiw.strategy.threshold import IntensityRange, Pulse, ThresholdEstimate
from isiw.strategy.threshold.pulses import one_sided

SPACE = IntensityRange(20, 80)


def test_the_grid_has_both_ends_and_nothing_beyond() -> None:
    grid = IntensityRange(30, 60, 2.5).grid_pct_mso
    assert (grid[0], grid[1], grid[-1]) == (30, 32.5, 60)
    assert [SPACE.snap(asked) for asked in (3.0, 50.4, 99.0)] == [20, 50, 80]


@pytest.mark.parametrize(("low", "high", "step"), [(50, 40, 1), (50, 50, 1), (0, 50, 1), (20, 101, 1), (20, 50, 7)])
def test_a_range_that_cannot_be_is_refused(low: float, high: float, step: float) -> None:
    with pytest.raises(InvalidValueError):
        IntensityRange(low, high, step)


@pytest.mark.parametrize("intensity", [19.0, 81.0, 50.5])
def test_what_is_beyond_the_range_or_off_its_grid_is_not_delivered(intensity: float) -> None:
    with pytest.raises(LimitExceededError, match="within the range"):
        SPACE.require(intensity)


def test_an_intensity_that_is_no_number_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="finite number"):
        SPACE.require(math.nan)


def test_a_response_is_more_than_50_microvolts() -> None:
    assert [Pulse(50, mep_mv).responded for mep_mv in (0.0, 0.05, 0.051)] == [False, False, True]
    assert Pulse(50, response=True).responded


@pytest.mark.parametrize(
    ("mep_mv", "response"), [(None, None), (0.1, True), (-0.1, None), (math.nan, None), (None, 1), (2000.0, None)]
)
def test_an_outcome_that_cannot_be_is_refused(*, mep_mv: float | None, response: bool | None) -> None:
    with pytest.raises(InvalidValueError):
        Pulse(50, mep_mv, response)


def test_an_estimate_is_told_in_words() -> None:
    assert str(ThresholdEstimate(52.04)) == "Resting motor threshold: 52.0 % MSO."
    assert "90 % interval 50.0–54.0" in str(ThresholdEstimate(52.0, 50.0, 54.0))
    assert str(ThresholdEstimate(None, reason="Why.")) == "No threshold can be stated. Why."


def test_an_estimate_beyond_the_range_has_no_number() -> None:
    assert ThresholdEstimate(80.0).within(SPACE).threshold_pct_mso == 80.0
    beyond = ThresholdEstimate(80.5, 70.0, 90.0).within(SPACE)
    assert beyond.threshold_pct_mso is None
    assert "above the highest intensity, 80 % MSO" in beyond.reason
    assert "below" in ThresholdEstimate(19.0).within(SPACE).reason


@pytest.mark.parametrize(("end_pct_mso", "response"), [(30.0, True), (80.0, False)])
def test_six_pulses_all_alike_near_the_end_of_the_range_say_that_it_is_wrong(
    end_pct_mso: float, *, response: bool
) -> None:
    space, away = IntensityRange(30, 80), 3.0 if response else -3.0
    far = [Pulse(end_pct_mso + 1.5 * away, response=response)] * 6
    near = [Pulse(end_pct_mso + away, response=response)] * 6
    decisions = [one_sided([*far, *near[:count]], space) for count in (5, 6)]
    assert [each is not None and each.stop for each in decisions] == [False, True]
