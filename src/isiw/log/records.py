"""The records of a log by their kind, with their times, and what makes no sense; those of earlier versions, too.

Earlier versions wrote sentences alone where there are kinds now. Nothing else reads meaning out of a text; the words
are those of these versions, and are never to be changed.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple, TypeVar

from pydantic import ValidationError

from isiw.checks import MOST_TRIALS
from isiw.decision import StopKind
from isiw.errors import DamagedLogError, LogError
from isiw.findings import Kind
from isiw.log.headers import AnyHeader, Production, first_fault, header_in_parts
from isiw.log.moments import Moment
from isiw.log.salvage import Salvage
from isiw.log.schema import (
    CONFIGURATION,
    EstimateRecord,
    Event,
    Intent,
    Message,
    PulseOutcome,
    Record,
    Waveform,
    decode,
)
from isiw.sweeps import Channel
from isiw.text.parsing import parsed, read_json
from isiw.text.sanitize import counted
from isiw.trials import Trial


class Onset(NamedTuple):
    """When a stimulus was about to be delivered: since the log's first one [s], and by the computer's clock."""

    onset_s: float
    at_ns: int


_SLEPT_S: Final = 1.0
"""What the computer measures besides is to the millisecond, so that it counts only where it says something else [s]."""


class Onsets:
    """The onsets of a log's stimuli, by the session's clock.

    If that began again or stood still, the time since the start of the computer counts, which nobody sets; of another
    start, or where that is not known, the log's time. A computer that slept has gone on all the same.
    """

    def __init__(self) -> None:
        self.by_trial: dict[int, Onset] = {}
        self._last: Onset | None = None
        self._clock_s: float | None = None
        self._moment: Moment | None = None

    def take(self, record: Record, at_ns: int) -> None:
        """Take the next record; of two intents for the same trial the second counts."""
        if isinstance(record, Intent):
            moment = Moment(at_ns, record.boot_id, record.boot_s)
            self._last = Onset(self._onset_s(record.t_s, moment), at_ns)
            self._moment = moment
            self._clock_s = record.t_s
            self.by_trial[record.trial] = self._last
        elif isinstance(record, Event) and record.kind == "resume":
            self._clock_s = None
        elif isinstance(record, Event) and record.kind == "refused" and len(self.by_trial) == 1:
            self.by_trial.clear()  # nothing was given before, so that the next stimulus is the first one
            self._last = None

    def _onset_s(self, clock_s: float, at: Moment) -> float:
        if self._last is None or self._moment is None:
            return 0.0
        passed = [] if self._clock_s is None or clock_s <= self._clock_s else [clock_s - self._clock_s]
        if (measured_s := at.since_s(self._moment)) is not None and (measured_s > _SLEPT_S or not passed):
            passed.append(measured_s)
        return self._last.onset_s + max([0.0, *(passed or [(at.wall_ns - self._moment.wall_ns) / 1e9])])


_KindT = TypeVar("_KindT", Kind, StopKind)

_KEY_IN_TEXT: Final = re.compile(r" \(key ([A-Za-z0-9_-]{1,64})\)$")
"""Before notes had a key, their text ended with it."""

_DECISIONS: Final[Mapping[StopKind, tuple[str, ...]]] = {
    StopKind.PAUSED: ("The session is paused", "The session was ended before its time"),
    StopKind.ABSENT: ("There is no window", "There is probably no window", "The probability "),
    StopKind.KNOWN: ("The window is ", "The window as it is known so far", "The F1 to be expected is not known"),
    StopKind.SMALL_GAIN: ("to the expected F1",),
    StopKind.SETTLED: ("windows in a row yet", "The window has", "The particles have", "No generation of particles",
                       "The scan of ISIs has"),
    StopKind.TOO_LITTLE: ("too few to speak of a window", "so nothing is known about a window"),
    StopKind.BUDGET: ("stimuli is used up", "stimuli are left", "stimulus is left"),
    StopKind.LIMIT: ("pulses is reached",),
}  # fmt: skip

_FINDINGS: Final[Mapping[Kind, tuple[str, ...]]] = {
    Kind.STRAY_EDGE: ("the steepest edge of the EMG is at",),
    Kind.LOUD: ("RMS, more than any muscle's at rest",),
    Kind.QUIET: ("RMS, less than any amplifier's noise",),
    Kind.REPEATED: ("is that of the one before, sample by sample",),
    Kind.MISPLACED: ("after the pulse, outside the MEP window of",),
    Kind.ARTEFACT: ("the EMG is much larger just before the MEP window",),
    Kind.EQUAL: ("amplitudes are exactly equal", "amplitudes are almost equal"),
    Kind.SILENT: ("pulses evoked an MEP: every amplitude is 0",),
    Kind.STOPPED: ("pulses evoked an MEP, though earlier ones did",),
    Kind.SMALL: ("µV, less than EMG at rest has",),
    Kind.LARGE: ("more than most muscles give",),
    Kind.JUMP: ("times as large as those before",),
    Kind.ISI_FAR: ("ms is far from the",),
}


def with_kinds(record: Record) -> Record:
    """A record of a log with the kinds that an earlier version left to its sentences."""
    if isinstance(record, EstimateRecord) and "stop_kind" not in record.model_fields_set:
        return record.model_copy(update={"stop_kind": _kind(record.reason, _DECISIONS) or StopKind.OWN})
    if isinstance(record, Event) and record.kind in {"doubt", "pause"} and "finding" not in record.model_fields_set:
        return record.model_copy(update={"finding": _kind(record.text, _FINDINGS)})
    if isinstance(record, Event) and record.kind == "note" and "key" not in record.model_fields_set:
        return record.model_copy(update={"key": (found := _KEY_IN_TEXT.search(record.text)) and found[1]})
    return record


def _kind(text: str, table: Mapping[_KindT, tuple[str, ...]]) -> _KindT | None:
    return next((kind for kind, said in table.items() if any(words in text for words in said)), None)


HeaderKind = TypeVar("HeaderKind", bound=AnyHeader)

MOST_LOSSES: Final = 50
"""Losses that are listed one by one."""


@dataclass
class Records:
    """The records of a log by kind, the last header, `losses` in sentences, and unreadable parts of the header."""

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
        for at, message in enumerate(salvaged.messages):
            records.take(message)
            if salvaged.topics_kept is not None:  # nothing else is made of it
                salvaged.messages[at] = replace(message, data=b"")
        return records

    @property
    def losses_said(self) -> tuple[str, ...]:
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
            try:
                text = self.salvaged.attachments.get(CONFIGURATION, b"").decode()
                header, self.unread = header_in_parts(parsed(text))
            except (ValueError, RecursionError) as error:
                raise _lost_header(self.salvaged) from error
        if not isinstance(header, kinds):
            raise _lost_header(self.salvaged)
        if header.schema_version > newest:
            raise LogError(
                "the log was written by a newer isiw",
                got=f"schema version {header.schema_version} in {self.salvaged.path}",
                expected=f"{newest} or older",
                remedy="Upgrade isiw.",
            )
        return header

    @property
    def delivered(self) -> int:
        """The number of stimuli that the index counts, those of lost records among them; refused ones do not count."""
        counted, history = self.salvaged.counted, self.history
        lost = counted.get("/intent", 0) - sum(isinstance(record, Intent) for record in history)
        last = (entry.trial for entry in history if isinstance(entry, Event) and entry.kind == "loss")
        before = [number + 1 for number in last if number is not None]
        return max(lost + len(_standing(history)), counted.get("/trial", 0), *before)

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
        elif isinstance(record, Trial | PulseOutcome | Production):
            trial = record.index if isinstance(record, Trial) else record.trial
            if trial in self._trials:
                self.losses.append(f"A second record of trial {trial} is left out.")
                return
            self._trials.add(trial)
            self.history.append(record)
        elif not isinstance(record, Waveform):
            self.history.append(record)
            if isinstance(record, Event) and record.kind == "loss":
                self.losses.append(record.text)
            self.onsets.take(record, message.log_time_ns)


def _decoded(message: Message) -> tuple[Record, dict[str, str]]:
    """A record, and of a header the parts that cannot be read."""
    try:
        return decode(message.topic, message.data), {}
    except ValidationError:
        if message.topic != "/header":
            raise
        return header_in_parts(read_json(message.data))


def _is_beyond(message: Message) -> bool:
    """True if a record is of a later trial than is read."""
    try:
        values = read_json(message.data)
    except ValueError:
        return False
    number = values.get("index" if message.topic == "/trial" else "trial") if isinstance(values, dict) else None
    return isinstance(number, int) and number >= MOST_TRIALS


def unknown_of(history: Sequence[Record], known: AbstractSet[int], delivered: int) -> tuple[Intent, ...]:
    """Stimuli that were delivered, or may have been, and whose outcome is not in the log."""
    intents = _standing(history)
    last = max(itertools.chain(known, intents, [min(delivered, MOST_TRIALS) - 1]))
    return tuple(
        intents.get(number, Intent(trial=number, isi_ms=None)) for number in range(last + 1) if number not in known
    )


def _standing(history: Sequence[Record]) -> dict[int, Intent]:
    """Intents that were not refused, by trial; a stimulus that was asked for again is one."""
    intents: dict[int, Intent] = {}
    for entry in history:
        if isinstance(entry, Intent):
            intents[entry.trial] = entry
        elif isinstance(entry, Event) and entry.kind == "refused" and entry.trial is not None:
            intents.pop(entry.trial, None)
    return intents


def _lost_header(salvaged: Salvage) -> DamagedLogError:
    return DamagedLogError(
        "the log's header is lost",
        got=str(salvaged.path),
        remedy="Its records may still be readable with any MCAP tool.",
    )
