"""A device that writes all that it is told into a file, so that the file says what it knew when isiw died."""

from __future__ import annotations

import os
import time
from pathlib import Path

import isiw
from isiw.devices.dying import armed_by_another

__all__ = ["RecordingDevice"]

_GLANCE_S = 0.002


class RecordingDevice:
    """Arms when it is staged, and takes its time to deliver; a watchdog disarms it if isiw dies.

    Args:
        record: the file, a line for each thing that it was told.
        info: what it says of itself; by default that a watchdog is there.
        takes_s: how long a delivery takes [s].
    """

    def __init__(self, record: Path, info: isiw.DeviceInfo | None = None, takes_s: float = 0.0) -> None:
        self._record, self._takes_s = record, takes_s
        self._info = info or isiw.DeviceInfo("recorder", "valve", if_isiw_dies="watchdog")
        self._handle: int | None = None
        self._watchdog: isiw.Watchdog | None = None

    def describe(self) -> isiw.DeviceInfo:
        """What it is."""
        return self._info

    def stage(self) -> None:
        """Start the watchdog, and arm."""
        self.unstage()
        self._handle = os.open(self._record, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        if self._info.if_isiw_dies == "watchdog":
            self._watchdog = isiw.Watchdog(self._handle, b"disarm\n")
        self._tell("arm")

    def deliver(self, stimulus: isiw.Stimulus, timeout_s: float) -> isiw.Measurement:
        """Fire."""
        del timeout_s
        if not self.is_armed:
            raise isiw.errors.NotDelivered("the recorder is not armed")
        self._tell(f"fire {stimulus.trial}")
        time.sleep(self._takes_s)
        return isiw.Measurement(0.01 + (stimulus.isi_ms or 0.0) / 1e4, stimulus.isi_ms)

    def stop(self) -> None:
        """Disarm."""
        if self._handle is not None:
            self._tell("disarm")

    def unstage(self) -> None:
        """Disarm, and close the file."""
        self.stop()
        if self._watchdog is not None:
            self._watchdog.end()
        if self._handle is not None:
            os.close(self._handle)
        self._handle = self._watchdog = None

    def die_armed(self, timeout_s: float) -> float:
        """How long it stayed armed when a process died that had armed it [s]."""
        if self._handle is None:
            raise isiw.errors.DeviceError("the recorder is not staged")
        self._tell("disarm")
        with armed_by_another(self._handle, b"arm\n", b"disarm\n") as process:
            while not self.is_armed and process.poll() is None:
                time.sleep(_GLANCE_S)
            died_s = time.monotonic()
            process.kill()
        while self.is_armed:
            if time.monotonic() > died_s + timeout_s:
                raise isiw.errors.DeviceError("the recorder is still armed")
            time.sleep(_GLANCE_S)
        return time.monotonic() - died_s

    @property
    def is_armed(self) -> bool:
        """Whether it was told to arm, and not to disarm since."""
        return self.told[-1:] != ["disarm"] and bool(self.told)

    @property
    def told(self) -> list[str]:
        """All that it was told."""
        return self._record.read_text(encoding="ascii").splitlines() if self._record.exists() else []

    def _tell(self, text: str) -> None:
        if self._handle is not None:
            os.write(self._handle, f"{text}\n".encode("ascii"))
