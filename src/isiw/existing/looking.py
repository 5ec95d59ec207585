"""A look into a file before it is analysed: what is in it, the command that would read it, and what is missing."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

import isiw
from isiw.errors import InvalidValueError, IsiwError
from isiw.existing import formats
from isiw.existing.apart import Answer, read_apart
from isiw.existing.delivered import Delivered
from isiw.existing.formats.contents import Contents, Track
from isiw.existing.frames import named
from isiw.existing.layout import Layout
from isiw.existing.limits import ReadingLimits
from isiw.existing.markers import marked, names_of, times_of
from isiw.existing.quantities import Columns
from isiw.existing.reading import people_of_contents
from isiw.files import is_mcap
from isiw.log.places import log_exists
from isiw.text.sanitize import command, counted
from isiw.types import FloatArray, Reference

if TYPE_CHECKING:  # the process that reads draws nothing
    from matplotlib.figure import Figure

SWEEPS: Final = 3  # so many sweeps are drawn
_MOST: Final = 30  # so many channels, events and columns are listed one by one
_TRIGGER: Final = 0.02  # the most of a channel of triggers that is neither near its lowest nor near its highest value


@dataclass(frozen=True, eq=False)
class Look:
    """What is in a file.

    Args:
        lines: its channels, events, or columns, one a line.
        command: the command that would analyse it, as far as it can be known.
        missing: what is still to be said; empty if nothing is.
        figure: the first sweeps, with what would be measured; None if there are none.
    """

    lines: tuple[str, ...]
    command: str
    missing: str
    figure: Figure | None

    def __str__(self) -> str:
        missing = [f"Missing: {self.missing}"] if self.missing else []
        return "\n".join([*filter(None, self.lines), f"Proposed: {self.command}", *missing])


def look(
    path: str | Path,
    layout: Layout | None = None,
    *,
    limits: ReadingLimits | None = None,
    also: Sequence[str | Path] = (),
) -> Look:
    """Look into a table or a recording.

    Args:
        path: the file.
        layout: how it is laid out, as far as that is known.
        limits: the most that is read.
        also: files elsewhere that it may refer to.

    Raises:
        InvalidValueError: a format that is not known, or a file that cannot be read.
        ConfigError: a library is not installed.
    """
    if log_exists(Path(path)) and is_mcap(Path(path)):
        remedy = f"{command('show', path)} says what is in it, and {command('analyse', path)} analyses it."
        raise InvalidValueError("this is a log of isiw, and says itself what it holds", got=str(path), remedy=remedy)
    people, said = read_apart(Path(path), layout or Layout(), "", limits or ReadingLimits(), also, look=True)
    sweeps = [isiw.plots.sweeps_figure(one.trials, one.sweeps, one.signals.mep_window_ms, SWEEPS) for one in people[:1]]
    return Look(tuple(said["lines"]), said["command"], said["missing"], *(sweeps or [None]))


def seen_in(contents: Contents, path: Path, layout: Layout, limits: ReadingLimits) -> Answer:
    """The people in a file, as far as they can be read, and what is said of its contents."""
    triggers = {} if len(contents.events) else dict(_triggers(contents))
    proposed = _with_markers(contents, triggers, layout)
    people, missing = list[Delivered](), ""
    try:
        known = replace(proposed, reference=proposed.reference or _reference(contents))
        people = people_of_contents(contents, path, known, "", limits)
    except IsiwError as error:
        missing = f"{error}"
    if proposed.reference is None:
        proposed = replace(proposed, reference=_reference(contents))
        missing = f"{missing} Do ISIs count from the impact (or electrical pulse), or the valve?".strip()
    heading = f"{path.name}: {formats.format_of(path).name}"
    lines = [heading, *(_of_recording(contents, triggers) if contents.tracks else _of_table(contents, proposed))]
    for one in people[:_MOST]:
        count = sum(trial.told for trial in one.trials)
        lines.append(f"{one.subject or 'unnamed'}: {counted(len(one.trials), 'trial')}, of which {count} count")
    notes = dict.fromkeys(note for one in people for note in one.notes)
    return Answer(people[:1], {"lines": [*lines, *notes], "command": _command(path, proposed), "missing": missing})


def _reference(contents: Contents) -> Reference:
    """The reference that is proposed: the valve, if its command is marked and no tap is."""
    valve, tap = (len(marked(contents.events, key, Layout())) > 0 for key in ("valve", "tap"))
    return "valve" if valve and not tap else "impact"


def _of_recording(contents: Contents, triggers: Mapping[str, FloatArray]) -> Iterator[str]:
    for track in contents.tracks[:_MOST]:
        said = ", ".join(filter(None, [track.unit or "no unit", f"{track.rate_hz:.6g} Hz", track.kind, _gaps(track)]))
        trigger = f"; a trigger? {_times(triggers[track.name])}" if track.name in triggers else ""
        yield f"  channel {track.name!r}: {said}{trigger}"
    if len(contents.tracks) > _MOST:
        yield f"  and {counted(len(contents.tracks) - _MOST, 'other channel')}"
    names = names_of(contents.events)
    for name in names[:_MOST]:
        yield f"  event {name!r}: {_times(times_of(contents.events, name))}"
    if len(names) > _MOST:
        yield f"  and {counted(len(names) - _MOST, 'other name', 'other names')} of events"
    if not names and not triggers:
        yield "  no events"


def _gaps(track: Track) -> str:
    """How long a channel lasts, and where it has gaps."""
    lasts_s = sum(stretch.samples for stretch in track.stretches) / track.rate_hz
    if len(track.stretches) == 1:
        return f"{lasts_s:.1f} s"
    return f"{lasts_s:.1f} s in {len(track.stretches)} parts, the second from {track.stretches[1].start_s:.1f} s on"


def _times(at_s: FloatArray) -> str:
    if len(at_s) < 2:
        return f"once, at {at_s[0]:.3f} s" if len(at_s) else "never"
    apart_s = np.diff(np.sort(at_s))
    return f"{len(at_s)} times, {np.median(apart_s):.3g} s apart ({apart_s.min():.3g} to {apart_s.max():.3g})"


def _triggers(contents: Contents) -> Iterator[tuple[str, FloatArray]]:
    """Channels of two levels, by when they leave the one at which they mostly are [s]."""
    for track in contents.tracks:
        first = None if track.kind == "emg" else next(track.pieces(), None)
        if first is None:
            continue
        low, high = (values := first[1]).min(), values.max()
        between = (values > low + 0.1 * (high - low)) & (values < high - 0.1 * (high - low))
        with suppress(IsiwError):  # of levels of which neither is rest
            if high > low and between.mean() < _TRIGGER and len(at_s := track.onsets_s()) > 1:
                yield track.name, np.asarray(at_s)


def _with_markers(contents: Contents, triggers: Mapping[str, FloatArray], layout: Layout) -> Layout:
    """A layout that says which events, or which triggers, mark tap and pulse, if one kind follows the other."""
    key = "valve" if (layout.reference or _reference(contents)) == "valve" else "tap"
    known = all(len(marked(contents.events, one, layout)) or one in layout.channels for one in (key, "pulse"))
    if not contents.tracks or (contents.trials is not None and contents.pulse_at_s is not None) or known:
        return layout
    times = triggers or {name: times_of(contents.events, name) for name in names_of(contents.events)}
    several = [name for name, at_s in times.items() if len(at_s) > 1 and not re.match("(?i)bad|sweep", name)]
    shares = dict[tuple[str, str], float]()
    for tap, pulse in permutations(several[:_MOST], 2):  # how many pulses follow a tap within the longest ISI
        before = np.searchsorted(times[tap], times[pulse], side="right") - 1
        after_s = times[pulse] - times[tap][np.maximum(before, 0)]
        shares[tap, pulse] = float(((after_s >= 0) & (after_s <= layout.longest_isi_ms / 1e3)).mean())
    pair = max(shares, key=lambda both: shares[both], default=None)
    if pair is None or shares[pair] < 0.5:
        return layout
    said = dict(zip((key, "pulse"), pair, strict=True))
    if triggers:  # and no events that a marker could be of
        return replace(layout, markers={}).saying(channels=said)
    return layout.saying(markers=said)


def _of_table(contents: Contents, layout: Layout) -> Iterator[str]:
    frame = named(contents.trials)
    try:
        found = Columns.found(frame, replace(layout, units=layout.units or ("ms", "mV")), contents.source)
        held = {column.name.partition(" (")[0]: key for key, column in found.of.items()}
    except IsiwError:
        held = {}
    for place, name in enumerate(frame.columns[:_MOST]):
        cells = frame.iloc[:, place]
        kinds = list(dict.fromkeys(map(str, cells.tolist())))
        some = ", ".join(kinds[:4]) + (f" … ({len(kinds)} different)" if len(kinds) > 4 else "")
        key = held.get(str(name), held.get(str(name).partition(" (")[0]))
        yield f"  column {str(name)!r}{f', the {key}' if key else ''}: {some}"
    yield f"  {counted(len(frame), 'row')}"


def _command(path: Path, layout: Layout) -> str:
    """The command line that says a layout."""
    words = ["analyse", str(path)]
    for option in ("reference", "alone", "decimal", "sheet", "unmarked"):
        if (value := getattr(layout, option)) is not None:
            words += [f"--{option}", value]
    for option in ("column", "where", "marker", "channel"):
        pairs: Mapping[str, str] = getattr(layout, "where" if option == "where" else f"{option}s")
        words += [word for key, name in pairs.items() for word in (f"--{option}", f"{key}={name}")]
    words += [word for unit in layout.units for word in ("--unit", unit)]
    return command(*words, "-o", f"{path.stem}.mcap")
