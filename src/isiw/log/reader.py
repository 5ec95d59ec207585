"""Reading a log: a session as values and its trials as a table, whatever state its file is in."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

from isiw.decision import StopDecision
from isiw.errors import InvalidValueError, LogError
from isiw.findings import is_silent, lacking
from isiw.log.headers import SCHEMA_VERSION, Header, ThresholdHeader
from isiw.log.kinds import LogKind, of_another_kind
from isiw.log.records import Onset, Records, unknown_of
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import EstimateRecord, Event, Intent, PulseOutcome, Record, waveform_topic
from isiw.log.verdicts import VERDICTS, doubted_by, under_all
from isiw.sweeps import Channel
from isiw.text.sanitize import command
from isiw.trials import Trial, TrialTable

HeaderT = TypeVar("HeaderT", Header, ThresholdHeader)


@dataclass(frozen=True, eq=False)
class _StimuliRecord(Generic[HeaderT]):
    """The contents of a log of stimuli; `history` has all records but headers and waveforms, in order.

    `losses` are sentences; with `end_lost` nobody knows how many stimuli there were; `delivered` is 0 without an index,
    and `unread` are parts of the header in whose place something neutral stands, and why.
    """

    path: Path
    header: HeaderT
    history: tuple[Record, ...] = field(repr=False)
    losses: tuple[str, ...]
    finished: bool
    end_lost: bool = False
    delivered: int = 0
    unread: Mapping[str, str] = field(default_factory=dict)

    def require_read(self, *parts: str) -> None:
        """Raise if a part of the header is needed that this version cannot read."""
        needed = {part: why for part, why in self.unread.items() if part in parts or not parts}
        if needed:
            raise LogError(
                f"what is needed of the log's header cannot be read: {', '.join(needed)}",
                got=f"{self.path}: {'; '.join(needed.values())}",
                remedy="Use the version of isiw that wrote it; isiw show, plot, report and export show the rest.",
            )

    @property
    def intents(self) -> tuple[Intent, ...]:
        """The intents to deliver."""
        return tuple(record for record in self.history if isinstance(record, Intent))

    @property
    def events(self) -> tuple[Event, ...]:
        """The events of the session."""
        return tuple(record for record in self.history if isinstance(record, Event))


class ThresholdRecord(_StimuliRecord[ThresholdHeader]):
    """A search for the motor threshold as its log tells it."""

    @cached_property
    def outcomes(self) -> tuple[PulseOutcome, ...]:
        """The outcome of each pulse, as it counts after an operator's verdict."""
        excluded = {event.trial: {"reason": event.text} for event in self.events if event.kind == "exclusion"}
        pulses = (record for record in self.history if isinstance(record, PulseOutcome))
        return tuple(pulse.model_copy(update=excluded.get(pulse.trial)) for pulse in pulses)

    @property
    def unknown(self) -> tuple[Intent, ...]:
        """Pulses that were given, or may have been, and whose outcome is not in the log."""
        return unknown_of(self.history, {outcome.trial for outcome in self.outcomes}, self.delivered)

    @property
    def given(self) -> int:
        """The number of pulses that were given, or may have been; one that an operator has withdrawn does not count."""
        return len(self.outcomes) + len(self.unknown)


