"""What MNE reads: BrainVision, FIF with raw data or epochs, CNT, GDF, MFF; and its objects in memory."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.existing.formats.contents import Contents, Stretch, Track, events_of, parted, timed, with_codes
from isiw.existing.frames import content_of, decoded
from isiw.existing.layout import EMG_UNITS, Layout
from isiw.text.named_code import library

_PAUSE: Final = re.compile(r"new segment|\bboundary\b", re.IGNORECASE)  # of unknown length, as annotations say it
_DATE: Final = 14  # the date of a marker of BrainVision has at least so many digits


def read(path: Path, _layout: Layout) -> Contents:
    """The contents of a file that MNE reads."""
    mne = library("mne", "import")
    if re.search(r"\.fif(\.gz)?$", path.name) and re.search(r"epo(chs)?\b", path.name):
        return of_epochs(mne.read_epochs(path, verbose="ERROR"), path.name)
    if path.suffix.casefold() == ".vhdr":
        _require_whole_markers(path)
    return of_raw(mne.io.read_raw(path, verbose="ERROR"), path.name).with_bids(path)


def _require_whole_markers(path: Path) -> None:
    """Raise if a comma in the text of a marker is not coded, which MNE takes for the end of the text."""
    said = re.search(r"^MarkerFile=(.*)$", decoded(content_of(path)), re.MULTILINE)
    markers = path.parent / (said[1].strip().replace("$b", path.stem) if said else path.name)
    for line in decoded(content_of(markers)).splitlines() if markers.is_file() else ():
        kind, *fields = line.partition("=")[2].split(",")  # of these: text, place, size, channel, and perhaps a date
        is_date = kind != "Comment" or len(fields[-1].strip()) >= _DATE
        dated = len(fields) == 5 and fields[1].strip().isdigit() and is_date
        if re.match(r"Mk\d+=", line) and len(fields) > 4 and not dated:
            what = f"a comma stands in the text of a marker in {markers.name}, where it must be coded"
            remedy = "Write that into the .vmrk with an editor; what wrote the file left it out."
            expected = r"\1 in its place, as BrainVision has it"
            raise InvalidValueError(what, got=line.strip(), expected=expected, remedy=remedy)


def of_raw(raw: Any, source: str = "the recording") -> Contents:
    """The channels of an `mne.io.Raw`, its annotations, and what stim channels have besides."""
    rate_hz = float(raw.info["sfreq"])
    noted = [(str(one["description"]).removeprefix("Comment/"), (float(one["onset"]) - raw.first_time) * rate_hz,
              float(one["duration"])) for one in raw.annotations]  # fmt: skip
    stretches = parted((round(at) for name, at, _ in noted if _PAUSE.search(name)), raw.n_times, rate_hz)

    def part(index: int, first: int, last: int) -> Any:
        return raw.get_data(picks=[index], start=first, stop=last, verbose="ERROR")[0]

    tracks = tuple(_tracks(raw, stretches, part))
    is_usual = not getattr(raw, "_orig_units", None)
    return Contents(source, tracks, with_codes(timed(noted, stretches, rate_hz), tracks), unit_is_usual=is_usual)


def of_epochs(epochs: Any, source: str = "the epochs") -> Contents:
    """The sweeps of `mne.Epochs`: their metadata say the ISIs, or their annotations the stimuli."""
    flat = [epochs.get_data(picks=[index], verbose="ERROR")[:, 0].ravel() for index in range(len(epochs.ch_names))]
    length, zero_s = len(epochs.times), -float(epochs.tmin)
    stretches = parted(range(0, length * len(epochs), length), length * len(epochs), float(epochs.info["sfreq"]))
    tracks = tuple(_tracks(epochs, stretches, lambda index, first, last: flat[index][first:last]))
    noted = {(str(name), round(stretch.start_s + float(at) + zero_s, 6)): float(lasts)
             for stretch, each in zip(stretches, epochs.get_annotations_per_epoch(), strict=True)
             for at, lasts, name in each}  # fmt: skip
    if epochs.metadata is not None:
        names = {code: name for name, code in epochs.event_id.items()}
        for code, stretch in zip(epochs.events[:, 2], stretches, strict=True):
            noted.setdefault((names[code], round(stretch.start_s + zero_s, 6)), 0.0)
    elif not noted:
        expected = "a column isi_ms in their metadata, or annotations of the stimuli"
        raise InvalidValueError(f"{source} do not hold the ISIs", expected=expected)
    events = events_of((name, at, lasts) for (name, at), lasts in noted.items())
    if epochs.metadata is None:
        return Contents(source, tracks, events, unit_is_usual=True)
    return Contents(source, tracks, events, epochs.metadata, zero_s, empty_is_alone=True, unit_is_usual=True)


def _tracks(held: Any, stretches: tuple[Stretch, ...], part: Callable[[int, int, int], Any]) -> Iterator[Track]:
    units = getattr(held, "_orig_units", None) or {}
    for index, (name, kind) in enumerate(zip(held.ch_names, held.get_channel_types(), strict=True)):
        said = units.get(name, "V")
        usual = "" if kind == "misc" and said not in {"V", "n/a", ""} else kind
        read, unit = partial(part, index), "" if said == "n/a" else said
        track = Track(str(name), float(held.info["sfreq"]), stretches, read, unit, usual, bad=name in held.info["bads"])
        yield track.scaled(1e3 / EMG_UNITS.get(said, 1e3))  # numbers in other units stay as they are
