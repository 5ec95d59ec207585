"""Randomness of sampled models: a stream of its own for each step, and picks of weighted samples."""

from __future__ import annotations

from typing import Final

import numpy as np

from isiw.lazy import torch
from isiw.models.protocol import Tensor

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
    cumulative = log_weights.double().softmax(-1).cumsum(-1)
    points = (torch.arange(size, device=log_weights.device, dtype=torch.double) + 0.5) / size
    picks = torch.searchsorted(cumulative, points.expand(len(cumulative), -1).contiguous())
    return picks.clamp_max(log_weights.shape[-1] - 1)
