"""A folder that is there as a whole or not at all."""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from isiw.errors import InvalidValueError


@contextmanager
def new_folder(target: str | Path) -> Iterator[Path]:
    """A folder to write to, which takes its name once everything is in it; where anything fails it is gone."""
    place = Path(target)
    _require_free(place)
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = place.with_name(f".{place.name}.{uuid.uuid4().hex}")
    beside.mkdir()
    try:
        yield beside
        _require_free(place)
        if place.exists():
            place.rmdir()
        beside.rename(place)
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True)
        raise


def _require_free(place: Path) -> None:
    if place.is_symlink() or (place.exists() and not (place.is_dir() and not any(place.iterdir()))):
        raise InvalidValueError(
            "an export goes into a new folder, and replaces nothing", got=str(place), remedy="Choose another one."
        )
