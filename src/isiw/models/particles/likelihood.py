"""What the trials so far say about each particle: the likelihood of their history."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from isiw.lazy import torch
from isiw.models.particles.noise import NODES, Response, log_gain, log_likelihood, recruits
from isiw.models.particles.prior import Person
from isiw.models.particles.shapes import facilitation
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.models.shared.tables import FACTOR_NODES, FIRST_GROUP_MS, GROUPS, ISI_GROUP_MS, averaged_over_isi

CHUNK_ELEMENTS = 1 << 20
"""On a CPU the likelihood is worked through in pieces of this many nodes: few calls, and bounded memory."""


def levels(person: Person, isi_ms: Tensor) -> Tensor:
    """Facilitation of each particle, negative where the tap depresses, shape (b, p, n)."""
    level = facilitation(person.shape, isi_ms.unsqueeze(-2)).mul_(person.present.unsqueeze(-1))
    if person.depression is not None:
        shape, depth, present = person.depression
        level -= facilitation(shape, isi_ms.unsqueeze(-2)).mul_((depth * present).unsqueeze(-1))
    return level.nan_to_num_(0.0)


def total_log_likelihood(person: Person, history: History) -> Tensor:
    """Log likelihood of a history under each particle, shape (b, p)."""
    if not history.shares_factor:
        return _at_factor(person, history, 0.0).sum(-1)
    place = (history.isi_ms.nan_to_num(0.0) - FIRST_GROUP_MS) / ISI_GROUP_MS
    of_group = torch.nn.functional.one_hot(place.long().clamp(0, GROUPS - 1), GROUPS).to(history.isi_ms)
    nodes = [_at_factor(person, history, at) @ of_group + math.log(share) for at, share in FACTOR_NODES]
    return torch.logsumexp(torch.stack(nodes), dim=0).sum(-1)


def _at_factor(person: Person, history: History, factor_at: float) -> Tensor:
    """Log likelihood of each trial at a node of the factor of known parts, shape (b, p, n)."""
    return averaged_over_isi(partial(_by_trial, person, history, factor_at), history.isi_ms, history.isi_sd_ms)


def _by_trial(person: Person, history: History, factor_at: float, isi_ms: Tensor) -> Tensor:
    """Log likelihood of each trial at some ISIs, shape (b, p, n)."""
    ends = (history.log_mep.unsqueeze(-2), history.log_mep_high.unsqueeze(-2))
    level, gain = levels(person, isi_ms), log_gain(person.response, history.order.unsqueeze(-2))
    known_mv, sd_mv, log_sd, offset, shift_pct_rmt, enhancement, by_curves = history.around.unsqueeze(-3).unbind(-1)
    if factor_at:
        factor = torch.exp(factor_at * log_sd)
        known_mv, sd_mv = known_mv * factor, sd_mv * factor
    if person.change is not None:
        changed = person.change.at(history.order.unsqueeze(-2))
        offset, shift_pct_rmt = offset + changed.log_gain, shift_pct_rmt + changed.shift_pct_rmt
        enhancement, per_scale = enhancement * changed.enhancement, torch.exp(-changed.log_scale)
        ends = (ends[0] - changed.log_scale, ends[1] - changed.log_scale)
        known_mv, sd_mv = known_mv * per_scale, sd_mv * per_scale
    others = (level * enhancement, *ends, gain + offset, shift_pct_rmt, known_mv, sd_mv)
    found = in_pieces(log_likelihood, person.response, others, NODES * isi_ms.shape[-1])
    unknown = ~by_curves.isnan() & ~recruits(person.response.kind).unsqueeze(-1)
    return torch.where(unknown, by_curves, found)


def in_pieces(function: Callable[..., Tensor], response: Response, others: tuple[Tensor, ...], elements: int) -> Tensor:
    """Apply a function of particles piece by piece on a CPU, so that its intermediate values stay small."""
    people, particles = response.log_floor.shape
    if response.log_floor.is_cuda or people * particles * elements <= CHUNK_ELEMENTS:
        return function(response, *others)
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
