"""Where windows start, as believed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.shared.start import Span, StartPrior
from isiw.types import FloatArray

MANY = 20_000
USUAL = (Span(1.0, 0.0, 115.0),)


def starts_ms(prior: StartPrior, space: DesignSpace) -> FloatArray:
    knots = prior.knots(space)
    return np.interp(np.random.default_rng(1).random(MANY), knots.below, knots.start_ms)


def share_of(starts: FloatArray, low_ms: float, high_ms: float) -> float:
    return float(((starts > low_ms) & (starts < high_ms)).mean())


@pytest.mark.parametrize(("space", "low_ms", "high_ms"), [(IMPACT_SPACE, 0.0, 115.0), (VALVE_SPACE, 180.0, 295.0)])
def test_windows_start_soon_after_the_impact_and_sometimes_anywhere(
    space: DesignSpace, low_ms: float, high_ms: float
) -> None:
    start = starts_ms(StartPrior(USUAL, hit_delay_ms=(180.0, 6.0), p_anywhere=0.2), space)
    elsewhere = 0.2 * (1 - (high_ms - low_ms + 30) / (space.high_ms - space.low_ms + 100))
    assert share_of(start, low_ms - 15, high_ms + 15) == pytest.approx(1 - elsewhere, abs=0.02)
    assert (start >= space.low_ms - 100).all()
    assert (start <= space.high_ms).all()


def test_an_unknown_rig_may_hit_late_and_a_stated_hit_delay_says_when() -> None:
    # A hit at 280 ms, and a start at most 115 ms later.
    unknown = share_of(starts_ms(StartPrior(USUAL), VALVE_SPACE), 330, 395)
    stated = share_of(starts_ms(StartPrior(USUAL, hit_delay_ms=(280.0, 6.0)), VALVE_SPACE), 330, 395)
    robot = share_of(starts_ms(StartPrior(USUAL, hit_delay_ms=(180.0, 6.0)), VALVE_SPACE), 330, 395)
    assert robot < 0.02 < unknown < stated
    assert stated == pytest.approx(65 / 115, abs=0.05)


def test_from_the_impact_the_hit_delay_says_nothing() -> None:
    told, untold = StartPrior(hit_delay_ms=(100.0, 6.0)), StartPrior()
    np.testing.assert_array_equal(starts_ms(told, IMPACT_SPACE), starts_ms(untold, IMPACT_SPACE))


def test_a_prior_that_trusts_no_stimulator_is_even_over_the_range() -> None:
    start = starts_ms(StartPrior(p_anywhere=1.0), VALVE_SPACE)
    shares = np.histogram(start, 5, (-100.0, 500.0))[0] / MANY
    assert np.abs(shares - 0.2).max() < 0.02  # three SDs of a share are 0.009


@pytest.mark.parametrize("p_anywhere", [0.04, 0.0])
def test_where_no_start_is_expected_all_are_as_likely(p_anywhere: float) -> None:
    space = DesignSpace(900, 1300, reference="valve")
    shares = (
        np.histogram(starts_ms(StartPrior(p_anywhere=p_anywhere), space), 5, (space.low_ms - 100, space.high_ms))[0]
        / MANY
    )
    assert np.abs(shares - 0.2).max() < 0.02


def test_a_range_with_a_part_of_the_usual_starts_has_only_their_share_of_them() -> None:
    space = DesignSpace(
        165, 365, reference="impact"
    )  # of the usual starts, 0 to 115 ms, its 100 ms margin holds 50 / 115
    start = starts_ms(StartPrior(USUAL, p_anywhere=0.5), space)
    usual = 0.5 * 50 / 115
    in_margin = (usual + 0.5 * 50 / 300) / (usual + 0.5)
    assert share_of(start, 0, 115) == pytest.approx(in_margin, abs=0.015)


def test_fewer_starts_are_below_earlier_ones_and_all_below_the_last() -> None:
    knots = StartPrior().knots(VALVE_SPACE)
    assert (np.diff(knots.below) >= 0).all()
    assert (knots.below[0], knots.below[-1]) == (0.0, 1.0)


def test_where_no_start_can_be_none_is_usual() -> None:
    prior, space = StartPrior((Span(1.0, 0.0, 100.0),), p_anywhere=0.0), DesignSpace(0, 3000, 10, reference="impact")
    assert prior.usual(np.array([50.0, 2500.0]), space).tolist() == [1.0, 0.0]


def test_the_density_is_that_of_the_starts_drawn() -> None:
    prior = StartPrior()
    starts = starts_ms(prior, VALVE_SPACE)
    grid_ms = np.linspace(-100, 500, 6001)
    density = np.exp(prior.log_density(grid_ms, VALVE_SPACE))
    for low_ms, high_ms in ((-100, 100), (180, 295), (350, 450)):
        inside = (grid_ms >= low_ms) & (grid_ms <= high_ms)
        mass = (density * inside).sum().item() * 0.1
        assert share_of(starts, low_ms, high_ms) == pytest.approx(mass, abs=0.012)
    assert np.isinf(prior.log_density(np.array([-101.0, 501.0]), VALVE_SPACE)).all()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"p_anywhere": float("nan")}, "p_anywhere"),
        ({"p_anywhere": 1.5}, "p_anywhere"),
        ({"p_robot": -0.1}, "p_robot"),
        ({"hit_delay_ms": (180.0, 0.0)}, "hit_delay_ms"),
        ({"spans": (Span(0.5, 0.0, 115.0),)}, "sum to 1"),
    ],
)
def test_an_invalid_prior_is_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        StartPrior(**wrong)


@pytest.mark.parametrize("wrong", [(1.0, 115.0, 0.0), (1.0, 0.0, 115.0, 0.0), (1.5, 0.0, 115.0)])
def test_an_invalid_span_is_refused(wrong: tuple[float, ...]) -> None:
    with pytest.raises(InvalidValueError):
        Span(*wrong)


def test_starts_have_a_density_from_a_tenth_of_a_second_before_a_range_to_its_end() -> None:
    for beyond_ms, there in ((0.0, True), (0.1, False)):
        ends_ms = np.array([VALVE_SPACE.low_ms - 100.0 - beyond_ms, VALVE_SPACE.high_ms + beyond_ms])
        assert np.isfinite(StartPrior().log_density(ends_ms, VALVE_SPACE)).tolist() == [there, there]
