"""Acquisition functions that seek only the best ISI: where the expected MEP is largest.

Expected improvement on the logarithmic scale [Ament2023], upper confidence bound [Srinivas2010], Thompson sampling
[Thompson1933] and knowledge gradient [Frazier2008].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Protocol

import numpy as np

from isiw.acquisition.protocol import ForeseesProfiles
from isiw.acquisition.twostep import lookahead
from isiw.checks import Checked, NonNegative
from isiw.lazy import scipy
from isiw.models.protocol import Posterior, PredictsOutcomes, SamplesProfiles
from isiw.types import Array


class _CountedProfiles(Posterior, SamplesProfiles, Protocol):
    """A posterior of profiles that knows how many trials there were."""


SOFTNESS: Final = 0.01
"""Width of the hinge at the best posterior mean, as a share of the largest SD; it tells near from far below."""


@dataclass(frozen=True)
class LogExpectedImprovement:
    """Log expected improvement over the best posterior mean."""

    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Array) -> Array:
        """Log expected improvement of the expected MEP [log mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        best = profiles.mean(axis=1).max(axis=-1)[:, None, None]
        scale = np.maximum(SOFTNESS * profiles.std(axis=1).max(axis=-1), 1e-9)[:, None, None]
        steps = (profiles - best) / scale
        # log softplus(x) is x itself far below the hinge, where softplus would underflow.
        log_hinge = np.where(steps < -15.0, steps, np.log(np.logaddexp(0.0, np.maximum(steps, -15.0))))
        score: Array = scipy.special.logsumexp(log_hinge, axis=1, b=1.0 / profiles.shape[1]) + np.log(scale[..., 0])
        return score


@dataclass(frozen=True)
class UpperConfidenceBound(Checked):
    """Posterior mean and some SDs.

    Args:
        width_sd: how many SDs; larger explores more.
    """

    width_sd: NonNegative = 2.0
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Array) -> Array:
        """The upper bound of the expected MEP [mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        bound: Array = profiles.mean(axis=1) + self.width_sd * profiles.std(axis=1)
        return bound


@dataclass(frozen=True)
class Thompson:
    """The best ISI of one posterior sample, another one on each trial.

    Args:
        seed: seed of the choice of the sample.
    """

    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: _CountedProfiles, isi_ms: Array) -> Array:
        """The expected MEP under that sample [mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        people, samples = profiles.shape[:2]
        rng = np.random.default_rng([self.seed, 1 + posterior.trials])  # [seed, 0] is the stream of seed
        sampled: Array = profiles[np.arange(people), rng.integers(samples, size=people)]
        return sampled


@dataclass(frozen=True)
class KnowledgeGradient:
    """Expected gain in the best posterior mean."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesProfiles)

    def __call__(self, posterior: ForeseesProfiles, isi_ms: Array) -> Array:
        """By how much the next MEP is expected to raise the largest posterior mean [mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        ahead = lookahead(posterior.outcome_mass(isi_ms), profiles)
        later = (ahead.probability * ahead.mean.max(axis=-1)).sum(-1)
        gain: Array = later - profiles.mean(axis=1).max(axis=-1, keepdims=True)
        return gain
