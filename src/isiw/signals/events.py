"""The events of a tap in its waveforms, by hysteresis about the level at rest [Kim2020, 3.3.1, Table 3.1]."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from isiw.errors import InvalidValueError
from isiw.signals.impact import HYSTERESIS_SD, VALVE_MS, impact_times
from isiw.signals.mep import EARLIEST_ONSET_MS
from isiw.signals.waveforms import as_waveforms, crossing_before, first_true, is_recording, per_waveform, rest_level
from isiw.sweeps import Channel, Sweep
from isiw.types import ArrayLike, FloatArray

MOTION_SD = 3.0
ARTEFACT_SEARCH_MS = (12.0, 30.0)  # four people: 18 to 23 ms after the impact, SD below 2 (Table 3.2)
ARTEFACT_SPAN_MS = (-1.0, 2.0)
EMG_DELAY_MS = (20.5, 2.4)
"""From the hit to the EMG's deviation [ms]: mean and SD over the four people of Table 3.2 (18, 23, 19 and 22 ms)."""

AFTER_VALVE_MS = (40.0, 450.0)
"""In which the tap shows in the EMG, of a rig of any hit delay from 20 to 430 ms."""

LATEST_MEP_MS = 50.0  # after the pulse, in hand muscles


@dataclass(frozen=True, eq=False)
class TapEvents:
    """The events of n taps [ms from the first sample], each of shape (n,), NaN where not found.

    Args:
        fill_ms: the chamber's pressure begins to rise.
        descent_ms: the hammer begins its descent: its acceleration goes above a threshold for good.
        hit_ms: the hammer hits: the acceleration falls through its level at rest.
        away_ms: the tendon has pushed the hammer back: the next rise through that level.
        memg_ms: the EMG shows the tap.
    """

    fill_ms: FloatArray
    descent_ms: FloatArray
    hit_ms: FloatArray
    away_ms: FloatArray
    memg_ms: FloatArray

    def columns(self) -> dict[str, FloatArray]:
        """The events by name, in order of occurrence."""
        return {field.name.removesuffix("_ms"): getattr(self, field.name) for field in fields(self)}


def detect_events(
    acceleration: ArrayLike,
    rate_hz: float,
    *,
    pressure: ArrayLike | None = None,
    emg: ArrayLike | None = None,
    valve_ms: float = VALVE_MS,
    t_tms_ms: ArrayLike | None = None,
) -> TapEvents:
    """Find the events of n taps.

    Args:
        acceleration: of the hammer, positive towards the tendon, shape (n, w).
        rate_hz: sampling rate of all waveforms [Hz].
        pressure: of the chamber, shape (n, w); None if not recorded.
        emg: shape (n, w); None if not recorded.
        valve_ms: the valve command [ms from the first sample].
        t_tms_ms: the magnetic pulse of each sweep [ms from the first sample], whose own artefact is passed over.

    Raises:
        InvalidValueError: a waveform that is not a recording, or waveforms of different shapes.
    """
    waves = as_waveforms(acceleration, rate_hz, "acceleration")
    hit = impact_times(waves, rate_hz, valve_ms)
    descent, away = _descent_and_away(waves, rate_hz, hit, valve_ms)
    fill = memg = np.full(len(waves), math.nan)
    if pressure is not None:
        fill = first_rise(_like(pressure, waves, rate_hz, "pressure"), rate_hz, valve_ms)
    if emg is not None:
        memg = _in_emg(_like(emg, waves, rate_hz, "EMG"), rate_hz, hit, valve_ms, per_waveform(t_tms_ms, waves))
    return TapEvents(fill, descent, hit, away, memg)


def sweep_events(sweep: Sweep) -> TapEvents:
    """Find the events of one recorded tap, in ms of the sweep's own clock.

    A channel that is empty, constant or not finite shows no event; without a usable acceleration there is none at all.

    Args:
        sweep: with an acceleration and the valve's time; pressure and EMG where they have the same samples.

    Raises:
        InvalidValueError: no acceleration, no valve time, or too low a sampling rate.
    """
    channel = sweep.channels.get("acceleration")
    if channel is None or sweep.t_valve_ms is None:
        raise InvalidValueError(
            "the timing of a tap needs its acceleration and the time of the valve command",
            got=sorted(sweep.channels),
            expected="a channel named acceleration, and t_valve_ms",
        )
    if not is_recording(channel.values):
        return TapEvents(*(np.full(1, math.nan) for _ in fields(TapEvents)))
    pressure, emg = (_same_samples(sweep.channels.get(name), channel) for name in ("pressure", "emg"))
    found = detect_events(
        channel.values,
        channel.rate_hz,
        pressure=pressure,
        emg=emg,
        valve_ms=sweep.t_valve_ms - channel.t0_ms,
        t_tms_ms=None if sweep.t_tms_ms is None else sweep.t_tms_ms - channel.t0_ms,
    )
    return TapEvents(*(times + channel.t0_ms for times in found.columns().values()))


def _same_samples(channel: Channel | None, other: Channel) -> FloatArray | None:
    """The samples of a channel, where it was recorded, and at the same times as another."""
    if channel is None or (channel.rate_hz, channel.t0_ms) != (other.rate_hz, other.t0_ms):
        return None
    return channel.values if channel.values.shape == other.values.shape and is_recording(channel.values) else None


