"""When nothing else helps: the process ends, with the reason on the screen and in the log.

What a process holds open, such as a serial port, is closed by its end; a rig with an interlock disarms by that.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Final, Never

from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.operator import alarm
from isiw.session.terminal import restore

__all__ = ["INTERRUPTED", "STILL_ARMED", "end_process"]

STILL_ARMED: Final = 4
"""The exit code where a device could not be disarmed."""

INTERRUPTED: Final = 130
"""The exit code where a session did not react to Ctrl-C: what shells report for it."""

_PATIENCE_S = 2.0


def end_process(reason: str, log: LogWriter | None, code: int) -> Never:
    """End the process at once, whatever its threads are busy with.

    Args:
        reason: why, in words.
        log: the session's log, which stays as it is and can be resumed; None where there is none.
        code: the exit code.
    """
    ends = f"{reason} The process ends."
    try:
        _try(lambda: _show(ends, log))
        if log is not None:
            _try(lambda: _write(ends, log))
    finally:
        os._exit(code)


def _try(step: Callable[[], object]) -> None:
    """Take a step in a thread of its own: a terminal or a disk that holds it up, or is gone, holds up nothing else."""
    trying = threading.Thread(target=step, daemon=True)
    trying.start()
    trying.join(_PATIENCE_S)


def _show(text: str, log: LogWriter | None) -> None:
    restore()
    safe = "" if log is None else f"\nThe log is safe; go on with {log.path}."
    alarm(f"\n{text}{safe}")


def _write(text: str, log: LogWriter) -> None:
    log.append(Event(kind="fault", text=text))
    log.sync()
