"""What an acquisition function is, and how its scores become the next ISI."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import torch

from isiw.models.protocol import Tensor

__all__ = ["AcquisitionFunction", "best_candidate"]


@runtime_checkable
class AcquisitionFunction(Protocol):
    """A settings object that scores candidate ISIs under a posterior; higher is better."""

    @property
    def needs(self) -> tuple[type, ...]:
        """The capability protocols that a posterior must have."""

    def __call__(self, posterior: Any, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs [ms], shape (t,), for each person, shape (b, t)."""


def best_candidate(scores: Tensor) -> Tensor:
    """Index of the best candidate for each person, shape (b,); a tie goes to the first, a score not finite loses.

    Args:
        scores: shape (b, t).
    """
    return torch.where(torch.isfinite(scores), scores, -torch.inf).argmax(dim=-1)
