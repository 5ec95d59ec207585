"""Spike2 up to version 7 (.smr): waveforms with their pauses, events, levels and markers with codes or texts."""

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

_LEVEL, _MARKER, _TEXTS = 4, 5, 8
"""Kinds of channels: a level's events are both of its edges; a marker has a code of four bytes, or a text."""
_EVER_S: Final = 1e6


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
    begin = firsts[segment]
    chunk = raw.get_analogsignal_chunk(0, segment, first - begin, last - begin, index)
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
    title = str(channel["name"])
    return [
        (_name(title, kind, str(label)), at_s, 0.0)
        for at_s, label in zip(times_s.tolist(), labels.tolist(), strict=True)
        if math.isfinite(at_s)
    ]


def _name(title: str, kind: int, label: str) -> str:
    """What an event is called: its text, its channel and code, or its channel."""
    if kind == _TEXTS:
        return label.strip("\0 ") or title
    return f"{title} {int(label) & 0xFF}" if kind == _MARKER and label.lstrip("-").isdigit() else title
