"""Steps that several models share: streams of randomness, and picks of samples."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from isiw.native.engine import Seeds
from isiw.types import Array, FloatArray, IntArray

LEVELS: Final = 24
"""Facilitations at which responses are worked out; what lies between is interpolated."""

OUTCOMES: Final = 24
"""Cells of the log MEP in which predictive distributions live."""

NEARLY_NOTHING: Final = -80.0
"""Log of a share of a sum that single precision does not see; powers of e below it are slow."""

SIMULATED: Final = 2**31
NOTED: Final = 2**30
TAUGHT: Final = 2**29
OTHER_HALF: Final = 2**28
"""The steps whose streams simulated people are drawn from, the first change that is noted, what pulses given alone have
taught, and the first of particles that do not learn from these: no posterior gets there."""


def stream(seed: int, step: int) -> np.random.Generator:
    """A stream of its own for each step, so that a posterior depends on its seed and its trials alone."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, step))))


def seeds(seed: int, step: int, people: int) -> Seeds:
    """Seeds of the engine's draws for each person at a step, (b,)."""
    own = (np.random.SeedSequence((seed + person, step)) for person in range(people))
    return np.array([sequence.generate_state(1, np.uint64)[0] for sequence in own], dtype=np.uint64)


def normal_below(z: Array) -> FloatArray:
    """Probability that a standard normal variable is below each of some numbers, same shape.

    SciPy has it too, and takes half a second to be imported.
    """
    found = [0.5 * math.erfc(-x) for x in (z / math.sqrt(2.0)).ravel().tolist()]
    return np.array(found).reshape(z.shape)


def systematic(log_weights: Array, size: int) -> IntArray:
    """Evenly spaced picks of weighted particles (b, p), in order, shape (b, size)."""
    weights = np.exp(log_weights - log_weights.max(-1, keepdims=True), dtype=np.float64)
    cumulative = weights.cumsum(-1)
    points = (np.arange(size) + 0.5) / size
    picks = [own.searchsorted(own[-1] * points) for own in cumulative]
    within: IntArray = np.minimum(np.stack(picks), log_weights.shape[-1] - 1)
    return within
