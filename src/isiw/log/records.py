"""The records of a log by their kind, of whatever it is, and what of it makes no sense."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeVar

from pydantic import ValidationError

from isiw.errors import DamagedLogError, LogError
from isiw.log.earlier import with_kinds
from isiw.log.headers import first_fault, header_in_parts
from isiw.log.onsets import Onsets
from isiw.log.production import Production
from isiw.log.salvage import Message, Salvage
from isiw.log.schema import MOST_TRIALS, AnyHeader, Event, Intent, PulseOutcome, Record, Waveform
from isiw.log.topics import decode
from isiw.log.writer import CONFIGURATION
from isiw.text.json_texts import read_json
from isiw.text.numbers import counted
from isiw.text.toml_files import parsed
from isiw.trials import Channel, Trial

HeaderKind = TypeVar("HeaderKind", bound=AnyHeader)

MOST_LOSSES: Final = 50
"""Losses that are listed one by one."""


@dataclass
class Records:
    """The records of a log by their kind, and what makes no sense.

    Args:
        salvaged: what was read from the log.
        header: the last header.
        history: all other records but waveforms, in order; of a trial that is told of twice, the first.
        waveforms: the recorded channels, by trial and name.
        losses: what was left out, a sentence each.
        onsets: when each stimulus was about to be delivered.
        unread: parts of the header that cannot be read, and why.
    """

    salvaged: Salvage
    header: AnyHeader | None = None
    history: list[Record] = field(default_factory=list)
    waveforms: dict[tuple[int, str], Channel] = field(default_factory=dict)
    losses: list[str] = field(default_factory=list)
    onsets: Onsets = field(default_factory=Onsets)
    unread: dict[str, str] = field(default_factory=dict)
    _beyond: int = 0
    _trials: set[int] = field(default_factory=set)

    @classmethod
    def of(cls, salvaged: Salvage) -> Records:
        """The records of a log."""
        records = cls(salvaged, losses=list(salvaged.losses))
        for message in salvaged.messages:
            records.take(message)
        return records

    @property
    def told_losses(self) -> tuple[str, ...]:
        """The losses, as many as somebody will read."""
        left = len(self.losses) - MOST_LOSSES
        listed = tuple(self.losses[:MOST_LOSSES])
        if self._beyond:
            records = counted(self._beyond, "record is", "records are")
            listed = (f"Only trials up to {MOST_TRIALS - 1} are read: {records} of later ones.", *listed)
        return listed if left <= 0 else (*listed, f"{left} more losses are not listed.")

    def header_of(self, kinds: tuple[type[HeaderKind], ...], newest: int) -> HeaderKind:
        """The log's header, from its records or else from the configuration that is attached."""
        header = self.header
        if not isinstance(header, kinds) or (self.losses and CONFIGURATION in self.salvaged.attachments):
            # what is lost may have been the last header
            header, self.unread = _header_from_attachment(self.salvaged)
        if not isinstance(header, kinds):
            raise _lost_header(self.salvaged)
        return _checked_version(header, newest, self.salvaged.path)

    @property
    def delivered(self) -> int:
        """How many stimuli the index counts, those of lost records among them; refused ones do not count."""
        counted, history = self.salvaged.counted, self.history
        lost = counted.get("/intent", 0) - sum(isinstance(record, Intent) for record in history)
        return max(lost + len(_standing(history)), counted.get("/trial", 0))

    def take(self, message: Message) -> None:
        """Take one more record."""
        try:
            record, unread = _decoded(message)
            record = with_kinds(record)
            if isinstance(record, Waveform):
                self.waveforms[record.trial, message.topic.removeprefix("/")] = record.channel()
        except ValueError as error:
            if _is_beyond(message):
                self._beyond += 1
                return
            self.losses.append(f"A record on {message.topic} makes no sense and is left out: {first_fault(error)}")
            return
        if isinstance(record, AnyHeader):
            self.header, self.unread = record, unread
        elif (trial := _concluded(record)) is not None and trial in self._trials:
            self.losses.append(f"A second record of trial {trial} is left out.")
        elif not isinstance(record, Waveform):
            self.history.append(record)
            self._note(record, message.log_time_ns)

    def _note(self, record: Record, at_ns: int) -> None:
        if (trial := _concluded(record)) is not None:
            self._trials.add(trial)
        elif isinstance(record, Intent):
            self.onsets.take(record, at_ns)
        elif isinstance(record, Event) and record.kind == "resume":
            self.onsets.resumed()
        elif isinstance(record, Event) and record.kind == "refused":
            self.onsets.refused()


def _decoded(message: Message) -> tuple[Record, dict[str, str]]:
    """A record, and of a header the parts that cannot be read."""
    try:
        return decode(message.topic, message.data), {}
    except ValidationError:
        if message.topic != "/header":
            raise
        return header_in_parts(read_json(message.data))


def _is_beyond(message: Message) -> bool:
    """Whether a record is of a later trial than is read."""
    try:
        values = read_json(message.data)
    except ValueError:
        return False
    number = values.get("index" if message.topic == "/trial" else "trial") if isinstance(values, dict) else None
    return isinstance(number, int) and number >= MOST_TRIALS


def _concluded(record: Record) -> int | None:
    """The number of the trial whose outcome a record is; None for any other record."""
    if isinstance(record, Trial):
        return record.index
    return record.trial if isinstance(record, PulseOutcome | Production) else None


def unknown_of(history: Sequence[Record], known: AbstractSet[int], delivered: int) -> tuple[Intent, ...]:
    """Stimuli that were delivered, or may have been, and whose outcome is not in the log."""
    intents = _standing(history)
    last = max(itertools.chain(known, intents, [min(delivered, MOST_TRIALS) - 1]))
    return tuple(
        intents.get(number, Intent(trial=number, isi_ms=None)) for number in range(last + 1) if number not in known
    )


def _standing(history: Sequence[Record]) -> dict[int, Intent]:
    """What was about to be delivered and was not refused, by trial; what was asked for again is one stimulus."""
    intents: dict[int, Intent] = {}
    for entry in history:
        if isinstance(entry, Intent):
            intents[entry.trial] = entry
        elif isinstance(entry, Event) and entry.kind == "refused" and entry.trial is not None:
            intents.pop(entry.trial, None)
    return intents


def _header_from_attachment(salvaged: Salvage) -> tuple[AnyHeader, dict[str, str]]:
    text = salvaged.attachments.get(CONFIGURATION, b"")
    try:
        return header_in_parts(parsed(text.decode()))
    except (ValueError, RecursionError) as error:
        raise _lost_header(salvaged) from error


def _lost_header(salvaged: Salvage) -> DamagedLogError:
    return DamagedLogError(
        "the log's header is lost",
        got=str(salvaged.path),
        remedy="Its records may still be readable with any MCAP tool.",
    )


def _checked_version(header: HeaderKind, newest: int, path: Path) -> HeaderKind:
    if header.schema_version > newest:
        raise LogError(
            "the log was written by a newer isiw",
            got=f"schema version {header.schema_version} in {path}",
            expected=f"{newest} or older",
            remedy="Upgrade isiw.",
        )
    return header
