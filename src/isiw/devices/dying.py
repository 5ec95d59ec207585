"""A process that arms an instrument over a connection and waits to be killed, for `isiw check`.

python -m isiw.devices.dying HANDLE ARM DISARM
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from isiw.devices.watchdog import Watchdog


def armed_by_another(handle: int, arm: bytes, disarm: bytes) -> subprocess.Popen[bytes]:
    """Start a process that inherits the connection of this number, has a watchdog of its own, and arms."""
    return subprocess.Popen(  # noqa: S603 - our own module
        [sys.executable, "-m", "isiw.devices.dying", str(handle), arm.hex(), disarm.hex()],
        stdin=subprocess.PIPE,
        pass_fds=(handle,),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path or str(Path.cwd()) for path in sys.path)},
    )


def main() -> None:
    """Arm, and wait."""
    handle = int(sys.argv[1])
    watchdog = Watchdog(handle, bytes.fromhex(sys.argv[3]))
    os.write(handle, bytes.fromhex(sys.argv[2]))
    sys.stdin.read()  # until it is killed, or nobody is left who would
    watchdog.end()


if __name__ == "__main__":
    main()
