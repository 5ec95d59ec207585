"""Opening a session of the lab's own loop, and resuming: one call finds out what a log is of, and continues it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Unpack, overload

from isiw.checks import code, flag
from isiw.design import DesignSpace
from isiw.devices.clock import MonotonicClock
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import USUAL_ITI_S, Limits
from isiw.devices.protocol import Device, HasMemory, info_of
from isiw.errors import InvalidValueError, LogError
from isiw.log.continuing import OWN_LOOP, continued_by, require_session
from isiw.log.headers import Header
from isiw.log.kinds import LogKind, of_another_kind
from isiw.log.places import log_exists
from isiw.log.record import SessionRecord, read_any, read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.writer import LogWriter
from isiw.session.assembly import (
    Changeable,
    OwnLoopOptions,
    ResumeOptions,
    header_of,
    require_fitting,
    require_known,
    require_new,
    require_parts,
)
from isiw.session.examination import estimate_record
from isiw.session.intensities import stimulus_of
from isiw.session.loop import Session
from isiw.session.recorder import Recorder
from isiw.session.replay import require_as_real, require_same_person, taken_up
from isiw.session.stated import require_given, require_limits, require_protocol, require_visit
from isiw.session.threshold import ThresholdRecorder, resume_threshold
from isiw.signals.limits import SignalLimits
from isiw.strategy.outcomes import require_trials
from isiw.strategy.strategy import Strategy
from isiw.trials import Trial
from isiw.visit import Visit, VisitProtocol


def open_session(
    strategy: Strategy,
    log: str | Path,
    *,
    resume: bool = False,
    earlier: Iterable[Trial] = (),
    **options: Unpack[OwnLoopOptions],
) -> Recorder:
    """Open a session whose loop is your own: ask it for ISIs, and tell it what came of them.

    Args:
        strategy: chooses ISIs and learns; of a session that is resumed, made with the same settings and seed.
        log: where the log is; it must not exist yet, unless the session is resumed.
        resume: whether to continue the log if there is one. A trial without an outcome in it becomes a mistrial.
        earlier: trials of this person that were delivered before, such as the `record.table` of a log or an analysis:
            the strategy learns them before its first ask, as `Strategy.learn_all` does, and of the limits `max_pulses`
            counts them.
        **options: `subject`, `visit`, `config`, `limits` and `protocol` as for `Session`, by default those that are
            logged already. The limits have 0 s between stimuli unless their `min_iti_s` is stated; control trials are
            the loop's own: `tell(None, …)` is TMS alone. `clock`, which `ask` waits by, before the first stimulus,
            too, as what came before is unknown. `lost_pulses`, as for `isiw.resume`. `on_doubt`, called with what
            looks like a slip in what was told, or like a rig that needs somebody to look; by default a warning.

    Raises:
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        DeviceError: the log is of a simulated device.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there; a subject that is no text,
            or another than the log's; a protocol with control trials; a rest or a period that limits nothing, a limit
            on intensity or coil temperature, which are unknown here, limits that do not hold the strategy's plan, or
            intensities or amplitudes of earlier trials that are in another unit.
        LogError: there is a log already, or it cannot be written or read.
        StrategyError: the strategy knows of trials already, or asks something else than the log says it asked.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    require_known("open_session", options, OwnLoopOptions)
    path = require_parts(log, options, strategy=(strategy, Strategy))
    require_new(strategy)
    if trials := require_trials(earlier):
        require_given(trials)
        strategy.learn_all(trials)
    stated = _stated(strategy.space, options)
    if flag("resume", resume) and log_exists(path):
        changes = {name: value for name, value in stated.items() if options.get(name) not in (None, "")}
        salvaged = salvage(path)
        return _own_loop_resumed(salvaged, read_salvaged(salvaged), strategy, changes, options)
    header = _header(strategy, **stated)
    require_fitting(strategy, header)
    clock, on_doubt = options.get("clock") or MonotonicClock(), options.get("on_doubt")
    return Recorder(strategy, LogWriter.create(path, header), header, clock, on_doubt=on_doubt)


