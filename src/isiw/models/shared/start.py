"""Where windows start in a design space: what is known of people, of the rig, and the chance that neither holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import torch

from isiw.checks import ascending, check_probabilities, number
from isiw.design import DesignSpace
from isiw.models.protocol import Tensor

__all__ = ["StartPrior"]

BEFORE_MS = 50.0
"""How far before the range a window may start."""

KNOTS = 512
LEAST_MASS = 1e-6


@dataclass(frozen=True)
class StartPrior:
    """Where windows start.

    Args:
        after_impact_ms: the start is uniform between these, counted from the impact [ms].
        hit_delay_ms: mean and SD of the impact on the clock of the valve, of a person unknown [ms]; 172–188 ms were
            measured (dissertation, 4.2).
        p_anywhere: probability that the start lies anywhere in the range instead, or up to 50 ms before it, for
            stimulators unlike that one; more in a range that only a part of the usual starts lies in.

    Raises:
        InvalidValueError: an empty range, a hit delay that is not positive, or an invalid probability.
    """

    after_impact_ms: tuple[float, float] = (0.0, 115.0)
    hit_delay_ms: tuple[float, float] = (180.0, 6.2)
    p_anywhere: float = 0.08

    def __post_init__(self) -> None:
        low, high = ascending("StartPrior.after_impact_ms", self.after_impact_ms)
        mean, sd = (number("StartPrior.hit_delay_ms", value, above=0) for value in self.hit_delay_ms)
        object.__setattr__(self, "after_impact_ms", (low, high))
        object.__setattr__(self, "hit_delay_ms", (mean, sd))
        check_probabilities(self, "p_anywhere")

    def start_ms(self, z: Tensor, space: DesignSpace) -> Tensor:
        """Starts in a space [ms] at standard normal latents of any shape: the prior's quantiles, of the same shape.

        Args:
            z: the latents.
            space: the design space; before it is known that the window starts there.
        """
        cdf, knots = _start_cdf(space, self)
        return _interpolate(torch.special.ndtr(z), cdf.to(z), knots.to(z))


@lru_cache(maxsize=16)
def _start_cdf(space: DesignSpace, prior: StartPrior) -> tuple[Tensor, Tensor]:
    """Probability that a window starts before each of some knots, and the knots [ms]."""
    shift, blur = prior.hit_delay_ms if space.reference == "valve" else (0.0, 1.0)
    low, high = (edge + shift for edge in prior.after_impact_ms)
    knots = torch.linspace(space.low_ms - BEFORE_MS, space.high_ms, KNOTS, dtype=torch.float64)
    edges = [torch.special.ndtr((knots - edge) / blur) * (knots - edge) for edge in (low, high)]
    bumps = [torch.exp(-0.5 * ((knots - edge) / blur) ** 2) * blur / math.sqrt(2 * math.pi) for edge in (low, high)]
    informed = (edges[0] + bumps[0] - edges[1] - bumps[1]) / (high - low)
    anywhere = (knots - knots[0]) / (knots[-1] - knots[0])
    mixed = (1 - prior.p_anywhere) * (informed - informed[0]) + prior.p_anywhere * anywhere
    # Given that it lies in the range: the further that is from where starts usually are, the more "anywhere" counts.
    return (mixed / mixed[-1] if mixed[-1] > LEAST_MASS else anywhere), knots


def _interpolate(x: Tensor, xs: Tensor, ys: Tensor) -> Tensor:
    right = torch.searchsorted(xs, x.contiguous()).clamp(1, len(xs) - 1)
    left = right - 1
    share = (x - xs[left]) / (xs[right] - xs[left]).clamp_min(1e-12)
    between: Tensor = ys[left] + share.clamp(0.0, 1.0) * (ys[right] - ys[left])
    return between
