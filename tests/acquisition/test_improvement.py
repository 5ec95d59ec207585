"""The best ISI alone: improvement, bounds, samples and knowledge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acquisition.hand_made import ISIS_MS, expected_gain, some_posterior
from isiw.acquisition.improvement import KnowledgeGradient, LogExpectedImprovement, Thompson, UpperConfidenceBound
from isiw.errors import InvalidValueError

seeds = st.integers(0, 2**31)


@given(seeds)
def test_log_improvement_is_the_logarithm_of_the_mean_improvement_over_the_best_mean(seed: int) -> None:
    p = some_posterior(seed, samples=50)
    profiles = p.profiles.astype(float)
    best = profiles.mean(axis=1).max(axis=-1)
    improvement = np.clip(profiles - best[:, None, None], 0, None).mean(axis=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("isiw.acquisition.improvement.SOFTNESS", 1e-4)
        ours = np.exp(LogExpectedImprovement()(p, ISIS_MS))
    np.testing.assert_allclose(ours, improvement, rtol=0.01, atol=1e-3)


def test_far_below_the_best_nearer_still_scores_higher_and_finite() -> None:
    p = some_posterior(0, people=1, samples=2)
    profiles = np.array([[[1.0, 2.0, 3.0, 1e4], [1.0, 2.0, 3.0, 1.1e4]]])
    scores = LogExpectedImprovement()(replace(p, profiles=profiles), ISIS_MS)[0]
    assert np.isfinite(scores).all()
    assert scores.tolist() == sorted(scores.tolist())


@given(seeds)
def test_the_bound_is_mean_and_so_many_sds(seed: int) -> None:
    p = some_posterior(seed)
    profiles = p.profiles
    expected = profiles.mean(axis=1) + 1.5 * profiles.std(axis=1)
    np.testing.assert_allclose(UpperConfidenceBound(1.5)(p, ISIS_MS), expected, rtol=1e-4)


@given(seeds)
def test_thompson_scores_by_one_of_the_samples_of_each_person(seed: int) -> None:
    p = some_posterior(seed)
    scores = Thompson(3)(p, ISIS_MS)
    for person in range(2):
        assert scores[person].tolist() in p.profiles[person].tolist()
    np.testing.assert_array_equal(scores, Thompson(3)(p, ISIS_MS))


def test_thompson_takes_every_sample_in_the_course_of_time() -> None:
    p = some_posterior(1, people=1)
    taken = {tuple(Thompson()(replace(p, trials=n), ISIS_MS)[0].tolist()) for n in range(60)}
    assert taken == {tuple(row) for row in p.profiles[0].tolist()}


@given(seeds)
def test_the_knowledge_gradient_is_what_the_best_mean_is_expected_to_gain(seed: int) -> None:
    p = some_posterior(seed)
    expected = expected_gain(p.mass, p.profiles, lambda weights, profiles: -float((weights @ profiles).max()))
    np.testing.assert_allclose(KnowledgeGradient()(p, ISIS_MS), expected, rtol=1e-3, atol=1e-4)


def test_a_negative_width_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="at least 0"):
        UpperConfidenceBound(-1.0)
