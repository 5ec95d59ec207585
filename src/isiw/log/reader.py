"""Reading a log: a session as values, whatever state its file is in."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final, TypeVar

import pandas as pd
from pydantic import ValidationError

from isiw.errors import DamagedLogError, InvalidValueError, LogError
from isiw.log.frames import trial_frame
from isiw.log.onsets import Onset, Onsets
from isiw.log.production import Production, ProductionHeader
from isiw.log.salvage import Message, Salvage, salvage
from isiw.log.schema import (
    MOST_TRIALS,
    SCHEMA_VERSION,
    AnyHeader,
    Estimate,
    Event,
    Header,
    Intent,
    PulseOutcome,
    Record,
    Waveform,
)
from isiw.log.topics import decode
from isiw.log.verdicts import VERDICTS, under_all
from isiw.log.writer import CONFIGURATION
from isiw.signals.doubts import is_silent
from isiw.strategy.stopping import StopDecision
from isiw.text.found import lacking
from isiw.text.toml_files import parsed
from isiw.trials import Channel, Stimulus, Trial, TrialTable

__all__ = ["Records", "SessionRecord", "of_production", "read_any", "read_salvaged", "read_session", "require_records"]

HeaderKind = TypeVar("HeaderKind", Header, ProductionHeader)

MOST_CONFIGURATION: Final = 2**20
"""Of a configuration as TOML [bytes]; the default's is 2 kB."""

MOST_LOSSES: Final = 50
"""Losses that are listed one by one."""


