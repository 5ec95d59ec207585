"""The events of a rotation of the wrist in its waveforms, by the same rule as those of a tap."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from isiw.signals.events import first_rise
from isiw.signals.impact import VALVE_MS
from isiw.signals.waveforms import as_waveforms, crossing_before, first_true, rest_level
from isiw.types import ArrayLike, FloatArray

FULL_RANGE_DEG = 178.0
"""A turn that counts as the full range of 180°: ten noise SDs of a coarse angle sensor less."""


@dataclass(frozen=True, eq=False)
class RotationEvents:
    """The events of n rotations [ms from the first sample], each of shape (n,), NaN where not found.

    Args:
        fill_ms: the pressure difference of the chambers begins to rise.
        motion_ms: the rotation begins.
        end_ms: the full range is reached.
    """

    fill_ms: FloatArray
    motion_ms: FloatArray
    end_ms: FloatArray

    def columns(self) -> dict[str, FloatArray]:
        """The events by name, in order of occurrence."""
        return {field.name.removesuffix("_ms"): getattr(self, field.name) for field in fields(self)}


def detect_rotations(
    angle_deg: ArrayLike, pressure: ArrayLike, rate_hz: float, valve_ms: float = VALVE_MS
) -> RotationEvents:
    """Find the events of n rotations."""
    angles = as_waveforms(angle_deg, rate_hz, "angle")
    level, _ = rest_level(angles, round(valve_ms * rate_hz / 1000), rate_hz)
    full = first_true(angles > level + FULL_RANGE_DEG)
    return RotationEvents(
        fill_ms=first_rise(as_waveforms(pressure, rate_hz, "pressure"), rate_hz, valve_ms),
        motion_ms=first_rise(angles, rate_hz, valve_ms),
        end_ms=np.where(full >= 0, crossing_before(angles, level + FULL_RANGE_DEG, full) * 1000 / rate_hz, math.nan),
    )
