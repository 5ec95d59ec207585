"""The standard normal density, and the distribution function between two ends, exact in either tail, as logarithms.

`torch.special.ndtr` has no lower tail: in double precision it is 0 at -10, where 7.6e-24 is right. Wherever a logarithm
or a ratio is taken of such a probability, it comes from here; the compiled engine has its like.
"""

from __future__ import annotations

import math

from isiw.lazy import torch
from isiw.models.parametric.tensors import Tensor


def log_standard(points: Tensor) -> Tensor:
    """Log density of points (..., d) under independent standard normal variables, shape (...)."""
    density: Tensor = -0.5 * points.square().sum(-1) - 0.5 * points.shape[-1] * math.log(2.0 * math.pi)
    return density


def log_between(low: Tensor, high: Tensor) -> Tensor:
    """Log of the probability that a standard normal variable is between two ends, broadcast shape; -inf if they meet.

    Ends may be infinite.
    """
    right = low > 0  # by symmetry, what is above the middle is looked at from below
    first, last = torch.where(right, -high, low), torch.where(right, -low, high)
    below_first, below_last = torch.special.log_ndtr(first), torch.special.log_ndtr(last)
    between: Tensor = below_last + _log_complement(below_first - below_last)
    return between


def _log_complement(log_share: Tensor) -> Tensor:
    """Log of 1 - exp(x) for x at most 0, same shape."""
    near = log_share > -math.log(2.0)
    # Each side is computed where it is used alone, so that gradients of the other are no NaN.
    of_near = torch.log(-torch.expm1(torch.where(near, log_share, -1.0)))
    of_far = torch.log1p(-torch.exp(torch.where(near, -1.0, log_share)))
    return torch.where(near, of_near, of_far)
