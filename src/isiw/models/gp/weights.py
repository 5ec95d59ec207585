"""Windows' processes as sums of a few functions with Gaussian weights [Rasmussen2006, section 2.1].

Measured in SDs of its share, u = (t - middle) / sd, the profile of each process of the ensemble has the same covariance

    k(u, u') = exp(-(u² + u'²) / 2) (deviation² correlation(|u - u'|) + rise_sd²),

so that its eigenfunctions, found once on a fine grid of u, serve all of them. Those that are left out hold less than
`LEFT_OUT` of the variance in the middle. With the constant as one more function, a process is known by a dozen
weights, and whatever the number of trials, what they say about it is a Gaussian law of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from isiw.lazy import torch
from isiw.models.gp.places import WIDTH_SDS, Places, Tensor, WindowsPrior
from isiw.models.gp.prior import KernelName, correlations

REACH: Final = 4.5
"""Further from the middle [SD of the share], the share is below 5e-5 and taken for 0."""

STEPS: Final = 40
"""Points of the grid of u in one SD; in between, functions are straight."""

LEFT_OUT: Final = 1e-4
"""Share of the largest variance that no point of the grid misses more than."""

STRAY: Final = 3.0
"""By how much the noise SD of a stray is larger."""

ROUNDS: Final = 2
"""Of finding strays."""

TINY: Final = 1e-300


@lru_cache(maxsize=16)
def functions(kernel: KernelName, prior: WindowsPrior) -> Tensor:
    """The functions on the grid of u, from -REACH to REACH, shape (u, r)."""
    u = torch.linspace(-REACH, REACH, 2 * round(REACH * STEPS) + 1, dtype=torch.float64)
    length = torch.tensor([prior.length_share * WIDTH_SDS], dtype=torch.float64)
    share = torch.exp(-0.5 * u.square())
    covariance = prior.deviation**2 * correlations(kernel, length, u)[0] + prior.rise.sd**2
    values, vectors = torch.linalg.eigh(covariance * share.unsqueeze(-1) * share)
    scaled = (vectors * values.clamp_min(0.0).sqrt()).flip(-1)
    missed = (scaled.square().sum(-1, keepdim=True) - scaled.square().cumsum(-1)).amax(0)
    kept: Tensor = scaled[:, : int((missed > LEFT_OUT * covariance.amax()).sum()) + 1].contiguous()
    return kept


def features(functions: Tensor, places: Places, isi_ms: Tensor) -> Tensor:
    """The functions of q processes at ISIs [ms] (t,), and a 1 for the constant, shape (q, t, r + 1)."""
    left, part = _on_grid(places, isi_ms)
    own = torch.lerp(functions[left], functions[left + 1], part.unsqueeze(-1))
    # A process without a window has no profile.
    return torch.nn.functional.pad(own * places.sd_ms.isfinite()[:, None, None], (0, 1), value=1.0)


def profiles(functions: Tensor, places: Places, weights: Tensor, isi_ms: Tensor) -> Tensor:
    """Profiles about their constants that q processes have with weights (q, r + 1), at ISIs [ms] (t,), (q, t)."""
    left, part = _on_grid(places, isi_ms)
    own = weights[:, :-1] @ functions.T
    deviation = torch.lerp(own.gather(-1, left), own.gather(-1, left + 1), part)
    return places.mean(isi_ms) + deviation * places.sd_ms.isfinite().unsqueeze(-1)


def _on_grid(places: Places, isi_ms: Tensor) -> tuple[Tensor, Tensor]:
    """The point of the grid of u to the left of each ISI [ms] (t,), and how far towards the next one, (q, t)."""
    u = (isi_ms - places.middle_ms.unsqueeze(-1)) / places.sd_ms.unsqueeze(-1)
    position = ((u + REACH) * STEPS).clamp(0.0, 2.0 * REACH * STEPS)
    left = position.long().clamp_max(2 * round(REACH * STEPS) - 1)
    return left, position - left


@dataclass(frozen=True, eq=False)
class Weights:
    """Law of the weights of q processes, standard normal but for the constant's, given values with Gaussian noise."""

    features: Tensor  # of each value, (q, n, r + 1)
    values: Tensor  # less the mean of each process, (q, n)
    variance: Tensor  # of their noise, (q, n)
    level_sd: float  # prior SD of the constant
    surplus: Tensor | float = 0.0  # of the log marginal likelihood over that of Gaussian noise, (q,)

    def with_strays(self, share: float) -> Weights:
        """The same if that share of the values, it is not known which, have `STRAY` times the noise SD.

        By variational inference [Bishop2006, section 10.1]: in turns, a value is as likely a stray as its expected
        squared distance from the profile says, and counts as much as that leaves of its noise.
        """
        if not share:
            return self
        odds, less = math.log(share / (1.0 - share)) - math.log(STRAY), 1.0 - STRAY**-2
        stray = torch.full_like(self.variance, share)
        for _ in range(ROUNDS):
            away, spread = replace(self, variance=self.variance / (1.0 - less * stray)).left
            stray = torch.sigmoid(odds + 0.5 * less * (away.square() + spread) / self.variance)
        wider = 1.0 / (1.0 - less * stray)
        # Of the bound on the evidence, what Gaussian noise that is so much wider does not have.
        bound = torch.xlogy(stray, share / (STRAY * stray)) + torch.xlogy(1.0 - stray, (1.0 - share) / (1.0 - stray))
        return replace(self, variance=self.variance * wider, surplus=(bound + 0.5 * wider.log()).sum(-1))

    @cached_property
    def factor(self) -> Tensor:
        """Lower Cholesky factor of the precision, (q, r + 1, r + 1)."""
        own = self.features.new_ones(self.features.shape[-1])
        own[-1] = self.level_sd**-2
        scaled = self.features / self.variance.sqrt().unsqueeze(-1)
        factor: Tensor = torch.linalg.cholesky(torch.diag(own) + scaled.mT @ scaled)
        return factor

    @cached_property
    def white(self) -> Tensor:
        """Precision times mean, divided by the factor, (q, r + 1)."""
        pull = self.features.mT @ (self.values / self.variance).unsqueeze(-1)
        white: Tensor = torch.linalg.solve_triangular(self.factor, pull, upper=False).squeeze(-1)
        return white

    @cached_property
    def log_marginal(self) -> Tensor:
        """Log marginal likelihood of the values, (q,) [Rasmussen2006, equations 2.30 and A.9 to A.10]."""
        noise = (self.values.square() / self.variance + self.variance.log() + math.log(2.0 * math.pi)).sum(-1)
        pivots = self.factor.diagonal(dim1=-2, dim2=-1).log().sum(-1)
        gaussian = 0.5 * (self.white.square().sum(-1) - noise) - pivots - math.log(self.level_sd)
        return gaussian + self.surplus

    @cached_property
    def left(self) -> tuple[Tensor, Tensor]:
        """What the profile's mean leaves of each value, and the profile's variance there, (q, n) each."""
        mean = torch.linalg.solve_triangular(self.factor.mT, self.white.unsqueeze(-1), upper=True)
        white = torch.linalg.solve_triangular(self.factor, self.features.mT, upper=False)
        return self.values - (self.features @ mean).squeeze(-1), white.square().sum(-2)

    @property
    def surprise(self) -> Tensor:
        """Distance of each value from what all others predict [SD], (q, n) [Rasmussen2006, equations 5.10 to 5.12]."""
        away, spread = self.left
        surprise: Tensor = away / (self.variance - spread).clamp_min(TINY).sqrt()
        return surprise

    def drawn(self, picks: Tensor, rng: np.random.Generator) -> Tensor:
        """Weights of some processes, shape (s, r + 1)."""
        z = torch.as_tensor(rng.standard_normal(self.white[picks].shape))
        white = (self.white[picks] + z).unsqueeze(-1)
        weights: Tensor = torch.linalg.solve_triangular(self.factor[picks].mT, white, upper=True).squeeze(-1)
        return weights
