"""What this model has in torch: one person's trials, streams of randomness, nodes of an uncertain ISI, and tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from isiw.lazy import torch
from isiw.models.shared.draws import LEVELS
from isiw.models.shared.history import History

Tensor: TypeAlias = "torch.Tensor"


class Trials(NamedTuple):
    """The trials of one person, in double precision."""

    isi_ms: Tensor  # NaN for TMS alone, (n,)
    isi_sd_ms: Tensor  # (n,)
    log_mep: Tensor  # lower and upper ends [log mV], (n, 2)

    @classmethod
    def of(cls, history: History, person: int = 0) -> Trials:
        """In a fixed order, so that a posterior does not depend on the order in which trials were told."""
        columns = history.columns[person, :, :4].astype(float)
        trials = torch.from_numpy(columns[np.lexsort(columns.T)])
        return cls(trials[:, 0], trials[:, 1], trials[:, 2:])


def step_generator(seed: int, step: int) -> torch.Generator:
    """A stream of its own for each step, so that a posterior depends on its seed and its trials alone."""
    state = np.random.SeedSequence((seed, step)).generate_state(1, np.uint64)
    return torch.Generator().manual_seed(int(state[0] >> np.uint64(1)))


ISI_NODES: Final = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))
"""Gauss–Hermite nodes [SD] and weights of an ISI that is known with an SD only."""


def averaged_over_isi(log_density: Callable[[Tensor], Tensor], isi_ms: Tensor, isi_sd_ms: Tensor) -> Tensor:
    """Log of a density by ISI; one that is known with an SD only is integrated out."""
    if not bool((isi_sd_ms > 0).any()):
        return log_density(isi_ms)
    nodes = [log_density(isi_ms + shift * isi_sd_ms) + math.log(weight) for shift, weight in ISI_NODES]
    return torch.logsumexp(torch.stack(nodes), dim=0)


def table_levels() -> Tensor:
    """Facilitations at which tables are worked out, denser where responses begin, shape (l,)."""
    return torch.linspace(0.0, 1.0, LEVELS, dtype=torch.float32).square()


def interpolated(table: Tensor, level: Tensor) -> Tensor:
    """Values between the rows of a table (b, s, l, y), shape (b, s, t, y)."""
    position = level.clamp(0.0, 1.0).sqrt() * (LEVELS - 1)
    below = position.floor().clamp_max(LEVELS - 2)
    first = LEVELS * torch.arange(table.shape[0] * table.shape[1]).view(*table.shape[:2], 1)
    row, above = (first + below.long()).flatten(), (position - below).flatten()
    pairs, weights = torch.stack((row, row + 1), -1), torch.stack((1.0 - above, above), -1)
    rows = table.reshape(-1, table.shape[-1])
    # The weighted sum of each pair of rows in one pass, without the pairs in memory.
    between = torch.nn.functional.embedding_bag(pairs, rows, per_sample_weights=weights, mode="sum")
    return between.view(*level.shape, -1)
