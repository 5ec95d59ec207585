"""Tables, recordings, logs and data frames of a lab, as the people whose trials they hold."""

from __future__ import annotations

import datetime as dt
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from isiw.checks import MOST_MEP_MV
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.existing import doubts, formats, frames, quantities, recordings
from isiw.existing.apart import read_apart
from isiw.existing.cells import is_missing
from isiw.existing.dates import dates_of, latest_of, times_of
from isiw.existing.delivered import Delivered, anywhere, read_log, renumbered
from isiw.existing.formats import mne_files
from isiw.existing.formats.contents import Contents
from isiw.existing.layout import CHANNELS, EMG_UNITS, Layout
from isiw.existing.limits import ReadingLimits, require_file, require_table, require_visits
from isiw.findings import INTENSITY_PCT, Kind
from isiw.lazy import pd
from isiw.log.places import log_exists
from isiw.opening import is_mcap
from isiw.signals.judgement import judge_measurement
from isiw.signals.limits import SignalLimits
from isiw.sweeps import Measurement
from isiw.trials import Status, Stimulus, Trial
from isiw.types import Reference
from isiw.visit import Visit

_STRONGEST_PCT_RMT: Final = 300.0
"""No stimulator reaches more in a person whose threshold can be found [% RMT]."""


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
    layout = layout or Layout()
    if not isinstance(source, str | Path):
        return _in_memory(source, layout, subject)
    path = Path(source)
    if log_exists(path) and is_mcap(path):
        found = read_log(path)
        other = None if layout.reference == found.reference else layout.reference
        _require_use(replace(layout, reference=other), {}, path.name, "a log")
        return [found]
    if not path.exists():
        raise InvalidValueError("there is no such file", got=str(path), remedy="Check the path.")
    return read_apart(path, layout, subject, limits or ReadingLimits(), also).people


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
    _require_used(contents, path, layout)
    name = subject or ("" if path is None else path.stem)
    if contents.tracks:
        return [recordings.of_contents(contents, layout, name)]
    return people_of(frames.named(contents.trials), layout, contents.source, name, limits)


def _require_used(contents: Contents, path: Path | None, layout: Layout) -> None:
    """Raise if something is stated that contents of this kind have no use for."""
    of_path = None if path is None else formats.format_of(path)
    in_columns, options = (False, ()) if of_path is None else (of_path.is_table, of_path.options)
    used: dict[str, AbstractSet[str] | None] = dict.fromkeys(("reference", "units", "longest_isi_ms", *options))
    if contents.trials is not None:
        used |= dict.fromkeys(("columns", "where", "alone", "decimal"))
    if contents.tracks:
        used |= dict.fromkeys(("channels", "markers", "rate_hz", "mep_window_ms"))
    kind = "a recording" if contents.tracks else "a table"
    if contents.tracks and contents.trials is not None:
        kind = "of sweeps whose ISIs are stated"
        used |= recordings.OF_SWEEPS
        if in_columns:
            used |= {"pulse_at_ms": None, "channels": {"emg"}, "markers": set[str]()}
        else:
            used["unmarked"] = None
    elif contents.tracks:
        channels = {*CHANNELS} if in_columns else {*CHANNELS} - {"events"}
        used |= {"unmarked": None, "units": {*EMG_UNITS}, "channels": channels}
        if in_columns:
            used["decimal"] = None
    _require_use(layout, used, "the data" if path is None else path.name, kind)


def _require_use(layout: Layout, used: Mapping[str, AbstractSet[str] | None], source: str, kind: str) -> None:
    """Raise if a layout states something else than what is used, of tables and lists also by their keys."""
    for name in (one.name for one in fields(Layout)):
        value = getattr(layout, name)
        if name not in used and value == getattr(Layout(), name):
            continue
        known = used.get(name, set())
        if known is not None and (odd := value if name not in used else sorted({*value} - known)):
            raise InvalidValueError(
                f"{source} is {kind}, and has no use for {name}",
                got=odd,
                remedy="Leave it out, or choose its file. If these are samples in columns, say --channel emg=NAME.",
            )


def _in_memory(source: Any, layout: Layout, subject: str) -> list[Delivered]:
    """The people of a table, or of a recording that MNE has read."""
    if isinstance(source, pd.DataFrame):
        contents = Contents("the table", trials=source)
    elif hasattr(source, "metadata") and hasattr(source, "get_data"):
        contents = mne_files.of_epochs(source)
    elif hasattr(source, "annotations"):
        contents = mne_files.of_raw(source)
    else:
        expected = "a path, a DataFrame, or mne.Epochs or Raw"
        raise InvalidValueError("this holds no trials", got=source, expected=expected)
    return people_of_contents(contents, None, layout, subject)


