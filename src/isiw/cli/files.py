"""Whether there is a log, and where a command puts a file that nobody gave a place."""

from __future__ import annotations

import itertools
import os
from pathlib import Path


def log_exists(source: str | Path) -> bool:
    """Whether there is a log of this name, closed or not."""
    closed = str(source).removesuffix(".part")
    return Path(closed).is_file() or Path(f"{closed}.part").is_file()


def free_beside(log: Path, suffix: str) -> Path:
    """Where a file of a session goes that nobody gave a place: beside its log, under a name that is free."""
    stem = Path(log.name.removesuffix(".part")).stem
    names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
    return next(path for path in (log.with_name(f"{name}{suffix}") for name in names) if not os.path.lexists(path))
