"""Two steps ahead, against enumeration of both outcomes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from acquisition.hand_made import ISIS_MS, HandMadePosterior, some_posterior, summed_variance
from isiw.acquisition.information import WindowGain
from isiw.acquisition.twostep import TwoStep
from isiw.errors import InvalidValueError

seeds = st.integers(0, 2**31)
GROUPS = 50
"""So many that no two outcomes share one, unless one of them is as good as impossible."""


def enumerated(posterior: HandMadePosterior) -> np.ndarray:
    """Expected loss of variance after the best second trial that follows each first outcome."""
    mass, masks = posterior.mass.astype(float), posterior.masks.astype(float)

    def after(weights: np.ndarray, b: int, t: int, depth: int) -> float:
        left = 0.0
        for y in range(mass.shape[3]):
            joint = weights * mass[b, :, t, y]
            if joint.sum() > 0:
                left += joint.sum() * least(joint / joint.sum(), b, depth - 1)
        return left

    def least(weights: np.ndarray, b: int, depth: int) -> float:
        if depth == 0:
            return summed_variance(weights, masks[b])
        return min(after(weights, b, t, depth) for t in range(mass.shape[2]))

    equal = np.full(mass.shape[1], 1 / mass.shape[1])
    now = [summed_variance(equal, masks[b]) for b in range(mass.shape[0])]
    return np.array([[now[b] - after(equal, b, t, 2) for t in range(mass.shape[2])] for b in range(mass.shape[0])])


@pytest.mark.slow
@given(seeds)
def test_two_steps_are_those_of_an_enumeration(seed: int) -> None:
    p = some_posterior(seed)
    assume(p.mass.mean(1).min() > 1 / GROUPS)
    got = TwoStep(shortlist=4, groups=GROUPS, stride=1)(p, ISIS_MS)
    np.testing.assert_allclose(got, enumerated(p), atol=2e-5)


@pytest.mark.slow
@given(seeds)
def test_a_second_trial_never_costs(seed: int) -> None:
    p = some_posterior(seed, outcomes=6)
    assert bool((TwoStep()(p, ISIS_MS) >= WindowGain()(p, ISIS_MS) - 1e-6).all())


def test_candidates_off_the_shortlist_keep_their_own_gain() -> None:
    p = some_posterior(3)
    one, two = WindowGain()(p, ISIS_MS), TwoStep(shortlist=1)(p, ISIS_MS)
    assert (np.abs(two - one) > 1e-6).sum(-1).tolist() == [1, 1]
    assert (two - one).argmax(-1).tolist() == one.argmax(-1).tolist()


@pytest.mark.parametrize("wrong", [{"shortlist": 0}, {"groups": 0}, {"stride": 0}])
def test_numbers_count_from_one(wrong: dict[str, int]) -> None:
    with pytest.raises(InvalidValueError, match="whole number of at least 1"):
        TwoStep(**wrong)
