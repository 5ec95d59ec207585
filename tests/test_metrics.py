"""F1, edge errors, coverage, and the trial from which a criterion is met."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.metrics import (
    covers,
    edge_error_ms,
    edge_ranks,
    f1,
    f1_of_masks,
    profile_correlation,
    trials_to_criterion,
    true_edges_ms,
)
from isiw.types import ArrayLike
from isiw.window import Window
from known import known

SPACE = DesignSpace(0, 40, step_ms=1, reference="impact")

masks = st.lists(st.booleans(), min_size=12, max_size=12).map(np.array)


def estimate_of(edges_ms: ArrayLike) -> WindowEstimate:
    return WindowEstimate(1.0, None, edge_samples_ms=np.array(edges_ms))


TRUTH, ESTIMATE = Window(10, 20), estimate_of([[10.0, 20.0]])


@given(masks, masks)
def test_f1_is_symmetric_within_0_to_1_and_1_only_for_equal_sets(a: np.ndarray, b: np.ndarray) -> None:
    score = float(f1_of_masks(a, b))
    assert score == float(f1_of_masks(b, a))
    assert 0.0 <= score <= 1.0
    assert (score == 1.0) == bool((a == b).all())
    assert (score == 0.0) == (not (a & b).any() and bool((a | b).any()))


@given(masks, masks)
def test_f1_is_the_harmonic_mean_of_precision_and_recall(a: np.ndarray, b: np.ndarray) -> None:
    hits = (a & b).sum()
    if hits:
        precision, recall = hits / a.sum(), hits / b.sum()
        assert float(f1_of_masks(a, b)) == pytest.approx(2 / (1 / precision + 1 / recall))


def test_f1_of_many_estimates_is_broadcast_against_one_truth() -> None:
    truth = np.array([True, True, False])
    estimates = np.array([[True, True, False], [False, False, True], [True, False, False]])
    np.testing.assert_allclose(f1_of_masks(estimates, truth), [1.0, 0.0, 2 / 3])


def test_no_window_rightly_reported_scores_1_and_wrongly_0() -> None:
    assert f1(None, None, SPACE) == 1.0
    assert f1(None, Window(5, 10), SPACE) == 0.0
    assert f1(Window(5, 10), None, SPACE) == 0.0


def test_f1_counts_grid_points_of_an_estimate_or_of_its_window() -> None:
    window, truth = Window(10, 19), Window(15, 24)
    assert f1(window, truth, SPACE) == pytest.approx(0.5)
    assert f1(WindowEstimate(0.9, window), truth, SPACE) == pytest.approx(0.5)
    assert f1(WindowEstimate(0.1, None), truth, SPACE) == 0.0


def test_a_method_without_an_answer_is_right_about_nobody() -> None:
    assert f1(WindowEstimate(0.1, None), None, SPACE) == 1.0
    assert f1(WindowEstimate(None, None), None, SPACE) == 0.0
    assert f1(WindowEstimate(0.1, None, silent=True), None, SPACE) == 0.0


def test_a_window_between_two_isis_of_the_space_is_one_still() -> None:
    coarse = DesignSpace(0, 100, step_ms=10, reference="impact")
    early, late = Window(32, 38), Window(82, 88)
    assert f1(early, early, coarse) == 1
    assert f1(early, late, coarse) == f1(early, None, coarse) == f1(None, late, coarse) == 0
    apart = Window(12, 84, ((12, 14), (82, 84)))
    assert f1(apart, Window(45, 55), coarse) == 0
    assert f1(apart, Window(8, 11), coarse) == pytest.approx(2 / 3)
    assert f1(Window(300, 380), None, coarse) == 1  # outside the space there is nothing to be found


def test_edge_errors_are_estimated_minus_true() -> None:
    assert edge_error_ms(Window(10, 20), Window(12, 15)) == (-2.0, 5.0)
    assert edge_error_ms(WindowEstimate(0.9, Window(10, 20)), Window(12, 15)) == (-2.0, 5.0)
    assert edge_error_ms(None, Window(12, 15)) is None
    assert edge_error_ms(Window(10, 20), None) is None


def test_a_true_edge_at_the_border_of_the_space_lies_beyond_it() -> None:
    assert true_edges_ms(Window(0, 20), SPACE) == (-math.inf, 20.0)
    assert true_edges_ms(Window(1, 40), SPACE) == (1.0, math.inf)


def test_each_edge_is_covered_by_its_own_interval() -> None:
    estimate = estimate_of([(10.0, 20.0), (11.0, 21.0), (12.0, 22.0)])
    assert covers(estimate, Window(11, 25), SPACE) == (True, False)
    assert covers(estimate, Window(9, 22), SPACE) == (False, True)


def test_half_a_grid_step_is_granted_and_no_more() -> None:
    estimate = estimate_of([(10.0, 20.0)])
    assert covers(estimate, Window(10.5, 19.5), SPACE) == (True, True)
    assert covers(estimate, Window(10.6, 19.4), SPACE) == (False, False)


def test_an_edge_beyond_the_range_is_covered_by_an_infinite_interval_only() -> None:
    beyond = estimate_of([(-math.inf, math.inf)])
    within = estimate_of([(1.0, 39.0)])
    assert covers(beyond, Window(0, 40), SPACE) == (True, True)
    assert covers(within, Window(0, 40), SPACE) == (False, False)


def test_an_estimate_without_intervals_is_not_judged() -> None:
    assert covers(WindowEstimate(None, Window(10, 20)), Window(10, 20), SPACE) is None
    assert covers(estimate_of([[10.0, 20.0]]), None, SPACE) is None


@pytest.mark.parametrize(
    ("measure", "of", "message"),
    [
        (f1, (TRUTH, ESTIMATE, SPACE), "the true window .* got 'WindowEstimate'; expected Window or None. The"),
        (f1, (SPACE, ESTIMATE, TRUTH), "the estimate .* got 'DesignSpace'; expected WindowEstimate or Window or None"),
        (f1, (ESTIMATE, TRUTH, None), "a design space is needed"),
        (covers, (TRUTH, ESTIMATE, SPACE), "the estimate .* got 'Window'; expected WindowEstimate. The estimate"),
        (covers, (ESTIMATE, (10, 20), SPACE), "the true window .* got 'tuple'"),
        (edge_error_ms, (TRUTH, ESTIMATE), "the true window .* got 'WindowEstimate'"),
        (edge_ranks, (ESTIMATE, None, SPACE, np.random.default_rng(0)), "the true window .* got 'NoneType'"),
    ],
)
def test_arguments_in_another_order_are_told_with_the_right_one(
    measure: Callable[..., object], of: tuple[Any, ...], message: str
) -> None:
    with pytest.raises(InvalidValueError, match=message):
        measure(*of)


def test_intervals_of_a_calibrated_posterior_cover_at_their_level() -> None:
    # 2000 draws: four standard errors of a share of 0.9 are 0.027.
    rng = np.random.default_rng(12)
    fine = DesignSpace(0, 40, step_ms=0.01, reference="impact")
    hits = []
    for _ in range(2000):
        middles = rng.normal((12.0, 28.0), 1.0)
        samples = rng.normal(middles, 1.0, (400, 2))
        start, end = rng.normal(middles, 1.0)
        hits.append(known(covers(estimate_of(samples), Window(start, end), fine)))
    np.testing.assert_allclose(np.mean(hits, axis=0), 0.9, atol=0.027)


@pytest.mark.parametrize(
    ("mean_f1", "expected"),
    [
        ([0.9, 0.95, 0.97], 1),
        ([0.1, 0.9, 0.95], 2),
        ([0.9, 0.1, 0.9], 3),
        ([0.9, 0.9, 0.1], None),
        ([0.9, math.nan, 0.9], 3),
        ([math.nan, math.nan], None),
        ([], None),
    ],
)
def test_a_criterion_lasts_from_the_trial_after_the_last_miss(mean_f1: list[float], expected: int | None) -> None:
    assert trials_to_criterion(mean_f1, 0.9) == expected


def test_the_ranks_of_edges_drawn_from_the_posterior_itself_are_uniform() -> None:
    # A coarse grid makes ties common. Kolmogorov-Smirnov on 4000 ranks: p < 0.0001 comes once in 10,000 seeds.
    rng = np.random.default_rng(5)
    space = DesignSpace(0, 100, reference="impact")
    ranks = []
    for _ in range(2000):
        edges = rng.integers((10, 50), (20, 60), size=(40, 2)).astype(float)
        estimate = WindowEstimate(probability=1.0, window=None, edge_samples_ms=edges[1:])
        ranks.append(edge_ranks(estimate, Window(*edges[0]), space, rng))
    assert scipy.stats.kstest(np.ravel(ranks), "uniform").pvalue > 1e-4


def test_an_edge_before_all_samples_ranks_first() -> None:
    estimate = WindowEstimate(probability=1.0, window=None, edge_samples_ms=np.tile([[50.0, math.inf]], (99, 1)))
    start, end = edge_ranks(estimate, Window(40, 60), DesignSpace(0, 100, reference="impact"), np.random.default_rng(0))
    assert start < 0.01
    assert end < 0.01
    _, end = edge_ranks(estimate, Window(40, 100), DesignSpace(0, 100, reference="impact"), np.random.default_rng(0))
    assert 0 < end < 1


def test_without_samples_a_rank_says_nothing() -> None:
    estimate = WindowEstimate(probability=None, window=None)
    rng = np.random.default_rng(2)
    ranks = [edge_ranks(estimate, Window(40, 60), DesignSpace(0, 100, reference="impact"), rng) for _ in range(500)]
    assert scipy.stats.kstest(np.ravel(ranks), "uniform").pvalue > 1e-3


def test_profiles_correlate_at_the_isis_that_they_share() -> None:
    own_ms, own_mv = [0.0, 10.0, 20.0, 30.0], [0.0, 1.0, 2.0, 3.0]
    found = profile_correlation(own_ms, own_mv, [5.0, 15.0, 25.0, 90.0], [1.0, 2.0, 3.0, -9.0])
    assert found.isis == 3
    assert found.r == pytest.approx(1.0)
    assert math.isnan(profile_correlation(own_ms, [1.0] * 4, own_ms, own_mv).r)


def test_profiles_that_share_no_isis_or_do_not_ascend_have_no_correlation() -> None:
    with pytest.raises(InvalidValueError, match="too few ISIs in common"):
        profile_correlation([0.0, 1.0, 2.0], [1.0, 2.0, 3.0], [5.0, 6.0, 7.0], [1.0, 2.0, 3.0])
    with pytest.raises(InvalidValueError, match="ISIs that ascend"):
        profile_correlation([0.0, 2.0, 1.0], [1.0, 2.0, 3.0], [0.0, 1.0, 2.0], [1.0, 2.0, 3.0])
