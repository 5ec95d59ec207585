"""Tables, recordings, logs and data frames of a lab, as the people whose trials they hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from isiw.errors import InvalidValueError, did_you_mean
from isiw.existing import frames, recordings
from isiw.existing.delivered import Delivered, read_log
from isiw.existing.layout import MARKERS, Layout
from isiw.existing.people import people_of, required_reference
from isiw.existing.tables import Column, is_missing, isis_of, required_unit, with_decimals
from isiw.files import is_mcap
from isiw.lazy import pd
from isiw.log.durable import log_exists
from isiw.signals.limits import EMG_UNITS_MV
from isiw.trials import Channel
from isiw.types import FloatArray


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
        return [_read_waves(path, layout, subject or path.stem)]
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


def _read_waves(path: Path, layout: Layout, subject: str) -> Delivered:
    """The trials of a recording whose layout names the column, or the array, of the EMG."""
    if path.suffix.lower() == ".mat":
        arrays = frames.read_arrays(path)
        if arrays.get(layout.channels["emg"], np.zeros(1)).ndim == 2:
            return _of_matrix(arrays, layout, subject, path.name)
    return _of_columns(frames.read_frame(path, layout), layout, subject, path.name)


def _required(layout: Layout, key: Literal["rate_hz", "pulse_at_ms"], what: str) -> float:
    value: float | None = getattr(layout, key)
    if value is None:
        raise InvalidValueError(f"{what} is not stated", remedy=f"Write {key} = NUMBER into a layout: --layout FILE.")
    return value


def _of_matrix(arrays: dict[str, FloatArray], layout: Layout, subject: str, source: str) -> Delivered:
    """Sweeps that are the rows or the columns of a matrix, beside a vector of their ISIs."""
    rate_hz = _required(layout, "rate_hz", f"the sampling rate of {source}")
    pulse_at_ms = _required(layout, "pulse_at_ms", f"the time of the pulse in a sweep of {source}")
    vectors = {
        name: array.ravel().tolist() for name, array in arrays.items() if max(array.shape, default=0) == array.size
    }
    isis_ms = isis_of(vectors, layout, source)
    name, sweeps = layout.channels["emg"], np.asarray(arrays[layout.channels["emg"]], dtype=np.float64)
    count = len(isis_ms)
    if count not in sweeps.shape:
        raise InvalidValueError(
            f"the sweeps of {source} are not as many as its ISIs",
            got=(sweeps.shape, count),
            remedy="Save one for each.",
        )
    factor_mv = EMG_UNITS_MV[required_unit("EMG", Column(name, [], of=source), layout, EMG_UNITS_MV)]
    values_mv = factor_mv * (sweeps if sweeps.shape[0] == count else sweeps.T)
    channels = [Channel(each, rate_hz, "mV", -pulse_at_ms) for each in values_mv]
    return recordings.of_sweeps(channels, isis_ms, layout, subject, source)


def _of_columns(frame: pd.DataFrame, layout: Layout, subject: str, source: str) -> Delivered:
    """A continuous recording, a row for each sample; blocks, each with lines of its own before it, are sweeps."""
    reference = required_reference(layout, source)
    rate_hz = _required(layout, "rate_hz", f"the sampling rate of {source}")
    for name in layout.channels.values():
        if name not in frame:
            remedy = (
                did_you_mean(name, list(frame)) or "If no line holds their names, write names = [...] into the layout."
            )
            raise InvalidValueError(
                f"{source} has no such column", got=name, expected=f"one of {', '.join(map(str, frame))}", remedy=remedy
            )
    breaks = frame.iloc[:, 0].astype(str).str.endswith("=").to_numpy()
    frame, block = frame[~breaks], np.cumsum(breaks)[~breaks]
    name = layout.channels["emg"]
    unit = required_unit("EMG", Column(name, [], of=source), layout, EMG_UNITS_MV)
    channels = {"emg": Channel(EMG_UNITS_MV[unit] * _numbers(frame, name, layout, source), rate_hz, "mV")}
    if "acceleration" in layout.channels:
        values = _numbers(frame, layout.channels["acceleration"], layout, source)
        channels["acceleration"] = Channel(values, rate_hz, "V")
    rows: list[tuple[str, float, float]] = []
    for key in MARKERS:
        if key in layout.channels:
            rows += [(key, at / rate_hz, 0.0) for at in _onsets(_numbers(frame, layout.channels[key], layout, source))]
    if "events" in layout.channels:
        texts = frame[layout.channels["events"]].tolist()
        rows += [(str(text).lstrip("#* "), at / rate_hz, 0.0) for at, text in enumerate(texts) if not is_missing(text)]
    if not rows:
        raise InvalidValueError(
            f"no event was found in {source}",
            remedy="Under [channels] of the layout, name columns of triggers (pulse, tap, valve) or of texts (events).",
        )
    starts = np.flatnonzero(np.diff(block, prepend=-1))
    if len(starts) > 1:
        ends = np.append(starts[1:], len(block))
        rows += [("sweep", first / rate_hz, (end - first) / rate_hz) for first, end in zip(starts, ends, strict=True)]
    recording = recordings.Recording(channels, pd.DataFrame(rows, columns=["name", "onset", "duration"]), source)
    sweeps = recordings.sweeps_of(recording, layout, reference)
    return recordings.delivered_of(recording, sweeps, layout, reference, subject)


def _numbers(frame: pd.DataFrame, name: str, layout: Layout, source: str) -> FloatArray:
    cells = frame[name]
    few = {name: Column(name, cells.iloc[:1000].tolist(), of=source)}
    if not pd.api.types.is_numeric_dtype(cells) and with_decimals(few, layout.decimal)[name].decimal == ",":
        cells = cells.str.replace(",", ".")
    numbers = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
    if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
        raise Column(name, frame[name].tolist(), of=source).refused(
            int(bad[0]), "is no number", "Do the names stand for the right columns, and are the lines before skipped?"
        )
    return numbers


def _onsets(values: FloatArray) -> list[int]:
    """Where a trigger leaves the level at which it mostly is."""
    high = values > (values.min() + values.max()) / 2
    active = high if high.mean() < 0.5 else ~high
    return [int(at) for at in np.flatnonzero(active[1:] & ~active[:-1]) + 1]
