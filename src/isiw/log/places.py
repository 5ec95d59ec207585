"""Where a log is while it is written and once it is finished, and which file is there."""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO, NamedTuple, Self

from isiw.errors import LogError


class Fingerprint(NamedTuple):
    """Which file it is, and in which state: it differs if a file was written to, or another is in its place."""

    device: int
    inode: int
    size: int
    changed_ns: int

    @classmethod
    def of(cls, file: IO[bytes] | Path) -> Self:
        """The fingerprint of an open file, or of the file at a path."""
        found = file.stat() if isinstance(file, Path) else os.fstat(file.fileno())
        return cls(found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)


def part_of(path: Path) -> Path:
    """Where a log is while it is being written."""
    if not path.name:
        raise LogError("a log needs a file's name", got=str(path))
    return path.with_name(f"{path.name}.part")


def log_of(path: Path) -> Path:
    """Where a log is once it is finished, from either of its names."""
    if "\0" in str(path):
        raise LogError("no file can have a NUL character in its path", got=str(path), remedy="Choose another path.")
    return path.with_suffix("") if path.suffix == ".part" else path


def log_exists(log: Path) -> bool:
    """True if there is a log of this name, finished or still being written."""
    return log.exists() or part_of(log).exists()
