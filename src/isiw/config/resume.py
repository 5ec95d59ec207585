"""Continuing a logged session with a configuration: nothing that a log names is imported or opened."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from isiw.config.run import RunConfig
from isiw.config.sections import RobotConfig, SimulatedConfig, person_under
from isiw.config.session import learns_from_earlier, simulated_device
from isiw.devices.limits import USUAL_ITI_S
from isiw.devices.simulated import SimulatedDevice
from isiw.errors import ConfigError, InvalidValueError, IsiwError, LimitExceededError, LogError
from isiw.log.continuing import continued_by, require_session
from isiw.log.headers import RUN_KEY, Header
from isiw.log.record import SessionRecord, read_session
from isiw.session.loop import Session
from isiw.session.resuming import limits_of_log
from isiw.strategy.catalogue import make_strategy
from isiw.text.sanitize import command
from isiw.text.toml_files import checked
from isiw.window import Window


class _LoggedRun(BaseModel):
    """The part of a log's run section that is read; everything else in it is for people."""

    model_config = ConfigDict(frozen=True)

    seed: int = Field(default=0, ge=0)
    subject: SimulatedConfig = SimulatedConfig()
    device: RobotConfig | None = None


@dataclass(frozen=True)
class Truth:
    """The true window of the person whom `isiw run` simulated, or why it is not known though one was simulated."""

    known: bool = False
    window: Window | None = None
    lacking: str = ""


def run_of_log(record: SessionRecord) -> _LoggedRun:
    """Seed, simulated person and robot of a session of `isiw run`; raise if nobody known here was simulated."""
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
    """The true window of a simulated person, from a log."""
    if RUN_KEY not in record.header.config:
        return Truth()
    try:
        run = run_of_log(record)
        if run.device is not None:
            person, _ = person_under(run.device, run.subject, run.seed, record.header.visit.intensity_pct_rmt)
        else:
            person = run.subject.person(run.seed, record.header.visit.intensity_pct_rmt)
    except (ConfigError, InvalidValueError) as error:
        return Truth(lacking=f"The true window of the simulated person is not known: {error}")
    return Truth(known=True, window=person.window(record.header.space))


def device_of_log(record: SessionRecord, data: Path | None = None) -> SimulatedDevice:
    """The simulated person of a log, as a device; MEPs are put into the recorded EMG of a folder if they were."""
    run = run_of_log(record)
    return simulated_device(run.seed, run.subject, record.header.space, record.header.visit, data, run.device)


def read_to_resume(log: Path, config: Path | None) -> SessionRecord:
    """The session to continue; raise if its log and the configuration are swapped."""
    try:
        return read_session(log)
    except LogError as error:
        if config is None:
            raise
        try:
            read_session(config)
        except LogError:
            raise error from None
        raise ConfigError(
            "the log and the configuration are swapped",
            got=f"{log} {config}",
            expected="the log first",
            remedy=f"Type: {command('resume', config, log)}",
        ) from error


def changes_on_resume(config: RunConfig, record: SessionRecord) -> dict[str, Any]:
    """Arguments of `isiw.resume` that a file changes: each of `[limits]` and `[signals]` counts as a whole."""
    record.require_read()
    header, given = record.header, config.model_fields_set
    _require_space(config, header)
    _require_same_simulated(config, record)
    changes: dict[str, Any] = {}
    if "limits" in given:
        said = dict(vars(config.limits.stated(USUAL_ITI_S)))
        if said["intensity_pct_mso"] is None:
            said["intensity_pct_mso"] = header.limits.intensity_pct_mso
        changes["limits"] = dataclasses.replace(header.limits, **said)
    if "signals" in given:
        changes["signals"] = config.signals
    if config.device is not None and "timeout_s" in config.device.model_fields_set:
        changes["timeout_s"] = config.timeout_s
    return changes


def differences_on_resume(config: RunConfig, record: SessionRecord) -> tuple[str, ...]:
    """The differences of the file from the log, in words; only limits, signals and time-out hold from here on."""
    header, changes = record.header, changes_on_resume(config, record)
    changed = [
        *_differing("limits", header.limits, changes.get("limits", limits_of_log(header))),
        *_differing("signals", header.signals, changes.get("signals", header.signals)),
        ("device.timeout_s", header.timeout_s, changes.get("timeout_s", header.timeout_s)),
    ]
    return (
        *(f"{key} is {_said(now)} from here on; it was {_said(was)}." for key, was, now in changed if was != now),
        *(
            f"{key} stays as the session began, {_said(was)}; the configuration says {_said(now)}."
            for key, was, now in _unchangeable(config, header)
            if was != now
        ),
    )


