"""Formats whose only readers are for Windows: Spike2 from version 8 on (.smrx), and LabChart (.adicht)."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from isiw.errors import ConfigError
from isiw.existing.formats.contents import Contents, Stretch, Track, events_of, parted, time_of
from isiw.existing.layout import Layout
from isiw.text.named_code import library
from isiw.types import FloatArray

SMRX = (
    "In Spike2: File, Export As, Spreadsheet text (.txt), a row a sample, EMG and triggers as columns; or "
    "File, Export As, an older Spike2 file (.smr). A layout says what is what: docs/your-data.md."
)
ADICHT = (
    "In LabChart: File, Export, LabChart text (.txt), with block header, time and comments; or MATLAB (.mat). A "
    "layout says what is what: docs/your-data.md."
)
_WAVES, _EVENTS, _MARKS, _TEXTS = {1, 9}, {2, 3}, {5}, {8}


def _on_windows(module: str, package: str, remedy: str) -> Any:
    """The reader, on Windows where it is installed; elsewhere how to export the file."""
    if sys.platform != "win32":
        raise ConfigError("this format has no reader but on Windows", got=sys.platform, remedy=remedy)
    try:
        return library(module, "import")
    except ConfigError as error:
        said = f"pip install {package}; its licence is its own. Or: {remedy}"
        raise ConfigError(f"{package} is not installed", remedy=said) from error


def smrx(path: Path, _layout: Layout) -> Contents:
    """The waveforms, events and markers of a file of Spike2 8 and later, by CED's sonpy."""
    held = _on_windows("sonpy.lib", "sonpy", SMRX).SonFile(str(path), bReadOnly=True)
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
    held = _on_windows("adi", "adi-reader", ADICHT).read_file(str(path))
    tracks, rows = list[Track](), list[tuple[str, float, float]]()
    for channel in held.channels:
        parts = [np.asarray(channel.get_data(n + 1), dtype=np.float64) for n in range(channel.n_records)]
        firsts = np.cumsum([0, *map(len, parts)]).tolist()
        rate_hz, unit = float(channel.fs[0]), ", ".join(sorted({unit for unit in channel.units if unit}))
        stretches = parted(firsts, firsts[-1], rate_hz)
        tracks.append(Track.of_values(channel.name, rate_hz, stretches, np.concatenate(parts), unit))
        if not rows:  # comments say how long after the beginning of their record they are
            for first, record in zip(firsts, held.records, strict=False):
                times = [(one.text, first + float(one.time) * rate_hz) for one in record.comments]
                rows += [(text, time_of(at, stretches, rate_hz), 0.0) for text, at in times]
    return Contents(path.name, tuple(tracks), events_of(rows))
