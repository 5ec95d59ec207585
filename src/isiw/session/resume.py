"""Opening a session of the lab's own loop, and resuming: one call finds out what a log is of, and continues it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Unpack, overload

from isiw.checks import text
from isiw.devices.clock import Clock, MonotonicClock
from isiw.devices.limits import USUAL_ITI_S, Limits
from isiw.devices.protocol import Device, DeviceInfo, HasMemory
from isiw.errors import InvalidValueError, StrategyError
from isiw.log.durable import log_exists
from isiw.log.headers import Header
from isiw.log.kinds import OWN_LOOP, LogKind, of_another_kind, require_session
from isiw.log.reader import SessionRecord, read_any, read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.threshold import ThresholdRecord
from isiw.log.writer import LogWriter
from isiw.session.assembly import Options, ResumeOptions, header_of, require_parts, require_room
from isiw.session.examination import estimate_record
from isiw.session.loop import Session
from isiw.session.recorder import Recorder
from isiw.session.replay import require_as_real, require_same_person, taken_up
from isiw.session.threshold import ThresholdRecorder, resume_threshold
from isiw.signals.limits import SignalLimits
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, Trial
from isiw.visit import Visit, VisitProtocol


def open_session(  # noqa: PLR0913 - all but two are keyword-only
    strategy: Strategy,
    log: str | Path,
    *,
    resume: bool = False,
    earlier: Iterable[Trial] = (),
    limits: Limits | None = None,
    clock: Clock | None = None,
    subject: str = "",
    visit: Visit | None = None,
    protocol: VisitProtocol | None = None,
    config: Mapping[str, Any] | None = None,
    lost_pulses: int | None = None,
    on_doubt: Callable[[str], None] | None = None,
) -> Recorder:
    """Open a session whose loop is your own: ask it for ISIs, and tell it what came of them.

    Args:
        strategy: proposes ISIs and learns; of a session that goes on, made with the same settings and seed.
        log: where the log is; it must not exist yet, unless the session goes on.
        resume: whether to continue the log if there is one. A trial without an outcome in it becomes a
            mistrial.
        earlier: trials of this person that were delivered before, such as the `record.table` of a log or an analysis:
            the strategy learns them before its first ask, as `Strategy.learn_all` does, and nothing counts them.
        limits: what may be asked; the strategy's space and 200 pulses by default. Nothing waits between stimuli unless
            their `min_iti_s` is stated. Of a session that goes on, the logged ones by default. Limits of the coil and
            of the intensity allow nothing, as these are not reported here.
        clock: tells the time, and waits in `ask` until the interval, the rest and the period of the limits have passed,
            before the first stimulus, too, as what came before is unknown.
        subject: the person's code, for the log; of a session that goes on, the logged one by default.
        visit: what is noted about the visit, for the log; of a session that goes on, the logged one by default.
        protocol: intervals, blocks and rests, which `ask` waits for; of a session that goes on, the logged one by
            default. Control trials are the loop's own: `tell(None, …)` is TMS alone.
        config: anything that should be kept in the log, as TOML values; of a session that goes on, what is logged by
            default.
        lost_pulses: as for `isiw.resume`: needed where the end of the log is missing.
        on_doubt: called with what looks like a slip in what was told, or like a rig that needs somebody to look; by
            default a warning.

    Raises:
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        DeviceError: the log is of a simulated device.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there; a subject that is no text,
            or another than the log's; a protocol with control trials; a rest or a period that limits nothing, a limit
            on intensity or coil temperature, which are unknown here, or limits that do not hold the strategy's plan.
        LogError: there is a log already, or it cannot be written or read.
        StrategyError: the strategy knows of trials already, or asks something else than the log says it asked.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    path = require_parts(
        log,
        strategy=(strategy, Strategy),
        limits=(limits, Limits | None),
        visit=(visit, Visit | None),
        protocol=(protocol, VisitProtocol | None),
    )
    if strategy.delivered:
        raise StrategyError(
            "the strategy knows of trials that are not this session's",
            got=f"{strategy.delivered} trials",
            remedy="Make it again, or give the session strategy.restarted().",
        )
    if trials := tuple(earlier):
        strategy.learn_all(trials)
    header = _header(
        strategy,
        subject=text("subject", subject),
        visit=visit or Visit(),
        protocol=_without_controls(protocol or VisitProtocol()),
        limits=(limits or Limits.of_space(strategy.space)).stated(0.0),
        config=dict(config or {}),
    )
    _require_reported(header.limits)
    header.limits.require_effect()
    header.protocol.require_effect(header.limits.iti_s)
    clock = clock or MonotonicClock()
    if not (resume and log_exists(path)):
        require_room(strategy, header)
        return Recorder(strategy, LogWriter.create(path, header), header, clock, on_doubt=on_doubt)
    given = {"subject": subject, "visit": visit, "protocol": protocol, "limits": limits, "config": config}
    changes = {name: getattr(header, name) for name, value in given.items() if value is not None and value != ""}
    salvaged = salvage(path)
    return own_loop_resumed(salvaged, read_salvaged(salvaged), strategy, changes, lost_pulses, clock, on_doubt)


