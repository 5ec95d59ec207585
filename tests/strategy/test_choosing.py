"""The ISI that an acquisition function chooses, for several people side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from isiw.acquisition.fixed import EvenSpacing
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import StrategyError
from isiw.models.protocol import Posterior
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.choice import Choice, best_choices, candidate_isis, evenly_spaced
from isiw.types import Array

FIVE = DesignSpace(0, 4, reference="impact")


@dataclass(frozen=True)
class Scores:
    """An acquisition function that gives the same scores whatever the posterior."""

    values: Array
    needs: tuple[type, ...] = ()

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        del posterior, isi_ms
        return self.values


@pytest.fixture
def three() -> Posterior:
    """Three people of whom nothing is known."""
    return make_strategy("pf", particles=4).model.begin(VALVE_SPACE, seed=0, people=3)


@pytest.mark.parametrize(
    "space",
    [
        VALVE_SPACE,
        IMPACT_SPACE,
        DesignSpace(0, 1, reference="impact"),
        DesignSpace(-20, 30, step_ms=0.1, reference="impact"),
    ],
)
def test_candidates_are_few_evenly_spaced_and_hold_both_ends(space: DesignSpace) -> None:
    candidates = candidate_isis(space).astype(float)
    assert len(candidates) <= 101
    assert (candidates[0], candidates[-1]) == pytest.approx((space.low_ms, space.high_ms))
    steps = np.diff(candidates)
    np.testing.assert_allclose(steps[:-1], steps[0], rtol=1e-4)
    assert 0 < steps[-1] <= steps[0] * (1 + 1e-4)


@pytest.mark.parametrize(
    "scores", [np.arange(3.0), np.array(1.0), np.zeros((3, 6)), np.zeros((2, 5)), np.zeros((1, 3, 5))]
)
def test_each_isi_has_a_score(three: Posterior, scores: Array) -> None:
    with pytest.raises(StrategyError, match=r"Scores.* shape \(5,\)"):
        best_choices(three, Scores(scores), FIVE, told=2, people=3)


@pytest.mark.parametrize("scores", [None, ["high"] * 5])
def test_scores_are_numbers(three: Posterior, scores: Any) -> None:
    with pytest.raises(StrategyError, match=r"numbers of shape \(5,\)"):
        best_choices(three, Scores(scores), FIVE, told=2, people=3)


def test_an_acquisition_function_that_writes_into_the_isis_spoils_no_other_ask(three: Posterior) -> None:
    class Writes(Scores):
        def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
            isi_ms *= 0.0
            return super().__call__(posterior, isi_ms)

    best_choices(three, Writes(np.zeros(5)), FIVE, told=2, people=3)
    assert candidate_isis(FIVE).tolist() == FIVE.grid_ms.tolist()


@pytest.mark.parametrize("name", ["default", "supra-threshold", "gp-straddle", "parametric-window"])
def test_what_a_posterior_hands_out_can_be_written_into_without_changing_it(name: str) -> None:
    strategy = make_strategy(name, VALVE_SPACE, seed=1)
    for isi_ms in (60.0, 240.0, 250.0):
        strategy.tell(isi_ms, 0.1)
    posterior: Any = strategy.posterior
    few_ms = VALVE_SPACE.grid_ms[::20].astype(np.float32)
    handed_out = [posterior.baselines_mv, lambda: posterior.profiles_mv(few_ms)]
    handed_out += [lambda: posterior.window_masks(few_ms), lambda: posterior.outcome_mass(few_ms)]
    for hand_out in handed_out:
        before = hand_out().copy()
        hand_out()[...] = -1.0
        assert np.array_equal(hand_out(), before)


def test_each_person_is_asked_what_scores_best_and_falls_back_alone(three: Posterior) -> None:
    nan = math.nan
    scores = Scores(np.array([[0.0, 1, 0, 0, 0], [nan, nan, nan, nan, nan], [nan, 0, 0, 0, 2.0]]))
    first, second, third = best_choices(three, scores, FIVE, told=2, people=3)
    assert (first, third) == (Choice(1.0), Choice(4.0))
    assert second.isi_ms == evenly_spaced(FIVE, 2)
    assert "Scores gives no ISI a finite score" in (second.fallback or "")


def test_scores_that_are_the_same_for_all_are_everybodys(three: Posterior) -> None:
    choices = best_choices(three, EvenSpacing(), VALVE_SPACE, told=0, people=3)
    assert choices == (Choice(evenly_spaced(VALVE_SPACE, 0)),) * 3
