"""Configuration files: read, checked, and turned into a session.

Every key may be left out. Example:

    seed = 7
    [subject]
    kind = "recorded"
    data = "recordings/uef"
    [strategy]
    settings = { max_trials = 40 }
"""

from __future__ import annotations

import dataclasses
import datetime as dt
import itertools
import shlex
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from isiw.config.rig import device_from_factory
from isiw.config.sections import (
    TIMEOUT_S,
    DeviceConfig,
    LimitsConfig,
    Section,
    SpaceConfig,
    StrategyConfig,
    SubjectConfig,
    VisitConfig,
    require_together,
)
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device, DeviceInfo
from isiw.devices.recorded import RecordedPerson, load_recordings
from isiw.devices.simulated import SimulatedDevice, SimulatedPerson
from isiw.errors import ConfigError, StrategyError
from isiw.log.reader import SessionRecord, read_session
from isiw.log.schema import RUN_KEY
from isiw.models.particles.prior import Prior
from isiw.priors import after, read_lab_prior
from isiw.session.loop import Session
from isiw.session.updates import SessionUpdate
from isiw.signals.judgement import SignalLimits
from isiw.strategy.catalogue import known_settings, make_strategy, settings_for
from isiw.subjects.cohorts import person_of
from isiw.subjects.subject import SimulatedSubject
from isiw.text.toml_files import checked, read_toml
from isiw.visit import VisitProtocol
from isiw.window import Window

__all__ = [
    "RunConfig",
    "config_of_log",
    "device_for",
    "fresh_log_path",
    "has_truth",
    "limits_for",
    "load_config",
    "require_same_person",
    "session_for",
    "subject_for",
    "true_window",
]

SESSIONS = Path("isiw-sessions")
"""The folder for logs of sessions without a path."""

LEAST_PCT = 3.0
"""Nobody stimulates with so low an intensity; 1.2 is meant as 120 %."""


class RunConfig(Section):
    """The whole configuration of `isiw run`; with a device, nobody is simulated."""

    seed: int = Field(default=0, ge=0)
    log: Path | None = None
    prior: Path | None = None
    after: tuple[Path, ...] = ()
    device: DeviceConfig | None = None
    visit: VisitConfig = VisitConfig()
    subject: SubjectConfig = SubjectConfig()
    space: SpaceConfig = SpaceConfig()
    strategy: StrategyConfig = StrategyConfig()
    limits: LimitsConfig = LimitsConfig()
    protocol: VisitProtocol = VisitProtocol()
    signals: SignalLimits = SignalLimits()

    @model_validator(mode="after")
    def _one_person(self) -> Self:
        if self.device is not None and "subject" in self.model_fields_set:
            raise ConfigError(
                "device and subject exclude each other",
                expected="a device of your own, or a simulated subject",
                remedy="To stimulate, remove [subject] and leave out --subject and --data; the person's code is "
                "visit.subject. To simulate, remove [device].",
            )
        return self

    @property
    def timeout_s(self) -> float:
        """How long the device may take for one delivery [s]."""
        return self.device.timeout_s if self.device else TIMEOUT_S

    def with_overrides(  # noqa: PLR0913 - an option of the command line each, all keyword-only
        self,
        *,
        seed: int | None = None,
        log: Path | None = None,
        subject: str | None = None,
        data: Path | None = None,
        strategy: str | None = None,
        prior: Path | None = None,
        after: Sequence[Path] | None = None,
        day: int | None = None,
        operator: str | None = None,
    ) -> RunConfig:
        """The same, with what was given on the command line; another strategy keeps the settings that were given.

        Args:
            seed: of the person, the trials and the strategy.
            log: where to log.
            subject: `"simulated"` or `"recorded"`.
            data: the folder with the recorded EMG.
            strategy: one of `list_strategies()`.
            prior: a lab's prior.
            after: logs of earlier sessions of the same person, the first one first.
            day: the number of the person's visit, from 1.
            operator: who runs the session.
        """
        values = self.model_dump(exclude_unset=True)  # what nobody set is not known to be wanted
        values |= _given(seed=seed, log=log, prior=prior, after=after or None)
        sections = {
            "subject": _given(kind=subject, data=data),
            "visit": _given(day=day, operator=operator),
            "strategy": _given(name=strategy),
        }
        for name, given in sections.items():
            if given:
                values[name] = values.get(name, {}) | given
        return _validated(values, "the command line")


def _given(**values: object) -> dict[str, object]:
    return {key: value for key, value in values.items() if value is not None}