def own_loop_resumed(
    salvaged: Salvage,
    record: SessionRecord,
    strategy: Strategy | None,
    changes: Mapping[str, Any],
    lost_pulses: int | None,
    clock: Clock,
    on_doubt: Callable[[str], None] | None,
) -> Recorder:
    """The session of a log, from where it ends, with the fields of its header that are said otherwise."""
    require_session(record.path, record.header)
    record.require_read()
    logged = record.header
    require_same_person(changes.get("subject", ""), logged)
    details = {name: getattr(logged, name) for name in ("subject", "visit", "protocol", "limits", "config")}
    details |= changes
    _require_reported(details["limits"])
    strategy, earlier = taken_up(salvaged, record, strategy, details["limits"], lost_pulses)
    header = _header(strategy, **details).model_copy(update=dict(earlier.kept))
    writer = earlier.open_log(header)
    for first in earlier.first_records:
        writer.append(first)
    if record.is_judged_since:
        writer.append(estimate_record(strategy, len(earlier.trials) - 1, strategy.decision(), None))
    writer.sync()
    return Recorder(strategy, writer, header, clock, earlier, on_doubt)


def _header(strategy: Strategy, **details: Any) -> Header:
    device = DeviceInfo(OWN_LOOP, strategy.space.reference)
    return header_of(strategy, device=device, signals=SignalLimits(), **details)


def _require_reported(limits: Limits) -> None:
    """Raise where limits need what a loop of one's own reports nothing of: such a session could never ask."""
    states = {"intensity_pct_mso": limits.intensity_pct_mso, "max_coil_c": limits.max_coil_c}
    given = {name: value for name, value in states.items() if value is not None}
    if given:
        raise InvalidValueError(
            "a loop of one's own reports neither intensity nor coil temperature, so these limits cannot be kept",
            got=given,
            remedy="Keep them yourself, and state others: limits=isiw.Limits.of_space(space, min_iti_s=5).",
        )


def _without_controls(protocol: VisitProtocol) -> VisitProtocol:
    if protocol.tms_alone or protocol.tap_alone:
        raise InvalidValueError(
            "in a loop of one's own the protocol cannot have control trials, as ask() answers with an ISI",
            got=protocol,
            remedy="Give TMS alone whenever you like, and tell it with tell(None, mep_mv). isiw.Session interleaves "
            "control trials itself.",
        )
    return protocol