def first_rise(waves: FloatArray, rate_hz: float, valve_ms: float) -> FloatArray:
    """When each waveform first rises above its noise after the valve command [ms], NaN if never, shape (n,)."""
    valve = round(valve_ms * rate_hz / 1000)
    level, noise = rest_level(waves, valve, rate_hz)
    risen = waves > level + HYSTERESIS_SD * noise
    risen[:, :valve] = False
    return crossing_before(waves, level + MOTION_SD * noise, first_true(risen)) * 1000 / rate_hz


def _like(values: ArrayLike, waves: FloatArray, rate_hz: float, name: str) -> FloatArray:
    other = as_waveforms(values, rate_hz, name)
    if other.shape != waves.shape:
        raise InvalidValueError(
            f"the {name} and the acceleration must have one shape", got=other.shape, expected=str(waves.shape)
        )
    return other


def load_cell_times(force: ArrayLike, rate_hz: float, *, valve_ms: float = VALVE_MS) -> FloatArray:
    """When the hammer hits a load cell [ms from the first sample], NaN where it does not, shape (n,).

    The bench tests took the hit from it, since it answers faster than the accelerometer [Kim2020, 3.3.2, 4.2.2].

    Args:
        force: on the load cell, positive under load, any unit, shape (n, w).
        rate_hz: sampling rate [Hz].
        valve_ms: the valve command [ms from the first sample]; nothing presses before it.

    Raises:
        InvalidValueError: a waveform that is not a recording, or less than 20 ms of rest.
    """
    return first_rise(as_waveforms(force, rate_hz, "force"), rate_hz, valve_ms)


def _descent_and_away(
    acceleration: FloatArray, rate_hz: float, hit_ms: FloatArray, valve_ms: float
) -> tuple[FloatArray, FloatArray]:
    level, noise = rest_level(acceleration, round(valve_ms * rate_hz / 1000), rate_hz)
    columns = np.arange(acceleration.shape[-1])
    hit = np.where(np.isnan(hit_ms), -1, np.floor(hit_ms * rate_hz / 1000)).astype(np.int64)
    descent = crossing_before(acceleration, level + MOTION_SD * noise, hit)
    pushed = (acceleration < level - MOTION_SD * noise) & (columns > hit[:, None])
    bottom = first_true(pushed)
    risen = (acceleration > level + MOTION_SD * noise) & (columns > bottom[:, None]) & (bottom >= 0)[:, None]
    away = crossing_before(acceleration, level, np.where(hit >= 0, first_true(risen), -1))
    return descent * 1000 / rate_hz, away * 1000 / rate_hz


def impact_times_in_emg(
    emg: ArrayLike, rate_hz: float, *, valve_ms: float = VALVE_MS, t_tms_ms: ArrayLike | None = None
) -> FloatArray:
    """When the hammer hit, by what the tap does to the EMG [ms from the first sample], NaN if never, shape (n,).

    For rigs without an accelerometer: the EMG deviates some 20 ms after the hit [Kim2020, 3.3.3]. It is the mean of
    `EMG_DELAY_MS` earlier; its SD is how far a person's hits may all be off. What begins 10 to 50 ms after the magnetic
    pulse may be the MEP, and is left out.

    Args:
        emg: shape (n, w).
        rate_hz: sampling rate [Hz].
        valve_ms: the valve command [ms from the first sample].
        t_tms_ms: the magnetic pulses [ms from the first sample], shape (n,), NaN for none; None if there are none.

    Raises:
        InvalidValueError: a waveform that is not a recording, or less than 20 ms of rest.
    """
    waves = as_waveforms(emg, rate_hz, "emg")
    earliest_ms, pulse_ms = np.full(len(waves), valve_ms), per_waveform(t_tms_ms, waves)
    return _in_emg(waves, rate_hz, earliest_ms, valve_ms, pulse_ms, AFTER_VALVE_MS) - EMG_DELAY_MS[0]


def _in_emg(
    waves: FloatArray,
    rate_hz: float,
    hit_ms: FloatArray,
    valve_ms: float,
    pulse_ms: FloatArray,
    span_ms: tuple[float, float] = ARTEFACT_SEARCH_MS,
) -> FloatArray:
    """When the tap shows in the EMG [ms], NaN if never; what begins 10 to 50 ms after the pulse may be the MEP."""
    level, noise = rest_level(waves, round(valve_ms * rate_hz / 1000), rate_hz)
    deviation = np.abs(waves - level)
    times = np.arange(waves.shape[-1]) * 1000 / rate_hz
    since_pulse = times - pulse_ms[:, None]
    deviation[(since_pulse >= ARTEFACT_SPAN_MS[0]) & (since_pulse <= ARTEFACT_SPAN_MS[1])] = 0.0
    since_hit = times - hit_ms[:, None]
    sought = (since_hit >= span_ms[0]) & (since_hit <= span_ms[1])
    sought &= ~((since_pulse >= EARLIEST_ONSET_MS) & (since_pulse <= LATEST_MEP_MS))
    shown = first_true(sought & (deviation > HYSTERESIS_SD * noise))
    onset: FloatArray = crossing_before(deviation, MOTION_SD * noise, shown) * 1000 / rate_hz
    return onset
