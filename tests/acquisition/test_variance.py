"""Variances that the next MEP is expected to reduce, against values worked out outcome by outcome."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from acquisition.hand_made import ISIS_MS, expected_gain, some_posterior, summed_variance
from isiw.acquisition.variance import EdgeVariance, IntegratedVariance, ProfileVariance

ROUNDING = 1e-4
seeds = st.integers(0, 2**31)


def variance_of_edges(weights: np.ndarray, masks: np.ndarray) -> float:
    """Summed variance of both edges given a window, weighted by the probability that there is one."""
    found = masks.any(1)
    if not weights[found].sum() > 0:
        return 0.0
    edges = np.array([[np.flatnonzero(mask)[0], np.flatnonzero(mask)[-1]] for mask in masks[found]], dtype=float)
    share = weights[found].sum()
    return float(share) * summed_variance(weights[found] / share, edges)


@given(seeds)
def test_the_profiles_variance_is_that_of_its_samples(seed: int) -> None:
    p = some_posterior(seed)
    np.testing.assert_allclose(ProfileVariance()(p, ISIS_MS), p.profiles.var(axis=1), rtol=1e-4)


@given(seeds)
def test_the_integrated_variance_is_expected_to_fall_by_so_much(seed: int) -> None:
    p = some_posterior(seed)
    expected = expected_gain(p.mass, p.profiles, summed_variance)
    np.testing.assert_allclose(IntegratedVariance()(p, ISIS_MS), expected, rtol=1e-3, atol=ROUNDING)


@given(seeds)
def test_the_edges_variance_is_expected_to_fall_by_so_much(seed: int) -> None:
    p = some_posterior(seed)
    expected = expected_gain(p.mass, p.masks, variance_of_edges)
    np.testing.assert_allclose(EdgeVariance()(p, ISIS_MS), expected, atol=ROUNDING)


def test_where_no_sample_has_a_window_no_isi_is_better_than_another() -> None:
    p = some_posterior(1)
    scores = EdgeVariance()(replace(p, masks=np.zeros_like(p.masks)), ISIS_MS)
    assert scores.tolist() == [[0.0] * 4] * 2
