"""Information about the next MEP, against values worked out outcome by outcome."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from isiw.acquisition.information import Alternating, MutualInformation, WindowGain, mutual_information, window_gain
from isiw.acquisition.protocol import AcquisitionFunction, best_candidate
from isiw.models.protocol import Posterior, PredictsOutcomes, SamplesWindows, Tensor
from isiw.window import WindowEstimate

ROUNDING = 1e-5
ISIS_MS = torch.arange(4.0)

seeds = st.integers(0, 2**31)


@dataclass(frozen=True)
class HandMadePosterior:
    """A posterior of given samples."""

    weights: Tensor
    mass: Tensor
    masks: Tensor
    trials: int = 0

    def estimate(self, person: int = 0) -> WindowEstimate:
        raise NotImplementedError(person)

    def outcome_mass(self, isi_ms: Tensor) -> tuple[Tensor, Tensor]:
        assert len(isi_ms) == self.mass.shape[2]
        return self.weights, self.mass

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        assert len(isi_ms) == self.masks.shape[2]
        return self.masks


def some_posterior(seed: int, people: int = 2, samples: int = 5, isis: int = 4, outcomes: int = 3) -> HandMadePosterior:
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(samples), size=people)
    mass = rng.dirichlet(0.5 * np.ones(outcomes), size=(people, samples, isis))
    masks = rng.random((people, samples, isis)) < 0.5
    return HandMadePosterior(*(torch.tensor(x, dtype=torch.float32) for x in (weights, mass, masks)))


def mutual_information_by_divergence(weights: Tensor, mass: Tensor) -> np.ndarray:
    """Expected divergence of the posterior from the prior over the samples [nat]: the other side of the symmetry."""
    w, m = weights.double().numpy(), mass.double().numpy()
    people, samples, isis, outcomes = m.shape
    information = np.zeros((people, isis))
    for b, t, y in np.ndindex(people, isis, outcomes):
        evidence = sum(w[b, s] * m[b, s, t, y] for s in range(samples))
        for s in range(samples):
            posterior = w[b, s] * m[b, s, t, y] / evidence if evidence > 0 else 0.0
            if posterior > 0:
                information[b, t] += evidence * posterior * math.log(posterior / w[b, s])
    return information


def reduction_of_variance(weights: Tensor, mass: Tensor, masks: Tensor) -> np.ndarray:
    """Summed variance of membership now, less its expectation after the next MEP."""
    w, m, inside = (x.double().numpy() for x in (weights, mass, masks))
    people, _, isis, outcomes = m.shape
    gain = np.zeros((people, isis))
    for b, t in np.ndindex(people, isis):
        now = w[b] @ inside[b]
        gain[b, t] = np.sum(now * (1 - now))
        for y in range(outcomes):
            joint = w[b] * m[b, :, t, y]
            if joint.sum() > 0:
                after = joint / joint.sum() @ inside[b]
                gain[b, t] -= joint.sum() * np.sum(after * (1 - after))
    return gain


@given(seeds)
def test_mutual_information_is_the_expected_divergence_of_posterior_from_prior(seed: int) -> None:
    p = some_posterior(seed)
    expected = mutual_information_by_divergence(p.weights, p.mass)
    np.testing.assert_allclose(mutual_information(p.weights, p.mass), expected, atol=ROUNDING)


@given(seeds)
def test_window_gain_is_the_expected_reduction_of_summed_variance(seed: int) -> None:
    p = some_posterior(seed)
    expected = reduction_of_variance(p.weights, p.mass, p.masks)
    np.testing.assert_allclose(window_gain(p.weights, p.mass, p.masks), expected, atol=ROUNDING)


@given(seeds)
def test_nothing_is_expected_to_be_lost(seed: int) -> None:
    p = some_posterior(seed)
    assert (mutual_information(p.weights, p.mass) >= -ROUNDING).all()
    assert (window_gain(p.weights, p.mass, p.masks) >= -ROUNDING).all()


@given(seeds)
def test_an_outcome_that_does_not_depend_on_the_sample_says_nothing(seed: int) -> None:
    p = some_posterior(seed)
    same = p.mass[:, :1].expand_as(p.mass)
    assert mutual_information(p.weights, same).abs().max() < ROUNDING
    assert window_gain(p.weights, same, p.masks).abs().max() < ROUNDING


@given(seeds)
def test_mutual_information_is_at_most_the_entropy_of_the_samples(seed: int) -> None:
    p = some_posterior(seed)
    entropy = torch.special.entr(p.weights).sum(-1, keepdim=True)
    assert (mutual_information(p.weights, p.mass) <= entropy + ROUNDING).all()


def test_an_outcome_that_tells_the_samples_apart_says_all_there_is_to_know() -> None:
    weights = torch.tensor([[0.25, 0.75]])
    mass = torch.eye(2)[None, :, None, :]
    masks = torch.tensor([[[1.0, 1.0, 0.0], [1.0, 0.0, 0.0]]])
    entropy = -(0.25 * math.log(0.25) + 0.75 * math.log(0.75))
    assert mutual_information(weights, mass).item() == pytest.approx(entropy, abs=ROUNDING)
    # Only the second ISI is in doubt, with variance 0.25 (1 - 0.25).
    assert window_gain(weights, mass, masks).item() == pytest.approx(0.1875, abs=ROUNDING)


def test_a_window_that_is_known_has_nothing_to_gain_where_other_unknowns_have() -> None:
    p = some_posterior(1)
    known = p.masks[:, :1].expand_as(p.masks)
    assert window_gain(p.weights, p.mass, known).abs().max() < ROUNDING
    assert (mutual_information(p.weights, p.mass) > 0.01).all()


def test_a_sample_without_weight_does_not_count() -> None:
    p = some_posterior(2)
    weights = torch.cat((p.weights, torch.zeros(2, 1)), dim=1)
    mass, masks = (torch.cat((x, x[:, :1].flip(-1)), dim=1) for x in (p.mass, p.masks))
    torch.testing.assert_close(mutual_information(weights, mass), mutual_information(p.weights, p.mass))
    torch.testing.assert_close(window_gain(weights, mass, masks), window_gain(p.weights, p.mass, p.masks))


@given(seeds)
def test_people_are_scored_independently_of_each_other(seed: int) -> None:
    p = some_posterior(seed, people=3)
    one = slice(1, 2)
    for together, alone in (
        (mutual_information(p.weights, p.mass), mutual_information(p.weights[one], p.mass[one])),
        (window_gain(p.weights, p.mass, p.masks), window_gain(p.weights[one], p.mass[one], p.masks[one])),
    ):
        torch.testing.assert_close(together[one], alone)


def test_the_acquisition_functions_score_what_the_posterior_says() -> None:
    p = some_posterior(3)
    torch.testing.assert_close(MutualInformation()(p, ISIS_MS), mutual_information(p.weights, p.mass))
    torch.testing.assert_close(WindowGain()(p, ISIS_MS), window_gain(p.weights, p.mass, p.masks))


@pytest.mark.parametrize(("trials", "chosen"), [(0, WindowGain()), (1, MutualInformation()), (2, WindowGain())])
def test_alternating_asks_for_the_window_first_and_for_all_unknowns_next(
    trials: int, chosen: AcquisitionFunction
) -> None:
    p = replace(some_posterior(4), trials=trials)
    torch.testing.assert_close(Alternating()(p, ISIS_MS), chosen(p, ISIS_MS))


@pytest.mark.parametrize("acquisition", [MutualInformation(), WindowGain(), Alternating()])
def test_ours_are_acquisition_functions(acquisition: AcquisitionFunction) -> None:
    assert isinstance(acquisition, AcquisitionFunction)


def test_the_window_can_be_asked_for_only_where_windows_are_sampled() -> None:
    assert isinstance(some_posterior(0), Posterior)
    assert set(MutualInformation().needs) == {PredictsOutcomes}
    assert set(WindowGain().needs) == set(Alternating().needs) == {PredictsOutcomes, SamplesWindows}


def test_the_highest_score_wins_for_each_person() -> None:
    assert best_candidate(torch.tensor([[0.0, 2.0, 1.0], [5.0, -1.0, 0.0]])).tolist() == [1, 0]


@pytest.mark.parametrize("ties", [2, 101, 5000])
def test_a_tie_goes_to_the_first(ties: int) -> None:
    assert best_candidate(torch.zeros(1, ties)).tolist() == [0]
    assert best_candidate(torch.cat((torch.zeros(1, 3), torch.ones(1, ties)), dim=1)).tolist() == [3]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_score_that_is_not_finite_loses(bad: float) -> None:
    assert best_candidate(torch.tensor([[bad, -1e30, bad, -5.0]])).tolist() == [3]
