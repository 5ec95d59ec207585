"""When something happened: by the computer's clock, which may be set, and since the computer was started.

The second is measured by a clock that nobody sets and that goes on while the computer sleeps, and is compared only
within one start of one computer. Linux has both; elsewhere the computer's clock is all there is.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple, Self


class Moment(NamedTuple):
    """A moment.

    Args:
        wall_ns: by the computer's clock [ns since 1970, UTC].
        boot_id: the start of the computer that `boot_s` counts from; empty if that is not known.
        boot_s: since then, sleep included [s]; None if that is not known.
    """

    wall_ns: int
    boot_id: str = ""
    boot_s: float | None = None

    @classmethod
    def now(cls) -> Self:
        """This moment."""
        return cls(time.time_ns(), boot_id(), boot_s())

    def since_s(self, other: Moment) -> float | None:
        """The time from another moment until this one [s], whatever the clock was set to; None if it is not known."""
        if not self.boot_id or self.boot_id != other.boot_id or self.boot_s is None or other.boot_s is None:
            return None
        return self.boot_s - other.boot_s


@cache
def boot_id() -> str:
    """The name of this start of the computer, which no other one has; empty where the system gives none."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""


def boot_s() -> float | None:
    """The time since the computer was started, sleep included [s]; None where the system does not tell."""
    if sys.platform == "linux":
        return round(time.clock_gettime(time.CLOCK_BOOTTIME), 3)
    return None


@dataclass(frozen=True)
class Ages:
    """How long ago some stimuli were given.

    Args:
        ages_s: of each, the oldest first [s].
        doubts: a sentence for each thing that is wrong with the clock by which that is known.
    """

    ages_s: tuple[float, ...] = ()
    doubts: tuple[str, ...] = ()
