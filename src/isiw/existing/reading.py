"""Tables, recordings, logs and data frames of a lab, as the people whose trials they hold."""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from isiw.checks import MOST_MEP_MV
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.existing import doubtful_numbers, doubts, formats, frames, recordings
from isiw.existing.apart import read_apart
from isiw.existing.cells import dates_of, days_of, is_missing, latest_of
from isiw.existing.delivered import Delivered, anywhere, read_log, renumbered, spelt_otherwise
from isiw.existing.formats import mne_files
from isiw.existing.formats.contents import Contents
from isiw.existing.layout import CHANNELS, EMG_UNITS, Layout
from isiw.existing.limits import ReadingLimits, require_file, require_most, require_table
from isiw.existing.markers import EVENT
from isiw.existing.names import ALL
from isiw.existing.quantities import Columns
from isiw.files import is_mcap
from isiw.findings import INTENSITY_PCT, Kind
from isiw.lazy import pd
from isiw.log.places import log_exists
from isiw.signals.judgement import judge_measurement
from isiw.signals.limits import SignalLimits
from isiw.sweeps import Measurement
from isiw.trials import Status, Stimulus, Trial
from isiw.types import Reference
from isiw.visit import Visit

_ALWAYS: Final = "reference units longest_isi_ms"
_OF_ROWS, _OF_SAMPLES = "columns where alone decimal", "channels markers rate_hz mep_window_ms"
"""What of a layout is used of any file, of rows that say ISIs, and of samples."""


def read_people(
    source: str | Path | Any,
    layout: Layout | None = None,
    *,
    subject: str = "",
    limits: ReadingLimits | None = None,
    also: Sequence[str | Path] = (),
) -> list[Delivered]:
    """The people whose trials a file or a table holds; a file is read by a process of its own.

    Args:
        source: the path of a table, a recording or a log; or a `pandas.DataFrame`, `mne.io.Raw` or `mne.Epochs`.
        layout: how it is laid out, as far as it does not say so itself.
        subject: the code of a person who has none in it; by default the file's name.
        limits: the most that is read of a file.
        also: files elsewhere that a recording may refer to; of others only those of its own folder are read.

    Raises:
        InvalidValueError: something that is ambiguous, missing or cannot be true, or a limit that is reached; the
            message says what to do.
        ConfigError: a library is not installed.
        LogError: a log that cannot be read.
    """
    people = people_in(source, layout or Layout(), subject, limits or ReadingLimits(), also)
    for error in spelt_otherwise(one.subject for one in people).values():
        raise error
    return people


def people_in(
    source: str | Path | Any, layout: Layout, subject: str, limits: ReadingLimits, also: Sequence[str | Path]
) -> list[Delivered]:
    """The same, also of codes that may be two spellings of one."""
    if not isinstance(source, str | Path):
        return people_of_contents(_in_memory(source), None, layout, subject)
    path = Path(source)
    if log_exists(path) and is_mcap(path):
        found = read_log(path)
        other = None if layout.reference == found.reference else layout.reference
        _require_use(replace(layout, reference=other), {}, path.name, "a log")
        return [found]
    if not path.exists():
        raise InvalidValueError("there is no such file", got=str(path), remedy="Check the path.")
    return read_apart(path, layout, subject, limits, also).people


def contents_in(path: Path, layout: Layout, limits: ReadingLimits) -> Contents:
    """What a file holds, within limits, read by this process."""
    require_file(limits, path, text=path.suffix.lower() in frames.TEXTS)
    contents = formats.read(path, layout)
    if contents.trials is not None:
        require_table(limits, contents.trials, path.name)
    return contents


def people_of_contents(
    contents: Contents, path: Path | None, layout: Layout, subject: str, limits: ReadingLimits | None = None
) -> list[Delivered]:
    """The people whose trials are in what a file holds; who has no code is called as the file is."""
    if contents.trials is None and not contents.tracks:
        remedy = "Record or export it again so that the stream of EMG, or its channel, says its rate, or as EDF+."
        raise InvalidValueError(f"{contents.source} has no channel of samples at a rate", remedy=remedy)
    _require_used(contents, path, layout)
    name = subject or ("" if path is None else path.stem)
    people = ([recordings.of_contents(contents, layout, name)] if contents.tracks
              else _people_of(frames.named(contents.trials), layout, contents.source, name, limits))  # fmt: skip
    for one in people:
        doubts.require_short(one, layout)
    return people


