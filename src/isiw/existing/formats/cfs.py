"""Signal's files (.cfs), by BioSig where its user has installed it; each frame is a sweep."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Final

import numpy as np

from isiw.errors import ConfigError
from isiw.existing.formats.contents import Contents, Track, events_of, parted, time_of
from isiw.existing.layout import Layout

_FRAME: Final = 0x7FFE
"""BioSig's type of an event where a new frame begins."""

WAY_IN: Final = (
    "In Signal: File, Export As, Text file (.txt), the frames one below the other, or MATLAB data (.mat). A layout "
    "says what is what: docs/your-data.md. Or install BioSig for Python, whose licence is GPL-3."
)


def read(path: Path, _layout: Layout) -> Contents:
    """The frames and markers of a file of Signal."""
    try:
        biosig = importlib.import_module("biosig")
    except ImportError as error:
        raise ConfigError("files of Signal are read by BioSig, which is not installed", remedy=WAY_IN) from error
    said, values = json.loads(biosig.header(str(path.resolve()))), np.asarray(biosig.data(str(path.resolve())))
    rate_hz, count = float(said["Samplingrate"]), len(values)
    events = [(int(one["TYP"], 16), float(one["POS"]), one) for one in said.get("EVENT", ())]
    firsts = [round(at * rate_hz) for kind, at, _ in events if kind == _FRAME]
    frames = parted(firsts, count, rate_hz)
    tracks = [
        Track.of_values(one["Label"], rate_hz, frames, values[:, index], one.get("PhysicalUnit", ""))
        for index, one in enumerate(said["CHANNEL"][: values.shape[1]])
    ]
    rows = [("sweep", frame.start_s, frame.samples / rate_hz) for frame in frames if len(frames) > 1]
    rows += [
        (str(one.get("Description") or kind), time_of(at * rate_hz, frames, rate_hz), 0.0)
        for kind, at, one in events
        if kind != _FRAME
    ]
    return Contents(path.name, tuple(tracks), events_of(rows))
