"""Samples in columns of text, a row each; blocks, each with lines of its own before it, are sweeps."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing import frames
from isiw.existing.cells import Column, is_missing, with_decimals
from isiw.existing.formats.contents import APART_S, Contents, Stretch, Track, events_of
from isiw.existing.layout import EMG_UNITS, ISI_UNITS_MS, MARKERS, Layout
from isiw.existing.tables import require_one, unit_said
from isiw.lazy import pd
from isiw.types import FloatArray


def read(path: Path, layout: Layout) -> Contents:
    """A table, or the channels and events of a recording whose layout names the column of the EMG."""
    frame, source = frames.read_frame(path, layout), path.name
    if "emg" not in layout.channels:
        return Contents(source, trials=frame)
    rate_hz = required(layout, "rate_hz", f"the sampling rate of {source}")
    remedy = "If no line holds their names, write names = [...] into the layout."
    for name in layout.channels.values():
        require_one("column", source, name, frame, remedy)
    breaks = frame.iloc[:, 0].astype(str).str.endswith("=").to_numpy()
    frame, block = frame[~breaks], np.cumsum(breaks)[~breaks]
    _require_clock(frame[block == block[:1]], layout, rate_hz, source)
    starts = np.flatnonzero(np.diff(block, prepend=-1)).tolist()
    ends = [*starts[1:], len(block)]
    stretches = tuple(Stretch(at, end - at, n * APART_S) for n, (at, end) in enumerate(zip(starts, ends, strict=True)))
    tracks = list[Track]()
    for key, name in layout.channels.items():
        if key != "events" and name not in {track.name for track in tracks}:
            values = _numbers(frame, name, layout, source)
            tracks.append(_track(name, rate_hz, stretches, values, "stim" if key in MARKERS else ""))
    rows = []
    for at, text in enumerate(frame[layout.channels["events"]].tolist() if "events" in layout.channels else ()):
        if not is_missing(text):
            stretch = next(one for one in reversed(stretches) if one.first <= at)
            rows.append((str(text).lstrip("#* "), stretch.start_s + (at - stretch.first) / rate_hz, 0.0))
    if len(stretches) > 1:
        rows += [("sweep", one.start_s, one.samples / rate_hz) for one in stretches]
    return Contents(source, tuple(tracks), events_of(rows))


def _track(name: str, rate_hz: float, stretches: tuple[Stretch, ...], values: FloatArray, kind: str) -> Track:
    return Track(
        name, rate_hz, stretches, lambda first, last: values[first:last], unit_said(name, EMG_UNITS) or "", kind
    )


def required(layout: Layout, key: Literal["rate_hz", "pulse_at_ms"], what: str) -> float:
    """What a layout states, since the file does not."""
    value: float | None = getattr(layout, key)
    if value is None:
        raise InvalidValueError(f"{what} is not stated", remedy=f"Write {key} = NUMBER into a layout: --layout FILE.")
    return value


def require_rate(stated_hz: float, found_hz: float, where: str) -> None:
    """Raise if a sampling rate that is stated is not the one that the file says."""
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
            require_rate(rate_hz, clock_hz, f"the column {name!r} of {source}")


def _clock_hz(cells: pd.Series, name: str, rate_hz: float) -> float | None:
    """The sampling rate that a column of times says; None if it is no such column, or of numbers of samples."""
    times = pd.to_numeric(cells.astype(str).str.replace(",", "."), errors="coerce").to_numpy(dtype=np.float64)
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 2 else 0.0
    even = times[0] + step * np.arange(len(times))
    if not step > 0 or not np.all(np.abs(times - even) <= 1.01 * step):  # they may be rounded
        return None
    unit = unit_said(name, ISI_UNITS_MS)
    rates = [1e3 / (step * per_ms) for known, per_ms in ISI_UNITS_MS.items() if unit in {None, known}]
    if unit is None and math.isclose(step, 1.0, rel_tol=1e-6):
        return None
    return min(rates, key=lambda rate: abs(math.log(rate / rate_hz)))


def _numbers(frame: pd.DataFrame, name: str, layout: Layout, source: str) -> FloatArray:
    cells = frame[name]
    texts = cells[cells.astype(str).str.contains("[.,]")].iloc[:1000].tolist()
    few = {name: Column(name, texts or cells.iloc[:1000].tolist(), of=source)}
    if not pd.api.types.is_numeric_dtype(cells) and with_decimals(few, layout.decimal)[name].decimal == ",":
        cells = cells.str.replace(",", ".")
    numbers = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
    if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
        raise Column(name, frame[name].tolist(), of=source).refused(
            int(bad[0]), "is no number", "Do the names stand for the right columns, and are the lines before skipped?"
        )
    return numbers
