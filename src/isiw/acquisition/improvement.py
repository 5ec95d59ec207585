"""Acquisition functions that seek only the best ISI: where the expected MEP is largest.

Expected improvement on the logarithmic scale [Ament2023], upper confidence bound [Srinivas2010], Thompson sampling
[Thompson1933] and knowledge gradient [Frazier2008].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from isiw.acquisition.protocol import ForeseesProfiles
from isiw.acquisition.twostep import lookahead
from isiw.checks import Checked, NonNegative
from isiw.lazy import torch
from isiw.models.protocol import Posterior, PredictsOutcomes, SamplesProfiles, Tensor


class _CountedProfiles(Posterior, SamplesProfiles, Protocol):
    """A posterior of profiles that knows how many trials there were."""


def log_expected_improvement(posterior: SamplesProfiles, isi_ms: Tensor, softness: float = 0.01) -> Tensor:
    """Log expected improvement of the expected MEP over the best posterior mean [log mV], shape (b, t).

    Where no sample improves, a soft hinge still tells near from far.
    """
    profiles = posterior.profiles_mv(isi_ms)
    best = profiles.mean(dim=1).amax(dim=-1)[:, None, None]
    scale = (softness * profiles.std(dim=1, correction=0).amax(dim=-1)).clamp_min(1e-9)[:, None, None]
    steps = (profiles - best) / scale
    # log softplus(x) is x itself far below the hinge, where softplus would underflow.
    log_hinge = torch.where(steps < -15.0, steps, torch.log(torch.nn.functional.softplus(steps.clamp_min(-15.0))))
    score: Tensor = torch.logsumexp(log_hinge, dim=1) - math.log(profiles.shape[1]) + scale.squeeze(-1).log()
    return score


def upper_confidence_bound(posterior: SamplesProfiles, isi_ms: Tensor, width_sd: float = 2.0) -> Tensor:
    """Posterior mean of the expected MEP and some SDs [mV], shape (b, t)."""
    profiles = posterior.profiles_mv(isi_ms)
    return profiles.mean(dim=1) + width_sd * profiles.std(dim=1, correction=0)


def thompson(posterior: _CountedProfiles, isi_ms: Tensor, seed: int = 0) -> Tensor:
    """The expected MEP under one posterior sample [mV], shape (b, t)."""
    profiles = posterior.profiles_mv(isi_ms)
    people, samples = profiles.shape[:2]
    rng = np.random.default_rng([seed, 1 + posterior.trials])  # [seed, 0] is the stream of seed
    return profiles[torch.arange(people), torch.as_tensor(rng.integers(samples, size=people))]


def knowledge_gradient(posterior: ForeseesProfiles, isi_ms: Tensor) -> Tensor:
    """By how much the next MEP is expected to raise the largest posterior mean [mV], shape (b, t)."""
    profiles = posterior.profiles_mv(isi_ms)
    ahead = lookahead(posterior.outcome_mass(isi_ms), profiles)
    return (ahead.probability * ahead.mean.amax(dim=-1)).sum(-1) - profiles.mean(dim=1).amax(dim=-1, keepdim=True)


@dataclass(frozen=True)
class LogExpectedImprovement:
    """Log expected improvement over the best posterior mean."""

    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        return log_expected_improvement(posterior, isi_ms)


@dataclass(frozen=True)
class UpperConfidenceBound(Checked):
    """Posterior mean and some SDs.

    Args:
        width_sd: how many SDs; larger explores more.
    """

    width_sd: NonNegative = 2.0
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        return upper_confidence_bound(posterior, isi_ms, self.width_sd)


@dataclass(frozen=True)
class Thompson:
    """The best ISI of one posterior sample, another one on each trial.

    Args:
        seed: seed of the choice of the sample.
    """

    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: _CountedProfiles, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        return thompson(posterior, isi_ms, self.seed)


@dataclass(frozen=True)
class KnowledgeGradient:
    """Expected gain in the best posterior mean."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesProfiles)

    def __call__(self, posterior: ForeseesProfiles, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        return knowledge_gradient(posterior, isi_ms)