def _require_used(contents: Contents, path: Path | None, layout: Layout) -> None:
    """Raise if something is stated that contents of this kind have no use for."""
    of_path = None if path is None else formats.format_of(path)
    in_columns, options = (False, ()) if of_path is None else (of_path.is_table, of_path.options)
    kind, used, keys = "a table", _OF_ROWS, dict[str, AbstractSet[str]]()
    if contents.tracks and contents.trials is None:
        kind, used = "a recording", f"{_OF_SAMPLES} unmarked{' decimal' if in_columns else ''}"
        keys = {"where": {EVENT, *(track.name for track in contents.tracks)}}
        keys |= {"units": {*EMG_UNITS}, "channels": {*CHANNELS} - (set() if in_columns else {"events"})}
    elif contents.tracks:
        kind, used = "of sweeps whose ISIs are stated", f"{_OF_ROWS} {_OF_SAMPLES}"
        used += " pulse_at_ms" if in_columns else " unmarked"
        keys = {**recordings.OF_SWEEPS, **({"channels": {"emg"}, "markers": set()} if in_columns else {})}
    names = [*_ALWAYS.split(), *used.split(), *options]
    known: Mapping[str, AbstractSet[str] | None] = {**dict.fromkeys(names), **keys}
    _require_use(layout, known, "the data" if path is None else path.name, kind)


def _require_use(layout: Layout, used: Mapping[str, AbstractSet[str] | None], source: str, kind: str) -> None:
    """Raise if a layout states something else than what is used, of tables and lists also by their keys."""
    for name in (one.name for one in fields(Layout)):
        value = getattr(layout, name)
        if name not in used and value == getattr(Layout(), name):
            continue
        known = used.get(name, set())
        if known is not None and (odd := value if name not in used else sorted({*value} - known)):
            remedy = "Leave it out, or choose its file. If these are samples in columns, say --channel emg=NAME."
            raise InvalidValueError(f"{source} is {kind}, and has no use for {name}", got=odd, remedy=remedy)


def _in_memory(source: Any) -> Contents:
    if isinstance(source, pd.DataFrame):
        return Contents("the table", trials=source)
    if not hasattr(source, "annotations"):
        expected = "a path, a DataFrame, or mne.Epochs or Raw"
        raise InvalidValueError("this holds no trials", got=source, expected=expected)
    return mne_files.of_epochs(source) if hasattr(source, "metadata") else mne_files.of_raw(source)


def _people_of(
    frame: pd.DataFrame, layout: Layout, source: str, name: str, limits: ReadingLimits | None
) -> list[Delivered]:
    reference = layout.required_reference(source)
    columns = Columns.found(frame, layout, source)
    given = [columns[key].cells for key in ("isi", "mep", "asked")]
    empty = {n for n in columns.rows if all(is_missing(cells[n]) for cells in given)}
    columns = replace(columns, rows=[n for n in columns.rows if n not in empty])
    if not columns.rows:
        raise InvalidValueError(f"{source} has no trials", remedy="Are the right columns named?")
    doubts.require_no_parts(columns, empty)
    doubts.require_codes(columns)
    dates = dates_of(columns["date"], columns.rows)
    people = _by_text(map(columns["subject"].text, columns.rows), columns.rows)
    visits = [(own, subject, day) for subject in people for day, own in _days(columns, people[subject], dates).items()]
    if limits is not None:
        most = max(len(own) for own, _, _ in visits)
        require_most(source, ("has too many people and days", len(visits), limits.visits, ""),
                     ("has too many trials of one person and day", most, limits.trials, ""))  # fmt: skip
    found = []
    for own, subject, day in sorted(visits, key=lambda visit: visit[0][0]):
        person = _person(replace(columns, rows=own), reference, subject or name)
        begun = dates[own[0]].isoformat(timespec="microseconds") if own[0] in dates else ""
        given_by = latest_of([columns["date"].text(row) for row in own], [dates.get(row) for row in own])
        found.append(replace(person, visit=replace(person.visit, day=day), created=begun, given_by=given_by))
    apart = max((row for row in columns.rows if row - 1 in empty), default=frame.attrs.get("apart"))
    doubts.require_no_summaries(columns, apart)
    return found


def _by_text(texts: Iterable[str], rows: Iterable[int]) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for text, row in zip(texts, rows, strict=True):
        found.setdefault(text, []).append(row)
    return found


def _days(columns: Columns, rows: list[int], dates: Mapping[int, dt.datetime]) -> dict[int | None, list[int]]:
    """The rows of each day, by a column of days, or by several dates; days without a number are counted."""
    named = "day" in columns.of
    days_by_date = days_of({row: dates[row] for row in rows if row in dates})
    texts = [columns["day"].text(row) if named else days_by_date.get(row, "") for row in rows]
    days = _by_text(texts, rows)
    several = len(days.keys() - {""}) > 1
    if "" in days and (several or (named and any(days))):
        raise columns["day" if named else "date"].refused(days[""][0], "is empty", "Write the day into each row.")
    if not any(days) or not (named or several):
        return {None: rows}
    numbers = [int(found[-1]) if len(found := re.findall(r"\d+", day[:80])) == 1 else 0 for day in days]
    if len(set(numbers)) < len(numbers) or min(numbers) < 1:
        numbers = list(range(1, len(days) + 1))
    return dict(zip(numbers, days.values(), strict=True))


