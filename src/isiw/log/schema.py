"""What is in a log: one kind of record per topic, as JSON with a JSON schema.

    /header     who, with what, and how: everything needed to make the strategy again; once more on resuming
    /intent     about to be delivered; an intent without a trial was interrupted, or refused as an event says
    /trial      what came of it
    /emg …      the waveforms of a trial, one topic a channel
    /estimate   what was believed after the trial, and what is asked next
    /event      what happened: an exclusion, a limit, a fault, a resumption, a pause, a note … (`EventKind`)

A log of a motor threshold has a header of its own, intents with an intensity, and in place of trials and estimates

    /threshold/pulse    what came of a pulse
    /threshold/belief   what was believed of the threshold after it

JSON knows no infinity: where a number is not finite it is one of the strings "Infinity", "-Infinity" and "NaN".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, Self, TypeAlias

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    Tag,
    TypeAdapter,
    field_validator,
    model_validator,
)

from isiw.checks import MOST_MEP_MV, mean_and_sd, number
from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import InvalidValueError
from isiw.estimate import Estimate, WindowEstimate
from isiw.findings import Kind
from isiw.log.production import Production, ProductionHeader
from isiw.signals.limits import SignalLimits
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.pulses import IntensityRange, ThresholdEstimate
from isiw.text.stimuli import STIMULI, StimulusWords
from isiw.trials import Channel, Stimulus, Trial
from isiw.types import Conditioning, Numbers
from isiw.visit import Visit, VisitProtocol

SCHEMA_VERSION = 4
"""4 since 0.1.0: control trials, and trials that an operator includes again or accepts. Before came 1 to 3."""

MOST_TRIALS: Final = 100_000
"""More than any session delivers; a record of a later trial makes no sense."""

TrialNumber: TypeAlias = Annotated[int, Field(ge=0, lt=MOST_TRIALS)]


class _Record(BaseModel):
    """A frozen record; keys that a newer version added are ignored."""

    model_config = ConfigDict(
        frozen=True,
        ser_json_inf_nan="strings",
        extra="ignore",
        coerce_numbers_to_str=True,  # an earlier version wrote a device's version as the number that it was given
    )


class StrategyRecipe(_Record):
    """How the strategy was made; an empty name means from a user's own objects."""

    name: str
    seed: int
    settings: dict[str, Any] = Field(default_factory=dict)

    @field_validator("settings")
    @classmethod
    def _readable(cls, settings: dict[str, Any]) -> dict[str, Any]:
        """What a header is read by, whatever the strategy."""
        if settings.get("conditioning", "tap") not in STIMULI:
            raise InvalidValueError("the conditioning stimulus is unknown", got=settings["conditioning"])
        if (limit_mv := settings.get("detection_limit_mv")) is not None:
            number("detection_limit_mv", limit_mv, above=0)
        if (delay_ms := settings.get("hit_delay_ms")) is not None:
            mean_and_sd("hit_delay_ms", delay_ms)
        return settings


RUN_KEY: Final = "isiw_run"
SERVED_KEY: Final = "isiw_serve"
"""Where `isiw run` and `isiw serve` keep in `Header.config` what they were asked for; other software has names of its
own."""


def with_reference(space: object) -> object:
    """A logged space; where it says no reference, its ISIs count from the impact, which once was the default."""
    return {"reference": "impact", **space} if isinstance(space, dict) else space


class _Header(_Record):
    """What the header of a log says in which a person is stimulated; its tag is `kind`, which older logs lack."""

    schema_version: int = SCHEMA_VERSION
    isiw_version: str
    created: str
    subject: str = ""
    seed: int
    device: DeviceInfo
    versions: dict[str, str] = Field(default_factory=dict)
    config: dict[str, Any] = Field(default_factory=dict)


class Header(_Header):
    """What a session is, written before anything else, and again before it goes on: the last one holds.

    `asks_from` is the first trial that was asked with these versions. `belief_version` and `engine_version` grow where
    the same settings come to believe something else, or compute it otherwise; 1 is what older logs mean.
    """

    kind: Literal["session"] = "session"
    strategy: StrategyRecipe
    space: Annotated[DesignSpace, BeforeValidator(with_reference)]
    limits: Limits
    signals: SignalLimits
    timeout_s: float = 30.0
    ask_deadline_s: float | None = None
    visit: Visit = Visit()
    protocol: VisitProtocol = VisitProtocol()
    asks_from: int = 0
    belief_version: int = 1
    engine_version: int = 1

    @property
    def conditioning(self) -> Conditioning:
        """The conditioning stimulus, as the strategy was told, or as the device says."""
        told: Conditioning = self.strategy.settings.get("conditioning", self.device.conditioning)
        return told

    @property
    def stimulus(self) -> StimulusWords:
        """What the conditioning stimulus is called."""
        return STIMULI[self.conditioning]

    @property
    def detection_limit_mv(self) -> float | None:
        """What an amplitude of 0 is known to be below [mV]: as the device states it, or as the strategy was told."""
        told = self.strategy.settings.get("detection_limit_mv")
        return self.device.detection_limit_mv if told is None else float(told)


