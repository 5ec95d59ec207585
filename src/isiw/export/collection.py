"""Which sessions are exported: the logs, copies of one session, pseudonyms, and which visit of the person each is."""

from __future__ import annotations

import datetime as dt
import itertools
import random
import secrets
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final, NamedTuple

from isiw.errors import InvalidValueError, LogError
from isiw.files import hash_of
from isiw.findings import Kind
from isiw.log.durable import kept_for
from isiw.log.headers import Header
from isiw.log.places import part_of
from isiw.log.reader import topics_of
from isiw.log.record import SessionRecord, read_salvaged, read_session
from isiw.log.records import Onset
from isiw.log.salvage import only_in, salvage_file
from isiw.log.schema import Event
from isiw.log.verdicts import VERDICTS
from isiw.summary import words_of
from isiw.text.sanitize import counted
from isiw.text.stimuli import StimulusWords

_FIRST_DAY: Final = dt.date(1900, 1, 1)
_DAYS: Final = 20 * 365
"""Shifted dates lie before 1925, by which BIDS knows them as shifted."""

_DAY_NS: Final = 86_400 * 10**9


class _Person(NamedTuple):
    pseudonym: str
    shift_days: int


def pseudonymised(
    records: Sequence[SessionRecord], draws: random.Random | None = None
) -> tuple[list[SessionRecord], dict[str, str]]:
    """The sessions with other codes and dates, and which code stands for whom.

    The days between a person's visits and the time of day stay; a session without a code is another person's.
    """
    draws = draws or secrets.SystemRandom()
    names = [record.header.subject or f"the session without a code in {record.path}" for record in records]
    order = sorted(set(names))
    draws.shuffle(order)
    people = {}
    for number, name in enumerate(order, start=1):
        begun = [_begin(record.header).date() for record, other in zip(records, names, strict=True) if other == name]
        first_day = _FIRST_DAY + dt.timedelta(days=draws.randrange(_DAYS))
        people[name] = _Person(f"{number:03d}", (first_day - min(begun)).days)
    changed = [_changed(record, people[name]) for record, name in zip(records, names, strict=True)]
    return changed, {name: people[name].pseudonym for name in sorted(people)}


def _begin(header: Header) -> dt.datetime:
    try:
        return dt.datetime.fromisoformat(header.created)
    except ValueError as error:
        raise InvalidValueError("a date that is none cannot be shifted", got=header.created) from error


def _changed(record: SessionRecord, person: _Person) -> SessionRecord:
    shift = dt.timedelta(days=person.shift_days)
    header = record.header.model_copy(
        update={
            "subject": person.pseudonym,
            "created": (_begin(record.header) + shift).isoformat(timespec="seconds"),
            "visit": replace(record.header.visit, operator="", age_years=None, height_cm=None),
            "device": replace(record.header.device, address=""),
            "config": {},
            "source": "",
        }
    )
    shift_ns = person.shift_days * _DAY_NS
    onsets = {trial: Onset(onset.onset_s, onset.at_ns + shift_ns) for trial, onset in record.onsets.items()}
    return replace(
        record,
        path=Path(),
        header=header,
        history=tuple(
            entry.model_copy(update={"text": ""}) if isinstance(entry, Event) else entry for entry in record.history
        ),
        onsets=onsets,
    )


def once_each(records: Sequence[SessionRecord]) -> tuple[list[SessionRecord], list[str]]:
    """Each session once, from its fullest log, and a sentence for each log left out; copies that differ later stay."""
    kept: list[SessionRecord] = []
    left_out = []
    for record in sorted(records, key=_weight, reverse=True):
        copies = (_Copy(record, fuller) for fuller in kept if _begun(fuller) == _begun(record))
        copy = next((each for each in copies if each.is_left_out), None)
        if copy is None:
            kept.append(record)
        elif copy.alone or copy.fuller.path != part_of(record.path):  # else it is the log's continuation
            left_out.append(str(copy))
    return kept, left_out


@dataclass(frozen=True, eq=False)
class _Copy:
    """A log beside a fuller one, or one as full, that says the same at its beginning."""

    record: SessionRecord
    fuller: SessionRecord

    @cached_property
    def alone(self) -> int:
        """The number of its records that the fuller log has not."""
        return only_in(salvage_file(self.record.path), salvage_file(self.fuller.path))

    @property
    def is_left_out(self) -> bool:
        """True if the fuller log stands for it, which has all of it, or tells of the same stimuli as far as both do."""
        if not self.alone or self.record.header.imported:  # a log that was imported never goes on, in no copy
            return not self.alone
        has_lost, known = _lacks(self.record) or _lacks(self.fuller), self.fuller.events
        has_verdicts_alone = any(event.kind in VERDICTS and event not in known for event in self.record.events)
        first, second = stimuli(self.record), stimuli(self.fuller)
        common = first.keys() & second.keys()
        same = all(first[trial] == second[trial] for trial in common) and bool(common or not first or not second)
        return same and (has_lost or not has_verdicts_alone)

    def __str__(self) -> str:
        name, fuller = _names(self.record, self.fuller)
        if self.alone:
            more = f"{counted(self.alone, 'record is', 'records are')} in {name} alone"
            return f"{name} is left out: it is of the same session as {fuller}, which holds more; {more}."
        if _is_damaged(self.record):
            return f"{name} is left out: it is a damaged copy of {fuller}, which has all that can be read of it."
        return f"{name} is left out: it is a part of {fuller}."


