"""The tapping robot with the vane actuator: the wrist is turned after the tap, as in the therapy [Kim2020, 8.1.2]."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from isiw.checks import MOST_DELAY_MS, number, whole
from isiw.devices.protocol import DeviceInfo
from isiw.devices.robot.tapper import Tapper
from isiw.devices.robot.vane.actuator import Vane
from isiw.devices.robot.vane.rotation import Rotations
from isiw.devices.robot.vane.strokes import RATE_HZ, UNITS, draw_strokes, record_strokes
from isiw.signals.impact import VALVE_MS, impact_time
from isiw.signals.mep import MEP_WINDOWS_MS
from isiw.trials import Channel, Stimulus, Sweep

STROKES = 32
WAIT_MS = 60.0
STILL_MS = 1000.0  # as long as a usual sweep
LATEST_MEP_MS = max(end for _, end in MEP_WINDOWS_MS.values())


class RotatingTapper:
    """A simulation of the tapping robot that turns the wrist by 180° after each tap; for `SimulatedDevice`.

    The actuator's valve opens a while after the impact, or after the pulse where that comes later, so that nothing
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
        """What the robot says about itself."""
        robot = self.tapper.info
        return replace(robot, name=f"{robot.name} with vane actuator", channels={**robot.channels, **UNITS})

    def answer(self, stimulus: Stimulus) -> Sweep:
        """Tap, pulse, turn the wrist, and record.

        Raises:
            DeviceError: as the tapping robot.
        """
        sweep = self.tapper.answer(stimulus)
        return replace(sweep, channels={**sweep.channels, **self._rotation(stimulus.trial, self._start_ms(sweep))})

    def _start_ms(self, sweep: Sweep) -> float | None:
        """When the actuator's valve opens [ms on the sweep's clock]; None where there was no tap to turn after."""
        hit_ms, acceleration = sweep.t_hit_ms, sweep.channels.get("acceleration")
        if sweep.t_valve_ms is not None and acceleration is not None:
            hit_ms = impact_time(acceleration.values, acceleration.rate_hz, VALVE_MS)
        return None if hit_ms is None else max(hit_ms, sweep.t_tms_ms or hit_ms) + self.wait_ms

    def _rotation(self, trial: int, start_ms: float | None) -> dict[str, Channel]:
        rng = np.random.default_rng([self._seed, trial])
        rest_ms = STILL_MS if start_ms is None else start_ms
        waves = record_strokes(_strokes(self.vane, self._seed).one(trial % STROKES), rng, rest_ms=rest_ms)
        kept = round(STILL_MS * RATE_HZ / 1000) if start_ms is None else None
        return {name: Channel(wave[0, :kept], RATE_HZ, UNITS[name]) for name, wave in waves.items()}


@lru_cache(maxsize=8)
def _strokes(vane: Vane, seed: int) -> Rotations:
    """Solved once for all devices of a session, since a stroke takes longer to solve than a trial to simulate."""
    return draw_strokes(vane, STROKES, np.random.default_rng(seed))
