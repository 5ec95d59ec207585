"""The session that a configuration describes: its device, its simulated person, its prior, and its log."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, Final

from isiw.config.given import Before, Given, before_of, given_before, is_table
from isiw.config.run import RunConfig, limits_for
from isiw.config.sections import RobotConfig, SimulatedConfig, robot_for
from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import Device, info_of
from isiw.devices.simulated import RecordedPerson, SimulatedDevice, SimulatedPerson, load_recordings
from isiw.errors import ConfigError, StrategyError
from isiw.files import write_output
from isiw.intervention import Intervention
from isiw.log.continuing import require_search
from isiw.log.headers import RUN_KEY, FirstStep
from isiw.log.places import log_exists
from isiw.log.reader import ThresholdRecord
from isiw.log.record import SessionRecord
from isiw.log.writer import now
from isiw.models.particles.prior import Prior
from isiw.models.particles.supra.prior import SupraPrior
from isiw.priors import above, after, read_lab_prior
from isiw.priors.above_threshold import SAME_VISIT, profile_below
from isiw.priors.days import DayToDay, require_each_once, require_whole
from isiw.session.given import given_pulses
from isiw.session.loop import Session
from isiw.strategy.catalogue import known_settings, make_strategy, settings_for
from isiw.subjects.responses import RecruitmentResponse
from isiw.text.named_code import named_code, require_fitting
from isiw.visit import Visit, VisitProtocol

SAME_VISIT_H: Final = 12.0
"""Sessions that began within so many hours are one visit, where no day is noted [h]."""

TEMPLATE_FILES = ("rig.py", "session.toml", "test_rig.py")
"""The files that `write_rig_template` writes."""


def device_from_factory(factory: str, settings: Mapping[str, Any], folder: Path | None = None) -> Device:
    """The device that a factory makes."""
    make = named_code(factory, folder, "device.factory")
    require_fitting(make, settings, "device.settings")
    device = make(**settings)
    if not isinstance(device, Device):
        raise ConfigError(
            "device.factory makes no device",
            got=type(device).__name__,
            expected="an object with describe, stage, deliver, stop and unstage",
            remedy="See isiw.Device.",
        )
    return device


def write_rig_template(folder: str | Path) -> tuple[Path, ...]:
    """Write a commented starting point for a rig: device, configuration and test. It runs as it is, on made-up EMG."""
    target = Path(folder)
    files = tuple(target / name for name in TEMPLATE_FILES)
    there = [str(file) for file in files if os.path.lexists(file)]
    if there:
        raise ConfigError("the files are there already", got=", ".join(there), remedy="Choose another folder.")
    templates = resources.files("isiw.config") / "rig_template"
    for file in files:
        write_output(file, (templates / f"{file.name}.txt").read_bytes())
    return files


def settings_with_prior(config: RunConfig, device: DeviceInfo, earlier: Sequence[SessionRecord]) -> dict[str, Any]:
    """The strategy's settings, with what earlier sessions taught as its prior."""
    settings = dict(config.strategy.settings)
    if config.prior is None and not earlier:
        return settings
    if "prior" in settings:
        raise ConfigError(
            "strategy.settings.prior and a prior from earlier sessions exclude each other",
            remedy="Give only one of them.",
        )
    second_step = looks_above(config.strategy.name) and bool(earlier)
    if not second_step and not learns_from_earlier(config.strategy.name):
        raise StrategyError(
            f"the strategy {config.strategy.name} learns nothing from earlier sessions",
            remedy="Leave out the prior and the earlier sessions, or choose another strategy, such as default.",
        )
    lab = None if config.prior is None else read_lab_prior(config.prior)
    nobodys = [str(config.prior)] if lab is not None and lab.simulated else []
    _require_people(config, earlier, device, nobodys, any_intensity=second_step)
    if lab is not None:
        _require_like(config, Visit(muscle=lab.noted_muscle), config.prior)
    before = None if lab is None else lab.joined(visit=config.visit.noted())
    if second_step:
        return settings | {"prior": above(*earlier, prior=before, law=_law(config, earlier))}
    return settings | {"prior": after(*earlier, prior=before)}


def learns_from_earlier(name: str) -> bool:
    """True if a strategy has a prior for what earlier sessions teach."""
    return _has_prior(name, Prior())


def looks_above(name: str) -> bool:
    """True if a strategy has a prior for the search above the threshold, the second of two steps."""
    return _has_prior(name, SupraPrior())


def _has_prior(name: str, kind: Prior | SupraPrior) -> bool:
    try:
        settings_for(name, prior=kind)
    except StrategyError:  # no prior, or that of another model
        return False
    return True


def first_step(config: RunConfig, earlier: Sequence[SessionRecord]) -> FirstStep | None:
    """The profile of the session below the threshold, the first of two steps; None if this is no second step."""
    return profile_below(earlier[-1]) if earlier and looks_above(config.strategy.name) else None


