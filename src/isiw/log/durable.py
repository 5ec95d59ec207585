"""Files that survive a crash: synced, locked while they are written, and renamed in one step."""

from __future__ import annotations

import itertools
import os
import shutil
import sys
import tempfile
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
    """Within, what the operating system refuses is a LogError.

    Args:
        path: the file, for the message.
        what: what cannot be done.
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


def _exclusive(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_EXCL, 0o666)


class DurableFile:
    """A new binary file that can be renamed while it is written.

    Args:
        path: where it is; must not exist.

    Raises:
        LogError: it exists, or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        with disk_errors(path, "the log cannot be made", "Choose another path."):
            path.parent.mkdir(parents=True, exist_ok=True)
            # Appending, so that a file that is shortened behind our back stays shorter than what was written.
            self._file: IO[bytes] = open(path, "a+b", opener=_exclusive)  # noqa: SIM115 - Path has no opener
        self.path, self._size = path, 0
        _lock(self._file, path)

    @property
    def closed(self) -> bool:
        """Whether it is closed."""
        return self._file.closed

    def write(self, data: bytes) -> int:
        """Append."""
        with _writing(self.path):
            written = self._file.write(data)
        self._size += written
        return written

    def tell(self) -> int:
        """Size so far."""
        return self._size

    def flush(self) -> None:
        """Hand everything to the operating system."""
        with _writing(self.path):
            self._file.flush()

    def sync(self) -> None:
        """Make everything so far durable."""
        with _writing(self.path):
            self._file.flush()
            os.fsync(self._file.fileno())

    def displacement(self) -> str | None:
        """What has become of the file's name or size behind its back, in words; None where it is as it was synced."""
        try:
            there = self.path.stat()
        except OSError as error:
            return f"the file is gone ({error.strerror})"
        if not os.path.samestat(there, os.fstat(self._file.fileno())):
            return "another file is in its place"
        if there.st_size != self._size:
            return f"the file has {there.st_size} bytes instead of the {self._size} written"
        return None

    def rescued(self, wanted: Path) -> Path:
        """Copy what the open file holds to a free name near the wanted one, and return it.

        The folder is made again where it is gone, and the one for temporary files stands in where that cannot be.
        """
        try:
            wanted.parent.mkdir(parents=True, exist_ok=True)
            return self._copied(wanted.parent, wanted)
        except (OSError, LogError):
            return self._copied(Path(tempfile.gettempdir()), wanted)

    def _copied(self, folder: Path, wanted: Path) -> Path:
        names = (folder / f"{wanted.stem}.rescued{number or ''}{wanted.suffix}" for number in itertools.count())
        with begun(next(name for name in names if not name.exists())) as copy:
            self._file.seek(0)
            shutil.copyfileobj(self._file, copy)
            copy.close()
            sync_folder(folder)
        return copy.path

    def rename(self, path: Path) -> None:
        """Close, and take this name in one step.

        Raises:
            LogError: it cannot be renamed; it stays complete where it is.
        """
        self.close()
        with disk_errors(path, "the log cannot be given its name", f"It is complete, at {self.path}."):
            self.path.replace(path)
            sync_folder(path.parent)

    def move_to(self, path: Path) -> None:
        """Take another file's place in one step, and go on there."""
        self.rename(path)
        self.path = path
        self._file = path.open("a+b")
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
    """A new file that is gone again where its beginning fails; once it has taken another file's place, it stays.

    Raises:
        LogError: it exists, or cannot be made.
    """
    file = DurableFile(path)
    try:
        yield file
    except BaseException:
        file.abandon()
        path.unlink(missing_ok=True)
        raise
