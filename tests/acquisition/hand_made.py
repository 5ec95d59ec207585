"""A posterior of given samples, and what follows from them outcome by outcome."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from isiw.estimate import WindowEstimate
from isiw.types import Array

Score: TypeAlias = Callable[["HandMadePosterior", Array], Array]
"""Scores ISIs [ms] (shape (t,)) for each person, shape (b, t)."""

ISIS_MS = np.arange(4.0)


@dataclass(frozen=True)
class HandMadePosterior:
    """A posterior of given samples: predictions (b, s, t, y), windows and profiles (b, s, t), baselines (b, s)."""

    mass: Array
    masks: Array
    profiles: Array
    baselines: Array
    trials: int = 0

    def estimate(self, person: int = 0) -> WindowEstimate:
        raise NotImplementedError(person)

    def outcome_mass(self, isi_ms: Array) -> Array:
        assert len(isi_ms) == self.mass.shape[2]
        return self.mass

    def window_masks(self, isi_ms: Array) -> Array:
        assert len(isi_ms) == self.masks.shape[2]
        return self.masks

    def profiles_mv(self, isi_ms: Array) -> Array:
        assert len(isi_ms) == self.profiles.shape[2]
        return self.profiles

    def baselines_mv(self) -> Array:
        return self.baselines

    def of(self, person: int) -> HandMadePosterior:
        one = slice(person, person + 1)
        return HandMadePosterior(self.mass[one], self.masks[one], self.profiles[one], self.baselines[one], self.trials)


def some_posterior(seed: int, people: int = 2, samples: int = 5, isis: int = 4, outcomes: int = 3) -> HandMadePosterior:
    rng = np.random.default_rng(seed)
    drawn = (
        rng.dirichlet(0.5 * np.ones(outcomes), size=(people, samples, isis)),
        rng.random((people, samples, isis)) < 0.5,
        rng.lognormal(size=(people, samples, isis)),
        0.1 * rng.random((people, samples)),
    )
    mass, masks, profiles, baselines = (x.astype(np.float32) for x in drawn)
    return HandMadePosterior(mass, masks, profiles, baselines)


def summed_variance(weights: np.ndarray, values: np.ndarray) -> float:
    """Of weights (s,) and values (s, g), over the g."""
    return float(np.sum(weights @ values**2 - (weights @ values) ** 2))


def expected_gain(mass: Array, values: Array, loss: Callable[[np.ndarray, np.ndarray], float]) -> np.ndarray:
    """Loss of the samples' weights now, less what is expected of it after the next MEP, shape (b, t).

    Args:
        mass: shape (b, s, t, y).
        values: of each sample, shape (b, s, g).
        loss: of weights (s,) and values (s, g).
    """
    m, v = mass.astype(float), values.astype(float)
    people, samples, isis, outcomes = m.shape
    gain = np.zeros((people, isis))
    for b, t in np.ndindex(people, isis):
        gain[b, t] = loss(np.full(samples, 1 / samples), v[b])
        for y in range(outcomes):
            joint = m[b, :, t, y] / samples
            if joint.sum() > 0:
                gain[b, t] -= joint.sum() * loss(joint / joint.sum(), v[b])
    return gain