def _law(config: RunConfig, earlier: Sequence[SessionRecord]) -> DayToDay:
    """How a person differs from the last session: another day, or the same visit where nothing noted says otherwise."""
    day, last = config.visit.day, earlier[-1].header
    if day is not None and last.visit.day is not None:
        return SAME_VISIT if day == last.visit.day else DayToDay()
    apart = now() - datetime.fromisoformat(last.created)
    return SAME_VISIT if apart < timedelta(hours=SAME_VISIT_H) else DayToDay()


def _require_people(
    config: RunConfig,
    records: Sequence[SessionRecord | ThresholdRecord],
    device: DeviceInfo,
    simulated: Sequence[str] = (),
    *,
    any_intensity: bool = False,
) -> None:
    """Raise if sessions, or what else was simulated, cannot teach anything of the person who will be examined."""
    nobodys = [*simulated, *(str(record.path) for record in records if record.header.device.simulated)]
    if nobodys and not device.simulated:
        raise ConfigError(
            "what simulated sessions taught says nothing about the person who will be stimulated",
            got=nobodys,
            remedy="Leave it out, or learn from sessions with people.",
        )
    require_same_person(config, records)
    for record in records:
        if isinstance(record, SessionRecord):
            visit = record.header.visit
            _require_like(config, replace(visit, intensity_pct_rmt=None) if any_intensity else visit, record.path)


def earlier_trials(config: RunConfig, device: DeviceInfo, given: Given) -> Before:
    """The earlier trials of the visit, which count for the limits, and which a strategy learns before its first ask."""
    # A later session may have learnt the trials of an earlier one.
    records = sorted(given.earlier, key=lambda record: (record.header.created, record.header.given_before))
    _require_people(config, [*records, *given.searches], device)
    require_each_once([*records, *given.sessions])
    for record in records:
        require_whole(record, "as a table: isiw export, then isiw analyse")
        header = record.header
        require_search(record.path, header)
        if (header.space.reference, header.conditioning) != (device.reference, device.conditioning):
            raise ConfigError(
                "the ISIs of the earlier trials are not those of the session",
                got=f"{header.conditioning} and {header.space.reference} in {record.path}",
                expected=f"{device.conditioning} and {device.reference}",
                remedy="Leave this file out.",
            )
    searches = sorted(given.searches, key=lambda search: search.header.created)
    trials = [*given_pulses(searches), *given.pulses]
    changed: set[int] = set()
    for record in records:
        before = before_of(record, trials)
        changed |= {len(trials) + place for place in before.changed_after}
        trials += before.trials
    return Before(tuple(trials), frozenset(changed))


def require_same_person(config: RunConfig, records: Sequence[SessionRecord | ThresholdRecord]) -> None:
    """Raise if a session is of another person than the configuration names, if both name somebody."""
    subject = config.visit.subject
    others = [record for record in records if record.header.subject not in {"", subject}]
    if subject and others:
        raise ConfigError(
            "the log is another person's",
            got=f"{others[0].header.subject} in {others[0].path}",
            expected=f"{subject}, as visit.subject says",
            remedy="Give this person's own log, or correct visit.subject.",
        )


def _require_like(config: RunConfig, visit: Visit, path: Path | None) -> None:
    """Raise if what taught something is of another muscle, or another intensity, than the configuration says."""
    if unlike := config.visit.noted().unlike(visit):
        raise ConfigError(
            f"[visit] and the sessions that were learnt from are of {unlike}",
            got=str(path),
            remedy="What one taught says little about the other. Leave this file out, or correct [visit].",
        )


SESSIONS: Final = Path("isiw-sessions")
"""The folder for logs of sessions without a path."""


def fresh_log_path(config: RunConfig) -> Path:
    """A path in the default folder at which there is no log yet."""
    stem = f"{now().astimezone():%Y-%m-%d_%H-%M-%S}_seed{config.seed}"
    names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
    paths = (SESSIONS / f"{name}.mcap" for name in names)
    return next(path for path in paths if not log_exists(path))


def assumed_space(config: RunConfig) -> str | None:
    """That a new session has the design space that is assumed; None if somebody has named one."""
    is_stated = config.space_named or config.own_rig
    return None if is_stated else f"No [space] is given, so ISIs are {config.space}."


def left_out(config: RunConfig, settings: RunConfig) -> str | None:
    """That files of a configuration are not read, as options name others in their place; None if all are."""
    stated, read = (
        {path.resolve() for path in (one.prior, *one.after, *one.earlier) if path is not None}
        for one in (config, settings)
    )
    if not (others := ", ".join(map(str, sorted(stated - read)))):
        return None
    return f"The command line names other files in the place of {others}: nothing is learnt of these, nor counted."


def device_for(config: RunConfig) -> Device:
    """The device: the user's own, or a simulated person, under a simulated robot or in recorded EMG if asked for.

    Raises:
        ConfigError: recorded EMG without its folder, or a factory that makes no device.
        DeviceError: no recordings in the folder.
    """
    if config.device is not None and config.device.factory is not None:
        return device_from_factory(config.device.factory, config.device.settings, config.device.folder)
    visit, person = config.visit.noted(), config.subject
    return simulated_device(config.seed, person, config.space, visit, person.data, config.robot)


