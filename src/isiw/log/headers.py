"""The header of a log: what a session, a threshold search or a production task is, and what another version's says.

The log of a production task has besides:

    /production            one interval that a person has produced
    /event                 a resumption, or presses that do not count

Its two topics have no frozen channel number: the file announces them.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_validator,
)

from isiw.checks import Checked, choice, code, mean_and_sd, number, whole
from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError
from isiw.intervention import Intervention
from isiw.signals.limits import SignalLimits
from isiw.strategy.threshold.estimate import IntensityRange
from isiw.text.stimuli import STIMULI, StimulusWords
from isiw.trials import Trial
from isiw.types import Conditioning, Reference
from isiw.visit import Visit, VisitProtocol

PRODUCTION_VERSION: Final = 1
"""Grows only if an older isiw would misread the log."""

MODES: Final = {
    1: "score bar",
    2: "light on or off",
    3: "target and produced time",
    4: "target and absolute error",
}
"""The feedback after each trial, by mode [Kim2020, Table 6.1]."""

LONGEST_MS: Final = 5000.0
"""Longer than a person who attends takes between the two presses [ms]."""

MOST_BLOCK_TRIALS: Final = 10_000


@dataclass(frozen=True)
class Block(Checked):
    """Trials in a row with one target and one kind of feedback.

    Args:
        mode: the kind of feedback, a key of `MODES`.
        target_ms: the interval to produce [ms].
        scale_pct: score at the target [%], A of equation 6.1.
        trials: how many.

    Raises:
        InvalidValueError: a mode that does not exist, or a number out of range.
    """

    mode: Annotated[int, partial(choice, known=MODES)]
    target_ms: Annotated[float, partial(number, above=0, below=LONGEST_MS)]
    scale_pct: Annotated[float, partial(number, least=1.0, most=100.0)] = 100.0
    trials: Annotated[int, partial(whole, least=1, most=MOST_BLOCK_TRIALS)] = 200


class LogRecord(BaseModel):
    """A frozen record; keys that a newer version added are ignored."""

    model_config = ConfigDict(
        frozen=True,
        ser_json_inf_nan="strings",
        extra="ignore",
        coerce_numbers_to_str=True,  # an earlier version wrote a device's version as the number that it was given
    )


PersonsCode: TypeAlias = Annotated[str, AfterValidator(partial(code, "subject"))]


class ProductionHeader(LogRecord):
    """The header of a production task; the seed draws the lights of mode 2."""

    kind: Literal["production"] = "production"
    schema_version: int = PRODUCTION_VERSION
    isiw_version: str
    created: str
    subject: PersonsCode = ""
    seed: int
    blocks: tuple[Block, ...] = Field(min_length=1)


class Production(LogRecord):
    """One produced interval and what the person saw; `trial` counts through all blocks, `light` is of mode 2."""

    trial: int = Field(ge=0)
    block: int = Field(ge=0)
    produced_ms: float = Field(gt=0.0, le=LONGEST_MS)
    score_pct: float
    light: bool | None = None


SCHEMA_VERSION = 4
"""4 since 0.1.0: control trials, and trials that an operator includes again or accepts. Before came 1 to 3."""


class StrategyRecipe(LogRecord):
    """The recipe of a strategy; an empty name means from a user's own objects."""

    name: str
    seed: int
    settings: dict[str, Any] = Field(default_factory=dict)

    @field_validator("settings")
    @classmethod
    def _readable(cls, settings: dict[str, Any]) -> dict[str, Any]:
        """Check what a header is read by, whatever the strategy."""
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


class _Header(LogRecord):
    """Common fields of headers of logs in which a person is stimulated; the tag is `kind`, which older logs lack."""

    schema_version: int = SCHEMA_VERSION
    isiw_version: str
    created: str
    subject: PersonsCode = ""
    seed: int
    device: DeviceInfo
    versions: dict[str, str] = Field(default_factory=dict)
    config: dict[str, Any] = Field(default_factory=dict)


class FirstStep(LogRecord):
    """The profile of a session below the motor threshold, which a search above it goes on from [Kim2020, 8.1.3].

    Args:
        log: the name of its log.
        intensity_pct_rmt: its intensity [% RMT]; None if it was not noted.
        reference: what its ISIs count from.
        grid_ms: ISIs [ms].
        profile_mv: the median of the expected MEP at each [mV].
    """

    log: str
    intensity_pct_rmt: float | None = None
    reference: Reference
    grid_ms: tuple[float, ...]
    profile_mv: tuple[float, ...]


