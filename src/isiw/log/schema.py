"""The records of a log: one kind of record per topic, as JSON with a JSON schema.

    /header     who, with what, and how: everything needed to make the strategy again; once more on resuming
    /intent     about to be delivered; an intent without a trial was interrupted, or refused as an event says
    /trial      what came of it
    /emg …      the waveforms of a trial, one topic a channel
    /estimate   the estimate after the trial, and the ISI that comes next
    /event      what happened: an exclusion, a limit, a fault, a resumption, a pause, a note … (`EventKind`)

A log of a motor threshold has a header of its own, intents with an intensity, and in place of trials and estimates

    /threshold/pulse    what came of a pulse
    /threshold/belief   the estimate of the threshold after it

JSON knows no infinity: where a number is not finite it is one of the strings "Infinity", "-Infinity" and "NaN".
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal, Self, TypeAlias

import numpy as np
from pydantic import ConfigDict, Field, FiniteFloat, TypeAdapter

from isiw.checks import MOST_MEP_MV, MOST_TRIALS
from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError
from isiw.figures import Estimate
from isiw.findings import Kind
from isiw.log.headers import ANY_HEADER, AnyHeader, Header, LogRecord, Production, ProductionHeader
from isiw.log.moments import Moment
from isiw.strategy.threshold.estimate import ThresholdEstimate
from isiw.sweeps import Channel
from isiw.text.parsing import refuse_doubled
from isiw.trials import Stimulus, Trial
from isiw.types import Numbers

CONFIGURATION = "configuration.toml"
"""The attachment that holds the header once more, as TOML."""

TrialNumber: TypeAlias = Annotated[int, Field(ge=0, lt=MOST_TRIALS)]


class Intent(LogRecord):
    """The intent to deliver a pair of stimuli, or without an ISI TMS alone or a tap alone.

    `boot_s` is when, since the start of the computer that `boot_id` names, if that is known: a clock may be set.
    """

    trial: TrialNumber
    isi_ms: float | None
    t_s: float = 0.0
    tap_alone: bool = False
    intensity_pct_mso: float | None = None
    intensity_pct_rmt: float | None = None
    place_mm: tuple[float, float] | None = None
    boot_id: str = ""
    boot_s: FiniteFloat | None = None

    @property
    def stimulus(self) -> Stimulus:
        """What was to be delivered."""
        return Stimulus(self.trial, self.isi_ms, self.tap_alone, self.intensity_pct_rmt)

    @classmethod
    def of(cls, stimulus: Stimulus, t_s: float, **more: Any) -> Self:
        """The intent to deliver a stimulus now; `t_s` is the time on the session's clock [s]."""
        now = Moment.now()
        known = {"trial": stimulus.trial, "isi_ms": stimulus.isi_ms, "t_s": t_s, "tap_alone": stimulus.tap_alone}
        known["intensity_pct_rmt"] = stimulus.intensity_pct_rmt
        return cls(**known | {"boot_id": now.boot_id, "boot_s": now.boot_s} | more)


class PulseOutcome(LogRecord):
    """The outcome of a pulse on the way to a threshold; with a `reason` nothing was learnt from it."""

    trial: TrialNumber
    intensity_pct_mso: float | None
    mep_mv: float | None = None
    response: bool | None = None
    reason: str = ""
    place_mm: tuple[float, float] | None = None


class ThresholdEstimateRecord(LogRecord):
    """The estimate of a motor threshold after a pulse, and whether to stop."""

    model_config = ConfigDict(title="ThresholdBelief")  # as its schema is called in every log

    trial: TrialNumber
    estimate: ThresholdEstimate
    decision: StopDecision


class Waveform(LogRecord):
    """One waveform of one trial."""

    trial: TrialNumber
    t0_ms: float
    rate_hz: float
    unit: str
    values: Numbers

    @classmethod
    def of(cls, trial: int, channel: Channel) -> Self:
        """The record of a channel."""
        return cls(
            trial=trial,
            t0_ms=channel.t0_ms,
            rate_hz=channel.rate_hz,
            unit=channel.unit,
            values=tuple(channel.values.tolist()),
        )

    def channel(self) -> Channel:
        """The channel as it was recorded."""
        return Channel(np.asarray(self.values), self.rate_hz, self.unit, self.t0_ms)


class EstimateRecord(Estimate):
    """The estimate after a trial, the decision to stop or not, and the ISI that is asked next.

    Nine of ten next MEPs lie between `predicted_low_mv` and `predicted_high_mv`, at the ISIs of the profile.
    `stop_kind` says what the decision rests on, `chosen_by` what chose the next ISI
    (`isiw.strategy.choice.ChosenBy`), and `scores` are those of the acquisition function at `scored_ms`; both are
    empty if nothing is asked next.
    """

    model_config = ConfigDict(title="Estimate")  # as its schema is called in every log

    trial: TrialNumber
    predicted_low_mv: Numbers = ()
    predicted_high_mv: Numbers = ()
    chosen_by: str = ""
    scored_ms: tuple[float, ...] = ()
    scores: Numbers = ()
    next_isi_ms: float | None = None
    stop: bool = False
    reason: str = ""
    stop_kind: StopKind = StopKind.OWN

    @property
    def decision(self) -> StopDecision:
        """The decision to stop here or not, with its reason."""
        return StopDecision(self.stop, self.reason, self.stop_kind)


