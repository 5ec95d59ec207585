"""AcqKnowledge (.acq): channels with rates of their own, and event markers."""

from __future__ import annotations

import re
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.existing.formats.contents import Contents, Track, events_of, parted, time_of
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray

_SEGMENT: Final = re.compile(r"segment \d+", re.IGNORECASE)
"""What a marker says where recording began, or was continued later."""

_TURNS: Final = 2**32
"""Numbers of samples below 0 are read as if so many were added."""


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and event markers of a file of AcqKnowledge."""
    reader = library("bioread.reader", "import").Reader
    with opened(path) as file:
        found = reader.read_headers(file)
    held, base_hz = found.datafile, float(found.samples_per_second)
    marked = [(int(one.sample_index), one) for one in found.event_markers or () if one.sample_index is not None]
    marks = [(at - _TURNS if at >= _TURNS // 2 else at, one) for at, one in marked]
    begun = min((at for at, one in marks if _SEGMENT.fullmatch(one.text.strip())), default=0)
    placed = [(at - min(begun, 0), one) for at, one in marks]
    cuts = [at for at, one in placed if _SEGMENT.fullmatch(one.text.strip())]

    @cache
    def numbers(channel: int) -> Any:
        with opened(path) as again:
            return reader.read(again, channel_indexes=[channel]).datafile.channels[channel]

    tracks = []
    for index, channel in enumerate(held.channels):
        rate_hz = float(channel.samples_per_second)
        stretches = parted((round(at / base_hz * rate_hz) for at in cuts), int(channel.point_count), rate_hz)
        part = partial(_part, numbers, index)
        track = Track(channel.name.strip(), rate_hz, stretches, part, channel.units)
        tracks.append(track.scaled(float(channel.raw_scale_factor), float(channel.raw_offset)))
    whole = parted(cuts, max((at for at, _ in placed), default=0) + 1, base_hz)
    rows = [
        (one.text.strip() or str(one.type).replace("None", "marker"), time_of(at, whole, base_hz), 0.0)
        for at, one in placed
        if not _SEGMENT.fullmatch(one.text.strip())
    ]
    return Contents(path.name, tuple(tracks), events_of(rows))


def _part(numbers: Any, index: int, first: int, last: int) -> FloatArray:
    return np.asarray(numbers(index).raw_data[first:last], dtype=np.float64)
