"""A sample of the posterior: predictive distributions, windows and profiles of equally weighted particles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from isiw.lazy import torch
from isiw.models.particles.shapes import facilitation, highest_facilitation, reaches
from isiw.models.particles.tables import TabledSample, cell_ends, log_ends
from isiw.models.protocol import Tensor
from isiw.models.shared.tables import LEVELS, OUTCOMES, interpolated
from isiw.models.windows import Runs, grid_of, least_excess_mv
from isiw.native import engine
from isiw.types import FloatArray, IntArray

FINE_MS = 1.0
"""Between the points of such a grid facilitation hardly changes."""


@dataclass(frozen=True, eq=False)
class PersonSample(TabledSample):
    """What equally weighted particles say about the next MEP and about the window."""

    @property
    def _grid_ms(self) -> Tensor:
        return grid_of(self.space, self._evoked.device)

    @cached_property
    def _highest(self) -> Tensor:
        """Largest facilitation on the space's grid, shape (b, s); on a fine one that of its whole range."""
        if self.space.step_ms <= FINE_MS:
            return highest_facilitation(self.person.shape, self.space.low_ms, self.space.high_ms)
        return facilitation(self.person.shape, self._grid_ms).amax(-1)

    @cached_property
    def edge_level(self) -> Tensor:
        """Facilitation at a window's edge by the least-excess rule; above 1 where there is no window, shape (b, s)."""
        if self.records is not None:
            fine = self.space.step_ms <= FINE_MS
            found = engine.edge_levels(self.records, self._evoked.numpy(), self._grid_ms.numpy(), fine=fine)
            return torch.from_numpy(found)
        excess_mv = self.person.response.log_floor.exp().unsqueeze(-1) * (self._evoked - self._evoked[..., :1])
        peak_mv = interpolated(excess_mv.unsqueeze(-1), self._highest.unsqueeze(-1))[..., 0, 0]
        least_mv = least_excess_mv(peak_mv, self.baselines_mv()).unsqueeze(-1)
        right = torch.searchsorted(excess_mv.contiguous(), least_mv.contiguous()).clamp(1, LEVELS - 1)
        low_mv, high_mv = excess_mv.gather(-1, right - 1), excess_mv.gather(-1, right)
        position = (right - 1 + (least_mv - low_mv) / (high_mv - low_mv).clamp_min(1e-12)).squeeze(-1) / (LEVELS - 1)
        enhanced = least_mv.squeeze(-1).isfinite() & self.person.present
        return torch.where(enhanced, position.square(), 2.0)

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows as 0 or 1, shape (b, s, t)."""
        if self.records is None:
            return reaches(self.person.shape, self.edge_level, isi_ms).to(torch.float32)
        return torch.from_numpy(_masks_of(self._pairs(isi_ms), len(isi_ms)))

    def runs(self, isi_ms: Tensor, person: int = 0) -> Runs:
        """Sampled windows of one person, as runs of some ascending ISIs [ms] (t,)."""
        if self.records is None:
            return Runs.of_masks(self.window_masks(isi_ms)[person])
        return Runs.of_pairs(self._pairs(isi_ms)[person], len(isi_ms))

    def _pairs(self, isi_ms: Tensor) -> IntArray:
        edges: IntArray = engine.window_runs(self.records, self.edge_level.numpy(), isi_ms.contiguous().numpy())
        return edges

    def baselines_mv(self) -> Tensor:
        """Expected MEP without a tap [mV], shape (b, s)."""
        return self._with_floor_mv(self._evoked[..., :1]).squeeze(-1)

    def mep_quantiles_mv(self, isi_ms: Tensor, shares: Tensor) -> Tensor:
        """Quantiles of the next MEP [mV], shape (b, t, q)."""
        below = torch.nn.functional.pad(self.outcome_mass(isi_ms).mean(1).cumsum(-1), (1, 0))
        wanted = shares.expand(*below.shape[:-1], -1).contiguous()
        right = torch.searchsorted(below, wanted).clamp(1, OUTCOMES)
        less, more = below.gather(-1, right - 1), below.gather(-1, right)
        ends = cell_ends(below.device)
        place = torch.lerp(ends[right - 1], ends[right], (wanted - less) / (more - less).clamp_min(1e-12))
        low, high = (end[:, None, None] for end in log_ends(self._log_floor, self._evoked))
        return torch.exp(low + place * (high - low))


def _masks_of(runs: IntArray, points: int) -> FloatArray:
    """Windows as 0 or 1 (b, s, t) from their runs (b, s, 4) on so many ISIs."""
    at, firsts, behinds = np.arange(points), runs[..., ::2, np.newaxis], runs[..., 1::2, np.newaxis]
    masks: FloatArray = ((firsts <= at) & (at < behinds)).any(-2).astype(np.float32)
    return masks
