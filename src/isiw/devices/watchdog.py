"""A small process beside isiw that disarms a device if isiw dies, whatever it dies of."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

from isiw.errors import DeviceError

_SCRIPT: Final = Path(__file__).with_name("watchdog_process.py").absolute()
_STARTING_S: Final = 10.0
_ENDING_S: Final = 2.0

SUPPORTED: Final = os.name == "posix"
"""Whether a process can inherit a connection here."""


class Watchdog:
    """A process that sends an instrument its command to disarm when this process is gone, however it went.

    It inherits the connection, so that no serial port is opened again, which would restart many boards. Start it
    before the instrument can be armed, and end it when nothing is armed any more, before the connection is closed.

    Args:
        handle: the connection's number, such as `port.fileno()`.
        disarm: all that is sent, ends of lines included; it must disarm in any state, also after half a line.

    Raises:
        DeviceError: the process does not start; on Windows always. Nothing should be armed then.
    """

    def __init__(self, handle: int, disarm: bytes) -> None:
        command = [sys.executable, "-I", "-S", str(_SCRIPT), str(handle), str(os.getpid()), disarm.hex()]
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own script
                command,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                pass_fds=(handle,),
                start_new_session=True,  # Ctrl-C and a terminal that closes are isiw's own to hear
                cwd=os.sep,
            )
        except (OSError, ValueError) as error:
            raise _not_started(f"{error}") from error
        if not self._ready:
            self.end()
            raise _not_started("it does not say that it is ready")

    @property
    def _ready(self) -> bool:
        said = self._process.stdout
        return said is not None and bool(select.select([said], [], [], _STARTING_S)[0]) and said.read(1) == b"+"

    @property
    def process(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def watches(self) -> bool:
        """True as long as the process runs."""
        return self._process.poll() is None

    def end(self) -> None:
        """End the process, which sends nothing then; calling it again is harmless."""
        with suppress(OSError, ValueError):  # it has ended already
            if self._process.stdin is not None:
                self._process.stdin.write(b".")
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            self._process.wait(_ENDING_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _not_started(why: str) -> DeviceError:
    return DeviceError(
        "the process that would disarm the device if isiw died does not start, so nothing is armed",
        got=why,
        expected=f"{sys.executable or 'the Python'} that runs isiw, on Linux or macOS",
    )
