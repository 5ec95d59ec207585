"""Mixtures of components for blocks of latents: what is usual of them, and what else may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from isiw.types import Array, FloatArray, IntArray

Component: TypeAlias = tuple[float, Sequence[tuple[float, float]]]
"""A share, and mean and SD of each latent."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of normal components with independent latents."""

    shares: FloatArray  # of the components, summing to 1, (k,)
    means: FloatArray  # of the latents in each, (k, d)
    sds: FloatArray  # likewise, (k, d)

    @classmethod
    def of(cls, components: Sequence[Component]) -> Mixture:
        """A mixture of components."""
        shares = np.array([share for share, _ in components])
        laws = np.array([latents for _, latents in components])
        return cls(shares / shares.sum(), laws[..., 0], laws[..., 1])

    def log_parts(self, x: Array) -> FloatArray:
        """Log density of each component times its share at x (..., d), shape (..., k)."""
        squares, lines, constants = self._squares
        exact = np.asarray(x, dtype=float)
        parts: FloatArray = np.square(exact) @ squares + exact @ lines + constants
        return parts

    def log_density(self, x: Array) -> FloatArray:
        """Log density at x (..., d), shape (...)."""
        return log_sum(self.log_parts(x))

    def usual(self, x: Array) -> FloatArray:
        """Probability that x (..., d) is of the component that is most probable beforehand, shape (...)."""
        parts = self.log_parts(x)
        share: FloatArray = np.exp(parts[..., self.shares.argmax()] - log_sum(parts))
        return share

    def component(self, x: Array) -> IntArray:
        """The component that most probably explains x (..., d), shape (...)."""
        found: IntArray = self.log_parts(x).argmax(-1)
        return found

    @cached_property
    def _squares(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Factors of x² and of x, each (d, k), and constants (k,), whose sum is the log density of each component."""
        precisions = self.sds**-2.0
        spent = (0.5 * precisions * self.means**2 + np.log(self.sds) + 0.5 * math.log(2.0 * math.pi)).sum(-1)
        with np.errstate(divide="ignore"):  # a component may have no share
            constants = np.log(self.shares) - spent
        return -0.5 * precisions.T, (precisions * self.means).T, constants


def log_sum(parts: FloatArray) -> FloatArray:
    """Log of the sum of exponentials along the last axis, shape (...)."""
    most = parts.max(-1, keepdims=True)
    most = np.where(np.isfinite(most), most, 0.0)
    with np.errstate(divide="ignore"):
        total: FloatArray = np.log(np.exp(parts - most).sum(-1)) + most[..., 0]
    return total
