"""Level sets: where it is least clear on which side of the edge's level an ISI lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acquisition.hand_made import ISIS_MS, HandMadePosterior, expected_gain, some_posterior
from isiw.acquisition.levelset import IntegratedFeasibility, Straddle, expected_feasibility
from isiw.errors import InvalidValueError
from isiw.types import Array

seeds = st.integers(0, 2**31)


def margins_of(p: HandMadePosterior) -> Array:
    excess = p.profiles - p.baselines[..., None]
    margins: Array = excess - 0.135 * excess.max(-1, keepdims=True).clip(0)
    return margins


@pytest.mark.parametrize(("mean", "sd"), [(0.0, 1.0), (0.5, 1.0), (-2.0, 0.7), (3.0, 1.2), (0.1, 5.0)])
def test_expected_feasibility_is_that_of_a_gaussian_margin(mean: float, sd: float) -> None:
    # Quadrature over twelve SDs on either side.
    x = np.linspace(mean - 12 * sd, mean + 12 * sd, 200_001)
    density = np.exp(-0.5 * ((x - mean) / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    expected = np.trapezoid(np.clip(2 * sd - np.abs(x), 0, None) * density, x)
    ours = expected_feasibility(np.array(mean), np.array(sd))
    assert ours.item() == pytest.approx(expected, abs=1e-6)


@given(seeds)
def test_the_straddle_is_how_far_the_interval_reaches_across_the_level(seed: int) -> None:
    p = some_posterior(seed)
    margins = margins_of(p)
    expected = 1.5 * margins.std(axis=1) - np.abs(margins.mean(axis=1))
    np.testing.assert_allclose(Straddle(1.5)(p, ISIS_MS), expected, atol=1e-4, rtol=1e-4)


@given(seeds)
def test_the_integrated_feasibility_is_expected_to_fall_by_so_much(seed: int) -> None:
    p = some_posterior(seed)

    def summed_feasibility(weights: np.ndarray, margins: np.ndarray) -> float:
        mean = weights @ margins
        sd = np.sqrt(np.clip(weights @ margins**2 - mean**2, 0, None))
        return float(expected_feasibility(mean, sd).sum())

    expected = expected_gain(p.mass, margins_of(p), summed_feasibility)
    np.testing.assert_allclose(IntegratedFeasibility()(p, ISIS_MS), expected, atol=2e-3, rtol=1e-2)


def test_the_interval_reaches_furthest_where_the_sign_of_the_margin_is_least_clear() -> None:
    p = some_posterior(0, people=1, samples=2)
    # Both samples agree on a peak of 1 at the last ISI; at the second they disagree about the edge's level of 0.135.
    profiles = np.array([[[0.0, 0.035, 0.6, 1.0], [0.0, 0.235, 0.6, 1.0]]])
    scores = Straddle()(replace(p, profiles=profiles, baselines=np.zeros((1, 2))), ISIS_MS)
    assert scores.argmax().item() == 1


@pytest.mark.parametrize("kind", [Straddle, IntegratedFeasibility])
def test_a_width_that_is_not_positive_is_refused(kind: type[Straddle | IntegratedFeasibility]) -> None:
    with pytest.raises(InvalidValueError, match="above 0"):
        kind(0.0)