def _stated(space: DesignSpace, options: OwnLoopOptions) -> dict[str, Any]:
    """Fields of a header as the options, or else the defaults, state them."""
    limits, protocol = options.get("limits") or Limits.of_space(space), options.get("protocol") or VisitProtocol()
    if protocol.tms_alone or protocol.tap_alone:
        raise InvalidValueError(
            "in a loop of one's own the protocol cannot have control trials, as ask() answers with an ISI",
            got=protocol,
            remedy="Give them whenever you like, and report TMS alone with tell(None, mep_mv), a tap alone with "
            "tell(isi_ms, mep_mv, pulse=False). isiw.Session interleaves control trials itself.",
        )
    limits = limits.stated(0.0)
    _require_reported(limits)
    require_limits(limits)
    require_protocol(protocol, limits.iti_s)
    subject, visit = code("subject", options.get("subject", "")), options.get("visit") or Visit()
    config = dict(options.get("config") or {})
    return {"subject": subject, "visit": visit, "protocol": protocol, "limits": limits, "config": config}


def _own_loop_resumed(
    salvaged: Salvage,
    record: SessionRecord,
    strategy: Strategy | None,
    changes: Mapping[str, Any],
    options: Mapping[str, Any],
) -> Recorder:
    """The session of a log, from where it ends, with the fields of its header that are stated otherwise."""
    require_session(record.path, record.header)
    record.require_read()
    logged = record.header
    if logged.intervention is not None:
        raise LogError(
            "the log is of an intervention, which isiw delivers itself",
            got=str(record.path),
            remedy=f"Continue it with its device: {continued_by(record.path, logged)}",
        )
    require_same_person(changes.get("subject", ""), logged)
    details = {name: getattr(logged, name) for name in ("subject", "visit", "protocol", "limits", "config")}
    details |= changes
    _require_reported(details["limits"])
    strategy, earlier = taken_up(salvaged, record, strategy, details["limits"], options)
    header = _header(strategy, **details).model_copy(update=dict(earlier.kept))
    if "visit" in changes:
        require_visit(header.visit, header.strategy.settings.get("intensity_pct_rmt"))
    writer = earlier.open_log(header)
    for first in earlier.first_records:
        writer.append(first)
    if record.is_judged_since:
        writer.append(estimate_record(strategy, len(earlier.trials) - 1, strategy.decision(), None))
    writer.sync()
    clock = options.get("clock") or MonotonicClock()
    return Recorder(strategy, writer, header, clock, earlier, options.get("on_doubt"))


def _header(strategy: Strategy, **details: Any) -> Header:
    device = DeviceInfo(OWN_LOOP, strategy.space.reference)
    return header_of(strategy, device=device, signals=SignalLimits(), **details)


def _require_reported(limits: Limits) -> None:
    """Raise if limits need what a loop of one's own reports nothing of: such a session could never ask."""
    states = {"intensity_pct_mso": limits.intensity_pct_mso, "max_coil_c": limits.max_coil_c}
    given = {name: value for name, value in states.items() if value is not None}
    if given:
        raise InvalidValueError(
            "a loop of one's own reports neither intensity nor coil temperature, so these limits cannot be kept",
            got=given,
            remedy="Keep them yourself, and state others: limits=isiw.Limits.of_space(space, min_iti_s=5).",
        )


