"""The sections of a configuration file; a slip of unit is refused where somebody states it, and not in a log."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from isiw.checks import Code, Flag, choice, fields_of, patience, whole
from isiw.design import DesignSpace, range_of
from isiw.devices.robot.mechanism import LINE_DELAY_MS, EventTime, Geometry, SensorNoise
from isiw.devices.robot.tapper import Tapper, TapperSettings, preset
from isiw.devices.robot.vane.rotation import Vane
from isiw.devices.robot.vane.tapper import WAIT_MS, RotatingTapper
from isiw.errors import ConfigError
from isiw.findings import UnitScale
from isiw.intervention import Intervention, Plan
from isiw.strategy.catalogue import list_strategies, settings_for
from isiw.strategy.threshold.curve import NamedPulses
from isiw.subjects.after_effects import AFTER_EFFECTS, after_effect_of
from isiw.subjects.cohorts import COHORTS, person_of
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.text.toml_files import checked
from isiw.visit import Visit

STOP_WIDTH_MS: Final = UnitScale(1.0, too_small=("s", 1000))
"""No interval of an edge is as narrow as the least; a width of 0.005 and less is meant to stop nothing."""

STOPS_NOTHING_MS: Final = 0.005
"""A smaller width to stop at is there to stop nothing."""


def require_units(values: Mapping[str, Any]) -> None:
    """Check that no width to stop at looks as if it were in another unit than its key says."""
    value = _given(values, "strategy", "settings", "stop_width_ms")
    slip = None if value is None or value < STOPS_NOTHING_MS else STOP_WIDTH_MS.slip(value)
    if slip is not None:
        raise ConfigError(
            "strategy.settings.stop_width_ms is probably in another unit",
            got=value,
            expected=f"at least {STOP_WIDTH_MS.least:g}",
            remedy=f"{slip} If no width is to end the session, write 0.001.",
        )


def _given(values: Any, *keys: str) -> float | None:
    """The number that was given under some keys; None if there is none."""
    for key in keys:
        values = values.get(key) if isinstance(values, Mapping) else None
    return values if isinstance(values, int | float) else None


TIMEOUT_S = 30.0
"""The longest time of one delivery [s], if the file does not say."""


_TOGETHER = (
    ("protocol", "rest_s", "block_trials"),
    ("limits", "rest_s", "max_block_pulses"),
    ("limits", "period_s", "max_period_pulses"),
)
"""Sections, and keys that mean something only together: how long, and after or with how many."""


class Section(BaseModel):
    """A section of a configuration file; it has no other keys than these."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class SimulatedConfig(BaseModel):
    """Who is simulated, in names and numbers; other keys are ignored, as a log of another version may have them."""

    model_config = ConfigDict(frozen=True)

    kind: Literal["simulated", "recorded"] = "simulated"
    cohort: Annotated[str, AfterValidator(lambda name: choice("the cohort", name, COHORTS))] = "recruitment"
    number: int = Field(default=0, ge=0, lt=10_000, strict=True)
    after_effect: Annotated[str, AfterValidator(lambda name: choice("the after-effect", name, AFTER_EFFECTS))] = "none"

    def person(self, seed: int, pct_rmt: float | None = None) -> SimulatedSubject:
        """The simulated person, stimulated at the intensity that the visit states, off by as much as a cohort's is."""
        person = after_effect_of(person_of(self.cohort, self.number, seed), self.after_effect, seed, self.number)
        response, usual_pct_rmt = person.response, person.stated_intensity_pct_rmt
        if pct_rmt is None or usual_pct_rmt is None or not isinstance(response, RecruitmentResponse):
            return person
        off_pct_rmt = response.intensity_pct_rmt - usual_pct_rmt
        return replace(person, response=replace(response, intensity_pct_rmt=pct_rmt + off_pct_rmt))


class SubjectConfig(SimulatedConfig):
    """Who is stimulated: a simulated person, whose MEPs may be put into recorded EMG.

    Args:
        kind: `"simulated"`, or `"recorded"` for simulated MEPs in recorded EMG.
        cohort: one of `isiw.subjects.COHORTS`.
        number: which person of the cohort, from 0.
        after_effect: what pairs leave behind, one of `isiw.subjects.AFTER_EFFECTS`; the person's time stands still
            between stimuli, so that none of it is lost.
        data: the folder with the recorded EMG.
    """

    model_config = ConfigDict(extra="forbid")

    data: Path | None = None


_RANGE: Final = ("low_ms", "high_ms", "step_ms")


