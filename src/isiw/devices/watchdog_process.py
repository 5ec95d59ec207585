"""The process beside isiw that disarms a device when isiw is gone; a plain script, since it has to start at once.

python -I -S watchdog_process.py HANDLE PARENT DISARM

HANDLE is the connection, which it inherits, PARENT the process that it watches, DISARM in hexadecimal digits what it
sends. Standard input ends when no process holds its other end any more; a byte there means that all is well.
"""

from __future__ import annotations

import os
import select
import sys
import time
from contextlib import suppress

_GLANCE_S = 0.1
_TIMES = 3  # an answer is not waited for, and a line can be damaged on its way
_BETWEEN_S = 0.1
_PATIENCE_S = 5.0  # with an instrument that takes nothing


def released(parent: int) -> bool:
    """Wait until isiw lets go, which is True, or is gone.

    A process that isiw has forked keeps the other end open, so its parent's number is looked at, too.
    """
    while os.getppid() == parent:
        if select.select([0], [], [], _GLANCE_S)[0]:
            return bool(os.read(0, 1))
    return False


def send(handle: int, data: bytes, until_s: float) -> None:
    """Write all of it to a handle that may refuse to wait."""
    while data and (left_s := until_s - time.monotonic()) > 0:
        select.select([], [handle], [], left_s)
        try:
            data = data[os.write(handle, data) :]
        except BlockingIOError:
            time.sleep(0.005)


def main() -> None:
    """Watch, and disarm."""
    inherited, parent, disarm = int(sys.argv[1]), int(sys.argv[2]), bytes.fromhex(sys.argv[3])
    handle = os.dup(inherited)  # a small number, as select wants it
    os.close(inherited)
    with suppress(OSError):  # nobody is left to read it
        os.write(1, b"+")
    if released(parent):
        return
    until_s = time.monotonic() + _PATIENCE_S
    with suppress(OSError):  # the connection is gone, too
        for _ in range(_TIMES):
            send(handle, disarm, until_s)
            time.sleep(_BETWEEN_S)


if __name__ == "__main__":
    main()