@overload
def resume(
    path: str | Path, device: Device, strategy: Strategy | None = None, **options: Unpack[ResumeOptions]
) -> Session: ...
@overload
def resume(
    path: str | Path, device: None = None, strategy: Strategy | None = None, **options: Unpack[ResumeOptions]
) -> Recorder | ThresholdRecorder: ...
def resume(
    path: str | Path, device: Device | None = None, strategy: Strategy | None = None, **options: Unpack[ResumeOptions]
) -> Session | Recorder | ThresholdRecorder:
    """Continue what a log is of. With a device it is a session; nothing is delivered or written before its `run`.

    Without one it is what asks and learns: of a session the `Recorder` that `open_session` opens, and of a search for
    a motor threshold the one that `open_threshold` opens. An interval production task goes on at the command line.

    Stimuli whose outcome is not in the log become mistrials "outcome unknown": they count against every limit. What the
    session goes on with is logged as a further header, and holds when it is resumed again.

    Args:
        path: the log, with or without `.part`; finished, torn or damaged.
        device: the device; one with a memory is brought to where the logged stimuli left it. None for a
            loop of your own, and for a search for a motor threshold.
        strategy: needed if the session's strategy was built from a user's own objects: the same again.
        **options: `lost_pulses`, needed if the end of a closed log is missing: how many stimuli were given that are not
            in it any more, as the stimulator counted; they become mistrials "outcome unknown". `verify=False` for no
            check that the strategy asks again what the log says it asked; with other versions than those that were
            logged a difference is a warning anyhow. `replayed`, called after each logged trial that the strategy
            learns again, with how many it knows. And what holds from here on instead of what was logged last, as for
            `Session`: `limits`, `signals` (trials that were judged stay as they are), `timeout_s`, `ask_deadline_s`,
            `clock`, `on_trial` and `safeguards`.

    Raises:
        LogError: no such log, one of which not even the header can be read, or one of something else.
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there; or a rest or a period
            of the limits that limits nothing.
        StrategyError: the strategy cannot be made again, or asks something else with the same versions.
        DeviceError: a simulated device for a session with a real one, or the other way round.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    require_known("resume", options, ResumeOptions)
    salvaged = salvage(path)
    record = read_any(salvaged)
    if isinstance(record, SessionRecord):
        return _session_resumed(salvaged, record, device, strategy, options)
    if device is None:
        return resume_threshold(path, clock=options.get("clock"))
    raise of_another_kind(record.path, LogKind.THRESHOLD, LogKind.SEARCH)


def _session_resumed(
    salvaged: Salvage, record: SessionRecord, device: Device | None, strategy: Strategy | None, options: ResumeOptions
) -> Session | Recorder:
    require_session(record.path, record.header)
    if device is None:
        return _own_loop_resumed(salvaged, record, strategy, {}, options)
    record.require_read()
    header = record.header
    require_unended(record)
    if (limits := options.get("limits")) is None:
        limits = limits_of_log(header)
    else:
        require_limits(limits)
    require_as_real(info_of(device), header.device)
    strategy = strategy.restarted() if strategy else None
    strategy, earlier = taken_up(salvaged, record, strategy, limits, options)
    if isinstance(device, HasMemory):
        device.resume_after([stimulus_of(trial, strategy, header) for trial in earlier.trials])
    kept: tuple[str, ...] = ("subject", "config", "visit", "protocol", "signals", "timeout_s", "ask_deadline_s")
    kept += ("intervention", "first_step")
    said: Any = {name: getattr(header, name) for name in kept}
    said |= {name: value for name, value in options.items() if name in Changeable.__annotations__ and value is not None}
    return Session(device, strategy, log=record.path, earlier=earlier, **said | {"limits": limits})


def require_unended(record: SessionRecord) -> None:
    """Raise if somebody has ended an intervention: what is given after that is another one."""
    stop = next((event for event in record.events if event.kind == "stop"), None)
    if stop is not None:
        raise LogError(
            "the intervention was ended by its operator, and is not continued",
            got=f"{record.path}: {stop.text}",
            remedy="If the protocol allows another one, begin it with a log of its own: isiw pair CONFIG --after LOG.",
        )


def limits_of_log(header: Header) -> Limits:
    """The limits that were logged last; a device gets at least the default interval, which an own loop has not."""
    limits = header.limits
    if header.device.name != OWN_LOOP or limits.iti_s >= USUAL_ITI_S:
        return limits
    return dataclasses.replace(limits, min_iti_s=USUAL_ITI_S)