class ThresholdHeader(_Header):
    """What a search for a motor threshold is: every pulse is TMS alone, at an intensity of a range."""

    kind: Literal["threshold"] = "threshold"
    search: StrategyRecipe
    intensities: IntensityRange
    min_iti_s: float
    max_pulses: int

    @model_validator(mode="before")
    @classmethod
    def _of_before(cls, values: Any) -> Any:
        """An older header is a session's, whose space and signals have no meaning."""
        recipe, limits = (values.get(key) if isinstance(values, dict) else None for key in ("strategy", "limits"))
        if not isinstance(recipe, dict) or not isinstance(limits, dict):
            return values
        search = {**recipe, "name": str(recipe.get("name", "")).removeprefix("threshold/")}
        return {**limits, **values, "search": search}


class Intent(_Record):
    """What is about to be delivered: a pair of stimuli, or without an ISI TMS alone or a tap alone."""

    trial: TrialNumber
    isi_ms: float | None
    t_s: float = 0.0
    tap_alone: bool = False
    intensity_pct_mso: float | None = None

    @classmethod
    def of(cls, stimulus: Stimulus, t_s: float) -> Self:
        """The intent to deliver a stimulus."""
        return cls(trial=stimulus.trial, isi_ms=stimulus.isi_ms, t_s=t_s, tap_alone=stimulus.tap_alone)


class PulseOutcome(_Record):
    """What came of a pulse on the way to a motor threshold; with a `reason`, nothing was learnt from it.

    The intensity is None where the log has lost it.
    """

    trial: TrialNumber
    intensity_pct_mso: float | None
    mep_mv: float | None = None
    response: bool | None = None
    reason: str = ""


class ThresholdBelief(_Record):
    """What was believed of a motor threshold after a pulse, and whether to stop."""

    trial: TrialNumber
    estimate: ThresholdEstimate
    decision: StopDecision


class Waveform(_Record):
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
    """What was known after a trial, whether to stop, and what is asked next.

    Nine of ten next MEPs lie between `predicted_low_mv` and `predicted_high_mv`, at the ISIs of the profile.
    `stop_kind` says what the decision rests on, `chosen_by` what chose the next ISI
    (`isiw.strategy.choosing.ChosenBy`), and `scores` are those of the acquisition function at `scored_ms`; both are
    empty where nothing is asked next.
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

    @classmethod
    def after(cls, trial: int, estimate: WindowEstimate, decision: StopDecision, next_isi_ms: float | None) -> Self:
        """The record of an estimate."""
        stops = {"stop": decision.stop, "reason": decision.reason, "stop_kind": decision.kind}
        return cls.of(estimate, trial=trial, next_isi_ms=next_isi_ms, **stops)

    @property
    def decision(self) -> StopDecision:
        """Whether the session stops here, and why."""
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
]


class Correction(_Record):
    """The values of a trial that were others than its record says; None for those that stay."""

    isi_ms: FiniteFloat | None = None
    isi_sd_ms: FiniteFloat | None = Field(default=None, ge=0)
    mep_mv: FiniteFloat | None = Field(default=None, ge=0, le=MOST_MEP_MV)
    mep_sd_mv: FiniteFloat | None = Field(default=None, ge=0)
    background_rms_uv: FiniteFloat | None = Field(default=None, ge=0)


class Event(_Record):
    """Something that happened to a session.

    `trial` is the one that was judged by an operator, refused or answered late, and otherwise the last one before the
    event. What is "refused" was not delivered, whatever the intent before it says. A note with the `key` of an earlier
    one is not logged. `finding` is what a doubt or a pause is about, and `corrected` what a correction says that the
    trial's values really were.
    """

    kind: EventKind
    finding: Kind | None = None
    trial: TrialNumber | None = None
    text: str = ""
    key: str | None = None
    corrected: Correction | None = None


def kind_tag(header: Any) -> str | None:
    """The kind of a header, be it a value or what was read of one; without a tag its fields say which."""
    if not isinstance(header, Mapping):
        return getattr(header, "kind", None)
    untagged = "threshold" if header.get("intensities") else "production" if "blocks" in header else "session"
    return str(header.get("kind", untagged))


AnyHeader: TypeAlias = Header | ThresholdHeader | ProductionHeader
ANY_HEADER: Final[TypeAdapter[AnyHeader]] = TypeAdapter(
    Annotated[
        Annotated[Header, Tag("session")]
        | Annotated[ThresholdHeader, Tag("threshold")]
        | Annotated[ProductionHeader, Tag("production")],
        Discriminator(kind_tag),
    ]
)
"""What turns a header into JSON and back, by its kind."""

Record: TypeAlias = (
    AnyHeader | Intent | Trial | Waveform | EstimateRecord | Event | PulseOutcome | ThresholdBelief | Production
)
