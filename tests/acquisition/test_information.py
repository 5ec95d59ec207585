"""Information about the next MEP, against values worked out outcome by outcome."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acquisition.hand_made import ISIS_MS, HandMadePosterior, Score, expected_gain, some_posterior, summed_variance
from isiw.acquisition.information import Alternating, MutualInformation, WindowGain, WindowInformation
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.design import VALVE_SPACE
from isiw.errors import InvalidValueError
from isiw.models.particles import ParticleModel
from isiw.models.protocol import Observation, Posterior, PredictsOutcomes, SamplesWindows
from isiw.types import Array

ROUNDING = 1e-5
ALL = [MutualInformation(), WindowGain(), WindowInformation()]

seeds = st.integers(0, 2**31)


def entropy(weights: np.ndarray) -> float:
    positive = weights[weights > 0]
    return float(-np.sum(positive * np.log(positive)))


@given(seeds)
def test_mutual_information_is_what_the_entropy_of_the_samples_is_expected_to_lose(seed: int) -> None:
    p = some_posterior(seed)
    expected = expected_gain(p.mass, p.masks, lambda weights, _values: entropy(weights))
    np.testing.assert_allclose(MutualInformation()(p, ISIS_MS), expected, atol=ROUNDING)


@given(seeds)
def test_window_gain_is_the_expected_reduction_of_summed_variance(seed: int) -> None:
    p = some_posterior(seed)
    np.testing.assert_allclose(WindowGain()(p, ISIS_MS), expected_gain(p.mass, p.masks, summed_variance), atol=ROUNDING)


@dataclass(frozen=True)
class WithDepression(HandMadePosterior):
    """The same with depressed segments: all ISIs that are not in the window."""

    def depressed_masks(self, isi_ms: Array) -> Array:
        return 1.0 - self.window_masks(isi_ms)


def test_depressed_segments_count_as_much_as_the_window() -> None:
    p = some_posterior(4)
    both = WithDepression(p.mass, p.masks, p.profiles, p.baselines)
    # What is not in the window varies exactly as what is.
    np.testing.assert_allclose(WindowGain()(both, ISIS_MS), 2.0 * WindowGain()(p, ISIS_MS), rtol=1e-4)


@given(seeds)
def test_window_information_is_what_the_entropy_of_distinct_windows_is_expected_to_lose(seed: int) -> None:
    # As many cells as samples tell any two windows apart that differ in an edge.
    p = some_posterior(seed)

    def entropy_of_windows(weights: np.ndarray, masks: np.ndarray) -> float:
        share: dict[object, float] = {}
        for weight, mask in zip(weights, masks > 0, strict=True):
            inside = np.flatnonzero(mask)
            window = (inside[0], inside[-1]) if len(inside) else None
            share[window] = share.get(window, 0.0) + weight
        return entropy(np.array(list(share.values())))

    expected = expected_gain(p.mass, p.masks, entropy_of_windows)
    np.testing.assert_allclose(WindowInformation(cells=5)(p, ISIS_MS), expected, atol=ROUNDING)


@given(seeds)
def test_the_window_is_never_more_informative_than_everything(seed: int) -> None:
    p = some_posterior(seed, samples=12)
    assert (WindowInformation(cells=3)(p, ISIS_MS) <= MutualInformation()(p, ISIS_MS) + ROUNDING).all()


@pytest.mark.parametrize("score", ALL)
@given(seed=seeds)
def test_nothing_is_expected_to_be_lost(score: Score, seed: int) -> None:
    assert (score(some_posterior(seed), ISIS_MS) >= -ROUNDING).all()


@pytest.mark.parametrize("score", ALL)
@given(seed=seeds)
def test_an_outcome_that_does_not_depend_on_the_sample_says_nothing(score: Score, seed: int) -> None:
    p = some_posterior(seed)
    assert np.abs(score(replace(p, mass=np.repeat(p.mass[:, :1], 5, axis=1)), ISIS_MS)).max() < ROUNDING


@given(seeds)
def test_mutual_information_is_at_most_the_entropy_of_the_samples(seed: int) -> None:
    assert (MutualInformation()(some_posterior(seed, samples=5), ISIS_MS) <= math.log(5) + ROUNDING).all()


def test_an_outcome_that_tells_the_samples_apart_says_all_there_is_to_know() -> None:
    masks = np.array([[[1.0, 1.0], [1.0, 0.0]]])
    mass = np.repeat(np.eye(2)[None, :, None, :], 2, axis=2)
    p, isis_ms = HandMadePosterior(mass, masks, masks, masks[..., 0]), np.arange(2.0)
    assert MutualInformation()(p, isis_ms)[0, 0].item() == pytest.approx(math.log(2), abs=ROUNDING)
    assert WindowInformation()(p, isis_ms)[0, 0].item() == pytest.approx(math.log(2), abs=ROUNDING)
    # Only the second ISI is in doubt, with variance 0.5 (1 - 0.5).
    assert WindowGain()(p, isis_ms)[0, 0].item() == pytest.approx(0.25, abs=ROUNDING)


def test_a_window_that_is_known_has_nothing_to_gain_where_other_unknowns_have() -> None:
    p = some_posterior(1)
    known = replace(p, masks=np.repeat(p.masks[:, :1], 5, axis=1))
    assert np.abs(WindowGain()(known, ISIS_MS)).max() < ROUNDING
    assert np.abs(WindowInformation()(known, ISIS_MS)).max() < ROUNDING
    assert (MutualInformation()(known, ISIS_MS) > 0.01).all()


@pytest.mark.parametrize("score", ALL)
@given(seed=seeds)
def test_people_are_scored_independently_of_each_other(score: Score, seed: int) -> None:
    p = some_posterior(seed, people=3)
    np.testing.assert_allclose(score(p, ISIS_MS)[1:2], score(p.of(1), ISIS_MS), atol=ROUNDING, rtol=ROUNDING)


@pytest.mark.parametrize(("trials", "chosen"), [(0, WindowGain()), (1, MutualInformation()), (2, WindowGain())])
def test_alternating_asks_for_the_window_first_and_for_all_unknowns_next(
    trials: int, chosen: AcquisitionFunction
) -> None:
    p = replace(some_posterior(4), trials=trials)
    np.testing.assert_array_equal(Alternating()(p, ISIS_MS), chosen(p, ISIS_MS))


@pytest.mark.parametrize(("pairs", "chosen"), [(0, WindowGain()), (1, MutualInformation()), (2, WindowGain())])
def test_alternating_takes_turns_by_pairs_also_where_each_is_followed_by_tms_alone(
    pairs: int, chosen: AcquisitionFunction
) -> None:
    model = ParticleModel(particles=50)
    posterior = model.begin(VALVE_SPACE, 1)
    for _ in range(pairs):
        posterior = model.update(posterior, Observation.of([100.0], [0.05]))
        posterior = model.update(posterior, Observation.of([None], [0.02]))
    isi_ms = np.arange(0.0, 300.0, 50.0, dtype=np.float32)
    np.testing.assert_array_equal(Alternating()(posterior, isi_ms), chosen(posterior, isi_ms))


@pytest.mark.parametrize("score", [MutualInformation(), WindowGain()])
@pytest.mark.parametrize("which", ["as it is", "as usual", "at an intensity"])
def test_what_a_posterior_foresees_by_itself_is_scored_as_its_distributions(
    which: str, score: MutualInformation | WindowGain
) -> None:
    model = ParticleModel(particles=100, thinned=30)
    posterior = model.update(model.begin(VALVE_SPACE, 0, people=2), Observation.of([60.0, 90.0], [0.3, 0.05]))
    posterior = posterior if which == "as it is" else posterior.as_usual
    posterior = posterior.at_intensity(10.0).posterior if which == "at an intensity" else posterior
    given: Any = SimpleNamespace(outcome_mass=posterior.outcome_mass, window_masks=posterior.window_masks)
    isi_ms = VALVE_SPACE.grid_ms[::9]
    assert score(posterior, isi_ms) == pytest.approx(score(given, isi_ms), rel=2e-5)


def test_the_window_can_be_asked_for_only_where_windows_are_sampled() -> None:
    assert isinstance(some_posterior(0), Posterior)
    assert set(MutualInformation().needs) == {PredictsOutcomes}
    for acquisition in (WindowGain(), WindowInformation(), Alternating()):
        assert set(acquisition.needs) == {PredictsOutcomes, SamplesWindows}


def test_a_single_cell_would_tell_nothing_and_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="at least 2"):
        WindowInformation(cells=1)
