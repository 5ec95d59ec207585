"""Formats whose readers their users install: Signal (.cfs), and on Windows Spike2 8 (.smrx) and LabChart (.adicht)."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.errors import ConfigError
from isiw.existing.formats.contents import Contents, Stretch, Track, events_of, parted, timed
from isiw.existing.layout import Layout
from isiw.text.named_code import library
from isiw.types import FloatArray

CFS: Final = (
    "In Signal: File, Export As, Text file (.txt), the frames one below the other, or MATLAB data (.mat). A layout "
    "says what is what: docs/your-data.md."
)
SMRX: Final = (
    "In Spike2: File, Export As, Spreadsheet text (.txt), a row a sample, EMG and triggers as columns; or "
    "File, Export As, an older Spike2 file (.smr). A layout says what is what: docs/your-data.md."
)
ADICHT: Final = (
    "In LabChart: File, Export, LabChart text (.txt), with block header, time and comments; or MATLAB (.mat). A "
    "layout says what is what: docs/your-data.md."
)
_FRAME: Final = 0x7FFE  # BioSig's type of an event where a new frame begins
_WAVES, _EVENTS, _MARKS, _TEXTS = {1, 9}, {2, 3}, {5}, {8}  # sonpy's types of channels


def _reader(module: str, install: str, way_in: str, *, on_windows: bool = False) -> Any:
    """The reader, where it is installed; elsewhere how to install it, or how to export the file."""
    if on_windows and sys.platform != "win32":
        raise ConfigError("this format has no reader but on Windows", got=sys.platform, remedy=way_in)
    try:
        return library(module, "import")
    except ConfigError as error:
        raise ConfigError(f"{module.partition('.')[0]} is not installed", remedy=f"{install}. Or: {way_in}") from error


def cfs(path: Path, _layout: Layout) -> Contents:
    """The frames and markers of a file of Signal, by BioSig; each frame is a sweep."""
    biosig = _reader("biosig", "Install BioSig for Python, whose licence is GPL-3", CFS)
    said, values = json.loads(biosig.header(str(path.resolve()))), np.asarray(biosig.data(str(path.resolve())))
    rate_hz, count = float(said["Samplingrate"]), len(values)
    events = [(int(one["TYP"], 16), float(one["POS"]), one) for one in said.get("EVENT", ())]
    frames = parted((round(at * rate_hz) for kind, at, _ in events if kind == _FRAME), count, rate_hz)
    tracks = [Track.of_values(one["Label"], rate_hz, frames, values[:, index], one.get("PhysicalUnit", ""))
              for index, one in enumerate(said["CHANNEL"][: values.shape[1]])]  # fmt: skip
    noted = [(str(one.get("Description") or kind), at * rate_hz, 0.0) for kind, at, one in events if kind != _FRAME]
    sweeps = [("sweep", frame.start_s, frame.samples / rate_hz) for frame in frames if len(frames) > 1]
    return Contents(path.name, tuple(tracks), events_of([*sweeps, *timed(noted, frames, rate_hz)]))


def smrx(path: Path, _layout: Layout) -> Contents:
    """The waveforms, events and markers of a file of Spike2 8 and later, by CED's sonpy."""
    sonpy = _reader("sonpy.lib", "pip install sonpy, whose licence is its own", SMRX, on_windows=True)
    held = sonpy.SonFile(str(path), bReadOnly=True)
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
        elif kind in _TEXTS:
            rows += [(one.Text, one.Tick * tick_s, 0.0) for one in held.ReadTextMarks(channel, 2**20, 0)]
    return Contents(path.name, tuple(tracks), events_of(rows))


def adicht(path: Path, _layout: Layout) -> Contents:
    """The channels and comments of a file of LabChart, by adi-reader; its records are apart."""
    adi = _reader("adi", "pip install adi-reader, whose licence is its own", ADICHT, on_windows=True)
    held = adi.read_file(str(path))
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