def _listed(space: object) -> object:
    """A design space as a file or a request states it, with the range of its list."""
    if not isinstance(space, Mapping) or not isinstance(isis_ms := space.get("isis_ms"), list) or not isis_ms:
        return space
    if given := [key for key in _RANGE if key in space]:
        raise ConfigError(
            "a list of ISIs and a range exclude each other",
            got=f"isis_ms and {', '.join(given)}",
            remedy="Give either isis_ms, or low_ms, high_ms and step_ms.",
        )
    return {**space, **range_of(isis_ms)}


Space: TypeAlias = Annotated[DesignSpace, BeforeValidator(_listed)]
"""The design space: a range with a step, or a list of ISIs."""


class StrategyConfig(Section):
    """The strategy.

    Args:
        name: one of `isiw.list_strategies()`.
        settings: its settings by key, as `isiw.list_settings` has them. Where no device of isiw's states an electrical
            pulse in the place of the tap, as over HTTP and in `isiw analyse`, `conditioning = "electrical"` does.
    """

    name: Annotated[str, AfterValidator(lambda name: choice("the strategy", name, list_strategies()))] = "default"
    settings: dict[str, Any] = Field(default_factory=dict)

    @field_validator("settings")
    @classmethod
    def _possible(cls, settings: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        if "name" in info.data:
            settings_for(info.data["name"], **settings)
        return settings


@dataclass(frozen=True)
class PlannedIntervention(Plan):
    """An intervention, which uses the window that a search has found.

    Args:
        changes_the_person: the statement that the intervention is meant to change the person; without it there is none.
        seed: draws the arm of each person, by the person's code, for whoever keeps the list of a study; without it
            nobody can draw it again.
    """

    changes_the_person: Flag = False
    seed: Annotated[int, whole] | None = None

    def plan(self) -> Plan:
        """The plan alone, as a log has it."""
        return Plan(**fields_of(Plan, self))

    def drawn(self, subject: str) -> Intervention:
        """The plan with the arm that is drawn for a person; raise where nobody has stated what it is."""
        if not self.changes_the_person:
            raise ConfigError(
                "the configuration does not state that the intervention is meant to change the person",
                expected="changes_the_person = true under [intervention]",
                remedy="Write it if your ethics approval is for such an intervention.",
            )
        return Intervention.drawn(self.plan(), subject, self.seed)


class RobotConfig(BaseModel):
    """A simulated robot of isiw's own, in names and numbers; other keys are ignored, as in `SimulatedConfig`."""

    model_config = ConfigDict(frozen=True)

    kind: Literal["tapper", "rotating-tapper"]
    settings: dict[str, Any] = Field(default_factory=dict)


class DeviceConfig(Section):
    """A lab's own rig by the factory that makes it, which no log names, or a simulated robot by its kind.

    Args:
        factory: the function that makes the device, as `module:function`.
        kind: a simulated robot, `tapper` or `rotating-tapper`.
        settings: keyword arguments of the factory, or settings of the robot.
        folder: where the factory's module is; by default beside the configuration.
        timeout_s: the longest time that one delivery may take [s].
    """

    factory: str | None = None
    kind: Literal["tapper", "rotating-tapper"] | None = None
    settings: dict[str, Any] = Field(default_factory=dict)
    folder: Path | None = None
    timeout_s: Annotated[float, BeforeValidator(partial(patience, "the time-out"))] = TIMEOUT_S

    @model_validator(mode="after")
    def _either(self) -> Self:
        if (self.factory is None) == (self.kind is None):
            raise ConfigError(
                "a device has either a factory, which makes your own, or the kind of a simulated robot",
                got={"factory": self.factory, "kind": self.kind},
                expected='such as factory = "rig:make", or kind = "tapper"',
            )
        return self

    @property
    def robot(self) -> RobotConfig | None:
        """The simulated robot; None if the rig is the lab's own."""
        return None if self.kind is None else RobotConfig(kind=self.kind, settings=self.settings)

    @field_validator("factory")
    @classmethod
    def _named(cls, factory: str | None) -> str | None:
        if factory is not None and not re.fullmatch(r"[\w.]+:\w+", factory):
            raise ConfigError(
                "a factory is named by its module and its function",
                got=factory,
                expected="module:function, such as rig:make",
            )
        return factory


@dataclass(frozen=True)
class PersonsVisit(Visit):
    """Who is examined, and what is noted about it.

    Args:
        subject: the person's code, never a name.
    """

    subject: Code = ""

    def noted(self) -> Visit:
        """The notes alone, as a log has them."""
        return Visit(**fields_of(Visit, self))


@dataclass(frozen=True)
class PlannedVisit(PersonsVisit):
    """Who is examined, what is noted about it, and what comes before the pairs.

    Args:
        curve: pulses over the recruitment curve, which `isiw threshold` gives before the session: `at_pct_mso`, the
            intensities, and `each`, how many at each of them. A session without their log in `after` is refused.
    """

    curve: NamedPulses | None = None


def require_together(values: Mapping[str, Any]) -> None:
    """Check that no half of a limit is set, which would limit nothing."""
    for section, key, other in _TOGETHER:
        table = values.get(section)
        if isinstance(table, Mapping) and key in table and table.get(other) is None:
            raise ConfigError(
                f"{section}.{key} does nothing without {section}.{other}",
                got=table[key],
                expected="both of them, or neither",
                remedy=f"Set {section}.{other}, or remove {section}.{key}.",
            )


_DESCENT_MS: Final = 55.0
"""From the start of the descent to the impact, in an average person."""

_REST_UV_PER_FLOOR_MV: Final = 160.0
"""EMG at rest [µV RMS] by the EMG floor: in 20 ms it spans 4.8 times its RMS, and is to be below nearly every trial's
floor, of which it is a part."""


@dataclass(frozen=True)
class _TapperKeys(TapperSettings):
    """The settings of a robot whose geometry is a preset's, or the person's own."""

    geometry: str | None = None


@dataclass(frozen=True)
class _RotatingTapperKeys(_TapperKeys):
    """The settings of a robot with the vane actuator."""

    wait_ms: float = WAIT_MS
    vane: Vane = field(default_factory=Vane)


def robot_for(
    robot: RobotConfig, seed: int, simulated: SimulatedConfig, space: DesignSpace, pct_rmt: float | None = None
) -> Tapper | RotatingTapper:
    """The robot that taps a simulated person."""
    person, geometry = person_under(robot, simulated, seed, pct_rmt)
    hit_ms, sd_ms = person.stated_hit_delay_ms
    values = {"reference": space.reference, "expected_hit_ms": hit_ms, "expected_hit_sd_ms": sd_ms} | robot.settings
    kind = _RotatingTapperKeys if robot.kind == "rotating-tapper" else _TapperKeys
    settings, answers = checked(kind, values, "device.settings"), person.begin(seed)
    tapper = Tapper(lambda isi_ms: answers.respond(isi_ms, "impact"), geometry, settings, seed=seed)
    tapper.require_possible(space.low_ms)
    if not isinstance(settings, _RotatingTapperKeys):
        return tapper
    return RotatingTapper(tapper, settings.vane, wait_ms=settings.wait_ms, seed=seed)


def person_under(
    robot: RobotConfig, simulated: SimulatedConfig, seed: int, pct_rmt: float | None = None
) -> tuple[SimulatedSubject, Geometry]:
    """The person and the wrist under the robot, which has the person's hit delay; that varies by the robot alone."""
    person = simulated.person(seed, pct_rmt)
    if simulated.kind != "simulated" or person.conditioning != "tap":
        raise ConfigError(
            "the tapping robot records its own EMG, of people who are tapped",
            got=f"subject.kind {simulated.kind}, a person conditioned by {person.conditioning}",
            expected="subject.kind simulated, and a cohort that is tapped",
        )
    name = robot.settings.get("geometry")
    geometry = own_wrist(person) if name is None else preset(name)
    return replace(person, hit_delay_ms=geometry.hit.mean_ms, hit_delay_sd_ms=0.0), geometry


def own_wrist(person: SimulatedSubject) -> Geometry:
    """A wrist with a person's own hit delay and EMG at rest."""
    hit_ms, sd_ms = person.hit_delay_ms, person.hit_delay_sd_ms
    if hit_ms - _DESCENT_MS <= LINE_DELAY_MS:
        raise ConfigError(
            "the tapping robot cannot hit so early",
            got=f"a person with a hit delay of {hit_ms:.0f} ms",
            remedy='Name a wrist, such as geometry = "subject1" under [device.settings], or choose another cohort.',
        )
    descent, hit = EventTime(hit_ms - _DESCENT_MS, sd_ms), EventTime(hit_ms, sd_ms)
    noise = SensorNoise(emg_uv=_REST_UV_PER_FLOOR_MV * person.response.floor.median_mv)
    return Geometry(descent, hit, EventTime(15.0, 0.5), EventTime(20.0, 1.0), noise=noise)
