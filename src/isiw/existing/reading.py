"""Tables, recordings, logs and data frames of a lab, as the people whose trials they hold."""

from __future__ import annotations

import datetime as dt
import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from isiw.checks import MOST_MEP_MV
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.existing import frames, recordings, tables
from isiw.existing.apart import read_apart
from isiw.existing.dates import dates_of, latest_of, times_of
from isiw.existing.delivered import Delivered, anywhere, read_log
from isiw.existing.layout import ISI_UNITS_MS, MARKERS, Layout, letters
from isiw.existing.limits import ReadingLimits, require_file, require_table
from isiw.files import is_mcap
from isiw.findings import Kind
from isiw.lazy import pd
from isiw.log.durable import log_exists
from isiw.signals.judgement import judge_measurement
from isiw.signals.limits import EMG_UNITS_MV, SignalLimits
from isiw.trials import Channel, Measurement, Status, Stimulus, Trial, TrialTable
from isiw.types import FloatArray, Reference
from isiw.visit import Visit

_RATES: Final = frozenset({"fs", "srate", "samplerate", "samplingrate", "samplingfrequency", "sfreq", "rate", "ratehz"})


def read_people(
    source: str | Path | Any,
    layout: Layout | None = None,
    *,
    subject: str = "",
    limits: ReadingLimits | None = None,
    also: Sequence[str | Path] = (),
) -> list[Delivered]:
    """The people whose trials a file or a table holds; a file is read by a process of its own.

    Args:
        source: the path of a table, a recording or a log; or a `pandas.DataFrame`, `mne.io.Raw` or `mne.Epochs`.
        layout: how it is laid out, as far as it does not say so itself.
        subject: the code of a person who has none in it; by default the file's name.
        limits: the most that is read of a file.
        also: files elsewhere that a recording may refer to; of others only those of its own folder are read.

    Raises:
        InvalidValueError: something that is ambiguous, missing or cannot be true, or a limit that is reached; the
            message says what to do.
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
    return read_apart(path, layout, subject, limits or ReadingLimits(), also)


def people_in(
    path: Path,
    layout: Layout,
    subject: str,
    limits: ReadingLimits,
    on_rows: Callable[[int], object] = lambda _rows: None,
) -> list[Delivered]:
    """The people whose trials a file holds, read by this process, which is informed how many rows a table has."""
    suffix = ".fif" if path.name.endswith(".fif.gz") else path.suffix.lower()
    require_file(limits, path, text=suffix in frames.TEXTS)
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
        return [_read_waves(path, layout, subject or path.stem, limits)]
    frame = _frame(path, layout, limits)
    on_rows(len(frame))
    return people_of(frame, layout, path.name, subject or path.stem)


def _frame(path: Path, layout: Layout, limits: ReadingLimits) -> pd.DataFrame:
    frame = frames.read_frame(path, layout)
    require_table(limits, frame, path.name)
    return frame


def _in_memory(source: Any, layout: Layout, subject: str) -> list[Delivered]:
    """The people of a table, or of a recording that MNE has read."""
    if isinstance(source, pd.DataFrame):
        return people_of(frames.named(source), layout, "the table", subject)
    if hasattr(source, "metadata") and hasattr(source, "get_data"):
        return [recordings.of_epochs(source, layout, subject)]
    if hasattr(source, "annotations"):
        return [recordings.of_raw(source, layout, subject)]
    raise InvalidValueError("this holds no trials", got=source, expected="a path, a DataFrame, or mne.Epochs or Raw")


def _read_waves(path: Path, layout: Layout, subject: str, limits: ReadingLimits) -> Delivered:
    """The trials of a recording whose layout names the column, or the array, of the EMG."""
    if path.suffix.lower() == ".mat":
        arrays = frames.read_arrays(path)
        tables.require_one("array", path.name, layout.channels["emg"], arrays)
        if arrays[layout.channels["emg"]].squeeze().ndim > 1:
            return _of_matrix(arrays, layout, subject, path.name)
    return _of_columns(_frame(path, layout, limits), layout, subject, path.name)


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
    columns = tables.of_vectors(vectors, layout, source)
    name, sweeps = layout.channels["emg"], np.asarray(arrays[layout.channels["emg"]], dtype=np.float64)
    count = columns.rows
    if sweeps.ndim != 2 or count not in sweeps.shape:
        raise InvalidValueError(
            f"the sweeps of {source} are not as many as its ISIs, in a matrix",
            got=f"{' × '.join(map(str, sweeps.shape))} samples and {count} ISIs",
            remedy="Save a row or a column for each ISI.",
        )
    for other, array in arrays.items():
        if array.size == 1 and letters(other) in _RATES and array.dtype.kind in "fiu":
            _require_rate(rate_hz, float(array.item()), f"{other!r} of {source}")
    factor_mv = EMG_UNITS_MV[tables.required_unit("EMG", tables.Column(name, [], of=source), layout, EMG_UNITS_MV)]
    values_mv = factor_mv * (sweeps if sweeps.shape[0] == count else sweeps.T)
    channels = [Channel(each, rate_hz, "mV", -pulse_at_ms) for each in values_mv]
    return recordings.of_sweeps(channels, columns, layout, subject, source)


def _of_columns(frame: pd.DataFrame, layout: Layout, subject: str, source: str) -> Delivered:
    """A continuous recording, a row for each sample; blocks, each with lines of its own before it, are sweeps."""
    rate_hz = _required(layout, "rate_hz", f"the sampling rate of {source}")
    remedy = "If no line holds their names, write names = [...] into the layout."
    for name in layout.channels.values():
        tables.require_one("column", source, name, frame, remedy)
    breaks = frame.iloc[:, 0].astype(str).str.endswith("=").to_numpy()
    frame, block = frame[~breaks], np.cumsum(breaks)[~breaks]
    name = layout.channels["emg"]
    unit = tables.required_unit("EMG", tables.Column(name, [], of=source), layout, EMG_UNITS_MV)
    _require_clock(frame[block == block[:1]], layout, rate_hz, source)
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
        rows += [
            (str(text).lstrip("#* "), at / rate_hz, 0.0) for at, text in enumerate(texts) if not tables.is_missing(text)
        ]
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
    return recordings.delivered_of(recording, recordings.sweeps_of(recording, layout), layout, subject)


def _require_rate(stated_hz: float, found_hz: float, where: str) -> None:
    if not 0.98 < found_hz / stated_hz < 1.02:
        raise InvalidValueError(
            f"the sampling rate is not the one that {where} says",
            got=f"{stated_hz:g} Hz",
            expected=f"{found_hz:g} Hz",
            remedy="Correct rate_hz in the layout.",
        )


def _require_clock(frame: pd.DataFrame, layout: Layout, rate_hz: float, source: str) -> None:
    """Raise if a column of times says another sampling rate than the layout."""
    for name in sorted({*frame.columns} - {*layout.channels.values()}):
        cells = frame.iloc[:, list(frame.columns).index(name)]
        if (clock_hz := _clock_hz(cells, name, rate_hz)) is not None:
            _require_rate(rate_hz, clock_hz, f"the column {name!r} of {source}")


def _clock_hz(cells: pd.Series, name: str, rate_hz: float) -> float | None:
    """The sampling rate that a column of times says; None if it is no such column, or of numbers of samples."""
    times = pd.to_numeric(cells.astype(str).str.replace(",", "."), errors="coerce").to_numpy(dtype=np.float64)
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 2 else 0.0
    even = times[0] + step * np.arange(len(times))
    if not step > 0 or not np.all(np.abs(times - even) <= 1.01 * step):  # they may be rounded
        return None
    unit = tables.unit_said(name, ISI_UNITS_MS)
    rates = [1e3 / (step * per_ms) for known, per_ms in ISI_UNITS_MS.items() if unit in {None, known}]
    if unit is None and math.isclose(step, 1.0, rel_tol=1e-6):
        return None
    return min(rates, key=lambda rate: abs(math.log(rate / rate_hz)))


def _numbers(frame: pd.DataFrame, name: str, layout: Layout, source: str) -> FloatArray:
    cells = frame[name]
    texts = cells[cells.astype(str).str.contains("[.,]")].iloc[:1000].tolist()
    few = {name: tables.Column(name, texts or cells.iloc[:1000].tolist(), of=source)}
    if not pd.api.types.is_numeric_dtype(cells) and tables.with_decimals(few, layout.decimal)[name].decimal == ",":
        cells = cells.str.replace(",", ".")
    numbers = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
    if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
        raise tables.Column(name, frame[name].tolist(), of=source).refused(
            int(bad[0]), "is no number", "Do the names stand for the right columns, and are the lines before skipped?"
        )
    return numbers


def _onsets(values: FloatArray) -> list[int]:
    """Where a trigger leaves the level at which it mostly is."""
    high = values > (values.min() + values.max()) / 2
    active = high if high.mean() < 0.5 else ~high
    return [int(at) for at in np.flatnonzero(active[1:] & ~active[:-1]) + 1]


def people_of(frame: pd.DataFrame, layout: Layout, source: str, name: str = "") -> list[Delivered]:
    """The people of a table, in the order in which they come first; who has no code is called as the file is."""
    reference = layout.required_reference(source)
    columns = tables.Columns.found(frame, layout, source)
    isi, mep = columns["isi"], columns["mep"]
    rows = [n for n in range(columns.rows) if mep.number(n) is not None or isi.text(n) or columns["asked"].text(n)]
    if not rows:
        raise InvalidValueError(f"{source} has no trials", remedy="Are the right columns named?")
    subjects = [columns["subject"].text(row) for row in rows]
    if any(subjects) and not all(subjects):
        empty = rows[subjects.index("")]
        raise columns.of["subject"].refused(empty, "is empty", "Write the person's code into each row.")
    people: dict[str, list[int]] = {}
    for subject, row in zip(subjects, rows, strict=True):
        people.setdefault(subject, []).append(row)
    dates = dates_of(columns["date"], rows)
    visits = [
        (own, subject, day) for subject, theirs in people.items() for day, own in _days(columns, theirs, dates).items()
    ]
    found = []
    for own, subject, day in sorted(visits, key=lambda visit: visit[0][0]):
        begun = dates[own[0]].isoformat(timespec="microseconds") if own[0] in dates else ""
        person = _person(columns, own, layout, reference, subject or name)
        given_by = latest_of([columns["date"].text(row) for row in own], [dates.get(row) for row in own])
        found.append(replace(person, visit=Visit(day=day), created=begun, given_by=given_by))
    return found


def _days(
    columns: tables.Columns, rows: Sequence[int], dates: Mapping[int, dt.datetime]
) -> dict[int | None, list[int]]:
    """The rows of each day, by a column of days, or by several dates; days without a number are counted."""
    named = "day" in columns.of
    texts = [columns["day"].text(row) if named else f"{dates[row].date()}" if row in dates else "" for row in rows]
    several = len({*texts} - {""}) > 1
    if "" in texts and (several or (named and any(texts))):
        column = columns["day" if named else "date"]
        raise column.refused(rows[texts.index("")], "is empty", "Write the day into each row.")
    if not any(texts) or not (named or several):
        return {None: list(rows)}
    days: dict[str, list[int]] = {}
    for row, text in zip(rows, texts, strict=True):
        days.setdefault(text, []).append(row)
    numbers = [int(found[-1]) if len(found := re.findall(r"\d+", day[:80])) == 1 else 0 for day in days]
    if len(set(numbers)) < len(numbers) or min(numbers) < 1:
        numbers = list(range(1, len(days) + 1))
    return dict(zip(numbers, days.values(), strict=True))


def _person(
    columns: tables.Columns, rows: Sequence[int], layout: Layout, reference: Reference, subject: str
) -> Delivered:
    _require_ascending(columns, rows)
    columns.require_said(rows, layout.alone)
    space, signals = anywhere(reference), SignalLimits()
    trials = [_trial(columns, row, number, layout, space, signals) for number, row in enumerate(rows)]
    blocks = [columns["block"].text(row) for row in rows]
    return Delivered(
        TrialTable(tuple(trials)),
        reference,
        subject=subject,
        source=columns["isi"].of,
        units=columns.units,
        unused=columns.unused,
        blocks={n: block for n, block in enumerate(blocks) if n and block != blocks[n - 1]},
    )


def _trial(
    columns: tables.Columns, row: int, number: int, layout: Layout, space: DesignSpace, signals: SignalLimits
) -> Trial:
    """One row as a trial: as the file judges it, or else as a session would."""
    alone = columns.tms_alone(row, layout.alone)
    isi_ms = None if alone else columns["isi"].number(row)
    asked_ms = columns["asked"].number(row) if "asked" in columns.of else isi_ms
    mep_mv, lost = columns["mep"].number(row), columns.lost(row)
    if mep_mv is not None and not 0 <= mep_mv <= MOST_MEP_MV:
        remedy = "It must be from peak to peak, in the unit that is stated; is --unit right?"
        raise columns.of["mep"].refused(row, "is no amplitude", remedy)
    facts: dict[str, Any] = {
        "commanded_isi_ms": asked_ms,
        "isi_ms": isi_ms,
        "isi_sd_ms": columns["isi_sd"].number(row) or 0.0,
        "mep_mv": mep_mv,
        "background_rms_uv": columns["background"].number(row),
        "excluded": "status" in columns.of and columns["exclude"].flag(row) is True,
    }
    if columns.tap_alone(row):
        return Trial(number, Status.ACCEPTED, tap_alone=True, **{**facts, "commanded_isi_ms": None})
    if lost is None and (mep_mv is None or (isi_ms is None and asked_ms is not None)):
        lost = Kind.OUTCOME_UNKNOWN
    if lost is None and not {"status", "exclude"} & columns.of.keys() and mep_mv is not None:
        measured = Measurement(mep_mv, isi_ms, facts["isi_sd_ms"] or 0.0, None)
        meant_ms = asked_ms if "asked" in columns.of or isi_ms is None else max(isi_ms, 0.0)
        judged = judge_measurement(measured, Stimulus(number, meant_ms), space, signals)
        lost = judged.reason
    return Trial(number, Status.ACCEPTED if lost is None else Status.MISTRIAL, reason=lost, **facts)


def _require_ascending(columns: tables.Columns, rows: Sequence[int]) -> None:
    """Raise if the rows are not in the order of delivery, on which drift and the start depend."""
    if (order := columns.of.get("order")) is None or "block" in columns.of:
        return
    known = [row for row in rows if order.text(row)]
    texts = [order.text(row) for row in known]
    are_numbers = [re.sub("[.,]", "", text).lstrip("-").isdigit() for text in texts]
    if any(are_numbers):
        if not all(are_numbers):
            odd = known[are_numbers.index(False)]
            raise order.refused(odd, "is none of a trial", "Delete the row if it is a sum or a mean.")
        places = [order.number(row) or 0.0 for row in known]
    else:  # times of the day, perhaps
        places = times_of(texts)
    times = Counter(places)
    repeated = next((text for text, place in zip(texts, places, strict=False) if times[place] > 1), None)
    if places != sorted(places):
        raise InvalidValueError(
            f"the rows of {order.of} are not in the order of its column {order.name!r}",
            remedy="Sort them as the trials were delivered, or name the column that says so: --column order=NAME.",
        )
    if all(are_numbers) and repeated is not None:
        raise InvalidValueError(
            f"a trial has two rows and more in {order.of}, by its column {order.name!r}",
            got=repeated,
            remedy="Leave one row for each trial, such as that of one muscle; or name a column of people or blocks: "
            "--column subject=NAME, --column block=NAME.",
        )
