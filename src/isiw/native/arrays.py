"""Arrays as the engine takes them: what they hold, and where they begin."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

FIELDS: Final = 27
"""Of a particle; their names and order are those of `isiw.models.particles.records`."""

COLUMNS: Final = 11
"""Of a trial, likewise."""

KINDS: Final = 5
"""Of a particle: its profile's shape, its noise, whether there is an enhancement, and a depression, and its change."""

MEANINGS: Final = 32
"""Latents that mean anything: those of the default in their order, then three of a depression."""

LANES: Final = 16
"""Latents that do not move are padded to whole vectors of any processor."""

UNKNOWN: Final = np.float32(1e30)
"""In place of the log density of a block that was not worked out yet."""

SINGLE, DOUBLE = np.dtype(np.float32), np.dtype(np.float64)
WHOLE, NATURAL, FLAG = np.dtype(np.int64), np.dtype(np.uint64), np.dtype(np.bool_)

Seeds: TypeAlias = NDArray[np.uint64]


def address(array: NDArray[np.generic], dtype: np.dtype[np.generic], *shape: int) -> int:
    """Where an array begins, if it is what the engine takes it for: C reads and writes all of the shape."""
    if array.dtype != dtype or array.shape != shape or not array.flags.c_contiguous:
        raise ValueError(f"the engine needs {dtype} {shape} side by side, not {array.dtype} {array.shape}")
    return int(array.__array_interface__["data"][0])
