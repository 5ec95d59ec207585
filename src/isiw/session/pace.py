"""How long the stimuli that are left may take, by the pace of the last ones."""

from __future__ import annotations

import itertools
import statistics
from collections import deque
from typing import Final

__all__ = ["Pace"]

_LAST: Final = 20


class Pace:
    """The usual time between the last stimuli; a rest or a pause among them does not change it."""

    def __init__(self) -> None:
        self._ends_s: deque[float] = deque(maxlen=_LAST + 1)

    def passed(self, now_s: float) -> None:
        """A stimulus was delivered.

        Args:
            now_s: the time [s].
        """
        self._ends_s.append(now_s)

    def left_s(self, stimuli: int) -> float | None:
        """About how long so many stimuli take [s]; None before the second one.

        Args:
            stimuli: how many.
        """
        gaps_s = [after - before for before, after in itertools.pairwise(self._ends_s)]
        return stimuli * statistics.median(gaps_s) if gaps_s else None
