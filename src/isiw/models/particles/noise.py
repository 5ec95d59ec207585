"""Where the noise of a person's MEPs enters; the law itself is `isiw/native/source/likelihood.h`, and docs/model.md."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from isiw.types import BoolArray, IntArray

PERSISTENCE: Final = 0.97
"""How slowly amplitudes wander, from trial to trial: as an autoregressive walk relaxes towards where it will stay."""


class NoiseKind(IntEnum):
    """Where the noise enters."""

    CONSTANT_CV = 0
    MISSING = 1
    RECRUITMENT = 2
    ALL_OR_NONE = 3
    RECTIFIED = 4
    BY_LEVELS = 5


def recruits(kind: IntArray) -> BoolArray:
    """Which particles know what pulses of another intensity evoke, by a recruitment curve or by levels, same shape."""
    found: BoolArray = (kind == NoiseKind.RECRUITMENT) | (kind >= NoiseKind.RECTIFIED)
    return found
