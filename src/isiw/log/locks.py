"""One writer a file: a lock that ends with its process, whatever ends that.

On POSIX it is an advisory lock of the open file. On Windows it is a lock of one byte far behind every log's end, since
nobody else may read a byte that is locked there; that branch has been type-checked, and has not been run.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from isiw.errors import LogError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_BUSY = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
_BYTE = 0x7FFF_FFF0


def claim(file: IO[bytes]) -> bool:
    """Lock an open file until it is closed; False where another process, or another opening of it, has the lock."""
    try:
        _claim(file.fileno())
    except OSError as error:
        if error.errno in _BUSY:
            return False
        raise
    return True


if sys.platform == "win32":

    def _claim(handle: int) -> None:
        before = os.lseek(handle, 0, os.SEEK_CUR)
        os.lseek(handle, _BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(handle, before, os.SEEK_SET)

else:

    def _claim(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def lock(file: IO[bytes], path: Path) -> None:
    """Lock an open log until it is closed."""
    try:
        free = claim(file)
    except OSError as error:
        raise LogError(
            f"the log cannot be locked: {error.strerror}", got=str(path), remedy="Choose a folder on a local disk."
        ) from error
    if not free:
        raise LogError(
            "the log is being written by a running session, or by another process that resumes it",
            got=str(path),
            remedy="End that session first.",
        )


@contextmanager
def claimed(path: Path) -> Iterator[IO[bytes]]:
    """Within, a log is this process's alone."""
    try:
        file = path.open("r+b")  # network disks lock only what is open for writing
    except FileNotFoundError as error:
        raise LogError(
            "the log has changed since it was read: it is not there any more",
            got=str(path),
            remedy="Another process may have finished it. Begin again by reading it.",
        ) from error
    except OSError as error:
        raise LogError(
            f"the log cannot be opened for writing: {error.strerror}", got=str(path), remedy="Check its permissions."
        ) from error
    with file:
        lock(file, path)
        yield file


def refuse_if_locked(path: Path) -> None:
    """Raise where another process writes to a log."""
    with claimed(path):
        pass