def simulated_device(
    seed: int, person: SimulatedConfig, space: DesignSpace, visit: Visit, data: Path | None, robot: RobotConfig | None
) -> SimulatedDevice:
    """The device of a simulated person."""
    if data is not None and person.kind != "recorded":
        raise ConfigError(
            "recordings are for a subject of the kind recorded, and would be ignored",
            got=str(data),
            remedy='Add --subject recorded, or kind = "recorded" under [subject]; or leave the data out.',
        )
    if robot is not None:
        return SimulatedDevice(robot_for(robot, seed, person, space, visit.intensity_pct_rmt))
    reference, subject = space.reference, person.person(seed, visit.intensity_pct_rmt)
    respond = partial(subject.begin(seed).respond, reference=reference)
    delay_ms = subject.stated_hit_delay_ms if reference == "valve" else None
    stated: dict[str, Any] = {"hit_delay_ms": delay_ms, "conditioning": subject.conditioning}
    if person.kind == "simulated":
        curve = isinstance(subject.response, RecruitmentResponse)
        return SimulatedDevice(SimulatedPerson(respond, reference, **stated, sets_intensity=curve))
    if data is None:
        raise ConfigError(
            "the folder of the recorded EMG is missing: recordings are not part of the package, nor taken from a log",
            expected="the folder with the recordings",
            remedy="Give it with --data DIR, or as subject.data in a configuration.",
        )
    return SimulatedDevice(RecordedPerson(respond, reference, load_recordings(data), seed, **stated))


def require_device(config: RunConfig, path: Path) -> None:
    """Raise if a configuration names no device of the lab's own, but would simulate a person."""
    if not config.own_rig:
        raise ConfigError(
            f"{path} names no device of your own, so there is nothing to check",
            expected='a section [device] with the function that makes it, such as factory = "rig:make"',
            remedy="Add it. isiw new rig FOLDER writes a device, and a configuration that names it.",
        )


def session_for(config: RunConfig, intervention: Intervention | None = None) -> Session:
    """The session that a configuration describes, ready to run.

    Args:
        config: the configuration.
        intervention: an intervention, in which no window is searched for; None for a search.

    Raises:
        ConfigError: a device without a design space; no recordings, or no prior, where the configuration says, or
            recordings that would be ignored; earlier sessions of another person, or sessions or a prior of another
            muscle or intensity, or simulated ones if the device is real.
        LogError: an earlier session of the person that cannot be read, or has no accepted trial.
        StrategyError: a prior for a strategy that has none of this kind.
    """
    space = config.design()
    log = config.log or fresh_log_path(config)
    device = device_for(config)
    info = info_of(device)
    known = {
        "hit_delay_ms": info.hit_delay_ms,
        "conditioning": None if info.conditioning == "tap" else info.conditioning,  # a tap may be nothing stated
        "intensity_pct_rmt": config.visit.intensity_pct_rmt,
    }
    given = given_before(config)
    settings = known_settings(config.strategy.name, known) | settings_with_prior(config, info, given.sessions)
    strategy = make_strategy(config.strategy.name, space=space, seed=config.seed, **settings)
    before = earlier_trials(config, info, given)
    if before.trials:
        strategy.learn_all(before.trials, changed_after=before.changed_after)
    return Session(
        device,
        strategy,
        log=log,
        limits=limits_for(config),
        subject=config.visit.subject or _code(config),
        signals=config.signals,
        config={} if config.own_rig else {RUN_KEY: _kept(config)},
        timeout_s=config.timeout_s,
        visit=config.visit.noted(),
        protocol=config.protocol if intervention is None else VisitProtocol(taps_first=0),
        intervention=intervention,
        first_step=first_step(config, given.sessions),
    )


def intervention_for(config: RunConfig) -> Session:
    """The intervention that a configuration describes, ready to run; `earlier` has the log in which the window is.

    Raises:
        ConfigError: no section [intervention], or one that does not state what it is meant to do; no log of a search,
            or one of another person; and as for `session_for`.
        InvalidValueError: no window was found.
    """
    if config.intervention is None:
        raise ConfigError(
            "the configuration has no intervention",
            expected='[intervention] with changes_the_person = true and the protocol\'s code, protocol_code = "..."',
            remedy="Write the section if your ethics approval is for such an intervention: docs/pairing.md has one.",
        )
    if all(map(is_table, config.earlier)):
        raise ConfigError(
            "an intervention needs the log of the search for the window",
            remedy="Search for it first, and give its log: isiw pair CONFIG --after WINDOW_LOG",
        )
    return session_for(config, config.intervention.drawn(config.visit.subject or _code(config)))


def _code(config: RunConfig) -> str:
    """The code of a simulated person; empty of a real one."""
    return "" if config.own_rig else f"{config.subject.cohort}-{config.seed}-{config.subject.number}"


def _kept(config: RunConfig) -> dict[str, Any]:
    """The part of a configuration that a log keeps: for readers, where a prior came from; no names of code."""
    kept = config.model_dump(mode="json", exclude_none=True, exclude={"log", "device", "signals", "intervention"})
    if config.subject.data is not None:
        kept["subject"]["data"] = str(config.subject.data.resolve())
    if config.robot is not None:
        kept["device"] = config.robot.model_dump()
    return kept
