"""Files that survive a crash: synced, locked while they are written, and renamed in one step over nothing else.

A lock ends with its process, whatever ends that: on POSIX it is an advisory one of the open file, on Windows one of a
byte far behind every log's end, since nobody else may read a byte that is locked there.

On Windows an open file can neither be renamed nor replaced, so files are let go of for that moment. These branches have
been type-checked, and have not been run.
"""

from __future__ import annotations

import errno
import itertools
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Final

from isiw.errors import LogError, os_errors
from isiw.files import force, new_file, sync_folder, take_free_place

DAMAGED: Final = ".damaged"
"""Ends the name of a damaged log that is kept."""


class DurableFile:
    """A new binary file that can be renamed while it is written; `wanted` is the name by which errors call it."""

    def __init__(self, path: Path, wanted: Path | None = None) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Appending, so that a file that is shortened behind our back stays shorter than what was written.
        self._file = new_file(path)
        self.path, self._size, self._synced = path, 0, False
        try:
            lock(self._file, wanted or path)
        except LogError:
            self.abandon()
            path.unlink()
            raise

    @property
    def closed(self) -> bool:
        """True if it is closed."""
        return self._file.closed

    def write(self, data: bytes) -> int:
        """Append."""
        with self._writing():
            written = self._file.write(data)
        self._size += written
        return written

    def tell(self) -> int:
        """Size so far."""
        return self._size

    def flush(self) -> None:
        """Hand everything to the operating system."""
        with self._writing():
            self._file.flush()

    def sync(self) -> None:
        """Make everything so far durable."""
        with self._writing():
            self._file.flush()
            force(self._file.fileno())
        self._synced = True

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Within, an error of the disk says what is safe; before the first `sync` nothing is, and it stays as it is."""
        try:
            yield
        except OSError as error:
            if not self._synced:
                raise
            safe = "What was synced before is safe. Make room, then resume the session."
            gone = "The file is gone, too. What can be saved of it is saved when the session ends."
            raise LogError(
                f"the log cannot be written: {error.strerror}",
                got=str(self.path),
                remedy=safe if os.path.lexists(self.path) else gone,
            ) from error

    def displacement(self) -> str | None:
        """The change of the file's name or size behind its back, in words; None if it is as it was synced."""
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
        """Copy what the open file holds to a free name near the wanted one, or in the folder for temporary files."""
        try:
            wanted.parent.mkdir(parents=True, exist_ok=True)
            return self._copied(wanted.parent, wanted)
        except (OSError, LogError):
            tried = "Its folder and the one for temporary files were tried."
            with os_errors(LogError, "what the session still held of the log cannot be saved", wanted, tried):
                return self._copied(Path(tempfile.gettempdir()), wanted)

    def _copied(self, folder: Path, wanted: Path) -> Path:
        names = (folder / f"{wanted.stem}.rescued{number or ''}{wanted.suffix}" for number in itertools.count())
        with begun(next(name for name in names if not os.path.lexists(name))) as copy:
            self._file.seek(0)
            shutil.copyfileobj(self._file, copy)
            copy.close()
            sync_folder(folder)
        return copy.path

    def move_to(self, place: Path, *, replacing: bool, source: IO[bytes] | None = None) -> None:
        """Take another name in one step, and go on there; the lock goes along."""
        self.sync()
        if sys.platform == "win32":
            self._file.close()
            if source is not None:
                source.close()
        if replacing:
            self.path.replace(place)
        else:
            take_free_place(self.path, place)
        self.path = place
        sync_folder(place.parent)
        if sys.platform == "win32":
            self._file = place.open("a+b")
            lock(self._file, place)

    def close(self) -> None:
        """Make everything durable and close."""
        if self._file.closed:
            return
        try:
            self.sync()
        finally:
            with self._writing():
                self._file.close()

    def abandon(self) -> None:
        """Close, whatever has become of it."""
        with suppress(OSError):
            self._file.close()


@contextmanager
def begun(path: Path, wanted: Path | None = None) -> Iterator[DurableFile]:
    """A new file that is removed if its first records fail; once it has taken another file's place, it stays."""
    file = DurableFile(path, wanted)
    try:
        yield file
    except BaseException:
        file.abandon()
        path.unlink(missing_ok=True)
        raise


def kept_for(path: Path) -> Path | None:
    """The log whose damaged file is kept at a path; None if the path's name does not say so."""
    name, damaged, number = path.name.rpartition(DAMAGED)
    return path.with_name(name) if damaged and name and (number.isdecimal() or not number) else None


def keep_damaged(damaged: Path, target: Path) -> None:
    """Keep a damaged file's bytes under a name of their own."""
    names = (target.with_name(f"{target.name}{DAMAGED}{number or ''}") for number in itertools.count())
    kept = next(name for name in names if not os.path.lexists(name))
    try:
        kept.hardlink_to(damaged)
    except OSError:  # a disk without hard links
        with begun(kept) as copy, damaged.open("rb") as source:
            shutil.copyfileobj(source, copy)
            copy.close()
    sync_folder(kept.parent)


if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_BUSY = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
_BYTE = 0x7FFF_FFF0


def claim(file: IO[bytes]) -> bool:
    """Lock an open file until it is closed; False if another process, or another opening of it, has the lock."""
    handle = file.fileno()
    try:
        if sys.platform == "win32":
            before = os.lseek(handle, 0, os.SEEK_CUR)
            os.lseek(handle, _BYTE, os.SEEK_SET)
            try:
                msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(handle, before, os.SEEK_SET)
        else:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _BUSY:
            return False
        raise
    return True


def lock(file: IO[bytes], path: Path) -> None:
    """Lock an open log until it is closed."""
    with os_errors(LogError, "the log cannot be locked", path, "Choose a folder on a local disk."):
        free = claim(file)
    if not free:
        raise LogError(
            "the log is being written by a running session, or by another process that resumes it",
            got=str(path),
            remedy="End that session first.",
        )


@contextmanager
def claimed(path: Path) -> Iterator[IO[bytes]]:
    """Within, a log is this process's alone."""
    with os_errors(LogError, "the log cannot be opened for writing", path, "Check its permissions."):
        try:
            file = path.open("r+b")  # network disks lock only what is open for writing
        except FileNotFoundError as error:
            raise LogError(
                "the log has changed since it was read: it is not there any more",
                got=str(path),
                remedy="Another process may have finished it. Begin again by reading it.",
            ) from error
    with file:
        lock(file, path)
        yield file
