"""A sample of the posterior with both kinds of segment: predictive distributions, segments and profiles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from isiw.excess import LEAST_DEPRESSED_MV, least_excess_mv
from isiw.models.particles.predictions import TabledSample
from isiw.types import Array, Singles

MOST_RANGE_POINTS: Final = 241
"""ISIs at which the largest enhancement and the deepest depression in the range are looked for, at most."""


@dataclass(frozen=True, eq=False)
class SupraSample(TabledSample):
    """What equally weighted particles with a depression say about the next MEP and about both kinds of segment."""

    @cached_property
    def _baseline_mv(self) -> Singles:
        """Expected MEP without a tap [mV], shape (b, s, 1)."""
        return self._mean_mv(np.zeros((*self.fields.shape[:2], 1), dtype=np.float32))

    def baselines_mv(self) -> Singles:
        """Expected MEP without a tap [mV], shape (b, s)."""
        return self._baseline_mv[..., 0].copy()

    @cached_property
    def _extremes_mv(self) -> tuple[Singles, Singles]:
        """Largest excess over the baseline and largest deficit in the range [mV], each of shape (b, s, 1)."""
        points = min(MOST_RANGE_POINTS, len(self.space.grid_ms))
        range_ms = np.linspace(self.space.low_ms, self.space.high_ms, points, dtype=np.float32)
        excess_mv = self.expected_mep_mv(range_ms) - self._baseline_mv
        return excess_mv.max(-1, keepdims=True), -excess_mv.min(-1, keepdims=True)

    def masks(self, isi_ms: Singles) -> tuple[Singles, Singles]:
        """Sampled windows, and depressed segments by the window's rule for the deficit, as 0 or 1, shape (b, s, t)."""
        excess_mv = self.expected_mep_mv(isi_ms) - self._baseline_mv
        largest_mv, deepest_mv = self._extremes_mv
        depressed = self._masks(-excess_mv, deepest_mv) * (self._baseline_mv >= LEAST_DEPRESSED_MV)
        return self._masks(excess_mv, largest_mv), depressed

    def window_masks(self, isi_ms: Singles) -> Singles:
        """Sampled windows alone, shape (b, s, t)."""
        return self.masks(isi_ms)[0]

    def depressed_masks(self, isi_ms: Singles) -> Singles:
        """Sampled depressed segments alone, shape (b, s, t)."""
        return self.masks(isi_ms)[1]

    def _masks(self, excess_mv: Array, largest_mv: Array) -> Singles:
        return (excess_mv >= least_excess_mv(largest_mv, self._baseline_mv)).astype(np.float32)
