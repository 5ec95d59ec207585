"""Opens a file that others may have put there: a regular one, since a pipe would keep isiw waiting for ever."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from io import BufferedReader
from pathlib import Path
from typing import IO, Final, cast

_LOG: Final = b"\x89MCAP"
"""What every log begins with."""


def opened(path: Path, *, links: bool = True) -> IO[bytes]:
    """A regular file, open for reading."""
    without_waiting = getattr(os, "O_NONBLOCK", 0) | (0 if links else getattr(os, "O_NOFOLLOW", 0))
    file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | without_waiting))  # noqa: SIM115 - pathlib has no opener; the caller closes it
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    raise OSError(errno.EINVAL, "it is no regular file", str(path))


def is_mcap(path: Path) -> bool:
    """True if a file begins as every log does, whatever its name."""
    if not path.is_file():
        return False
    with opened(path) as file:
        return file.read(len(_LOG)) == _LOG


def hash_of(path: Path) -> str:
    """The SHA-256 of a file."""
    with opened(path) as file:
        return hashlib.file_digest(cast("BufferedReader", file), "sha256").hexdigest()
