"""A sample of the posterior: predictive distributions, windows and profiles of equally weighted particles.

Responses are worked out in tables by facilitation, between whose rows predictions are interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Self

import numpy as np

from isiw.design import DesignSpace
from isiw.models.particles.records import FLOOR_SD, LOG_FLOOR, REST, SLOPE
from isiw.models.shared import history
from isiw.models.shared.draws import LEVELS, OUTCOMES
from isiw.models.windows import grid_of
from isiw.native import engine
from isiw.types import FloatArray, Singles

FINE_MS: Final = 1.0
"""Between the points of such a grid facilitation hardly changes."""

CELLS: Final = np.linspace(0.0, 1.0, OUTCOMES + 1, dtype=np.float32) ** np.float32(1.5)
"""Ends of the cells of the log MEP, from 0 to 1, (y + 1,); narrow where MEPs are as small as the floor."""


@dataclass(frozen=True, eq=False)
class TabledSample:
    """What equally weighted particles say about the next MEP."""

    fields: Singles  # what they mean, as the engine has it, (b, s, fields)
    space: DesignSpace  # in whose range windows are looked for
    order: int = 0  # how many trials came before the next one

    def expected_mep_mv(self, isi_ms: Singles) -> Singles:
        """Expected MEP [mV], shape (b, s, t)."""
        return self._mean_mv(engine.facilitations(self.fields, isi_ms))

    @property
    def at_the_next(self) -> Self:
        """The same at the intensity of the next pulse."""
        return self

    def outcome_mass(self, isi_ms: Singles) -> Singles:
        """Predictive distribution of the next MEP under each particle, shape (b, s, t, y)."""
        one = self.at_the_next
        return engine.rows_between(one.fields, one.outcomes[1], engine.facilitations(one.fields, isi_ms))

    def mep_quantiles_mv(self, isi_ms: Singles, shares: FloatArray) -> FloatArray:
        """Quantiles of the next MEP [mV], shape (b, t, q)."""
        below = np.zeros((len(self.fields), len(isi_ms), len(CELLS)))
        np.cumsum(self.outcome_mass(isi_ms).mean(1), axis=-1, dtype=float, out=below[..., 1:])
        cell = np.clip((below[..., np.newaxis, :] < shares[:, np.newaxis]).sum(-1) - 1, 0, len(CELLS) - 2)
        before, behind = (np.take_along_axis(below, at, axis=-1) for at in (cell, cell + 1))
        within = np.clip((shares - before) / np.maximum(behind - before, np.finfo(float).tiny), 0.0, 1.0)
        ends = CELLS[cell] + within * (CELLS[cell + 1] - CELLS[cell])
        low, high = (end[:, np.newaxis, np.newaxis] for end in self.outcomes[0].T)
        quantiles_mv: FloatArray = np.exp(low + ends * (high - low))
        return quantiles_mv

    def _mean_mv(self, level: Singles) -> Singles:
        """Expected MEP [mV] by facilitation (b, s, t), of the same shape."""
        between = engine.rows_between(self.fields, self._evoked[..., np.newaxis], level)
        return self._with_floor_mv(between[..., 0])

    def _with_floor_mv(self, evoked: Singles) -> Singles:
        """From an expected MEP above the floor, in floors, to mV, shape (b, s, ...)."""
        floor_mv, rest = np.exp(self.fields[..., LOG_FLOOR, None]), np.exp(0.5 * self.fields[..., FLOOR_SD, None] ** 2)
        found: Singles = floor_mv * (evoked + rest)
        return found

    @cached_property
    def _rows(self) -> tuple[Singles, Singles]:
        """Facilitations of the rows, and expected MEPs above the floor there, in floors, shape (b, s, l) each."""
        return engine.evoked_means(self.fields, LEVELS)

    @property
    def _evoked(self) -> Singles:
        return self._rows[1]

    @cached_property
    def outcomes(self) -> tuple[Singles, Singles]:
        """Between which log MEPs outcomes of the next trial lie, (b, 2), and the probability of each, (b, s, l, y)."""
        return engine.outcome_tables(self.fields, *self._rows, self.order, CELLS)


@dataclass(frozen=True, eq=False)
class PersonSample(TabledSample):
    """What equally weighted particles say about the next MEP and about the window.

    The window is that of the pairs' usual intensity, whatever that of the next pulse is.
    """

    stronger_pct_rmt: float = 0.0  # by how much the next pulse is stronger than the pairs'

    @cached_property
    def at_the_next(self) -> PersonSample:
        """The same at the intensity of the next pulse."""
        if not self.stronger_pct_rmt:
            return self
        fields = self.fields.copy()
        fields[..., REST] += fields[..., SLOPE] * np.float32(self.stronger_pct_rmt)
        return replace(self, fields=fields, stronger_pct_rmt=0.0)

    @cached_property
    def edge_level(self) -> Singles:
        """Facilitation at a window's edge by the least-excess rule; above 1 where there is no window, shape (b, s)."""
        fine = self.space.step_ms <= FINE_MS
        return engine.edge_levels(self.fields, self._evoked, grid_of(self.space), fine=fine)

    def window_masks(self, isi_ms: Singles) -> Singles:
        """Sampled windows as 0 or 1, shape (b, s, t)."""
        runs, at = engine.window_runs(self.fields, self.edge_level, isi_ms), np.arange(len(isi_ms))
        firsts, behinds = runs[..., ::2, np.newaxis], runs[..., 1::2, np.newaxis]
        inside = (firsts <= at) & (at < behinds)
        return (inside[..., 0, :] | inside[..., 1, :]).astype(np.float32)

    def baselines_mv(self) -> Singles:
        """Expected MEP without a tap [mV], shape (b, s)."""
        return self._with_floor_mv(self._evoked[..., :1])[..., 0]


_FLOORS: Final = np.linspace(-10.0, 16.0, 4097)
"""Log MEPs over the floor between which amplitudes are drawn; beyond them is none."""


def drawn_mep_mv(fields: Singles, isi_ms: Singles, rng: np.random.Generator) -> FloatArray:
    """One MEP of one particle (1, 1, fields) at each ISI in turn [mV], exactly as the likelihood says, shape (n,)."""
    # An MEP by how far it is above the floor: lanes are particles, so that each point is one, of a floor of its own.
    points, columns = np.tile(fields, (1, len(_FLOORS), 1)), history.neutral(len(isi_ms))
    points[..., LOG_FLOOR], log_mep = -_FLOORS, fields[0, 0, LOG_FLOOR] + _FLOORS
    columns[:, 0], columns[:, 2:4] = isi_ms, 0.0
    log_density = np.concatenate([engine.log_likelihoods(points, one[np.newaxis, np.newaxis]) for one in columns])
    density = np.exp(log_density - log_density.max(-1, keepdims=True), dtype=float)
    below = np.concatenate((np.zeros((len(isi_ms), 1)), (density[:, 1:] + density[:, :-1]).cumsum(-1)), axis=-1)
    wanted = rng.random(len(isi_ms)) * below[:, -1]
    mep_mv: FloatArray = np.exp([np.interp(*one, log_mep) for one in zip(wanted, below, strict=True)])
    return mep_mv
