"""The window, the 0.135 rule, and what an estimate says."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.excess import EDGE_LEVEL, window_from_excess
from isiw.figures import Estimate
from isiw.summary import bayes_factor, chance
from isiw.window import Window
from known import known

GRID_MS = np.arange(0.0, 100.0, 2.0)

masks = st.lists(st.booleans(), min_size=len(GRID_MS), max_size=len(GRID_MS)).map(np.array)
excesses = st.lists(st.floats(0, 1), min_size=len(GRID_MS), max_size=len(GRID_MS)).map(np.array)


@given(masks)
def test_a_window_made_from_a_mask_gives_the_mask_back(mask: np.ndarray) -> None:
    window = Window.from_mask(GRID_MS, mask)
    if window is None:
        assert not mask.any()
    else:
        np.testing.assert_array_equal(window.mask(GRID_MS), mask)


@given(masks)
def test_the_hull_runs_from_the_first_to_the_last_marked_isi(mask: np.ndarray) -> None:
    window = Window.from_mask(GRID_MS, mask)
    marked = GRID_MS[mask]
    assert (window is None) == (len(marked) == 0)
    if window is not None:
        assert (window.start_ms, window.end_ms) == (marked[0], marked[-1])
        assert window.width_ms == marked[-1] - marked[0]


def test_a_gap_in_the_mask_splits_the_window() -> None:
    window = Window.from_mask([0, 1, 2, 3, 4, 5], [True, True, False, False, True, False])
    assert window == Window(0, 4, ((0, 1), (4, 4)))
    assert str(window) == "0–1 ms and 4–4 ms"


def test_a_window_given_by_its_hull_has_one_segment() -> None:
    assert Window(10, 20).segments == ((10.0, 20.0),)


def test_both_edges_belong_to_the_window() -> None:
    assert Window(10, 20).mask([9.99, 10, 20, 20.01]).tolist() == [False, True, True, False]


@pytest.mark.parametrize(
    ("start", "end", "segments"),
    [
        (20, 10, ()),
        (math.nan, 10, ()),
        (0, math.inf, ()),
        (0, 30, ((0, 10), (5, 30))),
        (0, 30, ((0, 10), (10, 30))),
        (0, 30, ((20, 30), (0, 10))),
        (0, 40, ((0, 10), (20, 30))),
        (1, 30, ((0, 10), (20, 30))),
    ],
)
def test_segments_that_do_not_make_a_window_are_refused(
    start: float, end: float, segments: tuple[tuple[float, float], ...]
) -> None:
    with pytest.raises(InvalidValueError):
        Window(start, end, segments)


def test_the_edges_of_a_gaussian_lie_two_sds_from_its_peak() -> None:
    grid = np.arange(0.0, 200.0, 0.1)
    window = window_from_excess(grid, 0.1 * np.exp(-0.5 * ((grid - 100) / 20) ** 2), 0.01)
    assert window is not None
    assert (window.start_ms, window.end_ms) == pytest.approx((60, 140), abs=0.11)


def test_a_deep_valley_splits_the_window_and_a_shallow_one_does_not() -> None:
    grid = np.arange(0.0, 200.0)

    def segments(sd_ms: float) -> int:
        peaks = [np.exp(-0.5 * ((grid - at) / sd_ms) ** 2) for at in (60, 140)]
        window = window_from_excess(grid, 0.1 * (peaks[0] + peaks[1]), 0.0)
        assert window is not None
        return len(window.segments)

    assert (segments(15), segments(30)) == (2, 1)


@pytest.mark.slow
@given(excesses, st.floats(1.0, 1e3))
def test_the_window_does_not_depend_on_the_unit_once_it_is_above_the_least_excess(
    excess: np.ndarray, factor: float
) -> None:
    baseline_mv = 0.02
    window = window_from_excess(GRID_MS, excess, baseline_mv)
    if window is not None:
        scaled = window_from_excess(GRID_MS, factor * excess, factor * baseline_mv)
        # Rounding may move a grid point that lies on the level itself.
        on_level = np.isclose(excess, EDGE_LEVEL * excess.max(), rtol=1e-12, atol=0)
        assert scaled is not None
        np.testing.assert_array_equal(scaled.mask(GRID_MS)[~on_level], window.mask(GRID_MS)[~on_level])


@pytest.mark.slow
@given(excesses)
def test_the_window_holds_the_isi_of_the_largest_excess(excess: np.ndarray) -> None:
    window = window_from_excess(GRID_MS, excess, 0.0)
    assert (window is None) == (excess.max() < 0.002)
    if window is not None:
        assert window.mask(GRID_MS)[excess.argmax()]


@pytest.mark.parametrize(
    ("peak_mv", "baseline_mv", "enhanced"),
    [(0.0019, 0.0, False), (0.0021, 0.0, True), (0.0099, 0.1, False), (0.0101, 0.1, True), (-0.01, 0.0, False)],
)
def test_there_is_a_window_only_above_2_uv_and_a_tenth_of_the_baseline(
    peak_mv: float, baseline_mv: float, *, enhanced: bool
) -> None:
    assert (window_from_excess([0, 1, 2], [-1, peak_mv, -1], baseline_mv) is not None) == enhanced


@pytest.mark.parametrize(
    ("excess_mv", "baseline_mv"), [([0.1, math.nan], 0.01), ([0.1, math.inf], 0.01), ([0.1, 0.0], math.nan)]
)
def test_an_excess_that_is_not_finite_is_an_error_and_not_the_absence_of_a_window(
    excess_mv: list[float], baseline_mv: float
) -> None:
    with pytest.raises(InvalidValueError, match="finite"):
        window_from_excess([0, 1], excess_mv, baseline_mv)


@pytest.mark.parametrize("excess_mv", [[0.1], [0.1, 0.2, 0.3], [[0.1, 0.2]], 0.1])
def test_each_isi_has_one_excess(excess_mv: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"got '\d values for 2 ISIs'"):
        window_from_excess([0, 1], excess_mv, 0.01)


@pytest.mark.parametrize("probability", [-0.01, 1.01, math.nan])
def test_a_probability_outside_0_to_1_is_refused(probability: float) -> None:
    with pytest.raises(InvalidValueError, match="from 0 to 1"):
        WindowEstimate(probability, None)


def test_a_window_is_not_reported_against_its_probability() -> None:
    with pytest.raises(InvalidValueError, match="'no window' is more probable"):
        WindowEstimate(0.49, Window(0, 1))
    assert WindowEstimate(0.5, Window(0, 1)).window == Window(0, 1)


def test_what_a_method_without_a_posterior_does_not_have_is_none() -> None:
    estimate = WindowEstimate(None, Window(10, 20))
    assert estimate.interval() is None
    assert estimate.profile([15.0]) is None


def test_no_samples_given_a_window_are_no_interval() -> None:
    assert WindowEstimate(0.0, None, edge_samples_ms=np.empty((0, 2))).interval() is None


def test_the_interval_holds_its_share_of_the_samples() -> None:
    rng = np.random.default_rng(5)
    samples = np.sort(rng.uniform(0, 100, (2001, 2)), axis=1)
    intervals = WindowEstimate(1.0, None, edge_samples_ms=samples).interval(0.8)
    assert intervals is not None
    for column, (low, high) in zip(samples.T, intervals, strict=True):
        assert np.mean((column >= low) & (column <= high)) == pytest.approx(0.8, abs=0.002)
        assert np.mean(column < low) == pytest.approx(0.1, abs=0.001)


def test_an_edge_beyond_the_range_makes_an_infinite_interval_and_never_nan() -> None:
    samples = np.array([[-math.inf, 50.0], [10.0, math.inf], [20.0, math.inf], [30.0, math.inf]])
    intervals = WindowEstimate(1.0, None, edge_samples_ms=samples).interval(0.99)
    assert intervals == ((-math.inf, 30.0), (50.0, math.inf))


def test_an_estimate_is_printed_with_its_probability_medians_and_intervals() -> None:
    edges_ms = np.array([[-math.inf, 150.0], [30.0, 160.0], [34.0, math.inf]])
    estimate = WindowEstimate(0.876, Window(31.6, 158.0), 30.0, 160.0, edge_samples_ms=edges_ms)
    assert str(estimate).splitlines() == [
        "Window: 31.6–158 ms (probability 0.88)",
        "Start: 30 ms, 90 % interval before the range to 34 ms",
        "End: 160 ms, 90 % interval 150 ms to beyond the range",
    ]


def test_an_estimate_is_printed_without_what_it_does_not_have() -> None:
    assert str(WindowEstimate(None, Window(10, 40))) == "Window: 10–40 ms"
    assert str(WindowEstimate(None, None)) == "No answer yet"
    measured = WindowEstimate(None, None, grid_ms=np.array([10.0, 40.0]), profile_quantiles_mv=np.full((3, 2), 0.05))
    assert str(measured) == "No window"
    no_window = WindowEstimate(0.2, None, 10.0, 40.0, edge_samples_ms=np.array([[10.0, 40.0]]))
    assert str(no_window) == "Undecided (probability of a window: 0.20)"
    assert str(replace(no_window, probability=0.03)) == "No window (probability of a window: 0.03)"
    assert str(replace(no_window, probability=0.9)) == "Window not reported (probability of a window: 0.90)"


def test_the_robust_interval_is_the_hull_over_probable_hypotheses() -> None:
    rng = np.random.default_rng(6)
    hypotheses = rng.choice(4, 2000, p=[0.6, 0.3, 0.09, 0.01])
    middles = np.array([[50.0, 150.0], [60.0, 140.0], [45.0, 170.0], [10.0, 490.0]])[hypotheses]
    samples = middles + rng.uniform(-2, 2, (2000, 2))
    names = ("a", "b", "c", "d")
    estimate = WindowEstimate(1.0, None, edge_samples_ms=samples, hypothesis_samples=hypotheses, hypothesis_names=names)
    assert list(known(estimate.hypotheses)) == list(names)
    assert list(known(estimate.hypotheses).values()) == pytest.approx([0.6, 0.3, 0.09, 0.01], abs=0.04)
    start, end = known(estimate.robust_interval())
    assert start == pytest.approx((45 - 1.8, 60 + 1.8), abs=0.3)
    assert end == pytest.approx((140 - 1.8, 170 + 1.8), abs=0.3)
    (start_low, _), (_, end_high) = known(estimate.robust_interval(min_share=0.0))
    assert [start_low, end_high] == pytest.approx([8.2, 491.8], abs=0.8)


def test_without_hypotheses_the_robust_interval_is_the_interval() -> None:
    estimate = WindowEstimate(1.0, None, edge_samples_ms=np.random.default_rng(7).uniform(0, 50, (300, 2)))
    assert estimate.robust_interval(0.8) == estimate.interval(0.8)
    assert WindowEstimate(None, Window(10, 20)).robust_interval() is None


def test_edges_beyond_the_range_are_counted() -> None:
    edges = np.array([[-np.inf, 60.0], [20.0, np.inf], [-np.inf, np.inf], [-np.inf, 70.0]])
    estimate = WindowEstimate(probability=1.0, window=None, edge_samples_ms=edges)
    assert estimate.beyond_probability == (0.75, 0.5)


@pytest.mark.parametrize("level", [0.0, 1.0, -0.1, 1.5, math.nan])
def test_a_credible_level_lies_between_0_and_1(level: float) -> None:
    with pytest.raises(InvalidValueError, match="above 0 and below 1"):
        WindowEstimate(1.0, None).interval(level)


@pytest.mark.parametrize("min_share", [-0.01, 1.01, math.nan])
def test_the_least_share_of_a_hypothesis_lies_between_0_and_1(min_share: float) -> None:
    with pytest.raises(InvalidValueError, match="share"):
        WindowEstimate(1.0, None).robust_interval(min_share=min_share)


def test_the_profile_is_interpolated_between_grid_points() -> None:
    estimate = WindowEstimate(
        1.0, None, grid_ms=np.array([0.0, 10.0]), profile_quantiles_mv=np.array([[0.0, 1.0], [1.0, 2.0], [2.0, 5.0]])
    )
    band = estimate.profile([0.0, 5.0])
    assert band is not None
    np.testing.assert_allclose(band.low_mv, [0.0, 0.5])
    np.testing.assert_allclose(band.median_mv, [1.0, 1.5])
    np.testing.assert_allclose(band.high_mv, [2.0, 3.5])


def test_a_depression_that_is_less_probable_than_none_is_not_reported() -> None:
    for probability in (None, 0.4):
        with pytest.raises(InvalidValueError, match="depression is reported"):
            WindowEstimate(0.9, Window(50, 80), depressed=Window(10, 35), depressed_probability=probability)
    assert WindowEstimate(0.9, Window(50, 80), depressed_probability=0.4).depressed is None


def test_an_estimate_says_where_the_mep_is_depressed_only_where_that_was_looked_for() -> None:
    found = WindowEstimate(0.9, Window(50, 80), depressed=Window(10, 35), depressed_probability=0.7)
    assert str(found).endswith("Depressed: 10–35 ms (probability of it: 0.70)")
    nowhere = WindowEstimate(0.9, Window(50, 80), depressed_probability=0.04)
    assert str(nowhere).endswith("Depressed: nowhere (probability of it: 0.04)")
    assert str(replace(nowhere, depressed_probability=0.1)).endswith("Depressed: undecided (probability of it: 0.10)")
    assert "epressed" not in str(WindowEstimate(0.9, Window(50, 80)))


@pytest.mark.parametrize(
    ("probability", "beforehand", "factor"),
    [(0.9, 0.5, 9.0), (0.9, 0.75, 3.0), (0.75, 0.9, 1 / 3), (1.0, 0.5, math.inf), (0.0, 0.5, 0.0)],
)
def test_a_bayes_factor_is_by_what_the_odds_grew(probability: float, beforehand: float, factor: float) -> None:
    assert bayes_factor(probability, beforehand) == pytest.approx(factor)


@pytest.mark.parametrize("unknown", [(None, 0.5), (0.5, None), (0.5, 0.0), (0.5, 1.0)])
def test_of_what_is_not_known_or_was_certain_there_is_no_bayes_factor(
    unknown: tuple[float | None, float | None],
) -> None:
    assert bayes_factor(*unknown) is None


@pytest.mark.parametrize(
    ("probability", "beforehand", "said"),
    [
        (0.5, 1 / 11, "10"),
        (0.5, 1 / 101, "100"),
        (0.5, 1 / 102, "above 100"),
        (0.5, 0.99, "0.01"),
        (0.001, 0.5, "below 0.01"),
    ],
)
def test_a_bayes_factor_is_said_as_far_as_it_matters(probability: float, beforehand: float, said: str) -> None:
    estimate = WindowEstimate(probability, None, beforehand=beforehand).in_figures(Estimate)
    assert chance(estimate) == f" (probability of a window: {probability:.2f}, Bayes factor {said})"
