"""What programs of amplifiers write: AcqKnowledge (.acq), Signal (.cfs), and LabChart (.adicht)."""

from __future__ import annotations

import json
import re
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.existing.formats.contents import Contents, Track, events_of, part_of, parted, timed
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray

_SEGMENT: Final = re.compile(r"segment \d+", re.IGNORECASE)  # a marker of where recording began, or continued later
_TURNS: Final = 2**32  # numbers of samples below 0 are read as if so many were added
_FRAME: Final = 0x7FFE  # BioSig's type of an event where a new frame begins


def acq(path: Path, _layout: Layout) -> Contents:
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


def cfs(path: Path, _layout: Layout) -> Contents:
    """The frames and markers of a file of Signal, by BioSig; each frame is a sweep."""
    biosig = library("biosig", "import")
    said, values = json.loads(biosig.header(str(path.resolve()))), np.asarray(biosig.data(str(path.resolve())))
    rate_hz, count = float(said["Samplingrate"]), len(values)
    events = [(int(one["TYP"], 16), float(one["POS"]), one) for one in said.get("EVENT", ())]
    frames = parted((round(at * rate_hz) for kind, at, _ in events if kind == _FRAME), count, rate_hz)
    tracks = [Track.of_values(one["Label"], rate_hz, frames, values[:, index], one.get("PhysicalUnit", ""))
              for index, one in enumerate(said["CHANNEL"][: values.shape[1]])]  # fmt: skip
    noted = [(str(one.get("Description") or kind), at * rate_hz, 0.0) for kind, at, one in events if kind != _FRAME]
    sweeps = [("sweep", frame.start_s, frame.samples / rate_hz) for frame in frames if len(frames) > 1]
    return Contents(path.name, tuple(tracks), events_of([*sweeps, *timed(noted, frames, rate_hz)]))


def adicht(path: Path, _layout: Layout) -> Contents:
    """The channels and comments of a file of LabChart, by adi-reader; its records are apart."""
    held = library("adi", "import").read_file(str(path))
    tracks, rows = list[Track](), list[tuple[str, float, float]]()
    for channel in held.channels:
        parts = [np.asarray(channel.get_data(n + 1), dtype=np.float64) for n in range(channel.n_records)]
        firsts = np.cumsum([0, *map(len, parts)]).tolist()
        rate_hz, unit = float(channel.fs[0]), ", ".join(sorted({unit for unit in channel.units if unit}))
        stretches = parted(firsts, firsts[-1], rate_hz)
        tracks.append(Track.of_values(channel.name, rate_hz, stretches, np.concatenate(parts), unit))
        noted = [(one.text, first + float(one.time) * rate_hz, 0.0)  # which is since the beginning of its record
                 for first, record in zip(firsts, held.records, strict=False) for one in record.comments]  # fmt: skip
        rows = rows or timed(noted, stretches, rate_hz)
    return Contents(path.name, tuple(tracks), events_of(rows))
