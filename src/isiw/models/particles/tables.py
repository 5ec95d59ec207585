"""Tables by facilitation, from which a sample's predictions are interpolated: by torch, or by the engine."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.likelihood import in_pieces, levels
from isiw.models.particles.noise import NODES, evoked_mean, log_gain, outcome_density
from isiw.models.particles.prior import Person
from isiw.models.particles.records import LOG_FLOOR, person_of
from isiw.models.protocol import Tensor
from isiw.models.shared.tables import LEVELS, OUTCOMES, interpolated, table_levels
from isiw.native import engine
from isiw.types import FloatArray


@dataclass(frozen=True, eq=False)
class TabledSample:
    """What equally weighted particles say about the next MEP."""

    particles: Person | FloatArray  # what they mean, fields of shape (b, s), or their fields as the engine has them
    space: DesignSpace  # in whose range windows are looked for
    order: int = 0  # how many trials came before the next one

    @cached_property
    def person(self) -> Person:
        """What they mean."""
        return person_of(self.particles) if isinstance(self.particles, np.ndarray) else self.particles

    @property
    def records(self) -> FloatArray | None:
        """The particles as the engine has them; None where torch computes."""
        return self.particles if isinstance(self.particles, np.ndarray) else None

    def expected_mep_mv(self, isi_ms: Tensor) -> Tensor:
        """Expected MEP [mV], shape (b, s, t)."""
        return self._mean_mv(self._levels(isi_ms))

    def _mean_mv(self, level: Tensor) -> Tensor:
        """Expected MEP [mV] by facilitation (b, s, t), of the same shape."""
        return self._with_floor_mv(self._at(self._evoked.unsqueeze(-1), level).squeeze(-1))

    def _with_floor_mv(self, evoked: Tensor) -> Tensor:
        """From an expected MEP above the floor, in floors, to mV, shape (b, s, ...)."""
        response = self.person.response
        rest = torch.exp(0.5 * response.floor_log_sd.square()).unsqueeze(-1)
        return response.log_floor.exp().unsqueeze(-1) * (evoked + rest)

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP under each particle, shape (b, s, t, y)."""
        return self._at(self._outcome_table, self._levels(isi_ms))

    @property
    def _log_floor(self) -> Tensor:
        """Log of the EMG floor [mV], shape (b, s)."""
        return (
            self.person.response.log_floor if self.records is None else torch.from_numpy(self.records[..., LOG_FLOOR])
        )

    @cached_property
    def _depth(self) -> Tensor | None:
        """Facilitation at the deepest depression is minus this, shape (b, s, 1); None where nobody looks for one."""
        low = self.person.depression
        return None if low is None else low.depth.unsqueeze(-1)

    @cached_property
    def _rows(self) -> Tensor:
        """Facilitations of the rows, from the deepest depression to the largest enhancement, shape (b, 1 or s, l)."""
        if self.records is not None:
            return torch.from_numpy(engine.table_rows(self.records, LEVELS))
        people, device = len(self.person.present), self.person.present.device
        if self._depth is None:
            return table_levels(device).expand(people, 1, -1)
        return torch.linspace(0.0, 1.0, LEVELS, dtype=torch.float32, device=device) * (1.0 + self._depth) - self._depth

    @cached_property
    def _evoked(self) -> Tensor:
        """Expected MEP above the floor in each row, in floors, shape (b, s, l)."""
        if self.records is not None:
            return torch.from_numpy(engine.evoked_means(self.records, self._rows.numpy()))
        return evoked_mean(self.person.response, self._rows)

    def _at(self, table: Tensor, level: Tensor) -> Tensor:
        """What lies between the rows of a table."""
        if self.records is not None:
            return torch.from_numpy(engine.rows_between(self.records, table.contiguous().numpy(), level.numpy()))
        if self._depth is None:
            return interpolated(table, level)
        # `interpolated` has its rows at the squares of equal steps.
        return interpolated(table, ((level + self._depth) / (1.0 + self._depth)).clamp(0.0, 1.0).square())

    def _levels(self, isi_ms: Tensor) -> Tensor:
        """Facilitation of each particle at some ISIs [ms] (t,), shape (b, s, t)."""
        if self.records is not None:
            return torch.from_numpy(engine.facilitations(self.records, isi_ms.contiguous().numpy()))
        return levels(self.person, isi_ms.unsqueeze(0))

    @cached_property
    def _outcome_table(self) -> Tensor:
        """Probability of each outcome of the next trial in each row, shape (b, s, l, y)."""
        low, high = log_ends(self._log_floor, self._evoked)
        middle, width = _cells(low.device)
        log_mep = low.unsqueeze(-1) + middle * (high - low).unsqueeze(-1)
        if self.records is not None:
            cells = log_mep.numpy(), width.numpy()
            return torch.from_numpy(engine.outcome_tables(self.records, self._rows.numpy(), self.order, *cells))
        response = self.person.response
        gain = log_gain(response, torch.full_like(response.drift, self.order).unsqueeze(-1)).squeeze(-1)
        response = response._replace(log_ratio=response.log_ratio + gain)
        others = (self._rows, log_mep.unsqueeze(-2))
        mass = in_pieces(outcome_density, response, others, LEVELS * OUTCOMES * NODES) * width
        return mass / mass.sum(-1, keepdim=True)


def log_ends(log_floor: Tensor, evoked: Tensor) -> tuple[Tensor, Tensor]:
    """Between which log MEPs outcomes lie, each of shape (b,)."""
    top = log_floor + torch.log1p(evoked.amax(-1))
    return _quantile(log_floor, 0.05) - 1.0, _quantile(top, 0.95) + 1.5


def _quantile(values: Tensor, share: float) -> Tensor:
    """A quantile of values (b, s), shape (b,); `torch.quantile` takes ten times as long for so few."""
    place = share * (values.shape[-1] - 1)
    picks = [int(place), min(int(place) + 1, values.shape[-1] - 1)]
    low, high = torch.from_numpy(np.partition(values.cpu().numpy(), picks)[:, picks]).to(values.device).unbind(-1)
    return torch.lerp(low, high, place - picks[0])


@cache
def _cells(device: torch.device) -> tuple[Tensor, Tensor]:
    """Middles and widths of the cells, each (y,)."""
    ends = cell_ends(device)
    return 0.5 * (ends[1:] + ends[:-1]), ends.diff()


@cache
def cell_ends(device: torch.device) -> Tensor:
    """Ends of the cells of the log MEP, from 0 to 1, (y + 1,); narrow where MEPs are as small as the floor."""
    return torch.linspace(0.0, 1.0, OUTCOMES + 1, dtype=torch.float32, device=device).pow(1.5)