def people_of(
    frame: pd.DataFrame, layout: Layout, source: str, name: str = "", limits: ReadingLimits | None = None
) -> list[Delivered]:
    """The people of a table, in the order in which they come first; who has no code is called as the file is."""
    reference = layout.required_reference(source)
    columns = quantities.Columns.found(frame, layout, source)
    given = [columns[key].cells for key in ("isi", "mep", "asked")]
    rows = [n for n in columns.chosen(layout) if not all(is_missing(cells[n]) for cells in given)]
    if not rows:
        raise InvalidValueError(f"{source} has no trials", remedy="Are the right columns named?")
    subjects = [columns["subject"].text(row) for row in rows]
    doubts.require_codes(subjects, rows, columns)
    if any(subjects) and not all(subjects):
        empty = rows[subjects.index("")]
        raise columns.of["subject"].refused(empty, "is empty", "Write the person's code into each row.")
    people: dict[str, list[int]] = {}
    for subject, row in zip(subjects, rows, strict=True):
        people.setdefault(subject, []).append(row)
    dates = dates_of(columns["date"], rows)
    visits = [
        (own, subject, day) for subject, theirs in people.items() for day, own in _days(columns, theirs, dates).items()
    ]
    if limits is not None:
        require_visits(limits, source, [len(own) for own, _, _ in visits])
    found = []
    for own, subject, day in sorted(visits, key=lambda visit: visit[0][0]):
        begun = dates[own[0]].isoformat(timespec="microseconds") if own[0] in dates else ""
        person = _person(columns, own, layout, reference, subject or name)
        given_by = latest_of([columns["date"].text(row) for row in own], [dates.get(row) for row in own])
        found.append(replace(person, visit=replace(person.visit, day=day), created=begun, given_by=given_by))
    return found


def _days(
    columns: quantities.Columns, rows: Sequence[int], dates: Mapping[int, dt.datetime]
) -> dict[int | None, list[int]]:
    """The rows of each day, by a column of days, or by several dates; days without a number are counted."""
    named = "day" in columns.of
    texts = [columns["day"].text(row) if named else f"{dates[row].date()}" if row in dates else "" for row in rows]
    several = len({*texts} - {""}) > 1
    if "" in texts and (several or (named and any(texts))):
        column = columns["day" if named else "date"]
        raise column.refused(rows[texts.index("")], "is empty", "Write the day into each row.")
    if not any(texts) or not (named or several):
        return {None: list(rows)}
    days: dict[str, list[int]] = {}
    for row, text in zip(rows, texts, strict=True):
        days.setdefault(text, []).append(row)
    numbers = [int(found[-1]) if len(found := re.findall(r"\d+", day[:80])) == 1 else 0 for day in days]
    if len(set(numbers)) < len(numbers) or min(numbers) < 1:
        numbers = list(range(1, len(days) + 1))
    return dict(zip(numbers, days.values(), strict=True))


def _person(
    columns: quantities.Columns, rows: Sequence[int], layout: Layout, reference: Reference, subject: str
) -> Delivered:
    _require_ascending(columns, rows)
    columns.require_said(rows, layout.alone)
    doubts.require_one_kind(columns, rows, layout, columns["isi"].of)
    doubts.require_isis(columns, rows, layout)
    pairs = [row for row in rows if not columns.tms_alone(row, layout.alone)]
    for key in ("isi", "mep"):
        doubts.require_one_unit(key, columns[key], pairs)
    space, signals = anywhere(reference), SignalLimits()
    trials = [_trial(columns, row, number, layout, space, signals) for number, row in enumerate(rows)]
    trials, paired_pct_rmt = _with_intensities(trials, columns, rows)
    blocks = [columns["block"].text(row) for row in rows]
    begun = [n for n, block in enumerate(blocks) if not n or block != blocks[n - 1]]
    if (name := columns["block"].name) not in layout.where:
        before = set[str]()
        for n in begun:
            if blocks[n] and blocks[n] in before:
                remedy = (
                    f'If it tells muscles apart, say --where "{name}={blocks[n]}", or --where "{name}={doubts.ALL}".'
                )
                raise columns["block"].refused(rows[n], "comes back after another block", remedy)
            before.add(blocks[n])
    doubts.require_one_row_each(columns, rows, layout)
    found = Delivered(
        renumbered(trials),
        reference,
        subject=subject,
        source=columns["isi"].of,
        units=columns.units,
        unused=columns.unused,
        blocks={n: blocks[n] for n in begun if n},
        visit=Visit(intensity_pct_rmt=paired_pct_rmt),
    )
    doubts.require_short([trial.isi_ms for trial in trials if trial.isi_ms is not None], layout, columns["isi"].of)
    return found


