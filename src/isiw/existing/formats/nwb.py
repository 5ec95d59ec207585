"""Neurodata Without Borders (.nwb): time series with conversion and offset, annotations, and tables of intervals."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from isiw.existing.formats.contents import Contents, Stretch, Track, clocked, events_of, text_of, with_bad
from isiw.existing.layout import Layout
from isiw.lazy import pd
from isiw.text.named_code import library
from isiw.types import FloatArray


def read(path: Path, _layout: Layout) -> Contents:
    """The time series, annotations and intervals of an NWB file, which stays open as long as they are needed."""
    pynwb = library("pynwb", "import-nwb")
    held = pynwb.NWBHDF5IO(str(path), "r", load_namespaces=True)
    objects = list(held.read().objects.values())
    tracks, tables, events = list[Track](), list[pd.DataFrame](), list[pd.DataFrame]()
    for one in objects:
        if isinstance(one, pynwb.misc.AnnotationSeries):
            texts, times_s = one.data[:], one.timestamps[:]
            events.append(events_of((text_of(text), float(at), 0.0) for text, at in zip(texts, times_s, strict=True)))
        elif isinstance(one, pynwb.epoch.TimeIntervals):
            table, is_bad = one.to_dataframe(), one.name == "invalid_times"
            tables += [] if is_bad else [table]
            events.append(with_bad(_events(table, "start_time", "BAD invalid times" if is_bad else "sweep")))
        elif isinstance(one, pynwb.core.DynamicTable) and "timestamp" in one.colnames:
            events.append(_events(one.to_dataframe(), "timestamp", str(one.name)))
        elif isinstance(one, pynwb.TimeSeries) and getattr(one.data, "ndim", np.ndim(one.data)) in {1, 2}:
            if (codes := _codes(one)) is None:
                tracks += _channels(one, held)
            else:
                events.append(events_of(codes))
    found = pd.concat([events_of(()), *events], ignore_index=True).sort_values("onset", ignore_index=True)
    trials = next((table for table in tables if not tracks and len(table)), None)
    return Contents(path.name, tuple(tracks), found, trials)


def _channels(series: Any, held: Any) -> Iterator[Track]:
    """The channels of a series, scaled by its conversion, that of each channel, and its offset."""
    count = int(series.data.shape[1]) if len(series.data.shape) > 1 else 0
    if not len(series.data) or np.asarray(series.data[:1]).dtype.kind not in "fiu":
        return
    if series.timestamps is None:
        rate_hz, start_s = float(series.rate), float(series.starting_time or 0.0)
        stretches: tuple[Stretch, ...] = (Stretch(0, len(series.data), start_s),)
    else:
        times_s = np.asarray(series.timestamps[:], dtype=np.float64)
        rate_hz, stretches, _ = clocked(times_s, None, f"the series {series.name}")
    of_each = getattr(series, "channel_conversion", None)
    for channel in range(max(1, count)):
        factor = float(series.conversion or 1.0) * (1.0 if of_each is None else float(of_each[channel]))
        name, kind = f"{series.name} {channel + 1}", "emg" if "emg" in series.name.casefold() else ""
        name, part = name if count > 1 else series.name, partial(_part, series, held, channel if count else None)
        track = Track(name, rate_hz, stretches, part, str(series.unit or ""), kind)
        yield track.scaled(factor, float(series.offset or 0.0))


def _codes(series: Any) -> list[tuple[str, float, float]] | None:
    """What a series of whole numbers at times without a rate says, as triggers do; None if it is none."""
    if series.timestamps is None or np.asarray(series.data[:1]).dtype.kind not in "iu" or len(series.data.shape) > 1:
        return None
    times_s = np.asarray(series.timestamps[:], dtype=np.float64)
    steps_s = np.diff(times_s)
    if len(steps_s) > 1 and np.quantile(np.abs(steps_s / np.median(steps_s) - 1), 0.9) < 0.1:
        return None  # samples, that come evenly
    return [(f"{code}", at, 0.0) for code, at in zip(series.data[:].tolist(), times_s.tolist(), strict=True)]


def _part(series: Any, _held: Any, channel: int | None, first: int, last: int) -> FloatArray:
    values = series.data[first:last] if channel is None else series.data[first:last, channel]
    return np.asarray(values, dtype=np.float64)


def _events(table: pd.DataFrame, begin: str, usual: str) -> pd.DataFrame:
    """The rows of a table of times by their labels, and each further column of times as events."""
    label = next((name for name in ("label", "annotation", "event", "event_type", "name") if name in table), None)
    names = [usual] * len(table) if label is None else [text_of(text) or usual for text in table[label]]
    lasts: Any = (table["stop_time"] - table["start_time"]).to_numpy(dtype=np.float64) if "stop_time" in table else 0.0
    others = table.drop(columns=[begin, "stop_time"], errors="ignore")
    found = [others.assign(name=names, onset=table[begin].to_numpy(dtype=np.float64), duration=lasts)]
    for column in (str(name) for name in others if str(name).endswith("_time")):
        times_s = others[column].dropna().to_numpy(dtype=np.float64).tolist()
        found.append(events_of((column.removesuffix("_time"), at, 0.0) for at in times_s))
    return pd.concat(found, ignore_index=True)
