"""Clocks, by which real devices wait and simulated ones do not, and when the next stimulus may come."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol, runtime_checkable

from isiw.devices.allowed import earliest_s
from isiw.devices.limits import PulseLimits
from isiw.errors import LimitExceededError, NotDelivered

ROUNDING_S = 1e-6
"""Who sleeps for exactly as long as is left may wake up a rounding error early."""


@runtime_checkable
class Clock(Protocol):
    """Tells the time since an arbitrary moment, and waits."""

    def now_s(self) -> float:
        """The time [s]; never runs backwards."""

    def sleep_s(self, duration_s: float) -> None:
        """Wait [s]; not at all if the duration is not positive."""


class MonotonicClock:
    """The computer's monotonic clock."""

    def now_s(self) -> float:
        """The time since an arbitrary moment [s]."""
        return time.monotonic()

    def sleep_s(self, duration_s: float) -> None:
        """Wait at least so long [s]."""
        end_s = self.now_s() + duration_s
        while (left_s := end_s - self.now_s()) > 0:  # a sleep may end a little early
            time.sleep(left_s)


class VirtualClock:
    """A clock that moves on only by sleeping.

    Args:
        now_s: the time it shows at first [s].
    """

    def __init__(self, now_s: float = 0.0) -> None:
        self._now_s = now_s

    def now_s(self) -> float:
        """The virtual time [s]."""
        return self._now_s

    def sleep_s(self, duration_s: float) -> None:
        """Move on by so long [s], at once."""
        self._now_s += max(0.0, duration_s)


class Pacing:
    """The times of a session's stimuli, and the waits before each; the first waits too, as nobody knows what came."""

    def __init__(self, limits: PulseLimits, clock: Clock, earlier_s: Sequence[float] = ()) -> None:
        self._limits, self._clock = limits, clock
        self._since_s = clock.now_s()
        self._times_s = [self._since_s - age_s for age_s in sorted(earlier_s, reverse=True)]

    def wait_s(self, interval_s: float = 0.0) -> float:
        """The time until the next stimulus may come [s]."""
        return self.ahead_s((interval_s,))

    def ahead_s(self, intervals_s: Sequence[float]) -> float:
        """The time that the next stimuli take at these intervals, or as the limits allow [s]."""
        now_s, times_s = self._clock.now_s(), list(self._times_s)
        for interval_s in intervals_s:
            last_s = times_s[-1] if times_s else self._since_s
            times_s.append(max(now_s, last_s + interval_s, earliest_s(self._limits, times_s, self._since_s)))
        return times_s[-1] - now_s if intervals_s else 0.0

    def begin_again(self) -> None:
        """From now on there may be stimuli; the next one comes a whole interval later at the earliest."""
        self._since_s = self._clock.now_s()

    def came(self) -> None:
        """A stimulus has just come."""
        self._times_s.append(self._clock.now_s())

    @contextmanager
    def delivering(self) -> Iterator[None]:
        """Within, a stimulus is delivered. It counts from its end, even if it fails, unless it was refused."""
        self.came()
        try:
            yield
        except (NotDelivered, LimitExceededError):
            self._times_s.pop()
            raise
        except BaseException:
            self._times_s[-1] = self._clock.now_s()
            raise
        self._times_s[-1] = self._clock.now_s()
