"""Reads the computer's clock within what a log can hold: nanoseconds since 1970 in 64 bits, which end in 2554."""

from __future__ import annotations

import datetime as dt
import time
from typing import Final

from isiw.errors import LogError

_END_NS: Final = 2**64


def clock_ns() -> int:
    """What the computer's clock says [ns since 1970]."""
    now_ns = time.time_ns()
    if not 0 <= now_ns < _END_NS:
        raise LogError(
            "the computer's clock is wrong: no log can hold its time",
            got=f"{now_ns // 10**9} s from the beginning of 1970",
            expected="a time from 1970 to 2554",
            remedy="Set the clock, then begin again.",
        )
    return now_ns


def log_time_ns() -> int:
    """The same for a record; 0 where the clock of a running session has been set to a time that no log can hold."""
    return now_ns if 0 <= (now_ns := time.time_ns()) < _END_NS else 0


def now() -> dt.datetime:
    """The same as date and time, in UTC."""
    return dt.datetime.fromtimestamp(clock_ns() // 10**9, dt.UTC)
