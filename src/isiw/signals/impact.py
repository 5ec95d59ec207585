"""The impact of the hammer in its acceleration [Kim2020, 3.3.1, 5.2.2].

The first time that the acceleration falls through its level at rest, with a band of the sweep's own noise about it;
and, by momentum, the fall is steep, and the deceleration exceeds the acceleration before it.
"""

from __future__ import annotations

import math

import numpy as np

from isiw.checks import number
from isiw.errors import InvalidValueError
from isiw.signals.waveforms import as_waveforms, rest_level
from isiw.types import ArrayLike, FloatArray, IntArray

VALVE_MS = 500.0
"""The valve command in a trial of 1 s [Kim2020, 4.2]."""

HYSTERESIS_SD = 6.0
"""Half-width of the hysteresis band, in SDs of the noise at rest."""

FALL_MS = 2.0
"""How long a fall may take."""

MOTION_MS = 10.0
"""How much of the motion before a fall is compared with the deceleration."""

DETECTION_LATENCY_MS = 5.0
"""How much of the deceleration is seen before an impact is called one; nothing can be triggered sooner."""


def impact_time(acceleration: ArrayLike, rate_hz: float, after_ms: float = VALVE_MS) -> float | None:
    """The impact in one sweep [ms from its first sample], or None if there is none.

    Args:
        acceleration: acceleration of the hammer, positive towards the tendon, any unit, shape (w,).
        rate_hz: sampling rate [Hz].
        after_ms: the valve command [ms from the first sample]; the hammer is at rest before it.

    Raises:
        InvalidValueError: a waveform that is not a recording, or less than 20 ms of rest.
    """
    if np.ndim(acceleration) != 1:
        raise InvalidValueError("one sweep is a vector", got=np.shape(acceleration), remedy="Use impact_times.")
    time = float(impact_times(acceleration, rate_hz, after_ms)[0])
    return None if math.isnan(time) else time


def impact_times(acceleration: ArrayLike, rate_hz: float, after_ms: float = VALVE_MS) -> FloatArray:
    """The impact in each of n sweeps [ms from its first sample], NaN where there is none, shape (n,).

    Args:
        acceleration: acceleration of the hammer, positive towards the tendon, any unit, shape (n, w).
        rate_hz: sampling rate [Hz].
        after_ms: the valve command [ms from the first sample]; the hammer is at rest before it.

    Raises:
        InvalidValueError: a waveform that is not a recording, no finite time, or less than 20 ms of rest.
    """
    waves = as_waveforms(acceleration, rate_hz, "acceleration")
    after_ms = number("after_ms", after_ms)
    valve = round(after_ms * rate_hz / 1000)
    level, noise = rest_level(waves, valve, rate_hz)
    above_rest = waves - level
    band = HYSTERESIS_SD * noise[:, 0]
    rows, falls = _falls(above_rest, band, valve)
    steps = round(FALL_MS * rate_hz / 1000)
    fall = _samples(above_rest, rows, falls, -steps, 1)
    motion = _samples(above_rest, rows, falls, -steps - round(MOTION_MS * rate_hz / 1000), -steps).mean(axis=-1)
    deceleration = -_samples(above_rest, rows, falls, 0, round(DETECTION_LATENCY_MS * rate_hz / 1000)).min(axis=-1)
    impact = (fall.max(axis=-1) > band[rows]) & (motion > band[rows]) & (deceleration > motion)
    times = np.full(len(waves), math.nan)
    hit_rows, first = np.unique(rows[impact], return_index=True)  # the candidates ascend within a row
    chosen = np.flatnonzero(impact)[first]
    times[hit_rows] = (falls[chosen] - steps + last_fall(fall[chosen])) * 1000 / rate_hz
    return times


def _falls(above_rest: FloatArray, band: FloatArray, start: int) -> tuple[IntArray, IntArray]:
    """Rows and columns of all samples that are the first below the hysteresis band."""
    low = above_rest[:, start:] < -band[:, None]
    rows, columns = np.nonzero(low[:, 1:] & ~low[:, :-1])
    return rows, columns + start + 1


def _samples(waves: FloatArray, rows: IntArray, columns: IntArray, start: int, stop: int) -> FloatArray:
    """Samples from `start` to `stop` about each (row, column), shape (candidates, stop - start)."""
    about = np.clip(columns[:, None] + np.arange(start, stop), 0, waves.shape[-1] - 1)
    samples: FloatArray = waves[rows[:, None], about]
    return samples


def last_fall(fall: FloatArray) -> FloatArray:
    """Where each row last fell through zero [samples], its last sample being below, its largest above, shape (n,)."""
    last = fall.shape[-1] - 1 - (fall[:, ::-1] > 0).argmax(axis=-1)
    rows = np.arange(len(fall))
    before, after = fall[rows, last], fall[rows, last + 1]
    crossing: FloatArray = last + before / (before - after)
    return crossing
