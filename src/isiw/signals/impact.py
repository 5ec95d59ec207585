"""The impact of the hammer in its acceleration [Kim2020, 3.3.1, 5.2.2].

The first time that the acceleration falls through its level at rest, with a band of the sweep's own noise about it;
and, by momentum, the fall is steep, and the deceleration exceeds the acceleration before it. `ImpactDetector` calls it
as it happens: at the first sample whose deceleration exceeds the acceleration before the fall, at most 5 ms after it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from isiw.checks import number, whole
from isiw.errors import InvalidValueError
from isiw.findings import RATE_HZ
from isiw.signals.waveforms import REST_MS, as_waveforms, rest_level
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
    low = above_rest[:, valve:] < -band[:, None]
    rows, columns = np.nonzero(low[:, 1:] & ~low[:, :-1])
    falls = columns + valve + 1  # the first samples below the band
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


@dataclass(frozen=True)
class Impact:
    """An impact, on the clock of the valve command.

    Args:
        hit_ms: when the hammer hit [ms].
        known_ms: when the sample was taken that showed it [ms].
    """

    hit_ms: float
    known_ms: float


class _Fall(NamedTuple):
    """A fall through the hysteresis band that may be an impact; all in samples since the first."""

    sample: int
    crossing: float
    least_deceleration: float
    last: int


class _Search:
    """Looks for one impact after a valve command."""

    def __init__(self, rate_hz: float, valve: int, rest: FloatArray) -> None:
        level, noise = rest_level(rest[None], len(rest), rate_hz)
        self._level, self._band = float(level[0, 0]), HYSTERESIS_SD * float(noise[0, 0])
        self._valve, self._rate_hz = valve, rate_hz
        self._fall, self._motion, self._latency = (
            round(ms * rate_hz / 1000) for ms in (FALL_MS, MOTION_MS, DETECTION_LATENCY_MS)
        )
        self._pending: list[_Fall] = []

    def found(self, samples: FloatArray, begin: int, new: int) -> Impact | None:
        """The impact, if it shows in samples that begin with some that are known already, from the first new one on."""
        above_rest = samples - self._level
        self._pending += self._falls(above_rest, begin, new)
        calls = []
        for fall in self._pending:
            since = max(fall.sample, new)
            shown = above_rest[since - begin : fall.last + 1 - begin]
            enough = np.flatnonzero(shown < -fall.least_deceleration)
            calls += [(since + int(enough[0]), fall)] if enough.size else []
        self._pending = [fall for fall in self._pending if fall.last >= begin + len(samples)]
        if not calls:
            return None
        known, fall = min(calls)
        return Impact(*((sample - self._valve) * 1000 / self._rate_hz for sample in (fall.crossing, known)))

    def _falls(self, above: FloatArray, begin: int, new: int) -> Iterator[_Fall]:
        """The falls among the new samples behind which the hammer had begun to move."""
        low, first = above < -self._band, max(new, self._valve + 1) - begin
        for sample in np.flatnonzero(low[first:] & ~low[first - 1 : -1]) + first:
            fall = above[sample - self._fall : sample + 1]
            motion = float(above[sample - self._fall - self._motion : sample - self._fall].mean())
            if fall.max() > self._band and motion > self._band:
                number = begin + int(sample)
                crossing = number - self._fall + float(last_fall(fall[None])[0])
                last = min(number + self._latency - 1, math.floor(crossing + self._latency))
                yield _Fall(number, crossing, motion, last)


class ImpactDetector:
    """Finds one impact after each valve command in samples that arrive piece by piece.

    It knows of an impact at most 5 ms after it; the length of the pieces comes on top. Samples that are not finite, or
    that do not follow on those before, are an error, after which nothing is found until the next valve command.

    Args:
        rate_hz: sampling rate [Hz].

    Raises:
        InvalidValueError: a rate at which no impact is resolved.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = number("rate_hz", rate_hz, least=RATE_HZ.least)
        self._keep = round(REST_MS * rate_hz / 1000)
        self._kept: FloatArray = np.empty(0)
        self._next = 0
        self._search: _Search | None = None

    def valve(self) -> None:
        """The valve command comes with the next sample: the level at rest is read, and an impact is looked for.

        Raises:
            InvalidValueError: less than 20 ms of rest before it.
        """
        self._search = None
        self._search = _Search(self._rate_hz, self._next, self._kept)

    def add(self, samples: ArrayLike, first: int | None = None) -> Impact | None:
        """Take in the next samples; the impact, once after each valve command, or None.

        Args:
            samples: acceleration, positive towards the tendon, any unit, shape (w,).
            first: number of the first of them, as what delivers them counts; None if it does not count.

        Raises:
            InvalidValueError: samples that are not finite, or that do not follow on those before.
        """
        new = np.atleast_1d(np.asarray(samples, dtype=np.float64))
        begin = self._next if first is None else whole("first", first, least=0)
        missing, self._next = begin - self._next, begin + new.size
        if new.ndim != 1 or not np.isfinite(new).all():
            raise self._lost("samples of the acceleration are no vector of finite numbers", "Check the sensor.")
        if missing and len(self._kept):
            raise self._lost(
                f"samples of the acceleration do not follow on those before: {missing} are missing",
                "Check what delivers them, and how fast they are taken in.",
            )
        known = np.concatenate([self._kept, new])
        window_begin, self._kept = begin - len(self._kept), known[-self._keep :]
        if self._search is None:
            return None
        found = self._search.found(known, window_begin, begin)
        self._search = None if found else self._search
        return found

    def _lost(self, what: str, remedy: str) -> InvalidValueError:
        """What is said where samples are lost, after which nothing is known of the hammer."""
        self._kept, self._search = np.empty(0), None
        return InvalidValueError(
            what, remedy=f"{remedy} No impact is looked for until valve() is called again, after 20 ms of rest."
        )
