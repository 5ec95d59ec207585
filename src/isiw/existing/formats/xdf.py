"""XDF of LabRecorder (Lab Streaming Layer): streams with clock offsets, of which those with texts are markers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from isiw.existing.formats.contents import Contents, Track, events_of
from isiw.existing.formats.stamps import clocked
from isiw.existing.formats.xdf_chunks import shortened
from isiw.existing.layout import Layout
from isiw.text.named_code import library

_SCATTER_S = 2e-3


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and markers of all streams, on one clock; gaps are found here, since pyxdf smooths them away."""
    load = library("pyxdf", "import").load_xdf
    numbers, shorter = shortened(path)
    streams, _ = load(shorter, dejitter_timestamps=False, verbose=False)
    streams = [stream for stream in streams if len(stream["time_stamps"])]
    begun_s = min((float(stream["time_stamps"][0]) for stream in streams), default=0.0)
    hosts = {_said(stream["info"], "hostname") for stream in streams}
    tracks, rows, notes = list[Track](), list[tuple[str, float, float]](), list[str]()
    for stream in streams:
        name, times_s = _said(stream["info"], "name"), np.asarray(stream["time_stamps"]) - begun_s
        if len(hosts) > 1 and not len(stream.get("clock_times", ())):
            notes.append(f"The stream {name} has no clock offsets, and another computer recorded beside it.")
        if _is_of_markers(stream):
            rows += [(_text(one), at, 0.0) for one, at in zip(stream["time_series"], times_s.tolist(), strict=True)]
            continue
        if (held := numbers.get(stream["info"]["stream_id"])) is None:
            continue  # numbers at no rate, which no EMG has
        index = np.asarray(held.index[: len(times_s)])
        of_stream = clocked(times_s, 1.0 / held.period_s, f"the stream {name}", index, held.firsts[-1])
        if of_stream.scatter_s > _SCATTER_S:
            notes.append(
                f"The times of the stream {name} scatter by {1e3 * of_stream.scatter_s:.1f} ms: MEPs may lie elsewhere."
            )
        for channel, (label, unit, kind) in enumerate(_channels(stream)):
            part = partial(held.read, channel)
            tracks.append(Track(label, of_stream.rate_hz, of_stream.stretches, part, unit, kind))
    twice = {track.name for track in tracks if [one.name for one in tracks].count(track.name) > 1}
    if twice:
        notes.append(f"Several channels are called {', '.join(sorted(twice))}.")
    return Contents(path.name, tuple(tracks), events_of(rows), notes=tuple(notes))


def _is_of_markers(stream: Mapping[str, Any]) -> bool:
    """True for texts, and for numbers that come at no rate: whole ones, or of a type that says so."""
    form, kind = (_said(stream["info"], key).casefold() for key in ("channel_format", "type"))
    coded = form.startswith("int") or any(word in kind for word in ("marker", "trig", "ttl", "stim", "event"))
    return form == "string" or (float(_said(stream["info"], "nominal_srate") or 0.0) == 0.0 and coded)


def _said(info: Mapping[str, Any] | None, key: str) -> str:
    """What the description of a stream says, whose every entry is a list."""
    value = (info or {}).get(key)
    value = value[0] if isinstance(value, list) and value else value
    return "" if value is None or isinstance(value, list | dict) else str(value)


def _text(marker: Any) -> str:
    """What a marker says; a whole number has no decimal sign."""
    first = marker[0] if len(marker) == 1 else " ".join(map(str, marker))
    return first if isinstance(first, str) else f"{float(first):g}"


def _channels(stream: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The label, unit and type of each channel of a stream."""
    info, name = stream["info"], _said(stream["info"], "name")
    described = (info.get("desc") or [None])[0] or {}
    inner = (described.get("channels") or [None])[0] or {}
    each, count, found = inner.get("channel") or [], int(_said(info, "channel_count")), []
    for channel in range(count):
        said = each[channel] if channel < len(each) else None
        label = _said(said, "label") or (name if count == 1 else f"{name} {channel + 1}")
        found.append((label, _said(said, "unit"), (_said(said, "type") or _said(info, "type")).casefold()))
    return found