def _person(columns: Columns, reference: Reference, subject: str) -> Delivered:
    doubts.require_one_kind_each(columns)
    doubtful_numbers.require_plain_numbers(columns)
    space, signals = anywhere(reference), SignalLimits()
    trials = [_trial(columns, row, number, space, signals) for number, row in enumerate(columns.rows)]
    trials, paired_pct_rmt = _with_intensities(trials, columns)
    blocks = [columns["block"].text(row) for row in columns.rows]
    return Delivered(
        renumbered(trials),
        reference,
        subject=subject,
        source=columns["isi"].of,
        units=columns.units,
        units_by=columns.units_by,
        unused=tuple(columns.beside),
        blocks={n: block for n, (before, block) in enumerate(pairwise(blocks), 1) if block != before},
        visit=Visit(intensity_pct_rmt=paired_pct_rmt),
    )


def _trial(columns: Columns, row: int, number: int, space: DesignSpace, signals: SignalLimits) -> Trial:
    """One row as a trial: as the file judges it, or else as a session would."""
    isi_ms = None if columns.tms_alone(row) else columns["isi"].number(row)
    asked_ms = columns["asked"].number(row) if "asked" in columns.of else isi_ms
    mep_mv, lost = columns["mep"].number(row), columns.lost(row)
    if mep_mv is not None and not 0 <= mep_mv <= MOST_MEP_MV:
        remedy = "It must be from peak to peak, in the unit that is stated; is --unit right?"
        if mep_mv < 0:
            remedy = columns["mep"].remedy
        elif by := columns.units_by[1]:
            remedy = "It must be from peak to peak. If its name has the wrong unit, say the right one by --unit, and "
            remedy += f'--where "{by}={ALL}".'
        raise columns.of["mep"].refused(row, "is no amplitude", remedy)
    facts: dict[str, Any] = {
        "commanded_isi_ms": asked_ms,
        "isi_ms": isi_ms,
        "isi_sd_ms": columns["isi_sd"].number(row) or 0.0,
        "mep_mv": mep_mv,
        "mep_interval_mv": _interval_mv(columns, row) if mep_mv is None else None,
        "background_rms_uv": columns["background"].number(row),
        "excluded": "status" in columns.of and columns.excluded(row),
    }
    if columns.tap_alone(row):
        return Trial(number, Status.ACCEPTED, tap_alone=True, **{**facts, "commanded_isi_ms": None})
    is_unknown = mep_mv is None and facts["mep_interval_mv"] is None
    if lost is None and (is_unknown or (isi_ms is None and asked_ms is not None)):
        lost = Kind.OUTCOME_UNKNOWN
    if lost is None and not {"status", "exclude"} & columns.of.keys() and mep_mv is not None:
        meant_ms = asked_ms if "asked" in columns.of or isi_ms is None else max(isi_ms, 0.0)
        measured = Measurement(mep_mv, isi_ms, facts["isi_sd_ms"], None)
        lost = judge_measurement(measured, Stimulus(number, meant_ms), space, signals).reason
    return Trial(number, Status.ACCEPTED if lost is None else Status.MISTRIAL, reason=lost, **facts)


def _interval_mv(columns: Columns, row: int) -> tuple[float, float] | None:
    """The interval in which an amplitude lies of which no more is known; None if its ends are not said."""
    low_mv, high_mv = columns["mep_low"].number(row), columns["mep_high"].number(row)
    return None if low_mv is None and high_mv is None else (low_mv or 0.0, math.inf if high_mv is None else high_mv)


def _with_intensities(trials: Sequence[Trial], columns: Columns) -> tuple[list[Trial], float | None]:
    """Trials of TMS alone with their intensities [% RMT], and that of all pairs; None where none is stated."""
    name, own, paired = columns["intensity"].name, list[Trial](), dict[float | None, str]()
    stated = [columns["intensity"].number(row) for row in columns.rows]
    for row, pct_rmt, trial in zip(columns.rows, stated, trials, strict=True):
        if pct_rmt is not None and not INTENSITY_PCT.least <= pct_rmt <= INTENSITY_PCT.most:
            remedy = "It must be in % of the resting motor threshold."
            raise columns.of["intensity"].refused(row, "is no intensity in % RMT", remedy)
        if trial.wanted_isi_ms is not None:
            paired[pct_rmt] = columns["intensity"].text(row)
    if len(paired) > 1 and name not in columns.layout.where:
        texts = [text for text in paired.values() if text]
        what, got = f"the pairs of {columns['isi'].of} have several intensities", f"{', '.join(texts)} % RMT"
        got += ", and some say none" if None in paired else ""  # as isiw's own tables say nothing of the usual one
        remedy = f'Say --where "{name}={texts[0]}" for one of them, or --where "{name}={ALL}" '
        raise InvalidValueError(what, got=got, remedy=f"{remedy}if all are to be analysed together.")
    usual = next(iter(paired)) if len(paired) == 1 else None
    for trial, pct_rmt in zip(trials, stated, strict=True):
        of_alone = trial.wanted_isi_ms is None and not trial.tap_alone and pct_rmt != usual
        own.append(replace(trial, intensity_pct_rmt=pct_rmt) if of_alone else trial)
    return own, usual
