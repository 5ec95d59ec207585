"""A sample of the posterior with both kinds of segment: predictive distributions, segments and profiles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from isiw.lazy import torch
from isiw.models.particles.tables import TabledSample
from isiw.models.protocol import Tensor
from isiw.models.windows import least_excess_mv
from isiw.window import LEAST_DEPRESSED_MV

MOST_RANGE_POINTS = 241
"""ISIs at which the largest enhancement and the deepest depression in the range are looked for, at most."""


@dataclass(frozen=True, eq=False)
class SupraSample(TabledSample):
    """What equally weighted particles with a depression say about the next MEP and about both kinds of segment."""

    @cached_property
    def _baseline_mv(self) -> Tensor:
        """Expected MEP without a tap [mV], shape (b, s, 1)."""
        return self._mean_mv(torch.zeros_like(self.person.response.log_floor).unsqueeze(-1))

    def baselines_mv(self) -> Tensor:
        """Expected MEP without a tap [mV], shape (b, s)."""
        return self._baseline_mv.squeeze(-1)

    @cached_property
    def _extremes_mv(self) -> tuple[Tensor, Tensor]:
        """Largest excess over the baseline and largest deficit in the range [mV], each of shape (b, s, 1)."""
        points = min(MOST_RANGE_POINTS, len(self.space.grid_ms))
        range_ms = torch.linspace(
            self.space.low_ms, self.space.high_ms, points, dtype=torch.float32, device=self._baseline_mv.device
        )
        excess_mv = self.expected_mep_mv(range_ms) - self._baseline_mv
        return excess_mv.amax(-1, keepdim=True), -excess_mv.amin(-1, keepdim=True)

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows as 0 or 1, shape (b, s, t)."""
        return self._masks(self.expected_mep_mv(isi_ms) - self._baseline_mv, self._extremes_mv[0])

    def depressed_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled depressed segments as 0 or 1, by the window's rule for the deficit, shape (b, s, t)."""
        masks = self._masks(self._baseline_mv - self.expected_mep_mv(isi_ms), self._extremes_mv[1])
        return masks * (self._baseline_mv >= LEAST_DEPRESSED_MV)

    def _masks(self, excess_mv: Tensor, largest_mv: Tensor) -> Tensor:
        return (excess_mv >= least_excess_mv(largest_mv, self._baseline_mv)).to(excess_mv.dtype)