def _require_space(config: RunConfig, header: Header) -> None:
    if not config.space_named or config.space == header.space:
        return
    differing = [(key, was, now) for key, was, now in _differing("space", header.space, config.space) if was != now]
    raise ConfigError(
        "a session continues in the design space that it began with",
        got=", ".join(f"{key} = {now}" for key, _, now in differing),
        expected=", ".join(f"{key} = {was}" for key, was, _ in differing),
        remedy="Correct [space], or start a new session with isiw run.",
    )


def _require_same_simulated(config: RunConfig, record: SessionRecord) -> None:
    """Raise if another person is simulated; whom the log does not make out, nobody can compare."""
    try:
        was = run_of_log(record)
    except ConfigError:
        return
    now = SimulatedConfig(**config.subject.model_dump(exclude={"data"}))
    seed = config.seed if "seed" in config.model_fields_set else was.seed  # isiw run may have had it as --seed
    if (was.seed, was.subject, was.device) != (seed, now, config.robot):
        raise ConfigError(
            "the configuration simulates another person, or another robot",
            got=f"seed {seed}, {config.subject}, {config.robot or 'no robot'}",
            expected=f"seed {was.seed}, {was.subject}, {was.device or 'no robot'}",
            remedy="Leave the configuration out; the simulated person's settings are in the log: "
            f"{continued_by(record.path, record.header)}",
        )


def _differing(name: str, before: Any, after: Any) -> Iterator[tuple[str, object, object]]:
    for field in dataclasses.fields(before):
        yield f"{name}.{field.name}", getattr(before, field.name), getattr(after, field.name)


def _unchangeable(config: RunConfig, header: Header) -> Iterator[tuple[str, object, object]]:
    given = config.model_fields_set
    if "strategy" in given:
        yield "strategy.name", header.strategy.name, config.strategy.name
        if config.strategy.name == header.strategy.name:
            strategy = make_strategy(config.strategy.name, header.space, **config.strategy.settings)
            for key in config.strategy.settings:
                now = strategy.recipe.settings.get(key)
                yield f"strategy.settings.{key}", header.strategy.settings.get(key, now), now
    if header.intervention is not None and config.intervention is not None:
        yield from _differing("intervention", header.intervention.plan, config.intervention.plan())
    elif "protocol" in given:
        yield from _differing("protocol", header.protocol, config.protocol)
    for key, was, now in _differing("visit", header.visit, config.visit):
        if now not in (None, ""):
            yield key, was, now


def _said(value: object) -> object:
    if isinstance(value, dict):
        return "another one"
    return "not set" if value in (None, "") else value


def after_error(session: Session, config: Path | None, error: BaseException | None, *, delivered: bool) -> list[str]:
    """The lines that say how to continue after an error; the command comes last."""
    decision = None
    with suppress(IsiwError):
        decision = read_session(session.log_path).decision
    if decision is not None and decision.stop:  # so that nothing is missing in the log
        seen = command("show", session.log_path)
        return [f"The session is over, and its log is complete. See what was found with: {seen}"]
    limited = config is not None and isinstance(error, LimitExceededError)
    about = session.fault.about_the_trial if session.fault is not None else ""
    safe = "The session ended early. Its log is safe" if delivered else "No stimulus was delivered. The log is kept"
    way_on = f"{safe}; resume with: {continued_by(session.log_path, session.header, config, changed=limited)}"
    limits = f"The limits are under [limits] in {config}; they are read again when the session is resumed."
    return [*([about] if about else []), *([limits, way_on] if limited else [way_on])]


def after_end(session: Session, config: Path | None, *, delivered: bool) -> str | None:
    """The way to deliver more to the same person after a session is over; None if nobody has asked for that."""
    header = session.header
    if header.intervention is not None:
        return None
    if not session.strategy.decision().stop:  # so that it was the limits
        where = f"in {config}" if config is not None else "of a configuration"
        way_on = continued_by(session.log_path, header, config, changed=True)
        return f"For more pulses set a higher max_pulses under [limits] {where}, then resume with: {way_on}"
    if delivered:
        return None
    same = "" if config else ", with the same configuration if there was one"
    seed = ["--seed", header.seed] if RUN_KEY in header.config else []
    after = ["--after", session.log_path] if learns_from_earlier(header.strategy.name) else []
    more = command("run", *([config] if config else []), *seed, *after)
    new = f"For more trials with this person begin a new session{same}: {more}"
    return f"The session is over, so no stimulus was delivered. {new}"
