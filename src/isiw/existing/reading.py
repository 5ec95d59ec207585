"""Whatever a lab has its trials in, a table, a recording, a log or a data frame in memory, as the people in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from isiw.errors import InvalidValueError
from isiw.existing import frames, recordings, waves
from isiw.existing.delivered import Delivered, read_log
from isiw.existing.layout import Layout
from isiw.existing.people import people_of
from isiw.files import is_mcap
from isiw.lazy import pd
from isiw.log.durable import log_exists


def read_people(source: str | Path | Any, layout: Layout | None = None, *, subject: str = "") -> list[Delivered]:
    """The people whose trials a file or a table holds.

    Args:
        source: the path of a table, a recording or a log; or a `pandas.DataFrame`, `mne.io.Raw` or `mne.Epochs`.
        layout: how it is laid out, as far as it does not say so itself.
        subject: the code of a person who has none in it; by default the file's name.

    Raises:
        InvalidValueError: something that is ambiguous, missing or cannot be true; the message says what to do.
        ConfigError: a library is not installed.
        LogError: a log that cannot be read.
    """
    layout = layout or Layout()
    if not isinstance(source, str | Path):
        return _in_memory(source, layout, subject)
    path = Path(source)
    if log_exists(path) and is_mcap(path):
        return [read_log(path)]
    if not path.exists():
        raise InvalidValueError("there is no such file", got=str(path), remedy="Check the path.")
    suffix = (
        Path(path.name.lower().removesuffix(".gz")).suffix if path.name.endswith(".fif.gz") else path.suffix.lower()
    )
    if suffix in recordings.SUFFIXES:
        return [recordings.read_recording(path, layout, subject or path.stem)]
    if path.is_dir() or suffix not in frames.SUFFIXES:
        known = sorted(frames.SUFFIXES | recordings.SUFFIXES)
        raise InvalidValueError(
            "this cannot be read",
            got=path.name,
            expected=f"a file of {', '.join(known)}",
            remedy="Save or export it as one of these, such as CSV; of BrainVision's files name the .vhdr.",
        )
    if "emg" in layout.channels:
        return [waves.read_waves(path, layout, subject or path.stem)]
    return people_of(frames.read_frame(path, layout), layout, path.name, subject or path.stem)


def _in_memory(source: Any, layout: Layout, subject: str) -> list[Delivered]:
    """The people of a table, or of a recording that MNE has read."""
    if isinstance(source, pd.DataFrame):
        return people_of(frames.named(source), layout, "the table", subject)
    if hasattr(source, "metadata") and hasattr(source, "get_data"):
        return [recordings.of_epochs(source, layout, subject)]
    if hasattr(source, "annotations"):
        return [recordings.of_raw(source, layout, subject)]
    raise InvalidValueError("this holds no trials", got=source, expected="a path, a DataFrame, or mne.Epochs or Raw")