EventKind: TypeAlias = Literal[
    "exclusion",
    "inclusion",
    "acceptance",
    "correction",
    "limit",
    "fault",
    "resume",
    "fallback",
    "fit",
    "refused",
    "late",
    "pause",
    "doubt",
    "note",
    "change",
    "client",
    "block",
    "stop",
    "opening",
    "loss",
]


class Correction(LogRecord):
    """The values of a trial that were others than its record says; None for those that stay."""

    isi_ms: FiniteFloat | None = None
    isi_sd_ms: FiniteFloat | None = Field(default=None, ge=0)
    mep_mv: FiniteFloat | None = Field(default=None, ge=0, le=MOST_MEP_MV)
    mep_sd_mv: FiniteFloat | None = Field(default=None, ge=0)
    background_rms_uv: FiniteFloat | None = Field(default=None, ge=0)
    tap_mv: FiniteFloat | None = Field(default=None, ge=0)


class Event(LogRecord):
    """Something that happened to a session.

    `trial` is the one that was judged by an operator, refused or answered late, and otherwise the last one before the
    event. What is "refused" was not delivered, whatever the intent before it says. A note or a change with the
    `key` of an earlier one is not logged. A "change" bears on all MEPs after its trial. `finding` is what a
    doubt or a pause is about, or an exclusion by isiw and the inclusion that confirms its trial; `corrected` is what a
    correction says that the trial's values really were. `client` is the key of the client over HTTP that drives the
    session from a "client" on; None if it stated none. A "block" of an intervention begins with the next trial,
    `late_s` after it was due [s]; a "stop" ends it for good, and an "opening" says which arm it had. A "loss" is of
    records that were lost when the log was continued; its `trial` is the last stimulus that had been delivered.
    """

    kind: EventKind
    finding: Kind | None = None
    trial: TrialNumber | None = None
    text: str = ""
    key: str | None = None
    corrected: Correction | None = None
    client: str | None = None
    late_s: FiniteFloat | None = None


Record: TypeAlias = (
    AnyHeader | Intent | Trial | Waveform | EstimateRecord | Event | PulseOutcome | ThresholdEstimateRecord | Production
)


KINDS: dict[str, type[Any]] = {
    "/header": Header,
    "/intent": Intent,
    "/trial": Trial,
    "/estimate": EstimateRecord,
    "/event": Event,
    "/threshold/pulse": PulseOutcome,
    "/threshold/belief": ThresholdEstimateRecord,
    "/production_header": ProductionHeader,
    "/production": Production,
}
_FROZEN: Final = "header intent trial estimate event emg acceleration pressure force valve"

CHANNEL_IDS: Final = MappingProxyType({f"/{topic}": number for number, topic in enumerate(_FROZEN.split(), start=1)})
"""The channel numbers of the topics that every log has. They are frozen: a damaged log is read by them.

Any other topic takes the next free number in its file, and announces it there.
"""

ANNOUNCEMENT = "channel "
"""The beginning of the name of metadata that say which topic a further channel number has."""


@cache
def adapter(topic: str) -> TypeAdapter[Any]:
    """The converter of a topic's records into JSON and back; any topic that is not isiw's own holds waveforms."""
    return ANY_HEADER if topic == "/header" else TypeAdapter(KINDS.get(topic, Waveform))


def is_of_isiw(topic: str) -> bool:
    """True if a topic carries records of isiw's own, and not the waveforms of a channel."""
    return topic in KINDS


def waveform_topic(channel_name: str) -> str:
    """The topic of a channel's waveforms."""
    topic = f"/{channel_name}"
    if topic == "/" or topic in KINDS or not channel_name.isprintable():  # half a surrogate pair is not printable
        raise InvalidValueError(
            "a waveform's channel cannot have this name", got=channel_name, remedy="Rename it in the device."
        )
    return topic


_WAVEFORM: Final = re.compile(
    rb'{"trial":\d+,"t0_ms":[-+.e\d]+,"rate_hz":[-+.e\d]+,"unit":"[^"\\]*","values":\[', re.ASCII
)
"""The beginning of a waveform's record, as `encode` writes it."""


def without_samples(data: bytes) -> bytes | None:
    """The record of a waveform without its samples; None if it is another record, or not as `encode` writes it."""
    head = _WAVEFORM.match(data)
    if head is None or not data.endswith(b"]}") or data[head.end() : -2].translate(None, b"0123456789.,-+e"):
        return None
    return data[: head.end()] + b"]}"


def decode(topic: str, data: bytes) -> Record:
    """The record that was encoded."""
    record: Record = adapter(topic).validate_json(data)
    if without_samples(data) is None:  # else each key is there once
        refuse_doubled(data)
    if isinstance(record, Trial) and record.index >= MOST_TRIALS:
        raise InvalidValueError("no session has so many trials", got=record.index, expected=f"below {MOST_TRIALS}")
    return record


@dataclass(frozen=True)
class Message:
    """One record, still as bytes of JSON; `sequence` is its number in the file."""

    topic: str
    data: bytes
    log_time_ns: int
    sequence: int = 0