def load_config(path: str | Path | None = None) -> RunConfig:
    """Read a configuration file; without one, the defaults.

    Args:
        path: a TOML file.

    Raises:
        ConfigError: it cannot be read, or has an unknown key or a bad value; the message names file, key and value.
        InvalidValueError: a rest or a period that limits nothing.
    """
    if path is None:
        return _validated({}, "the defaults")
    values = read_toml(path)
    if isinstance(values.get("device"), dict):  # a module of the user's own usually lies beside the file
        values["device"] = {"folder": Path(path).resolve().parent} | values["device"]
    config = _validated(values, str(path))
    _require_percent(config.visit)
    require_together(values)
    limits_for(config).require_effect()
    config.protocol.require_effect(config.limits.min_iti_s)
    return config


def _require_percent(visit: VisitConfig) -> None:
    for name in ("intensity_pct_rmt", "intensity_pct_mso"):
        intensity_pct = getattr(visit, name)
        if intensity_pct is not None and intensity_pct < LEAST_PCT:
            raise ConfigError(
                f"visit.{name} is in %, and this is probably a ratio",
                got=intensity_pct,
                expected=f"at least {LEAST_PCT:g}",
                remedy="Multiply it by 100: 90 for 90 %.",
            )


def _validated(values: Mapping[str, Any], source: str) -> RunConfig:
    return checked(RunConfig, values, source)


def config_of_log(record: SessionRecord) -> RunConfig:
    """The configuration that a logged session was run with.

    Raises:
        ConfigError: it was run by other software than `isiw run`.
    """
    if RUN_KEY not in record.header.config:
        raise ConfigError(
            "the session was not run by isiw run with a simulated person, so its device is not known here",
            got=record.header.device.name,
            remedy=f"With a configuration that has a device: isiw resume {shlex.quote(str(record.path))} CONFIG. From "
            "other software: isiw.resume(path, device).run(), or for a loop of your own "
            "isiw.open_session(strategy, path, resume=True).",
        )
    return _validated(record.header.config[RUN_KEY], str(record.path))


def fresh_log_path(config: RunConfig) -> Path:
    """A path in the default folder at which there is no log yet."""
    stem = f"{dt.datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}_seed{config.seed}"
    names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
    paths = (SESSIONS / f"{name}.mcap" for name in names)
    return next(path for path in paths if not path.exists() and not path.with_name(f"{path.name}.part").exists())


def subject_for(config: RunConfig) -> SimulatedSubject:
    """The simulated person."""
    return person_of(config.subject.cohort, config.subject.number, config.seed)


def true_window(record: SessionRecord) -> Window | None:
    """The true window of the person whom `isiw run` simulated; None where it, or such a person, does not exist."""
    return subject_for(config_of_log(record)).window(record.header.space) if has_truth(record) else None


def has_truth(record: SessionRecord) -> bool:
    """Whether the session is of a person whom `isiw run` simulated."""
    return RUN_KEY in record.header.config


def device_for(config: RunConfig) -> Device:
    """The device: the user's own, or a simulated person, in recorded EMG where asked for.

    Raises:
        ConfigError: recorded EMG without its folder, or a factory that makes no device.
        DeviceError: no recordings in the folder.
    """
    if config.device is not None:
        return device_from_factory(config.device.factory, config.device.settings, config.device.folder)
    reference = config.space.reference
    subject = subject_for(config)
    respond = partial(subject.begin(config.seed).respond, reference=reference)
    hit_delay_ms = subject.stated_hit_delay_ms if reference == "valve" else None
    if config.subject.kind == "simulated":
        person = SimulatedPerson(respond, reference, hit_delay_ms=hit_delay_ms, conditioning=subject.conditioning)
        return SimulatedDevice(person)
    if config.subject.data is None:
        raise ConfigError(
            "subject.data is missing: recorded EMG is not part of the package",
            expected="the folder with the recordings",
            remedy="Give it with --data DIR.",
        )
    recordings = load_recordings(config.subject.data)
    recorded = RecordedPerson(respond, reference, recordings, config.seed, hit_delay_ms, subject.conditioning)
    return SimulatedDevice(recorded)


def limits_for(config: RunConfig) -> Limits:
    """What may be delivered: the ISIs of the space, within the section on limits."""
    return dataclasses.replace(Limits.of_space(config.space.design()), **config.limits.model_dump())


