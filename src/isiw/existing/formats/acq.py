"""AcqKnowledge (.acq): channels with rates of their own, and event markers."""

from __future__ import annotations

import re
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from isiw.existing.formats.contents import Contents, Track, events_of, part_of, parted, timed
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray

_SEGMENT: Final = re.compile(r"segment \d+", re.IGNORECASE)  # a marker of where recording began, or continued later
_TURNS: Final = 2**32  # numbers of samples below 0 are read as if so many were added


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and event markers of a file of AcqKnowledge."""
    reader = library("bioread.reader", "import").Reader
    with opened(path) as file:
        found = reader.read_headers(file)
    base_hz, marks = float(found.samples_per_second), list[tuple[str, int]]()
    for one in found.event_markers or ():
        if (at := one.sample_index) is not None:
            name = one.text.strip() or str(one.type).replace("None", "marker")
            marks.append((name, int(at) - _TURNS if at >= _TURNS // 2 else int(at)))
    begun = min((at for name, at in marks if _SEGMENT.fullmatch(name)), default=0)
    cuts = [at - min(begun, 0) for name, at in marks if _SEGMENT.fullmatch(name)]
    noted = [(name, at - min(begun, 0), 0.0) for name, at in marks if not _SEGMENT.fullmatch(name)]

    @cache
    def numbers(channel: int) -> Any:
        with opened(path) as again:
            return reader.read(again, channel_indexes=[channel]).datafile.channels[channel].raw_data

    def part(channel: int, first: int, last: int) -> FloatArray:
        return part_of(numbers(channel), first, last)

    tracks = []
    for index, channel in enumerate(found.datafile.channels):
        rate_hz = float(channel.samples_per_second)
        stretches = parted((round(at / base_hz * rate_hz) for at in cuts), int(channel.point_count), rate_hz)
        track = Track(channel.name.strip(), rate_hz, stretches, partial(part, index), channel.units)
        tracks.append(track.scaled(float(channel.raw_scale_factor), float(channel.raw_offset)))
    whole = parted(cuts, max([*cuts, *(at for _, at, _ in noted)], default=0) + 1, base_hz)
    return Contents(path.name, tuple(tracks), events_of(timed(noted, whole, base_hz)))
