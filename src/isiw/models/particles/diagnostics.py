"""How well particles represent the posterior after a trial, and when they do not."""

from __future__ import annotations

from typing import NamedTuple

from isiw.lazy import torch
from isiw.models.protocol import Tensor

LEAST_ESS = 0.01
"""Effective sample size before resampling, as a share of the particles: below it a trial contradicted the belief."""

LEAST_ACCEPTED = 0.05
"""Share of the shifts that must be accepted for the particles to explore the posterior."""

LEAST_DISTINCT = 0.4
"""Share of the particles that must differ from each other after the moves."""


class Health(NamedTuple):
    """How b people's particles took a trial; fields of shape (b,).

    Args:
        ess: effective sample size before resampling, as a share of the particles.
        shifts: share of the shifts by differences of other particles that were accepted; NaN where there were none.
        jumps: share of the jumps to other kinds that were accepted; NaN where there were none.
        distinct: share of the particles that differ from each other.
    """

    ess: Tensor
    shifts: Tensor
    jumps: Tensor
    distinct: Tensor


def ess_share(log_weights: Tensor) -> Tensor:
    """Effective sample size as a share of the particles, shape (b,)."""
    share: Tensor = torch.exp(-torch.logsumexp(2.0 * log_weights, dim=-1)) / log_weights.shape[-1]
    return share


def distinct_share(log_likelihood: Tensor) -> Tensor:
    """Share of the particles that differ, shape (b,); equal ones have the same likelihood of the history."""
    changes = log_likelihood.sort(dim=-1).values.diff(dim=-1) != 0
    return (1.0 + changes.sum(-1, dtype=torch.float32)) / log_likelihood.shape[-1]


def trouble_of(health: Health) -> str | None:
    """What is wrong with the particles of any of the people, in sentences; None where nothing is."""
    ess, shifts, distinct = (float(x.nan_to_num(1.0).min()) for x in (health.ess, health.shifts, health.distinct))
    said = []
    if ess < LEAST_ESS:
        said.append(f"The trial contradicts the estimate before it: {ess:.1%} of the particles carry the posterior.")
    if shifts < LEAST_ACCEPTED:
        said.append(f"The particles hardly move: {shifts:.1%} of their shifts were accepted.")
    if distinct < LEAST_DISTINCT:
        said.append(f"The particles are too much alike: {distinct:.0%} of them differ.")
    return " ".join(said) or None
