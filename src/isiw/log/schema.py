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

import itertools
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
    WithJsonSchema,
    field_validator,
    model_validator,
)

from isiw.checks import MOST_MEP_MV, mean_and_sd, number
from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.log.production import Production, ProductionHeader
from isiw.signals.limits import SignalLimits
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.pulses import IntensityRange, ThresholdEstimate
from isiw.text.stimuli import STIMULI, StimulusWords
from isiw.text.summary import summary
from isiw.trials import Channel, Stimulus, Trial
from isiw.types import Conditioning, FloatArray
from isiw.visit import Visit, VisitProtocol
from isiw.window import Window, WindowEstimate, depression, nothing_found

SCHEMA_VERSION = 4
"""4 since 0.1.0: control trials, and trials that an operator includes again or accepts. Before came 1 to 3."""

MOST_TRIALS: Final = 100_000
"""More than any session delivers; a record of a later trial makes no sense."""

PROFILE_DECIMALS = 6  # a nanovolt; the profile is a picture of the posterior, not a measurement

TrialNumber: TypeAlias = Annotated[int, Field(ge=0, lt=MOST_TRIALS)]
Number: TypeAlias = Annotated[float, WithJsonSchema({"type": ["number", "string"]})]
Numbers: TypeAlias = Annotated[
    tuple[float, ...], WithJsonSchema({"type": "array", "items": {"type": ["number", "string"]}})
]


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


class Estimate(_Record):
    """What was believed after a trial, whether to stop, and what is asked next.

    `start_beyond`, `end_beyond` and `split` are probabilities given a window: that an edge lies beyond the range, and
    that there is more than one segment. `hypotheses` and `unusual` are probabilities by name, `best_isi_ms` is the
    median and the ends of the 90 % interval; `excluded_mv` and `excluded_pct_rmt` are the largest enhancement that is
    excluded with 90 % probability. Nine of ten next MEPs lie between `predicted_low_mv` and `predicted_high_mv`, at the
    ISIs of the profile. `stop_kind` says what the decision rests on, `chosen_by` what chose the next ISI
    (`isiw.strategy.choosing.ChosenBy`), and `scores` are those of the acquisition function at `scored_ms`; both are
    empty where nothing is asked next. `depressed_ms` are the segments in which the tap depresses the MEP, and
    `depressed_probability` is that there are any; None where nobody looked for them.
    """

    trial: TrialNumber
    probability: float | None
    segments_ms: tuple[float, ...] = ()
    start_ms: Number | None = None
    end_ms: Number | None = None
    start_low_ms: Number | None = None
    start_high_ms: Number | None = None
    end_low_ms: Number | None = None
    end_high_ms: Number | None = None
    start_beyond: float | None = None
    end_beyond: float | None = None
    split: float | None = None
    hypotheses: dict[str, float] = Field(default_factory=dict)
    unusual: dict[str, float] = Field(default_factory=dict)
    expected_f1: float | None = None
    best_isi_ms: tuple[float, ...] = ()
    excluded_mv: float | None = None
    excluded_pct_rmt: float | None = None
    depressed_ms: tuple[float, ...] = ()
    depressed_probability: float | None = None
    grid_ms: tuple[float, ...] = ()
    profile_mv: Numbers = ()
    band_low_mv: Numbers = ()
    band_high_mv: Numbers = ()
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
    def of(cls, trial: int, estimate: WindowEstimate, decision: StopDecision, next_isi_ms: float | None) -> Self:
        """The record of an estimate, with its 90 % intervals."""
        start, end = estimate.interval(0.9) or ((None, None), (None, None))
        beyond, excluded = estimate.beyond_probability or (None, None), estimate.largest_excluded
        return cls(
            trial=trial,
            probability=estimate.probability,
            segments_ms=_edges(estimate.window),
            start_ms=estimate.start_ms,
            end_ms=estimate.end_ms,
            start_low_ms=start[0],
            start_high_ms=start[1],
            end_low_ms=end[0],
            end_high_ms=end[1],
            start_beyond=beyond[0],
            end_beyond=beyond[1],
            split=estimate.split_probability,
            hypotheses=estimate.hypotheses or {},
            unusual=dict(estimate.unusual),
            expected_f1=estimate.expected_f1,
            best_isi_ms=tuple(estimate.best_isi or ()),
            excluded_mv=None if excluded is None else excluded.mep_mv,
            excluded_pct_rmt=None if excluded is None else excluded.shift_pct_rmt,
            depressed_ms=_edges(estimate.depressed),
            depressed_probability=estimate.depressed_probability,
            next_isi_ms=next_isi_ms,
            stop=decision.stop,
            reason=decision.reason,
            stop_kind=decision.kind,
            **_profile(estimate),
        )

    def __str__(self) -> str:
        start = (self.start_ms, self.start_low_ms, self.start_high_ms)
        end = (self.end_ms, self.end_low_ms, self.end_high_ms)
        depressed = depression(self.depressed, self.depressed_probability)
        return summary(self.probability, self.window, self.nothing, start, end, depressed)

    @property
    def has_answer(self) -> bool:
        """Whether the method has one: some have none before they have measured enough."""
        return self.probability is not None or self.window is not None or bool(self.grid_ms)

    @property
    def nothing(self) -> str:
        """What is said in short where no window is reported."""
        return nothing_found(self.probability, has_answer=self.has_answer)

    @property
    def window(self) -> Window | None:
        """The reported window."""
        return _window(self.segments_ms)

    @property
    def depressed(self) -> Window | None:
        """The reported ISIs that depress the MEP."""
        return _window(self.depressed_ms)

    @property
    def decision(self) -> StopDecision:
        """Whether the session stops here, and why."""
        return StopDecision(self.stop, self.reason, self.stop_kind)


def _edges(window: Window | None) -> tuple[float, ...]:
    return () if window is None else tuple(itertools.chain(*window.segments))


def _window(edges_ms: tuple[float, ...]) -> Window | None:
    pairs = tuple(zip(edges_ms[::2], edges_ms[1::2], strict=True))
    return Window(edges_ms[0], edges_ms[-1], pairs) if pairs else None


def _profile(estimate: WindowEstimate) -> Mapping[str, Any]:
    band = None if estimate.grid_ms is None else estimate.profile(estimate.grid_ms)
    if band is None or estimate.grid_ms is None:
        return {}
    return {
        "grid_ms": tuple(estimate.grid_ms.tolist()),
        "profile_mv": _rounded(band.median_mv),
        "band_low_mv": _rounded(band.low_mv),
        "band_high_mv": _rounded(band.high_mv),
    }


def _rounded(values: FloatArray) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).round(PROFILE_DECIMALS).tolist())


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
    AnyHeader | Intent | Trial | Waveform | Estimate | Event | PulseOutcome | ThresholdBelief | Production
)
