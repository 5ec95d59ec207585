"""Acquisition functions that seek only the best ISI: where the expected MEP is largest.

Expected improvement on the logarithmic scale [Ament2023], upper confidence bound [Srinivas2010], Thompson sampling
[Thompson1933] and knowledge gradient [Frazier2008].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final, Protocol

import numpy as np

from isiw.acquisition.protocol import ForeseesProfiles
from isiw.acquisition.twostep import lookahead
from isiw.checks import Checked, NonNegative
from isiw.lazy import torch
from isiw.models.protocol import Posterior, PredictsOutcomes, SamplesProfiles, Tensor


class _CountedProfiles(Posterior, SamplesProfiles, Protocol):
    """A posterior of profiles that knows how many trials there were."""


SOFTNESS: Final = 0.01
"""Width of the hinge at the best posterior mean, as a share of the largest SD; it tells near from far below."""


@dataclass(frozen=True)
class LogExpectedImprovement:
    """Log expected improvement over the best posterior mean."""

    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Tensor) -> Tensor:
        """Log expected improvement of the expected MEP [log mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        best = profiles.mean(dim=1).amax(dim=-1)[:, None, None]
        scale = (SOFTNESS * profiles.std(dim=1, correction=0).amax(dim=-1)).clamp_min(1e-9)[:, None, None]
        steps = (profiles - best) / scale
        # log softplus(x) is x itself far below the hinge, where softplus would underflow.
        log_hinge = torch.where(steps < -15.0, steps, torch.log(torch.nn.functional.softplus(steps.clamp_min(-15.0))))
        score: Tensor = torch.logsumexp(log_hinge, dim=1) - math.log(profiles.shape[1]) + scale.squeeze(-1).log()
        return score


@dataclass(frozen=True)
class UpperConfidenceBound(Checked):
    """Posterior mean and some SDs.

    Args:
        width_sd: how many SDs; larger explores more.
    """

    width_sd: NonNegative = 2.0
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Tensor) -> Tensor:
        """The upper bound of the expected MEP [mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        return profiles.mean(dim=1) + self.width_sd * profiles.std(dim=1, correction=0)


@dataclass(frozen=True)
class Thompson:
    """The best ISI of one posterior sample, another one on each trial.

    Args:
        seed: seed of the choice of the sample.
    """

    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: _CountedProfiles, isi_ms: Tensor) -> Tensor:
        """The expected MEP under that sample [mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        people, samples = profiles.shape[:2]
        rng = np.random.default_rng([self.seed, 1 + posterior.trials])  # [seed, 0] is the stream of seed
        return profiles[torch.arange(people), torch.as_tensor(rng.integers(samples, size=people))]


@dataclass(frozen=True)
class KnowledgeGradient:
    """Expected gain in the best posterior mean."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesProfiles)

    def __call__(self, posterior: ForeseesProfiles, isi_ms: Tensor) -> Tensor:
        """By how much the next MEP is expected to raise the largest posterior mean [mV], shape (b, t)."""
        profiles = posterior.profiles_mv(isi_ms)
        ahead = lookahead(posterior.outcome_mass(isi_ms), profiles)
        return (ahead.probability * ahead.mean.amax(dim=-1)).sum(-1) - profiles.mean(dim=1).amax(dim=-1, keepdim=True)
