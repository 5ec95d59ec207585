"""Files that survive a crash: synced, locked while they are written, and renamed in one step."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO

from isiw.errors import LogError

if sys.platform != "win32":
    import fcntl

__all__ = ["DurableFile", "begun", "disk_errors", "log_of", "part_of", "refuse_if_locked", "sync_folder"]


def part_of(path: Path) -> Path:
    """Where a log is while it is being written.

    Raises:
        LogError: the path names no file.
    """
    if not path.name:
        raise LogError("a log needs a file's name", got=str(path))
    return path.with_name(f"{path.name}.part")


def log_of(path: Path) -> Path:
    """Where a log is once it is finished, from either of its names."""
    return path.with_suffix("") if path.suffix == ".part" else path


def sync_folder(folder: Path) -> None:
    """Make a rename in this folder durable; Windows does so by itself."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _lock(file: IO[bytes], path: Path) -> None:
    """Claim a file until it is closed; Windows does not let an open file be replaced anyway.

    Raises:
        LogError: another process has it.
    """
    if sys.platform == "win32":
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise LogError(
            "the log is being written by a running session", got=str(path), remedy="End that session first."
        ) from error


def refuse_if_locked(path: Path) -> None:
    """Raise where another process writes to a file.

    Raises:
        LogError: it does.
    """
    with path.open("rb") as file:
        _lock(file, path)


@contextmanager
def disk_errors(path: Path, what: str, remedy: str) -> Iterator[None]:
    """Within, an error of the operating system becomes a LogError.

    Args:
        path: the file, for the message.
        what: what failed, for the message.
        remedy: the way out.
    """
    try:
        yield
    except OSError as error:
        raise LogError(f"{what}: {error.strerror}", got=str(path), remedy=remedy) from error


_writing = partial(
    disk_errors,
    what="the log cannot be written",
    remedy="What was synced before is safe. Make room, then resume the session.",
)


class DurableFile:
    """A new binary file that can be renamed while it is written.

    Args:
        path: where it is; must not exist.

    Raises:
        LogError: it exists, or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        with disk_errors(path, "the log cannot be created", "Choose another path."):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[bytes] = path.open("xb")
        self.path = path
        _lock(self._file, path)

    def write(self, data: bytes) -> int:
        """Append."""
        with _writing(self.path):
            return self._file.write(data)

    def tell(self) -> int:
        """Size so far."""
        return self._file.tell()

    def flush(self) -> None:
        """Hand everything to the operating system."""
        with _writing(self.path):
            self._file.flush()

    def sync(self) -> None:
        """Make everything so far durable."""
        with _writing(self.path):
            self._file.flush()
            os.fsync(self._file.fileno())

    def move_to(self, path: Path) -> None:
        """Take another file's place in one step, and go on there."""
        self.close()
        self.path.replace(path)
        sync_folder(path.parent)
        self.path = path
        self._file = path.open("r+b")
        self._file.seek(0, os.SEEK_END)
        _lock(self._file, path)

    def close(self) -> None:
        """Make everything durable and close."""
        if self._file.closed:
            return
        try:
            self.sync()
        finally:
            with _writing(self.path):
                self._file.close()

    def abandon(self) -> None:
        """Close, whatever has become of it."""
        with suppress(OSError):
            self._file.close()


@contextmanager
def begun(path: Path) -> Iterator[DurableFile]:
    """A new file that is removed if its first records fail; once it has taken another file's place, it stays.

    Raises:
        LogError: it exists, or cannot be created.
    """
    file = DurableFile(path)
    try:
        yield file
    except BaseException:
        file.abandon()
        path.unlink(missing_ok=True)
        raise
