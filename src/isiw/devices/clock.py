"""Clocks: real devices wait, simulated ones do not."""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable

__all__ = ["ROUNDING_S", "Clock", "MonotonicClock", "VirtualClock"]

ROUNDING_S = 1e-6
"""Who sleeps for exactly as long as is left may wake up a rounding error early."""


@runtime_checkable
class Clock(Protocol):
    """Tells the time since an arbitrary moment, and waits."""

    def now_s(self) -> float:
        """The time [s]; never runs backwards."""

    def sleep_s(self, duration_s: float) -> None:
        """Wait [s]; not at all where the duration is not positive."""


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
