"""The impact of the hammer as it happens, by the rule of `isiw.signals.impact`: samples go in, the impact comes out.

It is called at the first sample whose deceleration exceeds the acceleration before the fall, at most 5 ms after it.
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
from isiw.signals.impact import DETECTION_LATENCY_MS, FALL_MS, HYSTERESIS_SD, MOTION_MS, last_fall
from isiw.signals.waveforms import REST_MS, rest_level
from isiw.types import ArrayLike, FloatArray


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


class _Window(NamedTuple):
    """Samples above the level at rest: some that are known already, then the new ones."""

    above_rest: FloatArray
    begin: int
    new: int

    @property
    def end(self) -> int:
        return self.begin + len(self.above_rest)


class _Search:
    """Looks for one impact after a valve command."""

    def __init__(self, rate_hz: float, valve: int, rest: FloatArray) -> None:
        level, noise = rest_level(rest[None], len(rest), rate_hz)
        self.level, self._band = float(level[0, 0]), HYSTERESIS_SD * float(noise[0, 0])
        self._valve, self._rate_hz = valve, rate_hz
        self._fall, self._motion, self._latency = (
            round(ms * rate_hz / 1000) for ms in (FALL_MS, MOTION_MS, DETECTION_LATENCY_MS)
        )
        self._pending: list[_Fall] = []

    def found(self, window: _Window) -> Impact | None:
        """The impact, if it shows in the new samples."""
        self._pending += self._falls(window)
        calls = []
        for fall in self._pending:
            since = max(fall.sample, window.new)
            new = window.above_rest[since - window.begin : fall.last + 1 - window.begin]
            enough = np.flatnonzero(new < -fall.least_deceleration)
            calls += [(since + int(enough[0]), fall)] if enough.size else []
        self._pending = [fall for fall in self._pending if fall.last >= window.end]
        if not calls:
            return None
        known, fall = min(calls)
        return Impact(*((sample - self._valve) * 1000 / self._rate_hz for sample in (fall.crossing, known)))

    def _falls(self, window: _Window) -> Iterator[_Fall]:
        """The falls among the new samples behind which the hammer had begun to move."""
        above, first = window.above_rest, max(window.new, self._valve + 1) - window.begin
        low = above < -self._band
        for sample in np.flatnonzero(low[first:] & ~low[first - 1 : -1]) + first:
            fall = above[sample - self._fall : sample + 1]
            motion = float(above[sample - self._fall - self._motion : sample - self._fall].mean())
            if fall.max() > self._band and motion > self._band:
                number = window.begin + int(sample)
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
        found = self._search.found(_Window(known - self._search.level, window_begin, begin))
        self._search = None if found else self._search
        return found

    def _lost(self, what: str, remedy: str) -> InvalidValueError:
        """What is said where samples are lost, after which nothing is known of the hammer."""
        self._kept, self._search = np.empty(0), None
        return InvalidValueError(
            what, remedy=f"{remedy} No impact is looked for until valve() is called again, after 20 ms of rest."
        )