@dataclass(frozen=True, eq=False)
class SessionRecord:
    """A session as its log tells it.

    Args:
        path: the file that was read.
        header: what the session is; of one that was resumed, what it went on with last.
        history: intents, trials, estimates and events, in the order in which they were logged.
        waveforms: the recorded channels, by trial and name.
        losses: what could not be read, a sentence each; empty where the log is whole.
        finished: whether the session closed its log.
        end_lost: whether its end is missing, so that nobody knows how many stimuli it told of.
        delivered: how many stimuli were given by its index, or may have been; 0 where it has none.
        onsets: when each stimulus was about to be delivered, by its trial's number.
    """

    path: Path
    header: Header
    history: tuple[Record, ...] = field(repr=False)
    waveforms: Mapping[tuple[int, str], Channel] = field(repr=False)
    losses: tuple[str, ...]
    finished: bool
    end_lost: bool = False
    delivered: int = 0
    onsets: Mapping[int, Onset] = field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        header, last = self.header, self.estimates[-1] if self.estimates else None
        strategy = header.strategy.name or "of a user's own objects"
        lines = [
            f"Session of {header.subject or 'an unnamed subject'}, {header.created}",
            f"Strategy: {strategy}, seed {header.strategy.seed}, {header.space.told(header.stimulus)}",
            f"Trials: {self.table.counted(header.stimulus)}"
            + (f", {len(self.unknown)} of unknown outcome" if self.unknown else ""),
        ]
        if last is not None:
            lines += [
                self.too_little or str(last),
                f"{'Ended' if last.stop else 'Not over'}: {last.reason}",
            ]
            if self.is_judged_since:
                lines.append("Trials were judged anew after this estimate.")
        return "\n".join([*lines, *(f"Lost: {loss}" for loss in self.losses), f"Log: {self.path}"])

    @cached_property
    def table(self) -> TrialTable:
        """All trials whose outcome was logged, as they count after what an operator said about them."""
        trials = sorted((r for r in self.history if isinstance(r, Trial)), key=lambda trial: trial.index)
        return under_all(TrialTable(tuple(trials)), self.events)

    @property
    def trials(self) -> pd.DataFrame:
        """All trials as a DataFrame, a row a trial, indexed by their number: onset, outcome, and the belief after it.

        The columns are those of `isiw.log.frames.TRIAL_COLUMNS`.
        """
        return trial_frame(self.table, self.onsets, self.estimates)

    @property
    def rests_on_data(self) -> bool:
        """Whether enough pairs of stimuli count to speak of a window, and any trial showed an MEP."""
        return self.too_little is None

    @property
    def too_little(self) -> str | None:
        """What is said where too little was measured to speak of a window; None where enough was."""
        return lacking(self.pairs, silent=self.is_silent)

    @property
    def pairs(self) -> int:
        """How many pairs of stimuli count; trials with TMS alone do not."""
        return sum(trial.isi_ms is not None for trial in self.table.told)

    @property
    def is_silent(self) -> bool:
        """Whether enough trials count, and each amplitude was 0, where the detection limit is too low for that."""
        meps_mv = [trial.mep_mv for trial in self.table.told if trial.mep_mv is not None]
        return is_silent(meps_mv, self.header.detection_limit_mv)

    @property
    def is_judged_since(self) -> bool:
        """Whether trials were judged anew after the last estimate, so that it does not know of it."""
        since = itertools.takewhile(lambda entry: not isinstance(entry, Estimate), reversed(self.history))
        return any(isinstance(entry, Event) and entry.kind in VERDICTS for entry in since)

    @property
    def intents(self) -> tuple[Intent, ...]:
        """What was about to be delivered."""
        return tuple(r for r in self.history if isinstance(r, Intent))

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """What was believed, trial by trial."""
        return tuple(r for r in self.history if isinstance(r, Estimate))

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened to the session."""
        return tuple(r for r in self.history if isinstance(r, Event))

    @property
    def decision(self) -> StopDecision | None:
        """The last decision; None before the first trial."""
        return self.estimates[-1].decision if self.estimates else None

    @cached_property
    def unknown(self) -> tuple[Intent, ...]:
        """Stimuli that were delivered, or may have been, and whose outcome is not in the log."""
        known = {trial.index for trial in self.table}
        intents = _standing(self.history)
        last = max(itertools.chain(known, intents, [min(self.delivered, MOST_TRIALS) - 1]))
        return tuple(
            intents.get(number, Intent(trial=number, isi_ms=None)) for number in range(last + 1) if number not in known
        )

    @property
    def unknown_trials(self) -> tuple[Trial, ...]:
        """The mistrials that `unknown` stimuli are."""
        return tuple(Trial.unknown(Stimulus(lost.trial, lost.isi_ms, lost.tap_alone)) for lost in self.unknown)

    @property
    def given(self) -> int:
        """How many stimuli were delivered, or may have been."""
        return len(self.table) + len(self.unknown)

    def sweep(self, trial: int) -> dict[str, Channel]:
        """The waveforms of one trial, by channel."""
        return {name: channel for (number, name), channel in self.waveforms.items() if number == trial}


def read_session(path: str | Path) -> SessionRecord:
    """Read a log, finished or not, whole or damaged; `losses` says what is missing.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one from a newer version.
        DamagedLogError: a log of which not even the header can be read.
    """
    return read_salvaged(salvage(path))


def read_salvaged(salvaged: Salvage) -> SessionRecord:
    """The search for a window in what was salvaged from a log.

    Args:
        salvaged: what was read.

    Raises:
        LogError: the log holds no search for a window, or is from a newer version.
        DamagedLogError: not even the header can be read.
    """
    record = read_any(salvaged)
    if record.header.intensities is not None:
        raise LogError(
            "the log is of a motor threshold, not of a search for a window",
            got=str(record.path),
            remedy=f"isiw threshold {record.path} --show says what was found.",
        )
    return record


def read_any(salvaged: Salvage) -> SessionRecord:
    """What was salvaged from a log, be it of a search for a window or of a motor threshold.

    Args:
        salvaged: what was read.

    Raises:
        LogError: the log of an interval production task, or one from a newer version.
        DamagedLogError: not even the header can be read.
    """
    if of_production(salvaged):
        raise LogError(
            "the log is of an interval production task, not of a search for a window",
            got=str(salvaged.path),
            remedy=f"isiw interval {salvaged.path} --show says what was produced.",
        )
    records = Records.of(salvaged)
    return SessionRecord(
        salvaged.path,
        records.header_of(Header, SCHEMA_VERSION),
        tuple(records.history),
        records.waveforms,
        records.told_losses,
        salvaged.finished,
        salvaged.end_lost,
        _delivered(salvaged, records.history),
        records.onsets.by_trial,
    )


def of_production(salvaged: Salvage) -> bool:
    """Whether a log is of an interval production task.

    Args:
        salvaged: what was read.
    """
    return any(message.topic in {"/production_header", "/production"} for message in salvaged.messages)


def _delivered(salvaged: Salvage, history: Sequence[Record]) -> int:
    """How many stimuli the index counts, those of lost records among them; refused ones do not count."""
    lost = salvaged.counted.get("/intent", 0) - sum(isinstance(record, Intent) for record in history)
    return max(lost + len(_standing(history)), salvaged.counted.get("/trial", 0))


def _standing(history: Sequence[Record]) -> dict[int, Intent]:
    """What was about to be delivered and was not refused, by trial; what was asked for again is one stimulus."""
    intents: dict[int, Intent] = {}
    for entry in history:
        if isinstance(entry, Intent):
            intents[entry.trial] = entry
        elif isinstance(entry, Event) and entry.kind == "refused" and entry.trial is not None:
            intents.pop(entry.trial, None)
    return intents


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
    """

    salvaged: Salvage
    header: AnyHeader | None = None
    history: list[Record] = field(default_factory=list)
    waveforms: dict[tuple[int, str], Channel] = field(default_factory=dict)
    losses: list[str] = field(default_factory=list)
    onsets: Onsets = field(default_factory=Onsets)
    _trials: set[int] = field(default_factory=set)

    @classmethod
    def of(cls, salvaged: Salvage) -> Records:
        """The records of a log.

        Args:
            salvaged: what was read from it.
        """
        records = cls(salvaged, losses=list(salvaged.losses))
        for message in salvaged.messages:
            records.take(message)
        return records

    @property
    def told_losses(self) -> tuple[str, ...]:
        """The losses, as many as somebody will read."""
        left = len(self.losses) - MOST_LOSSES
        listed = tuple(self.losses[:MOST_LOSSES])
        return listed if left <= 0 else (*listed, f"{left} more losses are not listed.")

    def header_of(self, kind: type[HeaderKind], newest: int) -> HeaderKind:
        """The log's header, from its records or else from the configuration that is attached.

        Args:
            kind: of header.
            newest: version that this isiw reads.

        Raises:
            LogError: the log is from a newer version.
            DamagedLogError: the header cannot be read.
        """
        header = self.header if isinstance(self.header, kind) else None
        if header is None or (self.losses and CONFIGURATION in self.salvaged.attachments):
            header = _header_from_attachment(self.salvaged, kind)  # what is lost may have been the last header
        return _checked_version(header, newest, self.salvaged.path)

    def take(self, message: Message) -> None:
        """Take one more record."""
        try:
            record = decode(message.topic, message.data)
            if isinstance(record, Waveform):
                self.waveforms[record.trial, message.topic.removeprefix("/")] = record.channel()
        except ValueError as error:
            self.losses.append(f"A record on {message.topic} makes no sense and is left out: {_first_line(error)}")
            return
        if isinstance(record, Header | ProductionHeader):
            self.header = record
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


