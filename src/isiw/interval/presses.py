"""Two keys and the time between them, by a monotonic clock that is read when a press arrives."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable
from typing import Final

from isiw.log.production import LONGEST_MS

START: Final = "f"
END: Final = "j"
QUIT: Final = "q"

_GLANCE_S = 0.2


class Presses:
    """Turns key presses into intervals; the thread that reads the keys presses, another one waits."""

    def __init__(self, clock_s: Callable[[], float] = time.perf_counter) -> None:
        self._clock_s = clock_s
        self._begun_s: float | None = None
        self._intervals: queue.SimpleQueue[float] = queue.SimpleQueue()
        self.left, self.resting = False, False

    def press(self, key: str) -> None:
        """Take a key: the first start counts, so that a key that is held down begins one interval only."""
        now_s = self._clock_s()
        if key.lower() == QUIT:
            self.left = True
        elif self.resting:
            self._begun_s = None
        elif key.lower() == START:
            self._begin(now_s)
        elif key.lower() == END and self._begun_s is not None:
            self._intervals.put(1000.0 * (now_s - self._begun_s))
            self._begun_s = None

    def leave(self) -> None:
        """Nobody is there any more."""
        self.left = True

    def next_ms(self) -> float | None:
        """Wait for the next interval [ms]; None where the person leaves instead."""
        while not self.left:
            try:
                return self._intervals.get(timeout=_GLANCE_S)
            except queue.Empty:
                continue
        return None

    def _begin(self, now_s: float) -> None:
        if self._begun_s is None or 1000.0 * (now_s - self._begun_s) > LONGEST_MS:
            self._begun_s = now_s
