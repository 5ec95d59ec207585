"""AcqKnowledge (.acq): channels with rates of their own, and event markers."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.existing.formats.contents import APART_S, Contents, Stretch, Track, events_of
from isiw.existing.layout import Layout
from isiw.files import opened
from isiw.text.named_code import library
from isiw.types import FloatArray

_APPENDED: Final = "apnd"
"""The type of a marker where recording was stopped, and continued later."""


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and event markers of a file of AcqKnowledge."""
    reader = library("bioread.reader", "import").Reader
    with opened(path) as file:
        found = reader.read_headers(file)
    held, base_hz = found.datafile, float(found.samples_per_second)
    marks = [one for one in found.event_markers or () if one.sample_index is not None]
    cuts_s = sorted(one.sample_index / base_hz for one in marks if one.type_code == _APPENDED and one.sample_index > 0)

    @cache
    def numbers(channel: int) -> Any:
        with opened(path) as again:
            return reader.read(again, channel_indexes=[channel]).datafile.channels[channel]

    tracks = []
    for index, channel in enumerate(held.channels):
        rate_hz = float(channel.samples_per_second)
        stretches = tuple(_between(cuts_s, rate_hz, int(channel.point_count)))
        tracks.append(Track(channel.name.strip(), rate_hz, stretches, partial(_part, numbers, index), channel.units))
    rows = [
        (one.text.strip() or str(one.type), _moved(one.sample_index / base_hz, cuts_s), 0.0)
        for one in marks
        if one.type_code != _APPENDED
    ]
    return Contents(path.name, tuple(tracks), events_of(rows))


def _part(numbers: Any, index: int, first: int, last: int) -> FloatArray:
    channel = numbers(index)
    values: FloatArray = np.asarray(channel.raw_data[first:last], dtype=np.float64)
    return values * float(channel.raw_scale_factor) + float(channel.raw_offset)


def _moved(at_s: float, cuts_s: list[float]) -> float:
    """A time, after each pause moved by as much as it is taken for."""
    return at_s + APART_S * sum(cut_s <= at_s for cut_s in cuts_s)


def _between(cuts_s: list[float], rate_hz: float, count: int) -> list[Stretch]:
    """What was recorded without a pause."""
    begins = [0, *(min(round(cut_s * rate_hz), count) for cut_s in cuts_s)]
    ends = [*begins[1:], count]
    return [
        Stretch(begin, end - begin, begin / rate_hz + APART_S * number)
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True))
        if end > begin
    ]