@overload
def resume(
    path: str | Path,
    device: Device,
    strategy: Strategy | None = None,
    *,
    lost_pulses: int | None = None,
    verify: bool = True,
    replayed: Callable[[int], None] = lambda _: None,
    **options: Unpack[ResumeOptions],
) -> Session: ...
@overload
def resume(
    path: str | Path,
    device: None = None,
    strategy: Strategy | None = None,
    *,
    lost_pulses: int | None = None,
    verify: bool = True,
    replayed: Callable[[int], None] = lambda _: None,
    **options: Unpack[ResumeOptions],
) -> Recorder | ThresholdRecorder: ...
def resume(
    path: str | Path,
    device: Device | None = None,
    strategy: Strategy | None = None,
    *,
    lost_pulses: int | None = None,
    verify: bool = True,
    replayed: Callable[[int], None] = lambda _: None,
    **options: Unpack[ResumeOptions],
) -> Session | Recorder | ThresholdRecorder:
    """Continue where a log ends. With a device it is a session; nothing is delivered or written before its `run`.

    Without one it is what asks and is told: of a session the `Recorder` that `open_session` opens, and of a search for
    a motor threshold the one that `open_threshold` opens. An interval production task goes on at the command line.

    Stimuli whose outcome is not in the log become mistrials "outcome unknown": they count against every limit. What the
    session goes on with is logged as a further header, and holds when it is resumed again.

    Args:
        path: the log, with or without `.part`; finished, torn or damaged.
        device: the device; one with a memory is brought to where the logged stimuli left it. None for a
            loop of your own, and for a search for a motor threshold.
        strategy: needed where the session's strategy was built from a user's own objects: the same again.
        lost_pulses: needed where the end of a closed log is missing: how many stimuli were given that are not in it any
            more, as the stimulator counted. They become mistrials "outcome unknown".
        verify: whether the strategy must ask again what the log says it asked, at first and at last. With other
            versions than those that were logged a difference is a warning; without verification the logged trials are
            told as they are.
        replayed: with a device, called after each logged trial that the strategy learns again, with how many it knows.
        **options: what holds from here on instead of what was logged last: `limits` (else those that `limits_of_log`
            says), `signals` (trials that were judged stay as they are), `timeout_s` and `ask_deadline_s`; and `clock`,
            `on_trial` and `safeguards`. All are as for `Session`.

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
    if unknown := options.keys() - ResumeOptions.__annotations__.keys():
        raise TypeError(f"resume() got an unexpected keyword argument {min(unknown)!r}")
    salvaged = salvage(path)
    record = read_any(salvaged)
    if isinstance(record, ThresholdRecord):
        if device is not None:
            raise of_another_kind(record.path, LogKind.THRESHOLD, LogKind.SEARCH)
        return resume_threshold(path, clock=options.get("clock"))
    require_session(record.path, record.header)
    if device is None:
        clock = options.get("clock") or MonotonicClock()
        return own_loop_resumed(salvaged, record, strategy, {}, lost_pulses, clock, None)
    record.require_read()
    header = record.header
    if (limits := options.get("limits")) is None:
        limits = limits_of_log(header)
    else:
        limits.require_effect()
    require_as_real(device.describe(), header.device)
    strategy = strategy.restarted() if strategy else None
    strategy, earlier = taken_up(salvaged, record, strategy, limits, lost_pulses, verify=verify, replayed=replayed)
    if isinstance(device, HasMemory):
        device.resume_after([Stimulus(t.index, t.commanded_isi_ms, t.tap_alone) for t in earlier.trials])
    options |= {"limits": limits, "signals": options.get("signals") or header.signals}
    for name in ("timeout_s", "ask_deadline_s"):
        if options.get(name) is None:
            options[name] = getattr(header, name)
    kept: Options = {
        **options,
        "subject": header.subject,
        "config": header.config,
        "visit": header.visit,
        "protocol": header.protocol,
    }
    return Session(device, strategy, log=path, earlier=earlier, **kept)


def limits_of_log(header: Header) -> Limits:
    """The limits that a device goes on with where none are stated: those that were logged last.

    A loop of the lab's own keeps its intervals itself, and has none by default; a device that takes it over has at
    least the default one.
    """
    limits = header.limits
    if header.device.name != OWN_LOOP or limits.iti_s >= USUAL_ITI_S:
        return limits
    return dataclasses.replace(limits, min_iti_s=USUAL_ITI_S)
