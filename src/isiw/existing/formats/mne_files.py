"""What MNE reads: BrainVision, FIF with raw data or epochs, CNT, GDF, MFF; and its objects in memory."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.existing.formats.beside import bids_events
from isiw.existing.formats.contents import APART_S, Contents, Stretch, Track, events_of, with_codes
from isiw.existing.layout import Layout
from isiw.files import opened
from isiw.lazy import pd
from isiw.text.named_code import library
from isiw.types import FloatArray

_SCALES_V: Final = {"V": 1.0, "mV": 1e-3, "µV": 1e-6, "uV": 1e-6, "nV": 1e-9}
"""The units that MNE knows, in V; numbers in others it leaves as they are."""

_ODD_MARKER: Final = re.compile(r"\s*Mk\d+=[^,]*,(?!([^,]*,){3}[^,]*(,\s*\d{14,}\s*)?$)(.*,){4}")
"""A marker of BrainVision with more than its text, place, size, channel, and a date."""


def read(path: Path, _layout: Layout) -> Contents:
    """The contents of a file that MNE reads."""
    mne = library("mne", "import")
    if re.search(r"\.fif(\.gz)?$", path.name) and re.search(r"epo(chs)?\b", path.name):
        return of_epochs(mne.read_epochs(path, verbose="ERROR"), path.name)
    if path.suffix.casefold() == ".vhdr":
        _require_whole_markers(path)
    return of_raw(mne.io.read_raw(path, verbose="ERROR"), path.name, bids_events(path))


def _require_whole_markers(path: Path) -> None:
    """Raise if a comma in the text of a marker is not coded, which MNE takes for the end of the text."""
    said = re.search(r"^\s*MarkerFile\s*=\s*(.*?)\s*$", _text(path), re.MULTILINE)
    markers = path.with_name(said[1].replace("$b", path.stem)) if said else path
    for line in _text(markers).splitlines() if markers.is_file() else ():
        if _ODD_MARKER.match(line):
            raise InvalidValueError(
                f"a comma stands in the text of a marker in {markers.name}, where it must be coded",
                got=line.strip(),
                expected=r"\1 in its place, as BrainVision has it",
                remedy="Write that into the .vmrk with an editor; what wrote the file left it out.",
            )


def _text(path: Path) -> str:
    with opened(path) as file:
        return file.read().decode("utf-8", errors="replace")


def of_raw(raw: Any, source: str = "the recording", events: pd.DataFrame | None = None) -> Contents:
    """The channels of an `mne.io.Raw`, and its annotations, or a table of events."""
    stretches = tuple(_between(raw))
    tracks = tuple(_tracks(raw, stretches, lambda index: partial(_values, raw, index)))
    return Contents(source, tracks, _events(raw, tracks) if events is None else events)


def of_epochs(epochs: Any, source: str = "the epochs") -> Contents:
    """The sweeps of `mne.Epochs`: their metadata say the ISIs, or their annotations the stimuli."""
    data = {index: epochs.get_data(picks=[index], verbose="ERROR")[:, 0] for index in range(len(epochs.ch_names))}
    length, count = len(epochs.times), len(epochs)
    stretches = tuple(Stretch(n * length, length, n * APART_S) for n in range(count))
    flat = {index: values.ravel() for index, values in data.items()}
    tracks = tuple(_tracks(epochs, stretches, lambda index: lambda first, last: flat[index][first:last]))
    if epochs.metadata is not None:
        return Contents(source, tracks, _zeros(epochs), epochs.metadata, -float(epochs.tmin), empty_is_alone=True)
    noted = [
        (str(one[2]), n * APART_S + float(one[0]) - float(epochs.tmin), float(one[1]))
        for n, each in enumerate(epochs.get_annotations_per_epoch())
        for one in each
    ]
    if not noted:
        raise InvalidValueError(
            f"{source} do not hold the ISIs",
            expected="a column isi_ms in their metadata, or annotations of the stimuli",
        )
    return Contents(source, tracks, events_of(noted))


def _zeros(epochs: Any) -> pd.DataFrame:
    """What each epoch is about, at its time 0."""
    names = {code: name for name, code in epochs.event_id.items()}
    return events_of((names[code], n * APART_S - float(epochs.tmin), 0.0) for n, code in enumerate(epochs.events[:, 2]))


def _tracks(held: Any, stretches: tuple[Stretch, ...], reader: Any) -> Iterator[Track]:
    units = getattr(held, "_orig_units", None) or {}
    for index, (name, kind) in enumerate(zip(held.ch_names, held.get_channel_types(), strict=True)):
        said = units.get(name, "V")
        known_v = _SCALES_V.get(said)
        read = reader(index) if known_v is None else partial(_divided, reader(index), known_v)
        usual = "" if kind == "misc" and said not in {"V", "n/a", ""} else kind
        yield Track(str(name), float(held.info["sfreq"]), stretches, read, "" if said == "n/a" else said, usual)


def _values(raw: Any, index: int, first: int, last: int) -> FloatArray:
    values: FloatArray = raw.get_data(picks=[index], start=first, stop=last, verbose="ERROR")[0]
    return values


def _divided(read: Any, scale: float, first: int, last: int) -> FloatArray:
    values: FloatArray = read(first, last)
    return values / scale


def _between(raw: Any) -> Iterator[Stretch]:
    """What lies between pauses of unknown length, of which annotations tell."""
    rate_hz, count, first = float(raw.info["sfreq"]), raw.n_times, 0
    cuts = sorted({at for at, one in _annotations(raw) if re.search(r"new segment|\bboundary\b", one, re.IGNORECASE)})
    for number, at_s in enumerate([*cuts, count / rate_hz]):
        at = min(round(at_s * rate_hz), count)
        if at > first:
            yield Stretch(first, at - first, first / rate_hz + APART_S * (number if first else 0))
            first = at


def _annotations(raw: Any) -> list[tuple[float, str]]:
    return [(float(one["onset"]) - raw.first_time, str(one["description"])) for one in raw.annotations]


def _events(raw: Any, tracks: tuple[Track, ...]) -> pd.DataFrame:
    """The annotations, and what stim channels have besides."""
    rate_hz = float(raw.info["sfreq"])
    lasts = [float(one["duration"]) for one in raw.annotations]
    starts = [(stretch.first / rate_hz, stretch.start_s) for stretch in (tracks[0].stretches if tracks else ())]

    def moved(at_s: float) -> float:
        begins, own = max((pair for pair in starts if pair[0] <= at_s + 0.5 / rate_hz), default=(0.0, 0.0))
        return at_s - begins + own

    rows = [(name, moved(at), long) for (at, name), long in zip(_annotations(raw), lasts, strict=True)]
    return with_codes(rows, tracks)
