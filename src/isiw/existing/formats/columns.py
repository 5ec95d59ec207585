"""Samples in columns of text, a row each; blocks, each with lines of its own before it, are sweeps."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Final, Literal

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing import frames
from isiw.existing.cells import Column, is_missing, with_decimals
from isiw.existing.formats.contents import Contents, Track, events_of, parted, timed
from isiw.existing.layout import ISI_UNITS_MS, MARKERS, Layout, unit_named
from isiw.existing.quantities import require_one, unit_of, unit_said
from isiw.lazy import pd
from isiw.types import FloatArray

_PERIOD: Final = re.compile(r"(?i)(?=interval\W|[\d.]+\s*\w+/sample)(?:interval\W+)?(\d[\d.e-]*)\s*([a-zµ]+)")
_RATE: Final = re.compile(r"(?:rate|sampl|frequency)[^\n\d]*(\d[\d.]*)\s*(k?)Hz", re.IGNORECASE)  # above samples
_FEW: Final = 0.01  # with a larger share of steps that are longer than usual, times have no pauses but are rounded
_OF_LAYOUT: Final = "Correct rate_hz in the layout; what has another rate must be a file of its own."


def read(path: Path, layout: Layout) -> Contents:
    """A table, or the channels and events of a recording whose layout names the column of the EMG."""
    return of_frame(frames.read_frame(path, layout), path.name, layout)


def of_frame(frame: pd.DataFrame, source: str, layout: Layout) -> Contents:
    """The same of a table that was read."""
    if "emg" not in layout.channels:
        return Contents(source, trials=frame)
    rate_hz, head = required(layout, "rate_hz", f"the sampling rate of {source}"), frame.attrs.get("head", "")
    for number, word in _PERIOD.findall(head):
        if (unit := unit_named(word)) in ISI_UNITS_MS and float(number):
            require_period(rate_hz, float(number), unit, f"the head of {source}")
    for number, kilo in _RATE.findall(head):
        require_rate(rate_hz, float(number) * (1e3 if kilo else 1.0), f"the head of {source}")
    for name in layout.channels.values():
        require_one("column", source, name, frame, "If no line holds their names, write names = [...] into the layout.")
    breaks = frame.iloc[:, 0].astype(str).str.endswith("=").to_numpy()
    frame, block = frame[~breaks], np.cumsum(breaks)[~breaks]
    pauses_s, blocks = dict[int, float](), np.flatnonzero(np.diff(block, prepend=-1)).tolist()
    for (begin, end), (place, name) in product(pairwise([*blocks, len(frame)]), enumerate(frame.columns)):
        if name not in layout.channels.values() and (clock := clock_of(frame.iloc[begin:end, place], name, rate_hz)):
            require_rate(rate_hz, clock[0], f"the column {name!r} of {source}")
            pauses_s = pauses_s or clock[1]
    stretches = parted(blocks if len(blocks) > 1 else pauses_s, len(block), rate_hz, pauses_s)
    tracks, texts = list[Track](), list[tuple[str, float, float]]()
    for key, name in layout.channels.items():
        if key == "events":
            texts = [(str(text).lstrip("#* "), at, 0.0) for at, text in enumerate(frame[name]) if not is_missing(text)]
        else:
            values, kind = _numbers(frame, name, layout, source), "stim" if key in MARKERS else ""
            track = Track.of_values(name, rate_hz, stretches, values, unit_of(name, frame), kind)
            tracks.append(replace(track, said=of_emg(head) if key == "emg" else ""))
    rows = timed(texts, stretches, rate_hz)
    rows += [("sweep", one.start_s, one.samples / rate_hz) for one in stretches if len(blocks) > 1]
    return Contents(source, tuple(tracks), events_of(rows))


def of_emg(text: str) -> str:
    """The lines of a text that are of EMG."""
    return "\n".join(line for line in text.splitlines() if re.search(r"(?i)\bemg\b|amplifier|verstärk|^\W*gain", line))


def required(layout: Layout, key: Literal["rate_hz", "pulse_at_ms"], what: str) -> float:
    """What a layout states, since the file does not."""
    value: float | None = getattr(layout, key)
    if value is None:
        raise InvalidValueError(f"{what} is not stated", remedy=f"Write {key} = NUMBER into a layout: --layout FILE.")
    return value


def require_rate(stated_hz: float, found_hz: float, where: str, remedy: str = _OF_LAYOUT) -> None:
    """Raise if a sampling rate that is stated is not the one that the file says."""
    if not 0.98 < found_hz / stated_hz < 1.02:
        what = f"the sampling rate is not the one that {where} says"
        raise InvalidValueError(what, got=f"{stated_hz:g} Hz", expected=f"{found_hz:g} Hz", remedy=remedy)


def clock_of(cells: pd.Series, name: str, rate_hz: float) -> tuple[float, dict[int, float]] | None:
    """The rate that times of samples say, and how long pauses were before some [s]; None if they are no such times."""
    steps = np.diff(pd.to_numeric(cells.astype(str).str.replace(",", "."), errors="coerce").to_numpy(dtype=np.float64))
    usual = float(np.median(steps)) if len(steps) > 1 else 0.0
    late = np.flatnonzero((steps > 1.5 * usual) | (steps < 0))  # or they begin again, and nobody knows how much later
    if not 0 < len(late) < _FEW * len(steps):
        late = late[:0]
    over = np.maximum(steps[late] - usual, 0.0)
    steps[late] = usual
    step = float(steps.mean()) if len(steps) > 1 else 0.0
    if not step > 0 or not np.all(np.abs(np.cumsum(steps - step)) <= 1.01 * step):  # they may be rounded
        return None
    if (unit := unit_said(name, ISI_UNITS_MS)) is None and math.isclose(step, 1.0, rel_tol=1e-6):
        return None
    found_hz = _rate_of(step, unit, rate_hz)
    return found_hz, dict(zip((late + 1).tolist(), (over / step / found_hz).tolist(), strict=True))


def _rate_of(step: float, unit: str | None, rate_hz: float) -> float:
    """The rate at which samples are so far from each other; without a unit, the one that is nearest to another."""
    rates = [1e3 / (step * per_ms) for known, per_ms in ISI_UNITS_MS.items() if unit in {None, known}]
    return min(rates, key=lambda rate: abs(math.log(rate / rate_hz)))


def require_period(stated_hz: float, period: float, unit: str | None, where: str) -> None:
    """Raise if the time from one sample to the next is not that of the rate that is stated."""
    found_hz = _rate_of(period, unit, stated_hz)
    if unit is not None or 0.1 < found_hz / stated_hz < 10:  # or else it is of something else
        require_rate(stated_hz, found_hz, where)


def _numbers(frame: pd.DataFrame, name: str, layout: Layout, source: str) -> FloatArray:
    cells = frame[name]
    texts = cells[cells.astype(str).str.contains("[.,]")].iloc[:1000].tolist()
    few = {name: Column(name, texts or cells.iloc[:1000].tolist(), of=source)}
    if not pd.api.types.is_numeric_dtype(cells) and with_decimals(few, layout.decimal)[name].decimal == ",":
        cells = cells.str.replace(",", ".")
    numbers = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
    if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
        remedy = "Do the names stand for the right columns, and are the lines before skipped?"
        raise Column(name, frame[name].tolist(), of=source).refused(int(bad[0]), "is no number", remedy)
    return numbers
