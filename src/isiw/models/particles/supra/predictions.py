"""A sample of the posterior with both kinds of segment: predictive distributions, segments and profiles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.prior import Person
from isiw.models.particles.tables import FacilitationTables
from isiw.models.protocol import Tensor
from isiw.models.windows import least_excess_mv
from isiw.types import FloatArray
from isiw.window import LEAST_DEPRESSED_MV

MOST_RANGE_POINTS = 241
"""ISIs at which the largest enhancement and the deepest depression in the range are looked for, at most."""


@dataclass(frozen=True, eq=False)
class SupraSample:
    """What equally weighted particles say about the next MEP and about both kinds of segment."""

    person: Person  # with a depression, fields of shape (b, s)
    space: DesignSpace  # in whose range segments are looked for
    order: int = 0  # how many trials came before the next one
    records: FloatArray | None = None  # the particles as kernels have them; None where torch computes

    @cached_property
    def _tables(self) -> FacilitationTables:
        return FacilitationTables(self.person, self.records)

    def _mean_mv(self, level: Tensor) -> Tensor:
        """Expected MEP [mV] by facilitation (b, s, t), of the same shape."""
        response = self.person.response
        floors = self._tables.at(self._tables.evoked.unsqueeze(-1), level).squeeze(-1)
        rest = torch.exp(0.5 * response.floor_log_sd.square()).unsqueeze(-1)
        return response.log_floor.exp().unsqueeze(-1) * (floors + rest)

    def expected_mep_mv(self, isi_ms: Tensor) -> Tensor:
        """Expected MEP [mV], shape (b, s, t)."""
        return self._mean_mv(self._tables.levels(isi_ms))

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

    @cached_property
    def _outcome_table(self) -> Tensor:
        return self._tables.outcomes(self.order)

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP under each particle, shape (b, s, t, y)."""
        return self._tables.at(self._outcome_table, self._tables.levels(isi_ms))
