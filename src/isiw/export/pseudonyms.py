"""Sessions without what tells whose they are: other codes, other dates, and no free text of an operator."""

from __future__ import annotations

import datetime as dt
import random
import secrets
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from isiw.errors import InvalidValueError
from isiw.log.onsets import Onset
from isiw.log.reader import SessionRecord
from isiw.log.schema import Event, Header

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

    People are numbered in a random order. All dates of a person move by one random number of days: the days between
    visits and the time of day stay. Operators, notes and all other texts of events, the configuration, the device's
    address and the log's path are left out. A session without a code is another person's.
    """
    draws = draws or secrets.SystemRandom()
    names = [record.header.subject or f"unnamed session {number}" for number, record in enumerate(records)]
    order = sorted(set(names))
    draws.shuffle(order)
    people = {
        name: _Person(f"{number:03d}", _shift_days(_of(name, names, records), draws))
        for number, name in enumerate(order, start=1)
    }
    changed = [_changed(record, people[name]) for record, name in zip(records, names, strict=True)]
    return changed, {name: people[name].pseudonym for name in sorted(people)}


def _of(name: str, names: Sequence[str], records: Sequence[SessionRecord]) -> list[SessionRecord]:
    return [record for record, other in zip(records, names, strict=True) if other == name]


def _shift_days(records: Sequence[SessionRecord], draws: random.Random) -> int:
    """By how many days the dates of a person move: the first one becomes a random day."""
    new = _FIRST_DAY + dt.timedelta(days=draws.randrange(_DAYS))
    return (new - min(_begin(record.header).date() for record in records)).days


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
            "visit": replace(record.header.visit, operator=""),
            "device": replace(record.header.device, address=""),
            "config": {},
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
