"""A sample of the posterior: predictive distributions, windows and profiles of equally weighted particles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.likelihood import in_pieces, levels
from isiw.models.particles.noise import NODES, Response, evoked_mean, log_gain, outcome_density
from isiw.models.particles.prior import Person
from isiw.models.particles.shapes import facilitation, highest_facilitation, reaches
from isiw.models.protocol import Tensor
from isiw.models.shared.tables import LEVELS, OUTCOMES, interpolated, table_levels
from isiw.models.windows import least_excess_mv

__all__ = ["PersonSample", "outcome_table"]

FINE_MS = 1.0
"""Between the points of such a grid facilitation hardly changes."""


@dataclass(frozen=True, eq=False)
class PersonSample:
    """What equally weighted particles say about the next MEP and about the window.

    Args:
        person: the particles, fields of shape (b, s).
        space: the design space, in whose range a window is looked for.
        order: how many trials came before the next one.
    """

    person: Person
    space: DesignSpace
    order: int = 0

    @cached_property
    def _levels(self) -> Tensor:
        return table_levels(self.person.present.device)[None, None, :]

    @cached_property
    def _evoked(self) -> Tensor:
        """Expected MEP above the floor at the tables' levels, in floors, shape (b, s, l)."""
        return evoked_mean(self.person.response, self._levels)

    @cached_property
    def _highest(self) -> Tensor:
        """Largest facilitation on the space's grid, shape (b, s); on a fine one that of its whole range."""
        if self.space.step_ms <= FINE_MS:
            return highest_facilitation(self.person.shape, self.space.low_ms, self.space.high_ms)
        grid_ms = torch.tensor(self.space.grid_ms, dtype=torch.float32, device=self.person.present.device)
        return facilitation(self.person.shape, grid_ms).amax(-1)

    @cached_property
    def edge_level(self) -> Tensor:
        """Facilitation at a window's edge by the least-excess rule; above 1 where there is no window, shape (b, s)."""
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
        return reaches(self.person.shape, self.edge_level, isi_ms).to(torch.float32)

    def expected_mep_mv(self, isi_ms: Tensor) -> Tensor:
        """Expected MEP [mV], shape (b, s, t)."""
        evoked = interpolated(self._evoked.unsqueeze(-1), levels(self.person, isi_ms.unsqueeze(0)))
        return self._with_floor_mv(evoked.squeeze(-1))

    def baselines_mv(self) -> Tensor:
        """Expected MEP without a tap [mV], shape (b, s)."""
        return self._with_floor_mv(self._evoked[..., :1]).squeeze(-1)

    def _with_floor_mv(self, evoked: Tensor) -> Tensor:
        """From an expected MEP above the floor, in floors, to mV, shape (b, s, ...)."""
        response = self.person.response
        rest = torch.exp(0.5 * response.floor_log_sd.square()).unsqueeze(-1)
        return response.log_floor.exp().unsqueeze(-1) * (evoked + rest)

    @cached_property
    def _outcome_table(self) -> Tensor:
        """Probability of each outcome of the next trial at the tables' levels, shape (b, s, l, y)."""
        levels = self._levels.expand(len(self.person.present), -1, -1)
        return outcome_table(self.person.response, levels, self._evoked, self.order)

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP under each particle, shape (b, s, t, y)."""
        return interpolated(self._outcome_table, levels(self.person, isi_ms.unsqueeze(0)))

    def mep_quantiles_mv(self, isi_ms: Tensor, shares: Tensor) -> Tensor:
        """Quantiles of the next MEP [mV], shape (b, t, q).

        Args:
            isi_ms: ISIs [ms], shape (t,).
            shares: which quantiles, shape (q,).
        """
        below = torch.nn.functional.pad(self.outcome_mass(isi_ms).mean(1).cumsum(-1), (1, 0))
        wanted = shares.expand(*below.shape[:-1], -1).contiguous()
        right = torch.searchsorted(below, wanted).clamp(1, OUTCOMES)
        less, more = below.gather(-1, right - 1), below.gather(-1, right)
        ends = _cell_ends(below.device)
        place = torch.lerp(ends[right - 1], ends[right], (wanted - less) / (more - less).clamp_min(1e-12))
        low, high = (end[:, None, None] for end in _log_ends(self.person.response, self._evoked))
        return torch.exp(low + place * (high - low))


def outcome_table(response: Response, levels: Tensor, evoked: Tensor, order: int) -> Tensor:
    """Probability of each outcome of the next trial at some levels of facilitation, shape (b, s, l, y).

    Args:
        response: response parameters, fields of shape (b, s).
        levels: facilitation, shape (b, 1 or s, l).
        evoked: expected MEP above the floor there, in floors, shape (b, s, l).
        order: how many trials came before.
    """
    low, high = _log_ends(response, evoked)
    gain = log_gain(response, torch.full_like(response.drift, order).unsqueeze(-1)).squeeze(-1)
    response = response._replace(log_ratio=response.log_ratio + gain)
    ends = _cell_ends(low.device)
    middle, width = 0.5 * (ends[1:] + ends[:-1]), ends.diff()
    log_mep = (low.unsqueeze(-1) + middle * (high - low).unsqueeze(-1)).unsqueeze(-2)
    density = in_pieces(outcome_density, response, (levels, log_mep), levels.shape[-1] * OUTCOMES * NODES)
    mass = density * width
    return mass / mass.sum(-1, keepdim=True)


def _log_ends(response: Response, evoked: Tensor) -> tuple[Tensor, Tensor]:
    """Between which log MEPs outcomes lie, each of shape (b,)."""
    top = response.log_floor + torch.log1p(evoked.amax(-1))
    low = torch.quantile(response.log_floor, 0.05, dim=-1) - 1.0
    return low, torch.quantile(top, 0.95, dim=-1) + 1.5


def _cell_ends(device: torch.device) -> Tensor:
    """Ends of the cells of the log MEP, from 0 to 1; narrow where MEPs are as small as the floor, which varies little.

    Shape (y + 1,).
    """
    return torch.linspace(0.0, 1.0, OUTCOMES + 1, dtype=torch.float32, device=device).pow(1.5)