class Header(_Header):
    """The header of a session, written before anything else, and again before it goes on: the last one holds.

    `asks_from` is the first trial that was asked with these versions. `belief_version` and `engine_version` grow if
    the same settings come to another estimate, or compute it otherwise; 1 is what older logs mean. An "imported"
    one is of trials that were delivered without isiw, and `source` says where they are from: it was no session, and has
    no intents; `given_by` is when all of them had been given, as ISO 8601 in UTC, if their dates say so. `earlier` are
    trials that were learnt before the first ask, `earlier_changed` are the places of those after which something
    changed, and `earlier_given` is how many stimuli these and lost ones were.
    An "intervention" uses a window that was found before, and searches for none; an older isiw does not know the kind,
    and so continues none as if it were a search.
    `first_step` is the profile below the motor threshold that a search above it goes on from.
    """

    kind: Literal["session", "imported", "intervention"] = "session"
    source: str = ""
    given_by: str = ""
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
    earlier: tuple[Trial, ...] = ()
    earlier_changed: tuple[int, ...] = ()
    earlier_given: int = 0
    earlier_same_level: bool = False
    intervention: Intervention | None = None
    first_step: FirstStep | None = None

    @field_validator("given_by")
    @classmethod
    def _a_date(cls, given_by: str) -> str:
        """Check what limits rest on."""
        if given_by and dt.datetime.fromisoformat(given_by).tzinfo is None:
            raise InvalidValueError("given_by has no zone", got=given_by)
        return given_by

    @property
    def given_before(self) -> int:
        """The number of stimuli that count for `max_pulses` before the session's own: those of earlier trials."""
        return max(self.earlier_given, len(self.earlier))

    @property
    def imported(self) -> bool:
        """True if its trials were delivered without isiw."""
        return self.kind == "imported"

    @property
    def conditioning(self) -> Conditioning:
        """The conditioning stimulus, as the strategy's settings or the device state it."""
        stated: Conditioning = self.strategy.settings.get("conditioning", self.device.conditioning)
        return stated

    @property
    def stimulus(self) -> StimulusWords:
        """The words for the conditioning stimulus."""
        return STIMULI[self.conditioning]

    @property
    def detection_limit_mv(self) -> float | None:
        """The amplitude that 0 is known to be below [mV]: as the device or the strategy's settings state it."""
        stated = self.strategy.settings.get("detection_limit_mv")
        return self.device.detection_limit_mv if stated is None else float(stated)


class ThresholdHeader(_Header):
    """The header of a search for a motor threshold: every pulse is TMS alone, at an intensity of a range."""

    kind: Literal["threshold"] = "threshold"
    search: StrategyRecipe
    muscle: str = ""
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
        | Annotated[Header, Tag("imported")]
        | Annotated[Header, Tag("intervention")]
        | Annotated[ThresholdHeader, Tag("threshold")]
        | Annotated[ProductionHeader, Tag("production")],
        Discriminator(kind_tag),
    ]
)
"""The converter of headers into JSON and back, by their kind."""

_SPACE: Final[TypeAdapter[DesignSpace]] = TypeAdapter(Annotated[DesignSpace, BeforeValidator(with_reference)])

_STAND_INS: Final[Mapping[str, Callable[[Mapping[str, Any]], object]]] = {
    "isiw_version": lambda _: "not known",
    "created": lambda _: "at an unknown time",
    "seed": lambda _: 0,
    "strategy": lambda values: {"name": _name(values.get("strategy")), "seed": 0},
    "limits": lambda values: Limits.of_space(_SPACE.validate_python(values.get("space"))),
    "device": lambda values: DeviceInfo(
        "not known",
        "impact" if kind_tag(values) == "threshold" else _SPACE.validate_python(values.get("space")).reference,
    ),
    "signals": lambda _: SignalLimits(),
}
"""Stand-ins for parts that cannot be read and have no default; without any other such part there is no header."""


def header_in_parts(values: Any) -> tuple[AnyHeader, dict[str, str]]:
    """A header, and why parts of it cannot be read; something neutral stands in for each of these."""
    unread: dict[str, str] = {}
    while True:
        try:
            return ANY_HEADER.validate_python(values), unread
        except ValidationError as error:
            _, part, *_ = (*map(str, error.errors()[0]["loc"]), "", "")  # the first is the header's kind
            field = Header.model_fields.get(part)
            has_default = field is not None and not field.is_required() and part not in {"kind", "schema_version"}
            if part in unread or not (has_default or part in _STAND_INS):
                raise
            unread[part] = first_fault(error)
            stand_in = {} if has_default else {part: _STAND_INS[part](values)}
            values = {key: value for key, value in values.items() if key != part} | stand_in


def _name(strategy: Any) -> str:
    name = strategy.get("name") if isinstance(strategy, Mapping) else None
    return name if isinstance(name, str) else "not known"


_KIND_TAGS: Final = ("session", "imported", "intervention", "threshold", "production")


def first_fault(error: ValueError) -> str:
    """The first fault of a record, without what pydantic says of where to read more."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        where = first["loc"][first["loc"][:1] in {(kind,) for kind in _KIND_TAGS} :]  # without the kind
        return f"{'.'.join(map(str, where))}: {first['msg']}"
    return str(error)
