"""What actuators of different sizes achieve: range and break-away delay by height and depth [Kim2020, 7.4]."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from isiw.checks import number, whole
from isiw.devices.robot.vane.actuator import Vane
from isiw.devices.robot.vane.rotation import rotate
from isiw.types import FloatArray


@dataclass(frozen=True, eq=False)
class Performance:
    """What n actuators achieve under a square wave.

    Args:
        range_share: range of the rotation within a period, as a share of 180°, shape (n,).
        delay_ms: break-away delay after the first command, from rest in mid-range [ms]; NaN without motion, shape (n,).
    """

    range_share: FloatArray
    delay_ms: FloatArray


def performance(
    vanes: Sequence[Vane], *, period_s: float = 1.0, periods: int = 10, step_ms: float = 0.1
) -> Performance:
    """Range and delay of actuators that are commanded to and fro.

    The text's "square wave excitation of 1 sec duration" is taken as one with a period of 1 s: a rotation there and
    back within the second that its 7.1 allows for a full cycle.
    """
    period_s, periods = number("period_s", period_s, above=0), whole("periods", periods, least=1)
    sample_ms = step_ms * max(1, round(2.0 / step_ms))
    done = rotate(vanes, duration_s=period_s * periods, half_wave_s=period_s / 2, step_ms=step_ms, sample_ms=sample_ms)
    last = done.angle_rad[:, done.t_ms >= 1000 * period_s * (periods - 1)]
    return Performance(np.ptp(last, axis=1) / math.pi, done.delay_ms)
