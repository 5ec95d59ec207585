"""A tapping robot that is right, and eight ways in which a rig is wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.robot.tapper import Tapper, TapperSettings
from isiw.devices.simulated import SimulatedDevice
from isiw.findings import Kind
from isiw.subjects.cohorts import cohort
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus
from isiw.types import Reference

SPACE = DesignSpace(0, 320, reference="impact")


def tapper(seed: int = 0, *, accelerometer: bool = True, name: str = "gaussian") -> Tapper:
    person = cohort(name, seed + 1, 700)[seed].begin(seed)
    reference: Reference = "impact" if accelerometer else "valve"
    settings = TapperSettings(reference=reference, accelerometer=accelerometer, rate_hz=3000.0)
    return Tapper(lambda isi_ms: person.respond(isi_ms, "impact"), "subject1", settings, seed=seed)


class WrongRig:
    """A tapping robot whose sweeps are changed on their way to isiw."""

    def __init__(self, wrong: Callable[[Sweep], Sweep], seed: int = 0, *, accelerometer: bool = True) -> None:
        self.right, self.wrong = tapper(seed, accelerometer=accelerometer), wrong

    @property
    def info(self) -> DeviceInfo:
        return self.right.info

    def answer(self, stimulus: Stimulus) -> Sweep:
        return self.wrong(self.right.answer(stimulus))


def _with(sweep: Sweep, **channels: Channel) -> Sweep:
    return dataclasses.replace(sweep, channels={**sweep.channels, **channels})


def _changed(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Sweep], Sweep]:
    def wrong(sweep: Sweep) -> Sweep:
        channel = sweep.channels[name]
        return _with(sweep, **{name: dataclasses.replace(channel, values=change(channel.values))})

    return wrong


def _tense(values: np.ndarray) -> np.ndarray:
    return values + 0.06 * np.random.default_rng(0).standard_normal(values.size)


def _swapped(sweep: Sweep) -> Sweep:
    emg, acceleration = sweep.channels["emg"], sweep.channels["acceleration"]
    return _with(
        sweep,
        emg=dataclasses.replace(emg, values=acceleration.values),
        acceleration=dataclasses.replace(acceleration, values=emg.values),
    )


def _at_another_rate(sweep: Sweep) -> Sweep:
    slower = {name: dataclasses.replace(channel, rate_hz=2000.0) for name, channel in sweep.channels.items()}
    return dataclasses.replace(sweep, channels=slower)


def doubled(gap_ms: float) -> Callable[[Sweep], Sweep]:
    """A stimulator that is left on paired pulses: another artefact so long after the pulse, or before it."""

    def wrong(sweep: Sweep) -> Sweep:
        emg, at_ms = sweep.channels["emg"], sweep.t_tms_ms
        if at_ms is None:
            return sweep
        first, other = (round((ms - emg.t0_ms - 1.0) * emg.rate_hz / 1000) for ms in (at_ms, at_ms + gap_ms))
        values, lasts = emg.values.copy(), round(0.002 * emg.rate_hz)
        values[other : other + lasts] += emg.values[first : first + lasts]
        return _with(sweep, emg=dataclasses.replace(emg, values=values))

    return wrong


WRONG: Mapping[str, Callable[[Sweep], Sweep]] = {
    "tense muscle": _changed("emg", _tense),
    "inverted accelerometer": _changed("acceleration", np.negative),
    "µV as mV": _changed("emg", lambda values: 1e3 * values),
    "V as mV": _changed("emg", lambda values: 1e-3 * values),
    "swapped channels": _swapped,
    "no impact": _changed("acceleration", lambda v: 0.3 * np.random.default_rng(0).standard_normal(v.size)),
    "wrong rate": _at_another_rate,
    "dead amplifier": _changed("emg", np.zeros_like),
}

NAMED: Mapping[str, str] = {
    "tense muscle": "muscle is tense",
    "inverted accelerometer": "accelerometer is inverted",
    "µV as mV": "in µV, and described as mV",
    "V as mV": "in V, and described as mV",
    "swapped channels": "swapped",
    "no impact": "no impact",
    "wrong rate": "sampling rate",
    "dead amplifier": "flat line",
}
"""By what words each is told."""

KINDS: Mapping[str, set[Kind]] = {
    "tense muscle": {Kind.BACKGROUND_ACTIVITY},
    "inverted accelerometer": {Kind.INVERTED},
    "µV as mV": {Kind.LOUD},
    "V as mV": {Kind.QUIET},
    "swapped channels": {Kind.SWAPPED},
    "no impact": {Kind.NO_IMPACT},
    "wrong rate": {Kind.STRAY_EDGE, Kind.TMS_BEFORE_IMPACT, Kind.ISI_OFF},
    "dead amplifier": {Kind.FLAT_LINE},
}
"""As what each may be found."""


def rig(wrong: str | None = None, seed: int = 0, *, accelerometer: bool = True) -> SimulatedDevice:
    """A rig that is wrong in one way, or right."""
    change = WRONG[wrong] if wrong else lambda sweep: sweep
    return SimulatedDevice(WrongRig(change, seed, accelerometer=accelerometer))
