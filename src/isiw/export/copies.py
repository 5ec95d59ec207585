"""Copies of one session's log, be they earlier, torn or damaged: the one that tells of most stands for the session."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from isiw.findings import Kind
from isiw.log.durable import part_of
from isiw.log.reader import SessionRecord
from isiw.log.salvage import only_in, salvage_file
from isiw.log.verdicts import VERDICTS
from isiw.text.numbers import counted


def once_each(records: Sequence[SessionRecord]) -> tuple[list[SessionRecord], list[str]]:
    """Each session once, from the log that tells of most of it, and a sentence for each log that is left out.

    Copies that went on differently are kept: with other stimuli, or, where nothing is lost, with other verdicts.
    """
    kept: list[SessionRecord] = []
    left_out = []
    for record in sorted(records, key=_told, reverse=True):
        copies = (_Copy(record, fuller) for fuller in kept if _begun(fuller) == _begun(record))
        copy = next((each for each in copies if each.is_left_out), None)
        if copy is None:
            kept.append(record)
        elif not copy.is_gone_on_from:
            left_out.append(str(copy))
    return kept, left_out


@dataclass(frozen=True, eq=False)
class _Copy:
    """A log beside another one that says the same at its beginning.

    Args:
        record: what the log tells.
        fuller: what the other one tells, which is no less.
    """

    record: SessionRecord
    fuller: SessionRecord

    @cached_property
    def alone(self) -> int:
        """How many of its records the fuller log has not."""
        return only_in(salvage_file(self.record.path), salvage_file(self.fuller.path))

    @property
    def is_left_out(self) -> bool:
        """Whether the fuller log stands for it."""
        if not self.alone:
            return True
        has_lost = _lacks(self.record) or _lacks(self.fuller)
        return _of_same_stimuli(self.record, self.fuller) and (has_lost or not self._has_verdicts_alone)

    @property
    def _has_verdicts_alone(self) -> bool:
        """Whether an operator said something about its trials that the fuller log does not know of."""
        known = self.fuller.events
        return any(event.kind in VERDICTS and event not in known for event in self.record.events)

    @property
    def is_gone_on_from(self) -> bool:
        """Whether the fuller log is its continuation, which is beside it until that is closed."""
        return self.fuller.path == part_of(self.record.path) and not self.alone

    def __str__(self) -> str:
        name, fuller = _names(self.record, self.fuller)
        if self.alone:
            more = f"{counted(self.alone, 'record is', 'records are')} in {name} alone"
            return f"{name} is left out: it is of the same session as {fuller}, which tells of more; {more}."
        if _is_damaged(self.record):
            return f"{name} is left out: it is a damaged copy of {fuller}, which has all that can be read of it."
        return f"{name} is left out: it is a part of {fuller}."


def _told(record: SessionRecord) -> tuple[int | bool, ...]:
    """How much a log tells of a session, what weighs most first; a whole and closed one before its like."""
    outcomes = len(record.table) - len(_unknown(record))
    verdicts = sum(event.kind in VERDICTS for event in record.events)
    believed = {estimate.trial for estimate in record.estimates}
    return (
        outcomes,
        verdicts,
        len(record.waveforms) + len(believed),
        len(record.history),
        not _lacks(record),
        record.finished,
    )


def _begun(record: SessionRecord) -> tuple[str, str, int]:
    """What a log says at its beginning, and a copy of it says as well."""
    return record.header.created, record.header.subject, record.header.seed


def _lacks(record: SessionRecord) -> bool:
    """Whether a log has lost something that a copy of it may still have."""
    return _is_damaged(record) or bool(record.unknown or _unknown(record))


def _is_damaged(record: SessionRecord) -> bool:
    return bool(record.losses) or record.end_lost


def _unknown(record: SessionRecord) -> list[int]:
    return [trial.index for trial in record.table if trial.reason is Kind.OUTCOME_UNKNOWN]


def _of_same_stimuli(one: SessionRecord, other: SessionRecord) -> bool:
    """Whether two logs tell of the same stimuli, as far as both tell of them."""
    first, second = stimuli(one), stimuli(other)
    common = first.keys() & second.keys()
    return all(first[trial] == second[trial] for trial in common) and bool(common or not first or not second)


def stimuli(record: SessionRecord) -> dict[int, int]:
    """When each stimulus with an outcome was about to be delivered [ns since 1970], by its trial's number."""
    return {trial.index: record.onsets[trial.index].at_ns for trial in record.table if trial.index in record.onsets}


def _names(one: SessionRecord, other: SessionRecord) -> tuple[str, str]:
    """What two logs are called; where they have one name, with their folders."""
    first, second = one.path, other.path
    if first.name != second.name:
        return first.name, second.name
    return f"{first.parent.name}/{first.name}", f"{second.parent.name}/{second.name}"
