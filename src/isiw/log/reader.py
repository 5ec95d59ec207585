"""Reading a log: a session as values and its trials as a table, whatever state its file is in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

from isiw.errors import LogError
from isiw.log.headers import SCHEMA_VERSION, Header, ThresholdHeader
from isiw.log.kinds import LogKind, of_another_kind
from isiw.log.records import Onset, Records, unknown_of
from isiw.log.salvage import Salvage
from isiw.log.schema import EstimateRecord, Event, Intent, PulseOutcome, Record, waveform_topic
from isiw.log.verdicts import under_all
from isiw.sweeps import Channel
from isiw.trials import Trial, TrialTable

HeaderT = TypeVar("HeaderT", Header, ThresholdHeader)
LoggedT = TypeVar("LoggedT", bound="LoggedSession")


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
class LoggedSession(_StimuliRecord[Header]):
    """A session as its log has it; `waveforms` are by trial and channel, `onsets` by trial."""

    waveforms: Mapping[tuple[int, str], Channel] = field(default_factory=dict, repr=False)
    onsets: Mapping[int, Onset] = field(default_factory=dict, repr=False)

    @property
    def conceals(self) -> bool:
        """True if it is of an intervention whose arm nobody has opened."""
        intervention = self.header.intervention
        opened = any(event.kind == "opening" for event in self.events)
        return intervention is not None and intervention.conceals and not opened

    @cached_property
    def table(self) -> TrialTable:
        """All trials whose outcome was logged, as they count after what an operator said about them."""
        trials = sorted((r for r in self.history if isinstance(r, Trial)), key=lambda trial: trial.index)
        return under_all(TrialTable(tuple(trials)), self.events)

    @property
    def estimates(self) -> tuple[EstimateRecord, ...]:
        """The estimates, trial by trial."""
        return tuple(r for r in self.history if isinstance(r, EstimateRecord))

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


def topics_of(channels: Iterable[str] | None) -> frozenset[str] | None:
    """The topics whose samples are kept if these channels are wanted; None is all."""
    wanted = [channels] if isinstance(channels, str) else channels
    return None if wanted is None else frozenset(map(waveform_topic, wanted))


def read_any(salvaged: Salvage, wanted: LogKind, kind: type[LoggedT]) -> LoggedT | ThresholdRecord:
    """The record of a salvaged log in which a person is stimulated; of a session, as this kind of record."""
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
    return kind(header=header, waveforms=records.waveforms, onsets=records.onsets.by_trial, **read)


def of_production(salvaged: Salvage) -> bool:
    """True if a log is of an interval production task."""
    return any(message.topic in {"/production_header", "/production"} for message in salvaged.messages)
