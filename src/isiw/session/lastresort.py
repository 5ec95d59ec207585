"""When nothing else helps: the process ends, with the reason on the screen and in the log.

What a process holds open, such as a serial port, is closed by its end; a rig with an interlock disarms by that.
"""

from __future__ import annotations

import os
import threading
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

_LOGGING_S = 2.0


def end_process(reason: str, log: LogWriter | None, code: int) -> Never:
    """End the process at once, whatever its threads are busy with.

    Args:
        reason: why, in words.
        log: the session's log, which stays as it is and can be resumed; None where there is none.
        code: the exit code.
    """
    restore()
    alarm(f"\n{reason} The process ends.")
    if log is not None:
        alarm(f"The log is safe; go on with {log.path}.")
        writing = threading.Thread(target=_write, args=(log, reason), daemon=True)
        writing.start()
        writing.join(_LOGGING_S)  # whatever holds the log up must not hold this up
    os._exit(code)


def _write(log: LogWriter, reason: str) -> None:
    log.append(Event(kind="fault", text=f"{reason} The process ends."))
    log.sync()
