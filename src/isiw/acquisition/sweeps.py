"""Designs that do not look at the responses: random and evenly spaced ISIs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch

from isiw.models.protocol import Posterior, Tensor

__all__ = ["EvenSpacing", "RandomIsi", "golden_index"]

_GOLDEN = (5**0.5 - 1) / 2


def golden_index(trial: int, candidates: int) -> int:
    """The candidate of a trial in an order that fills the range evenly, however long it goes on.

    Args:
        trial: number of the trial, from 0.
        candidates: how many candidates there are.
    """
    return int((0.5 + trial * _GOLDEN) % 1.0 * candidates)


def _only(index: int, isi_ms: Tensor) -> Tensor:
    scores = torch.zeros((1, len(isi_ms)))
    scores[0, index] = 1.0
    return scores


@dataclass(frozen=True)
class EvenSpacing:
    """ISIs that fill the range evenly: multiples of the golden ratio, modulo the range."""

    needs: ClassVar[tuple[type, ...]] = ()

    def __call__(self, posterior: Posterior, isi_ms: Tensor) -> Tensor:
        """Score the ISI whose turn it is 1 and all others 0, shape (1, t)."""
        return _only(golden_index(posterior.trials, len(isi_ms)), isi_ms)


@dataclass(frozen=True)
class RandomIsi:
    """Uniformly random ISIs.

    Args:
        seed: seed of the order.
    """

    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = ()

    def __call__(self, posterior: Posterior, isi_ms: Tensor) -> Tensor:
        """Score the ISI drawn for this trial 1 and all others 0, shape (1, t)."""
        rng = np.random.default_rng([self.seed, posterior.trials])
        return _only(int(rng.integers(len(isi_ms))), isi_ms)