def _trial(
    columns: quantities.Columns, row: int, number: int, layout: Layout, space: DesignSpace, signals: SignalLimits
) -> Trial:
    """One row as a trial: as the file judges it, or else as a session would."""
    alone = columns.tms_alone(row, layout.alone)
    isi_ms = None if alone else columns["isi"].number(row)
    asked_ms = columns["asked"].number(row) if "asked" in columns.of else isi_ms
    mep_mv, lost = columns["mep"].number(row), columns.lost(row)
    if mep_mv is not None and not 0 <= mep_mv <= MOST_MEP_MV:
        remedy = "It must be from peak to peak, in the unit that is stated; is --unit right?"
        raise columns.of["mep"].refused(row, "is no amplitude", remedy)
    facts: dict[str, Any] = {
        "commanded_isi_ms": asked_ms,
        "isi_ms": isi_ms,
        "isi_sd_ms": columns["isi_sd"].number(row) or 0.0,
        "mep_mv": mep_mv,
        "background_rms_uv": columns["background"].number(row),
        "excluded": "status" in columns.of and columns["exclude"].flag(row) is True,
    }
    if columns.tap_alone(row):
        return Trial(number, Status.ACCEPTED, tap_alone=True, **{**facts, "commanded_isi_ms": None})
    if lost is None and (mep_mv is None or (isi_ms is None and asked_ms is not None)):
        lost = Kind.OUTCOME_UNKNOWN
    if lost is None and not {"status", "exclude"} & columns.of.keys() and mep_mv is not None:
        measured = Measurement(mep_mv, isi_ms, facts["isi_sd_ms"] or 0.0, None)
        meant_ms = asked_ms if "asked" in columns.of or isi_ms is None else max(isi_ms, 0.0)
        judged = judge_measurement(measured, Stimulus(number, meant_ms), space, signals)
        lost = judged.reason
    return Trial(number, Status.ACCEPTED if lost is None else Status.MISTRIAL, reason=lost, **facts)


def _with_intensities(
    trials: Sequence[Trial], columns: quantities.Columns, rows: Sequence[int]
) -> tuple[list[Trial], float | None]:
    """Trials of TMS alone with their intensities [% RMT], and that of all pairs; None where none is stated."""
    stated = [columns["intensity"].number(row) for row in rows]
    for row, pct_rmt in zip(rows, stated, strict=True):
        if pct_rmt is not None and not INTENSITY_PCT.least <= pct_rmt <= _STRONGEST_PCT_RMT:
            remedy = "It must be in % of the resting motor threshold."
            raise columns.of["intensity"].refused(row, "is no intensity in % RMT", remedy)
    paired = {pct_rmt for trial, pct_rmt in zip(trials, stated, strict=True) if trial.wanted_isi_ms is not None}
    usual = paired.pop() if len(paired) == 1 else None
    own = [
        replace(trial, intensity_pct_rmt=pct_rmt)
        if trial.wanted_isi_ms is None and not trial.tap_alone and pct_rmt != usual
        else trial
        for trial, pct_rmt in zip(trials, stated, strict=True)
    ]
    return own, usual


def _require_ascending(columns: quantities.Columns, rows: Sequence[int]) -> None:
    """Raise if the rows are not in the order of delivery, on which drift and the start depend."""
    if (order := columns.of.get("order")) is None or "block" in columns.of:
        return
    known = [row for row in rows if order.text(row)]
    texts = [order.text(row) for row in known]
    are_numbers = [re.sub("[.,]", "", text).lstrip("-").isdigit() for text in texts]
    if any(are_numbers):
        if not all(are_numbers):
            odd = known[are_numbers.index(False)]
            raise order.refused(odd, "is none of a trial", "Delete the row if it is a sum or a mean.")
        places = [order.number(row) or 0.0 for row in known]
    else:  # times of the day, perhaps
        places = times_of(texts)
    times = Counter(places)
    repeated = next((text for text, place in zip(texts, places, strict=False) if times[place] > 1), None)
    if places != sorted(places):
        raise InvalidValueError(
            f"the rows of {order.of} are not in the order of its column {order.name!r}",
            remedy="Sort them as the trials were delivered, or name the column that says so: --column order=NAME.",
        )
    if all(are_numbers) and repeated is not None:
        raise InvalidValueError(
            f"a trial has two rows and more in {order.of}, by its column {order.name!r}",
            got=repeated,
            remedy='Leave one row for each trial, such as that of one muscle: --where "muscle=FCR"; or name a column '
            "of people or blocks: --column subject=NAME, --column block=NAME.",
        )