@dataclass(frozen=True, eq=False)
class SessionRecord(_StimuliRecord[Header]):
    """A session as its log has it; `waveforms` are by trial and channel, `onsets` by trial."""

    waveforms: Mapping[tuple[int, str], Channel] = field(default_factory=dict, repr=False)
    onsets: Mapping[int, Onset] = field(default_factory=dict, repr=False)

    @property
    def conceals(self) -> bool:
        """True if it is of an intervention whose arm nobody has opened."""
        intervention = self.header.intervention
        opened = any(event.kind == "opening" for event in self.events)
        return intervention is not None and intervention.conceals and not opened

    def require_open(self) -> None:
        """Raise if what is made of it would show a concealed arm."""
        if self.conceals:
            raise LogError(
                "the arm of this intervention is concealed, and this would show it",
                got=str(self.path),
                remedy="When nobody has to be blind any more, open it; that is logged: "
                f"{command('pair', '--open', self.path)}",
            )

    @property
    def unread_said(self) -> tuple[str, ...]:
        """A sentence for each part of the header that this version cannot read."""
        said = "The log's {} cannot be read by this version of isiw: {}"
        return tuple(said.format(part, why) for part, why in self.unread.items())

    @cached_property
    def table(self) -> TrialTable:
        """All trials whose outcome was logged, as they count after what an operator said about them."""
        trials = sorted((r for r in self.history if isinstance(r, Trial)), key=lambda trial: trial.index)
        return under_all(TrialTable(tuple(trials)), self.events)

    @property
    def rests_on_data(self) -> bool:
        """True if enough pairs of stimuli count to speak of a window, and any trial showed an MEP."""
        return self.too_little is None

    @property
    def too_little(self) -> str | None:
        """A sentence if too little was measured, or too doubtful, to report a window; None if enough was."""
        found = lacking(self.pairs, silent=self.is_silent, in_doubt=self.in_doubt)
        return None if found is None else f"{found}"

    @property
    def in_doubt(self) -> bool:
        """True if realised ISIs are in doubt, which nobody has confirmed or judged."""
        return bool(doubted_by(self.events))

    @property
    def pairs(self) -> int:
        """The number of pairs of stimuli that count; trials with TMS alone do not."""
        return sum(trial.isi_ms is not None for trial in self.table.told)

    @property
    def is_silent(self) -> bool:
        """True if enough trials count, and each amplitude was 0, where the detection limit is too low for that."""
        meps_mv = [trial.mep_mv for trial in self.table.told if trial.mep_mv is not None]
        return is_silent(meps_mv, self.header.detection_limit_mv)

    @property
    def is_judged_since(self) -> bool:
        """True if trials were judged after the last estimate, which is then outdated."""
        since = itertools.takewhile(lambda entry: not isinstance(entry, EstimateRecord), reversed(self.history))
        return any(isinstance(entry, Event) and entry.kind in VERDICTS for entry in since)

    @property
    def estimates(self) -> tuple[EstimateRecord, ...]:
        """The estimates, trial by trial."""
        return tuple(r for r in self.history if isinstance(r, EstimateRecord))

    @property
    def found(self) -> EstimateRecord | None:
        """The last estimate; None if there is none, or it rests on too little to speak of a window."""
        return self.estimates[-1] if self.estimates and self.rests_on_data else None

    @property
    def decision(self) -> StopDecision | None:
        """The last decision; None before the first trial."""
        return self.estimates[-1].decision if self.estimates else None

    @cached_property
    def unknown(self) -> tuple[Intent, ...]:
        """Stimuli that were delivered, or may have been, and whose outcome is not in the log."""
        return unknown_of(self.history, {trial.index for trial in self.table}, self.delivered)

    @property
    def unknown_trials(self) -> tuple[Trial, ...]:
        """The mistrials that `unknown` stimuli are."""
        return tuple(Trial.unknown(lost.stimulus) for lost in self.unknown)

    @property
    def given(self) -> int:
        """The number of stimuli that were delivered, or may have been."""
        return len(self.table) + len(self.unknown)

    def sweep(self, trial: int) -> dict[str, Channel]:
        """The waveforms of one trial, by channel."""
        return {name: channel for (number, name), channel in self.waveforms.items() if number == trial}


def read_session(path: str | Path, *, channels: Iterable[str] | None = None) -> SessionRecord:
    """The session of a log, of whose channels these have samples; `isiw.log.frames.read_session` has it with tables."""
    return read_salvaged(salvage(path, topics_of(channels)))


def topics_of(channels: Iterable[str] | None) -> frozenset[str] | None:
    """The topics whose samples are kept if these channels are wanted; None is all."""
    return None if channels is None else frozenset(map(waveform_topic, channels))


def read_salvaged(salvaged: Salvage) -> SessionRecord:
    """The session in what was salvaged from a log."""
    record = read_any(salvaged)
    if isinstance(record, ThresholdRecord):
        raise of_another_kind(record.path, LogKind.THRESHOLD, LogKind.SEARCH)
    return record


def read_any(salvaged: Salvage, wanted: LogKind = LogKind.SEARCH) -> SessionRecord | ThresholdRecord:
    """The record of a salvaged log in which a person is stimulated."""
    if of_production(salvaged):
        raise of_another_kind(salvaged.path, LogKind.PRODUCTION, wanted)
    records = Records.of(salvaged)
    header = cast("Header | ThresholdHeader", records.header_of((Header, ThresholdHeader), SCHEMA_VERSION))
    read: dict[str, Any] = {
        "path": salvaged.path,
        "history": tuple(records.history),
        "losses": records.losses_said,
        "finished": salvaged.finished,
        "end_lost": salvaged.end_lost,
        "delivered": records.delivered,
        "unread": records.unread,
    }
    if isinstance(header, ThresholdHeader):
        return ThresholdRecord(header=header, **read)
    return SessionRecord(header=header, waveforms=records.waveforms, onsets=records.onsets.by_trial, **read)


def of_production(salvaged: Salvage) -> bool:
    """True if a log is of an interval production task."""
    return any(message.topic in {"/production_header", "/production"} for message in salvaged.messages)


def require_records(records: Iterable[object]) -> None:
    """Raise if these are no records of sessions, but the paths of their logs, say."""
    for record in records:
        if not isinstance(record, SessionRecord):
            raise InvalidValueError(
                "this is not a session record", got=record, remedy="Read the log first: isiw.read_session(path)."
            )
