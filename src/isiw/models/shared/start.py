"""Where windows start in a design space: what is known of people, of the rig, and the chance that neither holds."""

from __future__ import annotations

import math
from functools import lru_cache

import torch

from isiw.design import DesignSpace
from isiw.models.protocol import Tensor

__all__ = ["start_ms"]


def start_ms(
    z: Tensor,
    space: DesignSpace,
    after_impact_ms: tuple[float, float],
    hit_delay_ms: tuple[float, float],
    p_anywhere: float,
) -> Tensor:
    """Start of a window in a space [ms] from a standard normal latent: the prior's quantile at its probability.

    Args:
        z: standard normal latents, any shape.
        space: the design space.
        after_impact_ms: the start is uniform between these, counted from the impact [ms].
        hit_delay_ms: mean and SD of the impact on the clock of the valve [ms].
        p_anywhere: probability that the start lies anywhere in the range instead, or up to 50 ms before it; before it
            is known that it lies there.
    """
    cdf, knots = _start_cdf(space, after_impact_ms, hit_delay_ms, p_anywhere)
    return _interpolate(torch.special.ndtr(z), cdf.to(z), knots.to(z))


_LEAST_MASS = 1e-6


@lru_cache(maxsize=16)
def _start_cdf(
    space: DesignSpace, after_impact_ms: tuple[float, float], hit_delay_ms: tuple[float, float], p_anywhere: float
) -> tuple[Tensor, Tensor]:
    """Probability that a window starts before each of some knots, and the knots [ms]; see `start_ms`."""
    shift, blur = hit_delay_ms if space.reference == "valve" else (0.0, 1.0)
    low, high = (edge + shift for edge in after_impact_ms)
    knots = torch.linspace(space.low_ms - 50.0, space.high_ms, 512, dtype=torch.float64)
    edges = [torch.special.ndtr((knots - edge) / blur) * (knots - edge) for edge in (low, high)]
    bumps = [torch.exp(-0.5 * ((knots - edge) / blur) ** 2) * blur / math.sqrt(2 * math.pi) for edge in (low, high)]
    informed = (edges[0] + bumps[0] - edges[1] - bumps[1]) / (high - low)
    anywhere = (knots - knots[0]) / (knots[-1] - knots[0])
    mixed = (1 - p_anywhere) * (informed - informed[0]) + p_anywhere * anywhere
    # Given that it lies in the range: the further that is from where starts usually are, the more "anywhere" counts.
    return (mixed / mixed[-1] if mixed[-1] > _LEAST_MASS else anywhere), knots


def _interpolate(x: Tensor, xs: Tensor, ys: Tensor) -> Tensor:
    right = torch.searchsorted(xs, x.contiguous()).clamp(1, len(xs) - 1)
    left = right - 1
    share = (x - xs[left]) / (xs[right] - xs[left]).clamp_min(1e-12)
    between: Tensor = ys[left] + share.clamp(0.0, 1.0) * (ys[right] - ys[left])
    return between
