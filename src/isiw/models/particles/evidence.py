"""What the trials so far say about each particle: the history, and its likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch

from isiw.models.particles.prior import Person
from isiw.models.particles.response import NODES, Response, log_gain, log_likelihood
from isiw.models.particles.shapes import facilitation
from isiw.models.protocol import Observation, Tensor

__all__ = ["ISI_NODES", "History", "in_pieces", "levels", "observed", "total_log_likelihood"]

CHUNK_ELEMENTS = 1 << 20
"""On a CPU the likelihood is worked through in pieces of this many nodes: few calls, and bounded memory."""

ISI_NODES = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))
"""Nodes [SD] and weights of an uncertain ISI."""


@dataclass(frozen=True, eq=False)
class History:
    """The trials told so far; amplitudes are intervals of log mV, which are points where the amplitude is known.

    Args:
        isi_ms: realised ISIs [ms]; NaN is TMS alone, shape (b, n).
        isi_sd_ms: their SDs [ms], shape (b, n).
        log_mep: lower end of the log MEP, shape (b, n).
        log_mep_high: upper end, shape (b, n).
        order: how many trials came before each, shape (b, n).
    """

    isi_ms: Tensor
    isi_sd_ms: Tensor
    log_mep: Tensor
    log_mep_high: Tensor
    order: Tensor

    @classmethod
    def empty(cls, people: int, device: torch.device) -> History:
        """No trials."""
        return cls(*(torch.empty((people, 0), device=device) for _ in range(5)))

    @property
    def columns(self) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """All of it, in order."""
        return self.isi_ms, self.isi_sd_ms, self.log_mep, self.log_mep_high, self.order

    def to(self, device: torch.device | str, dtype: torch.dtype) -> History:
        """The same on another device, or in another precision."""
        return History(*(column.to(device, dtype) for column in self.columns))

    def appended(self, trial: History) -> History:
        """This history and one more trial."""
        return History(*(torch.cat(pair, dim=-1) for pair in zip(self.columns, trial.columns, strict=True)))


def observed(observation: Observation, detection_limit_mv: float, response_threshold_mv: float, order: int) -> History:
    """One trial of each person as a history.

    Args:
        observation: the trial.
        detection_limit_mv: what an amplitude of 0 is known to be below [mV].
        response_threshold_mv: what a response is known to be above, and no response below [mV].
        order: how many trials came before.
    """
    seen, silent = observation.response == 1, observation.response == 0
    log_mep = torch.log(observation.mep_mv)
    limit, threshold = math.log(detection_limit_mv), math.log(response_threshold_mv)
    low = torch.where(seen, threshold, torch.where(silent, -torch.inf, log_mep))
    high = torch.where(seen, torch.inf, torch.where(silent, threshold, log_mep))
    high = torch.where(observation.mep_mv == 0, limit, high)
    columns = (observation.isi_ms, observation.isi_sd_ms, low, high, torch.full_like(log_mep, order))
    return History(*(x.unsqueeze(-1) for x in columns))


def levels(person: Person, isi_ms: Tensor) -> Tensor:
    """Facilitation of each particle, shape (b, p, n).

    Args:
        person: particles, fields of shape (b, p).
        isi_ms: ISIs [ms], shape (b or 1, n); NaN is TMS alone.
    """
    level = facilitation(person.shape, isi_ms.unsqueeze(-2)).mul_(person.present.unsqueeze(-1))
    return level.nan_to_num_(0.0)


def total_log_likelihood(person: Person, history: History) -> Tensor:
    """Log likelihood of a history under each particle, shape (b, p).

    An ISI that is known with an SD only is integrated out on three Gauss-Hermite nodes.

    Args:
        person: particles, fields of shape (b, p).
        history: trials of b people.
    """
    if not bool((history.isi_sd_ms > 0).any()):
        return _by_trial(person, history, history.isi_ms).sum(-1)
    nodes = [
        _by_trial(person, history, history.isi_ms + shift * history.isi_sd_ms) + math.log(weight)
        for shift, weight in ISI_NODES
    ]
    return torch.logsumexp(torch.stack(nodes), dim=0).sum(-1)


def _by_trial(person: Person, history: History, isi_ms: Tensor) -> Tensor:
    """Log likelihood of each trial at some ISIs, shape (b, p, n)."""
    ends = (history.log_mep.unsqueeze(-2), history.log_mep_high.unsqueeze(-2))
    others = (levels(person, isi_ms), *ends, log_gain(person.response, history.order.unsqueeze(-2)))
    return in_pieces(log_likelihood, person.response, others, NODES * isi_ms.shape[-1])


def in_pieces(function: Callable[..., Tensor], response: Response, others: tuple[Tensor, ...], elements: int) -> Tensor:
    """Apply a function of particles piece by piece on a CPU, so that its intermediate values stay small.

    Args:
        function: maps a response (fields (b, p)) and the others to a tensor of shape (b, p, ...).
        response: response parameters, fields of shape (b, p).
        others: tensors of shape (b, p or 1, ...).
        elements: size of the intermediate values for one particle.
    """
    if response.log_floor.is_cuda:
        return function(response, *others)
    people, particles = response.log_floor.shape
    together = max(1, CHUNK_ELEMENTS // max(1, elements * particles))
    step = max(1, CHUNK_ELEMENTS // max(1, elements))
    rows = []
    for some in (slice(first, first + together) for first in range(0, people, together)):
        pieces = [slice(first, first + step) for first in range(0, particles, step)]
        parts = [
            function(
                Response(*(field[some, piece] for field in response)),
                *(x[some, piece] if x.shape[1] == particles else x[some] for x in others),
            )
            for piece in pieces
        ]
        rows.append(torch.cat(parts, dim=1))
    return torch.cat(rows, dim=0)
