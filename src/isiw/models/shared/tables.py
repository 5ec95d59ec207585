"""Steps that several models share: streams of randomness, picks of samples, nodes and tables of an uncertain ISI."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Final

import numpy as np

from isiw.lazy import torch
from isiw.models.protocol import Tensor

ISI_NODES = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))
"""Gauss–Hermite nodes [SD] and weights of an ISI that is known with an SD only."""


_FACTORS_AT = (-2.0, -1.0, 0.0, 1.0, 2.0)
_DENSITY = tuple(math.exp(-0.5 * at * at) for at in _FACTORS_AT)
FACTOR_NODES = tuple((at, density / sum(_DENSITY)) for at, density in zip(_FACTORS_AT, _DENSITY, strict=True))
"""Nodes [SD] and weights of the log of a factor that is known with an SD only."""

ISI_GROUP_MS, FIRST_GROUP_MS, GROUPS = 15.0, -150.0, 64
"""Trials whose ISIs are in the same stretch of so many ms share one factor: responses hardly change there."""


def averaged_over_isi(log_density: Callable[[Tensor], Tensor], isi_ms: Tensor, isi_sd_ms: Tensor) -> Tensor:
    """Log of a density by ISI; one that is known with an SD only is integrated out."""
    if not bool((isi_sd_ms > 0).any()):
        return log_density(isi_ms)
    nodes = [log_density(isi_ms + shift * isi_sd_ms) + math.log(weight) for shift, weight in ISI_NODES]
    return torch.logsumexp(torch.stack(nodes), dim=0)


LEVELS = 24
"""Facilitations at which responses are worked out; what lies between is interpolated."""

OUTCOMES = 24
"""Cells of the log MEP in which predictive distributions live."""


def table_levels(device: torch.device) -> Tensor:
    """Facilitations at which tables are worked out, denser where responses begin, shape (l,)."""
    return torch.linspace(0.0, 1.0, LEVELS, dtype=torch.float32, device=device).square()


def interpolated(table: Tensor, level: Tensor) -> Tensor:
    """Values between the rows of a table."""
    position = level.clamp(0.0, 1.0).sqrt() * (LEVELS - 1)
    below = position.floor().clamp_max(LEVELS - 2)
    first = LEVELS * torch.arange(table.shape[0] * table.shape[1], device=level.device).view(*table.shape[:2], 1)
    row, above = (first + below.long()).flatten(), (position - below).flatten()
    pairs, weights = torch.stack((row, row + 1), -1), torch.stack((1.0 - above, above), -1)
    rows = table.reshape(-1, table.shape[-1])
    # The weighted sum of each pair of rows in one pass, without the pairs in memory.
    between = torch.nn.functional.embedding_bag(pairs, rows, per_sample_weights=weights, mode="sum")
    return between.view(*level.shape, -1)


SIMULATED: Final = 2**31
NOTED: Final = 2**30
"""The step whose stream simulated people are drawn from, and that of the first change that is noted: no posterior gets
there."""


def step_generator(device: str, seed: int, step: int) -> torch.Generator:
    """A stream of its own for each step, so that a posterior depends on its seed and its trials alone."""
    state = np.random.SeedSequence((seed, step)).generate_state(1, np.uint64)
    return torch.Generator(device=device).manual_seed(int(state[0] >> np.uint64(1)))


def systematic(log_weights: Tensor, size: int) -> Tensor:
    """Evenly spaced picks of weighted particles, in order."""
    cumulative = log_weights.softmax(-1, dtype=torch.double).cumsum(-1)
    points = _evenly_spaced(size, log_weights.device).expand(len(cumulative), -1).contiguous()
    return torch.searchsorted(cumulative, points).clamp_max_(log_weights.shape[-1] - 1)


@cache
def _evenly_spaced(size: int, device: torch.device) -> Tensor:
    """So many points between 0 and 1, shape (size,)."""
    return (torch.arange(size, device=device, dtype=torch.double) + 0.5) / size
