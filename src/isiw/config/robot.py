"""The simulated robots that a configuration or a log names by kind, and the simulated person under them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from isiw.config.sections import RobotConfig, SimulatedConfig
from isiw.design import DesignSpace
from isiw.devices.robot.mechanism import LINE_DELAY_MS, Event, Geometry, SensorNoise
from isiw.devices.robot.tapper import Tapper, TapperSettings, preset
from isiw.devices.robot.vane.actuator import Vane
from isiw.devices.robot.vane.tapper import WAIT_MS, RotatingTapper
from isiw.errors import ConfigError
from isiw.subjects.cohorts import person_of
from isiw.subjects.subject import SimulatedSubject
from isiw.text.toml_files import checked

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


def robot_for(robot: RobotConfig, seed: int, simulated: SimulatedConfig, space: DesignSpace) -> Tapper | RotatingTapper:
    """The robot that taps a simulated person."""
    person, geometry = _under(robot, simulated, seed)
    hit_ms, sd_ms = person.stated_hit_delay_ms
    values = {"reference": space.reference, "expected_hit_ms": hit_ms, "expected_hit_sd_ms": sd_ms} | robot.settings
    kind = _RotatingTapperKeys if robot.kind == "rotating-tapper" else _TapperKeys
    settings, answers = checked(kind, values, "device.settings"), person.begin(seed)
    tapper = Tapper(lambda isi_ms: answers.respond(isi_ms, "impact"), geometry, settings, seed=seed)
    tapper.require_possible(space.low_ms)
    if not isinstance(settings, _RotatingTapperKeys):
        return tapper
    return RotatingTapper(tapper, settings.vane, wait_ms=settings.wait_ms, seed=seed)


def person_under(robot: RobotConfig, simulated: SimulatedConfig, seed: int) -> SimulatedSubject:
    """The person, whose hit delay is that of the wrist under the robot, and varies by the robot alone."""
    return _under(robot, simulated, seed)[0]


def _under(robot: RobotConfig, simulated: SimulatedConfig, seed: int) -> tuple[SimulatedSubject, Geometry]:
    person = person_of(simulated.cohort, simulated.number, seed)
    if simulated.kind != "simulated" or person.conditioning != "tap":
        raise ConfigError(
            "the tapping robot records its own EMG, of people who are tapped",
            got=f"subject.kind {simulated.kind}, a person conditioned by {person.conditioning}",
            expected="subject.kind simulated, and a cohort that is tapped",
        )
    name = robot.settings.get("geometry")
    geometry = _own_wrist(person) if name is None else preset(name)
    return replace(person, hit_delay_ms=geometry.hit.mean_ms, hit_delay_sd_ms=0.0), geometry


def _own_wrist(person: SimulatedSubject) -> Geometry:
    """A wrist with a person's own hit delay and EMG at rest."""
    hit_ms, sd_ms = person.hit_delay_ms, person.hit_delay_sd_ms
    if hit_ms - _DESCENT_MS <= LINE_DELAY_MS:
        raise ConfigError(
            "the tapping robot cannot hit so early",
            got=f"a person with a hit delay of {hit_ms:.0f} ms",
            remedy='Name a wrist, such as geometry = "subject1" under [device.settings], or choose another cohort.',
        )
    events = Event(hit_ms - _DESCENT_MS, sd_ms), Event(hit_ms, sd_ms), Event(15.0, 0.5), Event(20.0, 1.0)
    return Geometry(*events, noise=SensorNoise(emg_uv=_REST_UV_PER_FLOOR_MV * person.response.floor.median_mv))
