"""Resuming: one call finds out what a log is of, and continues it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Unpack, overload

from isiw.devices.clock import MonotonicClock
from isiw.devices.limits import USUAL_ITI_S, Limits
from isiw.devices.protocol import Device, HasMemory
from isiw.log.headers import Header
from isiw.log.kinds import OWN_LOOP, LogKind, of_another_kind, require_session
from isiw.log.reader import read_any
from isiw.log.salvage import salvage
from isiw.log.threshold import ThresholdRecord
from isiw.session.assembly import Options, ResumeOptions
from isiw.session.loop import Session
from isiw.session.opening import own_loop_resumed
from isiw.session.recorder import Recorder
from isiw.session.replay import require_as_real, taken_up
from isiw.session.threshold import ThresholdRecorder, resume_threshold
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus


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
    """What goes on where a log ends. With a device it is a session; nothing is delivered or written before its `run`.

    Without one it is what asks and is told: of a session the `Recorder` that `open_session` opens, and of a search for
    a motor threshold the one that `open_threshold` opens. An interval production task goes on at the command line.

    Stimuli whose outcome is not in the log become mistrials "outcome unknown": they count against every limit. What the
    session goes on with is logged as a further header, and holds when it is resumed again.

    Args:
        path: the log, with or without `.part`; finished, torn or damaged.
        device: the device to go on with; one with a memory is brought to where the logged stimuli left it. None for a
            loop of your own, and for a search for a motor threshold.
        strategy: needed where the session's strategy was built from a user's own objects: the same again.
        lost_pulses: needed where the end of a closed log is missing: how many stimuli were given that are not in it any
            more, as the stimulator counted. They become mistrials "outcome unknown".
        verify: whether the strategy must ask again what the log says it asked, at first and at last. With other
            versions than those that were logged a difference is a warning; without verification the logged trials are
            told as they are.
        replayed: with a device, called after each logged trial that the strategy is told again, with how many it knows.
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
