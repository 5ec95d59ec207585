"""Designs that do not look at the responses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.acquisition.fixed import EvenSpacing, IncrementalSweep, OwnProposal, RandomIsi, SobolIsi
from isiw.acquisition.protocol import AcquisitionFunction, FollowsPlan, best_candidate, golden_index
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.models.protocol import ProposesIsi
from isiw.types import Array

CANDIDATES = 101
ISIS_MS = np.linspace(0.0, 500.0, CANDIDATES, dtype=np.float32)


@dataclass(frozen=True)
class CountingPosterior:
    """Knows how many trials there were, and nothing else."""

    trials: int

    def estimate(self, person: int = 0) -> WindowEstimate:
        raise NotImplementedError(person)


def picks(acquisition: AcquisitionFunction, trials: int) -> list[int]:
    return [int(best_candidate(acquisition(CountingPosterior(trial), ISIS_MS))[0]) for trial in range(trials)]


@given(st.integers(0, 100_000), st.integers(1, 2000))
def test_the_even_order_stays_among_the_candidates(trial: int, candidates: int) -> None:
    assert 0 <= golden_index(trial, candidates) < candidates


def test_the_even_order_starts_in_the_middle() -> None:
    assert picks(EvenSpacing(), 1) == [CANDIDATES // 2]


@pytest.mark.parametrize("trials", [5, 13, 40, 80])
def test_the_even_order_leaves_no_gap_much_wider_than_an_even_one(trials: int) -> None:
    # Three-distance theorem: no gap exceeds phi^2 = 2.62 times the mean; one candidate is granted for rounding.
    visited = sorted(picks(EvenSpacing(), trials))
    gaps = np.diff([visited[-1] - CANDIDATES, *visited])
    assert gaps.max() <= 2.62 * CANDIDATES / trials + 1


def test_the_even_order_comes_to_every_candidate() -> None:
    assert set(picks(EvenSpacing(), 2 * CANDIDATES)) == set(range(CANDIDATES))


def test_the_random_order_is_uniform_over_the_candidates() -> None:
    # 4040 draws of 101 candidates: chi-square beyond the 0.9999 quantile comes in 1 of 10,000 seeds.
    counts = np.bincount(picks(RandomIsi(seed=3), 40 * CANDIDATES), minlength=CANDIDATES)
    assert np.sum((counts - 40) ** 2 / 40) < 161.3


def test_the_random_order_depends_on_its_seed_alone() -> None:
    assert picks(RandomIsi(1), 20) == picks(RandomIsi(1), 20) != picks(RandomIsi(2), 20)


def test_each_random_trial_is_a_new_draw() -> None:
    order = np.array(picks(RandomIsi(1), 1000))
    assert abs(np.corrcoef(order[1:], order[:-1])[0, 1]) < 4 / math.sqrt(1000)


@pytest.mark.parametrize("acquisition", [EvenSpacing(), RandomIsi(7), SobolIsi(7)])
def test_one_isi_is_scored_1_and_the_others_0(acquisition: AcquisitionFunction) -> None:
    scores = acquisition(CountingPosterior(3), ISIS_MS)
    assert scores.shape == (1, CANDIDATES)
    assert sorted(scores[0].tolist()) == [0.0] * (CANDIDATES - 1) + [1.0]


@pytest.mark.parametrize("acquisition", [EvenSpacing(), RandomIsi(), SobolIsi(), IncrementalSweep()])
def test_a_design_needs_nothing_of_the_posterior(acquisition: AcquisitionFunction) -> None:
    assert acquisition.needs == ()


@pytest.mark.parametrize("trials", [8, 16, 32])
def test_the_sobol_order_has_one_isi_in_each_of_as_many_equal_parts(trials: int) -> None:
    isis_ms = np.arange(128.0, dtype=np.float32)
    order = [int(SobolIsi(3)(CountingPosterior(trial), isis_ms).argmax()) for trial in range(trials)]
    assert {index * trials // 128 for index in order} == set(range(trials))


def test_the_sweep_stays_at_each_isi_for_its_trials_and_begins_again_at_the_end() -> None:
    order = picks(IncrementalSweep(step_ms=100.0, trials_per_isi=3), 21)
    assert order == [k for k in (0, 20, 40, 60, 80, 100, 0) for _ in range(3)]


def test_a_sweep_stays_at_one_isi_where_its_stops_lie_between_those_of_the_space() -> None:
    isis_ms = np.arange(0.0, 40.1, 4.0, dtype=np.float32)
    order = [int(IncrementalSweep(10.0, 3)(CountingPosterior(trial), isis_ms).argmax()) for trial in range(15)]
    assert [order.count(index) for index in sorted(set(order))] == [3, 3, 3, 3, 3]


@pytest.mark.parametrize(
    ("space", "step_ms", "asked_ms"),
    [
        (DesignSpace(0, 320, reference="impact"), 5.0, [0.0, 5.0, 10.0, 15.0, 20.0]),
        (DesignSpace(0, 320, reference="impact"), 2.0, [0.0, 2.0, 4.0, 6.0, 8.0]),
        (DesignSpace(0, 30, step_ms=10, reference="impact"), 5.0, [0.0, 10.0, 20.0, 30.0, 0.0]),
        (DesignSpace(0, 40, step_ms=4, reference="impact"), 10.0, [0.0, 12.0, 24.0, 36.0, 0.0]),
    ],
)
def test_a_sweep_is_planned_on_the_grid_of_the_space(space: DesignSpace, step_ms: float, asked_ms: list[float]) -> None:
    sweep = IncrementalSweep(step_ms, trials_per_isi=3)
    assert isinstance(sweep, FollowsPlan)
    planned_ms = [sweep.planned_isi_ms(space, pairs) for pairs in range(15)]
    assert planned_ms == [isi_ms for isi_ms in asked_ms for _ in range(3)]


@pytest.mark.parametrize(("low_ms", "high_ms", "step_ms"), [(100, 109, 0.3), (0, 1.3, 0.1), (10, 17, 0.1), (0, 8, 0.4)])
def test_a_sweep_comes_to_the_last_isi_of_a_range_of_whole_steps(low_ms: float, high_ms: float, step_ms: float) -> None:
    stops, sweep = round((high_ms - low_ms) / step_ms) + 1, IncrementalSweep(step_ms, trials_per_isi=1)
    space = DesignSpace(low_ms, high_ms, step_ms=step_ms, reference="impact")
    assert [sweep.planned_isi_ms(space, pairs) for pairs in range(stops)] == space.grid_ms.tolist()
    isis_ms = space.grid_ms.astype(np.float32)
    assert [int(sweep(CountingPosterior(trial), isis_ms).argmax()) for trial in range(stops)] == list(range(stops))


@pytest.mark.parametrize("settings", [{"step_ms": 0.0}, {"trials_per_isi": 0}])
def test_a_sweep_without_step_or_trials_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="IncrementalSweep"):
        IncrementalSweep(**settings)


class Planner(CountingPosterior):
    """Wants two ISIs."""

    def proposed_isis_ms(self) -> Array:
        return np.array([[253.0, 10.0], [6.0, 400.0]])


def test_what_the_method_wants_first_is_asked_as_nearly_as_can_be() -> None:
    planner = Planner(0)
    assert isinstance(planner, ProposesIsi)
    assert ISIS_MS[best_candidate(OwnProposal()(planner, ISIS_MS))].tolist() == [255.0, 5.0]
