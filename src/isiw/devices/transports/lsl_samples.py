"""A stream of samples of the Lab Streaming Layer: what is kept of it, and the sweep that is cut out by timestamps.

They are the sender's, plus liblsl's clock correction: its own smoothing (`proc_dejitter`) would hide dropped samples.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from isiw.checks import Checked, Natural, Positive, Text
from isiw.errors import DeviceError, NotDelivered
from isiw.types import FloatArray

LATE_S: Final = 1.0
"""How late samples may arrive [s]; what comes later is late, and what does not come is lost."""

_CHUNK: Final = 4096
_NAP_S: Final = 0.005
_GLANCE_S: Final = 0.05


@dataclass(frozen=True)
class LslChannel(Checked):
    """Where a channel of a sweep comes from.

    Args:
        stream: the name of the stream.
        unit: the unit of its samples, such as "mV".
        rate_hz: the sampling rate of the stream [Hz].
        column: which of the stream's channels it is, from 0.

    Raises:
        InvalidValueError: a name or a unit that is no text, a rate that is not positive, or a column below 0.
    """

    stream: Text
    unit: Text
    rate_hz: Positive
    column: Natural = 0


class SampleStream:
    """The newest samples of a stream."""

    def __init__(
        self,
        inlet: Any,  # a pylsl.StreamInlet of numbers
        name: str,
        rate_hz: float,
        max_jitter_ms: float,
        kept_s: float,
        lost: tuple[type[Exception], ...],
    ) -> None:
        self._inlet, self._name, self._rate_hz, self._max_jitter_ms = inlet, name, rate_hz, max_jitter_ms
        self._lost, self._kept = lost, math.ceil(kept_s * rate_hz)
        self._stamps_s: FloatArray = np.empty(0)
        self._values: FloatArray = np.empty((0, 0))
        self._correction_s = 0.0

    def require_live(self, clock: Callable[[], float], history_s: float) -> None:
        """Raise if the stream is not running before anything is delivered."""
        try:
            if not self._update(LATE_S):
                raise self._silent()
            begun_s = float(self._stamps_s[0]) + self._correction_s
            self._await(begun_s + history_s, time.monotonic() + history_s + LATE_S)
        except DeviceError as error:
            remedy = "This stimulus was not delivered. Start the stream again, then resume."
            raise NotDelivered(error.what, remedy=remedy) from error
        age_s = clock() - self._newest_s
        if abs(age_s) > LATE_S:
            raise NotDelivered(
                f"the samples of {self._name} are {'late' if age_s > 0 else 'ahead of time'}",
                got=f"{abs(age_s):.3g} s",
                expected=f"at most {LATE_S:g} s",
                remedy="This stimulus was not delivered. Check the load of both computers, the network, and the "
                "sender's clock.",
            )

    def cut(self, start_s: float, end_s: float, until_s: float) -> tuple[float, FloatArray]:
        """The samples between two times, once they have come."""
        self._await(end_s, until_s)
        times_s = self._stamps_s + self._correction_s
        first, last = np.searchsorted(times_s, (start_s, end_s))
        if times_s[0] > start_s + 1e-3 * self._max_jitter_ms:
            raise DeviceError(
                f"the samples of {self._name} begin after the sweep does", got=f"{times_s[0] - start_s:.3g} s later"
            )
        about = times_s[max(first - 1, 0) : last + 1]  # so that a gap at either end is seen
        check_timing(self._name, about, self._rate_hz, self._max_jitter_ms)
        begin_s = float(np.median(times_s[first:last] - np.arange(last - first) / self._rate_hz))
        return begin_s, self._values[first:last]

    @property
    def _newest_s(self) -> float:
        return self._stamps_s[-1] + self._correction_s if self._stamps_s.size else -math.inf

    def _await(self, end_s: float, until_s: float) -> None:
        """Wait until the samples up to a time have come."""
        heard_s = time.monotonic()
        while (missing_s := end_s - self._newest_s) > 0:
            if self._update(_GLANCE_S):
                heard_s = time.monotonic()
            elif time.monotonic() - heard_s > LATE_S:
                raise self._silent()
            if time.monotonic() > until_s:
                raise DeviceError(
                    f"the samples of {self._name} are late",
                    got=f"{missing_s:.3g} s of the sweep had not come in time",
                    remedy="Check the load of both computers and the network.",
                )

    def _silent(self) -> DeviceError:
        return DeviceError(f"the stream {self._name} has fallen silent", got=f"no sample for {LATE_S:g} s")

    def _update(self, wait_s: float) -> bool:
        """Take what has come since the last time; whether there was anything."""
        end_s = time.monotonic() + wait_s
        try:
            self._correction_s = self._inlet.time_correction(LATE_S)
            while not (pulled := self._pulled()) and time.monotonic() < end_s:
                time.sleep(_NAP_S)
        except self._lost as error:
            raise DeviceError(f"the stream {self._name} is lost", got=str(error)) from error
        return pulled

    def _pulled(self) -> bool:
        """True if samples were there; they are added to what is kept."""
        chunks = [(self._values, self._stamps_s)] if self._stamps_s.size else []
        before = len(chunks)
        while not chunks[before:] or len(chunks[-1][1]) == _CHUNK:
            values, stamps_s = self._inlet.pull_chunk(0.0, _CHUNK, as_numpy=True)
            if not len(stamps_s):
                break
            chunks.append((values, stamps_s))
        if len(chunks) > before:
            self._values = np.concatenate([values for values, _ in chunks])[-self._kept :]
            self._stamps_s = np.concatenate([stamps_s for _, stamps_s in chunks])[-self._kept :]
        return len(chunks) > before


def check_timing(name: str, times_s: FloatArray, rate_hz: float, max_jitter_ms: float) -> None:
    """Raise if samples are missing, or do not come at their rate."""
    if times_s.size < 2:
        raise DeviceError(f"the stream {name} has no samples in the sweep")
    steps_ms = 1e3 * (np.diff(times_s) - 1 / rate_hz)
    longest = int(np.argmax(np.abs(steps_ms)))
    if abs(steps_ms[longest]) > max_jitter_ms:
        back = steps_ms[longest] < 0
        raise DeviceError(
            f"the clock of {name} jumped back" if back else f"samples of {name} were dropped",
            got=f"{abs(steps_ms[longest]):.3g} ms after {1e3 * (times_s[longest] - times_s[0]):.4g} ms of the sweep",
            remedy="Check the load of the sender, its buffers and its cable.",
        )
    off_ms = 1e3 * (times_s - times_s[0] - np.arange(times_s.size) / rate_hz)
    if np.ptp(off_ms) > 2 * max_jitter_ms:
        raise DeviceError(
            f"the samples of {name} do not come at their rate",
            got=f"{(times_s.size - 1) / (times_s[-1] - times_s[0]):.6g} Hz in the sweep",
            expected=f"{rate_hz:g} Hz",
            remedy="Many small gaps look the same. Check the rate that the sender states.",
        )
