"""Whom a logged session simulated: names and numbers. Nothing that a log names is imported or opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from isiw.config.robot import person_under
from isiw.config.sections import RobotConfig, SimulatedConfig
from isiw.config.session import simulated_device
from isiw.devices.simulated import SimulatedDevice
from isiw.errors import ConfigError, InvalidValueError
from isiw.log.headers import RUN_KEY
from isiw.log.kinds import continued_by, require_session
from isiw.log.reader import SessionRecord
from isiw.subjects.cohorts import person_of
from isiw.text.toml_files import checked
from isiw.window import Window


class _LoggedRun(BaseModel):
    """What is read of a log's run section; everything else in it is for people."""

    model_config = ConfigDict(frozen=True)

    seed: int = Field(default=0, ge=0)
    subject: SimulatedConfig = SimulatedConfig()
    device: RobotConfig | None = None


@dataclass(frozen=True)
class Truth:
    """The true window of the person whom `isiw run` simulated.

    Args:
        known: whether somebody was simulated whose window is known.
        window: the window; None where there is none.
        lacking: why it is not known, though the log says that somebody was simulated; else empty.
    """

    known: bool = False
    window: Window | None = None
    lacking: str = ""


def run_of_log(record: SessionRecord) -> _LoggedRun:
    """Seed, simulated person and robot of a session of `isiw run`.

    Raises:
        ConfigError: it was run with a device of the lab's own or by other software, or the person is not known here.
    """
    require_session(record.path, record.header)
    run = record.header.config.get(RUN_KEY)
    device = run.get("device", {}) if isinstance(run, Mapping) else {}
    if run is None or (device != {} and not (isinstance(device, Mapping) and "kind" in device)):
        raise ConfigError(
            "the session's device is not known here",
            got=record.header.device.name,
            remedy=f"Continue it where it was run: {continued_by(record.path, record.header)}",
        )
    return checked(_LoggedRun, run, f"the run section of {record.path}")


def truth_of(record: SessionRecord) -> Truth:
    """What a log says of the true window of a simulated person."""
    if RUN_KEY not in record.header.config:
        return Truth()
    try:
        run = run_of_log(record)
        if run.device is not None:
            person = person_under(run.device, run.subject, run.seed)
        else:
            person = person_of(run.subject.cohort, run.subject.number, run.seed)
    except (ConfigError, InvalidValueError) as error:
        return Truth(lacking=f"The true window of the simulated person is not known: {error}")
    return Truth(known=True, window=person.window(record.header.space))


def device_of_log(record: SessionRecord, data: Path | None = None) -> SimulatedDevice:
    """The simulated person of a log, as a device.

    Args:
        record: the session.
        data: the folder with the recorded EMG, where MEPs were put into one.

    Raises:
        ConfigError: as for `run_of_log`, or recorded EMG without its folder.
        DeviceError: no recordings in the folder.
    """
    run = run_of_log(record)
    return simulated_device(run.seed, run.subject, record.header.space, data, run.device)
