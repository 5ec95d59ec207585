"""The tapping robot with the vane actuator: the wrist is turned after the tap, as in the therapy [Kim2020, 8.1.2].

The strokes of one actuator differ as real ones do, and its sensors record them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from isiw.checks import MOST_DELAY_MS, number, whole
from isiw.devices.info import DeviceInfo
from isiw.devices.robot.tapper import Tapper
from isiw.devices.robot.vane.rotation import ATMOSPHERE_BAR, PA_PER_BAR, Rotations, Vane, rotate
from isiw.signals.impact import VALVE_MS, impact_time
from isiw.signals.spans import MEP_WINDOWS_MS
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus
from isiw.types import FloatArray

RATE_HZ = 1000.0
STROKE_S = 1.0
"""What the text allows for the full range [s]."""

UNITS = {"angle": "deg", "vane_pressure": "kPa"}
"""The unit of each channel; the pressure is that of the filled chamber less that of the other."""

STEP_MS = 0.25  # within 1 ms of a step of 0.1 ms
LEAST_SHARE = 0.1  # of the mean: neither friction nor pressure ever vanishes

STROKES = 32
WAIT_MS = 60.0
STILL_MS = 1000.0  # as long as a usual sweep
LATEST_MEP_MS = max(end for _, end in MEP_WINDOWS_MS.values())


FRICTION_CV, RESERVOIR_CV = 0.1, 0.02
"""SD from stroke to stroke of the friction, and of what the reservoir has above the room's pressure; chosen, as the
dissertation measured neither."""

NOISE_SD: Mapping[str, float] = MappingProxyType({"angle": 0.2, "vane_pressure": 0.5})
"""Of each channel, in its unit."""


def draw_strokes(vane: Vane, n: int, rng: np.random.Generator) -> Rotations:
    """Strokes from one end of the range to the other, n of them."""
    z = rng.standard_normal((2, n))
    friction = np.maximum(1 + FRICTION_CV * z[0], LEAST_SHARE)
    reservoir = np.maximum(1 + RESERVOIR_CV * z[1], LEAST_SHARE)
    gauge_bar, vanes = vane.supply.reservoir_bar - ATMOSPHERE_BAR, []
    for own, pressure in zip(friction.tolist(), reservoir.tolist(), strict=True):
        rotor = replace(vane.rotor, friction_nm=own * vane.rotor.friction_nm)
        supply = replace(vane.supply, reservoir_bar=ATMOSPHERE_BAR + pressure * gauge_bar)
        vanes.append(replace(vane, rotor=rotor, supply=supply))
    return rotate(vanes, duration_s=STROKE_S, half_wave_s=STROKE_S, start_rad=0.0, step_ms=STEP_MS)


def record_strokes(strokes: Rotations, rng: np.random.Generator, rest_ms: float = VALVE_MS) -> dict[str, FloatArray]:
    """Sensor signals of n strokes, by channel in the units of `UNITS`, at `RATE_HZ`, each of shape (n, w)."""
    rest = round(rest_ms * RATE_HZ / 1000)
    clean = {
        "angle": np.degrees(strokes.angle_rad),
        "vane_pressure": PA_PER_BAR / 1000 * (strokes.chamber_bar[:, 0] - strokes.chamber_bar[:, 1]),
    }
    waves = {name: np.pad(values, ((0, 0), (rest, 0)), mode="edge") for name, values in clean.items()}
    return {name: wave + NOISE_SD[name] * rng.standard_normal(wave.shape) for name, wave in waves.items()}


class RotatingTapper:
    """A simulation of the tapping robot that turns the wrist by 180° after each tap; for `SimulatedDevice`.

    The actuator's valve opens a while after the impact, or after the pulse if that comes later, so that nothing
    moves while the MEP is measured. TMS alone is followed by no rotation, nor is a tap whose accelerometer shows no
    impact; without an accelerometer the predicted impact counts. Before the next trial the hand has been brought back.
    The sweep has two channels more: the shaft's angle, and the pressure difference of the chambers.

    Args:
        tapper: the tapping robot.
        vane: the actuator; by default the middle of those that the dissertation recommends.
        wait_ms: from the impact or the pulse to the opening of the actuator's valve [ms].
        seed: of the strokes, of which 32 are drawn that come in turn, and of the sensors' noise.

    Raises:
        InvalidValueError: a wait in which an MEP may still come, or a negative seed.
    """

    def __init__(self, tapper: Tapper, vane: Vane | None = None, *, wait_ms: float = WAIT_MS, seed: int = 0) -> None:
        self.tapper, self.vane = tapper, vane or Vane()
        self.wait_ms = number("wait_ms", wait_ms, least=LATEST_MEP_MS, most=MOST_DELAY_MS)
        self._seed = whole("seed", seed, least=0)

    @property
    def info(self) -> DeviceInfo:
        """The robot's description of itself."""
        robot = self.tapper.info
        return replace(robot, name=f"{robot.name} with vane actuator", channels={**robot.channels, **UNITS})

    def answer(self, stimulus: Stimulus) -> Sweep:
        """Tap, pulse, turn the wrist, and record; it fails as the tapping robot does."""
        sweep, rng = self.tapper.answer(stimulus), np.random.default_rng([self._seed, stimulus.trial])
        hit_ms, acceleration = sweep.t_hit_ms, sweep.channels.get("acceleration")
        if sweep.t_valve_ms is not None and acceleration is not None:
            hit_ms = impact_time(acceleration.values, acceleration.rate_hz, VALVE_MS)
        if hit_ms is None:  # there was no tap to turn after, and the wrist is still
            rest_ms, kept = STILL_MS, round(STILL_MS * RATE_HZ / 1000)
        else:
            rest_ms, kept = max(hit_ms, sweep.t_tms_ms or hit_ms) + self.wait_ms, None
        waves = record_strokes(_strokes(self.vane, self._seed).one(stimulus.trial % STROKES), rng, rest_ms=rest_ms)
        turned = {name: Channel(wave[0, :kept], RATE_HZ, UNITS[name]) for name, wave in waves.items()}
        return replace(sweep, channels={**sweep.channels, **turned})


@lru_cache(maxsize=8)
def _strokes(vane: Vane, seed: int) -> Rotations:
    """Solved once for all devices of a session, since a stroke takes longer to solve than a trial to simulate."""
    return draw_strokes(vane, STROKES, np.random.default_rng(seed))