def _concluded(record: Record) -> int | None:
    """The number of the trial whose outcome a record is; None for any other record."""
    if isinstance(record, Trial):
        return record.index
    return record.trial if isinstance(record, PulseOutcome | Production) else None


def _first_line(error: ValueError) -> str:
    """What is wrong with a record, without what pydantic says of where to read more."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return str(error)


def _header_from_attachment(salvaged: Salvage, kind: type[HeaderKind]) -> HeaderKind:
    text = salvaged.attachments.get(CONFIGURATION, b"")[:MOST_CONFIGURATION]
    try:
        return kind.model_validate(parsed(text.decode()))
    except (ValueError, RecursionError) as error:
        raise DamagedLogError(
            "the log's header is lost",
            got=str(salvaged.path),
            remedy="Its records may still be readable with any MCAP tool.",
        ) from error


def _checked_version(header: HeaderKind, newest: int, path: Path) -> HeaderKind:
    if header.schema_version > newest:
        raise LogError(
            "the log was written by a newer isiw",
            got=f"schema version {header.schema_version} in {path}",
            expected=f"{newest} or older",
            remedy="Upgrade isiw.",
        )
    return header


def require_records(records: Iterable[object]) -> None:
    """Check that sessions were read, and are not their paths.

    Args:
        records: what should be records of sessions.

    Raises:
        InvalidValueError: something else.
    """
    for record in records:
        if not isinstance(record, SessionRecord):
            raise InvalidValueError(
                "this is no record of a session", got=record, remedy="Read the log first: isiw.read_session(path)."
            )
