"""Spike2 (.smr up to version 7, .smrx later): waveforms with their pauses, events, levels, and markers."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.existing.formats.contents import Contents, Stretch, Track, events_of
from isiw.existing.layout import Layout
from isiw.text.named_code import library
from isiw.types import FloatArray

_LEVEL, _MARKER, _TEXTS = 4, 5, 8  # a level's events are both of its edges; a marker has four bytes, or a text
_EVER_S: Final = 1e6
_WAVES, _EVENTS, _MARKS, _TEXT_MARKS = {1, 9}, {2, 3}, {5}, {8}  # sonpy's types of channels


def read(path: Path, _layout: Layout) -> Contents:
    """The waveforms and events of a file of Spike2."""
    raw = library("neo.rawio", "import").Spike2RawIO(str(path), try_signal_grouping=False)
    raw.parse_header()
    segments = range(raw.segment_count(0))
    tracks = []
    for index, channel in enumerate(raw.header["signal_channels"]):
        sizes = [int(raw.get_signal_size(0, n, index)) for n in segments]
        starts = [float(raw.get_signal_t_start(0, n, index)) for n in segments]
        firsts = np.cumsum([0, *sizes]).tolist()
        stretches = tuple(Stretch(*each) for each in zip(firsts, sizes, starts, strict=False) if each[1])
        name, unit, part = str(channel["name"]), str(channel["units"]), partial(_part, raw, index, firsts)
        track = Track(name, float(channel["sampling_rate"]), stretches, part, unit)
        tracks.append(track.scaled(float(channel["gain"]), float(channel["offset"])))
    rows = [row for index in range(len(raw.header["event_channels"])) for row in _events(raw, index)]
    return Contents(path.name, tuple(tracks), events_of(rows))


def _part(raw: Any, index: int, firsts: list[int], first: int, last: int) -> FloatArray:
    """Numbers of a channel, of the segment in which they are."""
    segment = int(np.searchsorted(firsts, first, side="right")) - 1
    chunk = raw.get_analogsignal_chunk(0, segment, first - firsts[segment], last - firsts[segment], index)
    return np.asarray(chunk[:, 0], dtype=np.float64)


def _events(raw: Any, index: int) -> list[tuple[str, float, float]]:
    """The events of a channel, also of those between two segments; of a level, one of both edges."""
    channel = raw.header["event_channels"][index]
    ticks, _, labels = raw.get_event_timestamps(0, 0, index, t_start=0.0, t_stop=_EVER_S)
    times_s = raw.rescale_event_timestamp(ticks, "float64", index)
    kind = raw._channel_infos[int(channel["id"])]["kind"]  # noqa: SLF001 - neo does not say it elsewhere
    if kind == _LEVEL:  # which begins with the first edge that leaves the level at which it mostly is
        spans_s = np.diff(times_s)
        first = int(len(spans_s) > 1 and np.median(spans_s[0::2]) > np.median(spans_s[1::2]))
        times_s, labels = times_s[first::2], labels[first::2]
    title, rows = str(channel["name"]), []
    for at_s, said in zip(times_s.tolist(), map(str, labels.tolist()), strict=True):
        name = said.strip("\0 ") or title if kind == _TEXTS else title
        if kind == _MARKER and said.lstrip("-").isdigit():
            name = f"{title} {int(said) & 0xFF}"
        if math.isfinite(at_s):
            rows.append((name, at_s, 0.0))
    return rows


def smrx(path: Path, _layout: Layout) -> Contents:
    """The waveforms, events and markers of a file of Spike2 8 and later, by CED's sonpy."""
    held = library("sonpy", "import").SonFile(str(path), bReadOnly=True)
    tick_s, end = held.GetTimeBase(), held.MaxTime()
    tracks, rows = list[Track](), list[tuple[str, float, float]]()
    for channel in range(held.MaxChannels()):
        kind, title = int(held.ChannelType(channel)), held.GetChannelTitle(channel)
        if kind in _WAVES:
            step = held.ChannelDivide(channel)
            stretches, parts, first = list[Stretch](), list[FloatArray](), 0
            at = held.FirstTime(channel, 0, end)
            while 0 <= at <= end:
                values = np.asarray(held.ReadFloats(channel, 2**22, at), dtype=np.float64)
                stretches.append(Stretch(first, len(values), at * tick_s))
                parts, first = [*parts, values], first + len(values)
                at = held.FirstTime(channel, at + len(values) * step, end)
            whole, unit = np.concatenate(parts) if parts else np.empty(0), held.GetChannelUnits(channel)
            tracks.append(Track.of_values(title, 1 / (step * tick_s), stretches, whole, unit))
        elif kind in _EVENTS:
            rows += [(title, at * tick_s, 0.0) for at in held.ReadEvents(channel, 2**20, 0)]
        elif kind in _MARKS:
            rows += [(f"{title} {one.Code1}", one.Tick * tick_s, 0.0) for one in held.ReadMarkers(channel, 2**20, 0)]
        elif kind in _TEXT_MARKS:
            rows += [(one.Text, one.Tick * tick_s, 0.0) for one in held.ReadTextMarks(channel, 2**20, 0)]
    return Contents(path.name, tuple(tracks), events_of(rows))