def _weight(record: SessionRecord) -> tuple[int | bool, ...]:
    """The amount that a log tells of a session, the weightiest part first; a whole and closed one before its like."""
    outcomes = len(record.table) - len(_unknown(record))
    verdicts = sum(event.kind in VERDICTS for event in record.events)
    estimated = {estimate.trial for estimate in record.estimates}
    return (
        outcomes,
        verdicts,
        len(record.waveforms) + len(estimated),
        len(record.history),
        not _lacks(record),
        record.finished,
    )


def _begun(record: SessionRecord) -> tuple[str, str, int]:
    """The beginning of a log, which a copy of it has as well."""
    return record.header.created, record.header.subject, record.header.seed


def _lacks(record: SessionRecord) -> bool:
    """True if a log has lost something that a copy of it may still have."""
    return _is_damaged(record) or bool(record.unknown or _unknown(record))


def _is_damaged(record: SessionRecord) -> bool:
    return bool(record.losses) or record.end_lost


def _unknown(record: SessionRecord) -> list[int]:
    return [trial.index for trial in record.table if trial.reason is Kind.OUTCOME_UNKNOWN]


def stimuli(record: SessionRecord) -> dict[int, int]:
    """When each stimulus with an outcome was about to be delivered [ns since 1970], by its trial's number."""
    return {trial.index: record.onsets[trial.index].at_ns for trial in record.table if trial.index in record.onsets}


def _names(one: SessionRecord, other: SessionRecord) -> tuple[str, str]:
    """The names of two logs; if they have one name, with their folders."""
    first, second = one.path, other.path
    if first.name != second.name:
        return first.name, second.name
    return f"{first.parent.name}/{first.name}", f"{second.parent.name}/{second.name}"


@dataclass(frozen=True, eq=False)
class Part:
    """One session of an export: the person's code, and its number of the person's sessions, such as "01"."""

    subject: str
    session: str
    record: SessionRecord

    def __str__(self) -> str:
        return f"{self.subject}, session {self.session}"

    @property
    def whose(self) -> dict[str, str]:
        """The beginning of this session's rows in every table."""
        return {"subject": self.subject, "session": self.session}


def read_logs(source: str | Path, channels: Iterable[str] | None = None) -> tuple[list[SessionRecord], list[str]]:
    """The sessions of a log or a folder of logs, each by the log that tells most, and a sentence for each left out.

    Of other `channels` than these no samples are read; with None all are.
    """
    if not Path(source).is_dir():
        record = read_session(source, channels=channels)
        record.require_open()
        return [record], []
    records: dict[str, SessionRecord] = {}
    left_out = []
    files = (file for file in Path(source).rglob("*.mcap*") if file.is_file())
    logs = (file for file in files if file.suffix in {".mcap", ".part"} or kept_for(file) is not None)
    for file in sorted(logs):
        try:
            record = read_salvaged(salvage_file(file, topics_of(channels)))
            record.require_open()
        except LogError as error:
            left_out.append(f"{file.name} is left out: {error.what}.")
            continue
        first = records.setdefault(hash_of(file), record)
        if first is not record:
            copy, kept_log = (each.relative_to(source) for each in (file, first.path))
            left_out.append(f"{copy} is left out: it is a copy of {kept_log}.")
    if not records:
        what = "no log in the folder can be read" if left_out else "there is no log in the folder"
        raise LogError(what, got=str(source), expected="files called .mcap or .mcap.part")
    kept, copies = once_each(list(records.values()))
    return kept, left_out + copies


def numbered(records: Sequence[SessionRecord]) -> list[Part]:
    """Sessions with person and number, as they were begun; each without a code is taken for another person's."""
    sessions: Counter[str] = Counter()
    codes = {record.header.subject for record in records}
    unnamed = (code for number in itertools.count(1) if (code := f"unnamed{number}") not in codes)
    parts = []
    for record in sorted(records, key=lambda each: each.header.created):
        subject = record.header.subject or next(unnamed)
        sessions[subject] += 1
        parts.append(Part(subject, f"{sessions[subject]:02d}", record))
    return sorted(parts, key=lambda part: (part.subject, part.session))


def stated_twice(parts: Iterable[Part]) -> list[str]:
    """A sentence for each two sessions that have trials in common."""
    of_stimulus: dict[tuple[int, int], Part] = {}
    said = []
    for part in parts:
        others = Counter(str(of_stimulus.setdefault(each, part)) for each in stimuli(part.record).items())
        said += [
            f"{part}: {number} of its trials are in {other} as well, as copies of a log went on differently; "
            "export one of them."
            for other, number in others.items()
            if other != str(part)
        ]
    return said


def stimulus_of(parts: Iterable[Part]) -> StimulusWords:
    """The words for the conditioning stimulus of some sessions."""
    return words_of(part.record.header.conditioning for part in parts)


def log_losses(record: SessionRecord) -> list[str]:
    """The losses of a log, a sentence each."""
    unknown = [str(intent.trial) for intent in record.unknown]
    has_onsets = not record.header.imported
    timeless = [str(trial.index) for trial in record.table if has_onsets and trial.index not in record.onsets]
    said: Sequence[tuple[object, str]] = (
        (record.end_lost, "The end of the log is missing, so the number of stimuli is not known."),
        (unknown, f"The outcome of stimuli that may have been given is not known: trials {', '.join(unknown)}."),
        (timeless, f"The onset is not known of trials {', '.join(timeless)}."),
        (not record.finished and not record.losses, "The session had not closed its log."),
    )
    unread = (f"The log's {part} cannot be read by this version of isiw." for part in record.unread)
    return [*record.losses, *unread, *(sentence for lacks, sentence in said if lacks)]
