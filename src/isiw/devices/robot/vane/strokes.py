"""Strokes of one actuator that differ as real ones do, and what its sensors record of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isiw.checks import check_numbers, whole
from isiw.devices.robot.vane.actuator import ATMOSPHERE_BAR, PA_PER_BAR, Vane
from isiw.devices.robot.vane.rotation import Rotations, rotate
from isiw.signals.impact import VALVE_MS
from isiw.types import FloatArray

RATE_HZ = 1000.0
STROKE_S = 1.0
"""What the text allows for the full range [s]."""

UNITS = {"angle": "deg", "vane_pressure": "kPa"}
"""The unit of each channel; the pressure is that of the filled chamber less that of the other."""

STEP_MS = 0.25  # within 1 ms of a step of 0.1 ms
LEAST_SHARE = 0.1  # of the mean: neither friction nor pressure ever vanishes


@dataclass(frozen=True)
class Variation:
    """How strokes differ, and the noise of the sensors. The dissertation measured neither; these were chosen.

    Args:
        friction_cv: SD of the friction from stroke to stroke, as a share of its mean.
        reservoir_cv: SD of what the reservoir has above the room's pressure, as a share of its mean.
        angle_sd_deg: noise of the angle sensor [°].
        pressure_sd_kpa: noise of the pressure difference [kPa].

    Raises:
        InvalidValueError: a negative value.
    """

    friction_cv: float = 0.1
    reservoir_cv: float = 0.02
    angle_sd_deg: float = 0.2
    pressure_sd_kpa: float = 0.5

    def __post_init__(self) -> None:
        check_numbers(self, "friction_cv", "reservoir_cv", "angle_sd_deg", "pressure_sd_kpa", least=0)


def draw_strokes(vane: Vane, n: int, rng: np.random.Generator, variation: Variation | None = None) -> Rotations:
    """Strokes from one end of the range to the other, n of them."""
    varied = variation or Variation()
    z = rng.standard_normal((2, whole("n", n, least=1)))
    friction = np.maximum(1 + varied.friction_cv * z[0], LEAST_SHARE)
    reservoir = np.maximum(1 + varied.reservoir_cv * z[1], LEAST_SHARE)
    vanes = [_varied(vane, float(one), float(other)) for one, other in zip(friction, reservoir, strict=True)]
    return rotate(vanes, duration_s=STROKE_S, half_wave_s=STROKE_S, start_rad=0.0, step_ms=STEP_MS)


def _varied(vane: Vane, friction: float, reservoir: float) -> Vane:
    gauge_bar = vane.supply.reservoir_bar - ATMOSPHERE_BAR
    return replace(
        vane,
        rotor=replace(vane.rotor, friction_nm=friction * vane.rotor.friction_nm),
        supply=replace(vane.supply, reservoir_bar=ATMOSPHERE_BAR + reservoir * gauge_bar),
    )


def record_strokes(
    strokes: Rotations, rng: np.random.Generator, variation: Variation | None = None, *, rest_ms: float = VALVE_MS
) -> dict[str, FloatArray]:
    """What the sensors record of n strokes, by channel in the units of `UNITS`, at `RATE_HZ`, each of shape (n, w)."""
    varied, rest = variation or Variation(), round(rest_ms * RATE_HZ / 1000)
    clean = {
        "angle": np.degrees(strokes.angle_rad),
        "vane_pressure": PA_PER_BAR / 1000 * (strokes.chamber_bar[:, 0] - strokes.chamber_bar[:, 1]),
    }
    noise_sd = {"angle": varied.angle_sd_deg, "vane_pressure": varied.pressure_sd_kpa}
    waves = {name: np.pad(values, ((0, 0), (rest, 0)), mode="edge") for name, values in clean.items()}
    return {name: wave + noise_sd[name] * rng.standard_normal(wave.shape) for name, wave in waves.items()}