def session_for(config: RunConfig, on_trial: Callable[[SessionUpdate], None] | None = None) -> Session:
    """The session that a configuration describes, ready to run.

    Args:
        config: the configuration.
        on_trial: called after each trial.

    Raises:
        ConfigError: no recordings, or no prior, where the configuration says, or recordings that would be ignored;
            earlier sessions of another person, muscle or intensity, or simulated ones where the device is real.
        LogError: an earlier session of the person that cannot be read, or has no accepted trial.
        StrategyError: a prior for a strategy that has none of this kind.
    """
    _require_used(config.subject)
    space = config.space.design()
    log = config.log or fresh_log_path(config)
    device = device_for(config)
    info = device.describe()
    known = {"hit_delay_ms": info.hit_delay_ms, "conditioning": info.conditioning}
    settings = known_settings(config.strategy.name, known) | _settings_for(config, info)
    return Session(
        device,
        make_strategy(config.strategy.name, space=space, seed=config.seed, **settings),
        log=log,
        limits=limits_for(config),
        on_trial=on_trial,
        subject=config.visit.subject or ("" if config.device else _code(config)),
        signals=config.signals,
        config={} if config.device else {RUN_KEY: _kept(config)},
        timeout_s=config.timeout_s,
        visit=config.visit.noted(),
        protocol=config.protocol,
    )


def _require_used(subject: SubjectConfig) -> None:
    if subject.data is not None and subject.kind != "recorded":
        raise ConfigError(
            "recordings are for a subject of the kind recorded, and would be ignored",
            got=str(subject.data),
            remedy='Add --subject recorded, or kind = "recorded" under [subject]; or leave the data out.',
        )


def _settings_for(config: RunConfig, device: DeviceInfo) -> dict[str, Any]:
    """The strategy's settings, with what earlier sessions taught as its prior."""
    settings = dict(config.strategy.settings)
    if config.prior is None and not config.after:
        return settings
    if "prior" in settings:
        raise ConfigError(
            "strategy.settings.prior and a prior from earlier sessions exclude each other",
            remedy="Give only one of them.",
        )
    try:
        settings_for(config.strategy.name, prior=Prior())
    except StrategyError as error:  # no prior, or that of another model
        raise StrategyError(
            f"the strategy {config.strategy.name} learns nothing from earlier sessions",
            remedy="Leave out the prior and the earlier sessions, or choose another strategy, such as default.",
        ) from error
    return settings | {"prior": _taught(config, device)}


def _taught(config: RunConfig, device: DeviceInfo) -> Prior:
    """What the lab's people and the person's earlier sessions taught."""
    lab = None if config.prior is None else read_lab_prior(config.prior)
    earlier = [read_session(path) for path in config.after]
    nobodys = [str(record.path) for record in earlier if record.header.device.simulated]
    if lab is not None and lab.simulated:
        nobodys.append(str(config.prior))
    if nobodys and not device.simulated:
        raise ConfigError(
            "what simulated sessions taught says nothing about the person who will be stimulated",
            got=nobodys,
            remedy="Leave it out, or learn from sessions with people.",
        )
    require_same_person(config, earlier)
    _require_like(config, earlier)
    return after(*earlier, prior=None if lab is None else lab.joined())


def require_same_person(config: RunConfig, records: Sequence[SessionRecord]) -> None:
    """Check that sessions are of the person whom a configuration names, where both say whom they are of.

    Args:
        config: the configuration.
        records: the sessions.

    Raises:
        ConfigError: a session of another subject than `visit.subject`.
    """
    subject = config.visit.subject
    others = [record for record in records if record.header.subject not in {"", subject}]
    if subject and others:
        raise ConfigError(
            "the log is another person's",
            got=f"{others[0].header.subject} in {others[0].path}",
            expected=f"{subject}, as visit.subject says",
            remedy="Give this person's own log, or correct visit.subject.",
        )


def _require_like(config: RunConfig, records: Sequence[SessionRecord]) -> None:
    """Raise where an earlier session had another muscle, or another intensity, than the configuration says."""
    for record in records:
        if unlike := config.visit.noted().unlike(record.header.visit):
            raise ConfigError(
                f"the earlier session and [visit] are of {unlike}",
                got=str(record.path),
                remedy="What one taught says little about the other. Leave the log out, or correct [visit].",
            )


def _code(config: RunConfig) -> str:
    return f"{config.subject.cohort}-{config.seed}-{config.subject.number}"


def _kept(config: RunConfig) -> dict[str, Any]:
    """What a log keeps to simulate the same person again; never what names code to import.

    What a prior came to is in the strategy's recipe; where it came from is kept for whoever reads the log.
    """
    kept = config.model_dump(mode="json", exclude_none=True, exclude={"log", "device", "signals"})
    if config.subject.data is not None:
        kept["subject"]["data"] = str(config.subject.data.resolve())
    return kept
