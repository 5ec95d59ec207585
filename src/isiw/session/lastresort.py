"""When nothing else helps: the process ends, with the reason on the screen and in the log.

What a process holds open, such as a serial port, is closed by its end; a rig with an interlock disarms by that.
"""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress
from typing import Final, Never

from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.operator import alarm
from isiw.session.terminal import restore

STILL_ARMED: Final = 4
"""The exit code where a device could not be disarmed."""

INTERRUPTED: Final = 130
"""The exit code where a session did not react to Ctrl-C: what shells report for it."""

_PATIENCE_S = 2.0
_GLANCE_S = 0.02


def end_process(reason: str, log: LogWriter | None, code: int) -> Never:
    """End the process at once, whatever its threads are busy with."""
    ends = f"{reason} The process ends."
    end_s = time.monotonic() + _PATIENCE_S
    # Each in a thread of its own: a terminal or a disk that holds one up, or is gone, holds up nothing else.
    steps = [threading.Thread(target=_show, args=(ends, log), daemon=True)]
    if log is not None:
        steps.append(threading.Thread(target=_write, args=(ends, log), daemon=True))
    try:
        for step in steps:
            step.start()
        while any(step.is_alive() for step in steps) and time.monotonic() < end_s:
            with suppress(KeyboardInterrupt):  # Ctrl-C pressed again; the process is ending already
                time.sleep(_GLANCE_S)
    finally:
        os._exit(code)


def _show(text: str, log: LogWriter | None) -> None:
    restore()
    safe = "" if log is None else f"\nThe log is safe; go on with {log.path}."
    alarm(f"\n{text}{safe}")


def _write(text: str, log: LogWriter) -> None:
    log.append(Event(kind="fault", text=text))
    log.sync()
