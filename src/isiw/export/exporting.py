"""Sessions exported into a new folder."""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType

from isiw.checks import choice
from isiw.errors import InvalidValueError, os_errors
from isiw.export.bids import write_bids
from isiw.export.collection import Part, log_losses, numbered, pseudonymised, read_logs, stated_twice
from isiw.export.emg import EMG
from isiw.export.tables import write_tables


@contextmanager
def new_folder(target: str | Path) -> Iterator[Path]:
    """A folder to write to, which takes its name once everything is in it; if anything fails it is gone."""
    place = Path(target)
    _require_free(place)
    beside = place.with_name(f".{place.name}.{uuid.uuid4().hex}")
    with os_errors(InvalidValueError, "the folder cannot be made", place, "Choose another one, or make room."):
        place.parent.mkdir(parents=True, exist_ok=True)
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


FORMATS: Mapping[str, Callable[[Sequence[Part], Path], Sequence[str] | None]] = MappingProxyType(
    {
        "csv": partial(write_tables, suffix="csv"),
        "parquet": partial(write_tables, suffix="parquet"),
        "bids": write_bids,
    }
)
"""The writer of each format."""


@dataclass(frozen=True)
class Exported:
    """The result of an export.

    Args:
        folder: where to.
        sessions: how many sessions.
        trials: how many trials.
        lacking: what could not be read or exported, a sentence each.
        pseudonyms: which code stands for whom, if the sessions are pseudonymised; it is kept nowhere else.
    """

    folder: Path
    sessions: int
    trials: int
    lacking: tuple[str, ...] = ()
    pseudonyms: Mapping[str, str] = field(default_factory=dict)


def export_logs(source: str | Path, folder: str | Path, to: str = "csv", *, pseudonymise: bool = False) -> Exported:
    """Export a log, or all logs of a folder as one data set.

    Args:
        source: the log or the folder.
        folder: a new folder.
        to: the format, one of `FORMATS`.
        pseudonymise: replace people's codes and dates, and leave free texts out, as docs/export.md says.

    Raises:
        InvalidValueError: an unknown format, a folder with something in it, or people who could not be told apart.
        LogError: nothing can be read.
    """
    choice("the format of an export", to, FORMATS)
    records, lacking = read_logs(source, None if to == "bids" else (EMG,))
    pseudonyms: Mapping[str, str] = {}
    if pseudonymise:
        records, pseudonyms = pseudonymised(records)
        lacking = [f"Logs that are left out, as they cannot be read or are copies: {len(lacking)}."] if lacking else []
    parts = numbered(records)
    for part in parts:
        lacking += [f"{part}: {loss}" for loss in log_losses(part.record)]
    lacking += stated_twice(parts)
    with new_folder(folder) as beside:
        lacking += FORMATS[to](parts, beside) or ()
    trials = sum(len(part.record.table) for part in parts)
    return Exported(Path(folder), len(parts), trials, tuple(lacking), pseudonyms)
