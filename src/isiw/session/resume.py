"""Going on with a session from its log: the strategy is made again, and the loop continues where it stood."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from pathlib import Path

from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device, HasMemory
from isiw.log.reader import read_salvaged
from isiw.log.salvage import salvage
from isiw.log.schema import Header
from isiw.log.writer import LogWriter
from isiw.session.header import OWN_LOOP
from isiw.session.loop import Session
from isiw.session.replay import replay, strategy_of
from isiw.session.resumption import (
    ages_s,
    as_resumed,
    require_as_real,
    resumption,
    warn_where_differing,
    with_lost_pulses,
)
from isiw.session.safeguards import Safeguards
from isiw.session.updates import SessionUpdate
from isiw.signals.limits import SignalLimits
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus

__all__ = ["limits_of_log", "resume"]


def resume(  # noqa: PLR0913 - all but three are keyword-only
    path: str | Path,
    device: Device,
    strategy: Strategy | None = None,
    *,
    limits: Limits | None = None,
    signals: SignalLimits | None = None,
    clock: Clock | None = None,
    on_trial: Callable[[SessionUpdate], None] | None = None,
    timeout_s: float | None = None,
    ask_deadline_s: float | None = None,
    safeguards: Safeguards | None = None,
    lost_pulses: int | None = None,
    verify: bool = True,
) -> Session:
    """A session that goes on where a log ends. Nothing is delivered or written before its `run`.

    Stimuli whose outcome is not in the log become mistrials "outcome unknown": they count against every limit. What the
    session goes on with is logged as a further header, and holds when it is resumed again.

    Args:
        path: the log, with or without `.part`; finished, torn or damaged.
        device: the device to go on with; one with a memory is brought to where the logged stimuli left it.
        strategy: needed where the session's strategy was built from a user's own objects: the same again.
        limits: other limits than those that `limits_of_log` says.
        signals: other demands on sweeps than those that were logged last; trials that were judged stay as they are.
        clock: as for `Session`.
        on_trial: as for `Session`.
        timeout_s: another time for one delivery than the logged one [s].
        ask_deadline_s: another time for one ask than the logged one [s].
        safeguards: as for `Session`.
        lost_pulses: needed where the end of a closed log is missing: how many stimuli were given that are not in it any
            more, as the stimulator counted. They become mistrials "outcome unknown".
        verify: whether the strategy must ask again what the log says it asked, at first and at last. With other
            versions than those that were logged a difference is a warning; without verification the logged trials are
            told as they are.

    Raises:
        LogError: no such log, or one of which not even the header can be read.
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there; or a rest or a period
            of the limits that limits nothing.
        StrategyError: the strategy cannot be made again, or asks something else with the same versions.
        DeviceError: a simulated device for a session with a real one, or the other way round.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    record.require_read()
    header = record.header
    if limits is not None:
        limits.require_effect()
    limits = limits or limits_of_log(header)
    require_as_real(device.describe(), header.device)
    record = with_lost_pulses(record, lost_pulses)
    replayed = replay(record, strategy.restarted() if strategy else strategy_of(header), verify=verify)
    warn_where_differing(replayed, header)
    if isinstance(device, HasMemory):
        device.resume_after([Stimulus(t.index, t.commanded_isi_ms, t.tap_alone) for t in replayed.trials])
    session = Session(
        device,
        replayed.strategy,
        log=path,
        limits=limits,
        clock=clock,
        on_trial=on_trial,
        subject=header.subject,
        signals=signals or header.signals,
        config=header.config,
        timeout_s=header.timeout_s if timeout_s is None else timeout_s,
        ask_deadline_s=header.ask_deadline_s if ask_deadline_s is None else ask_deadline_s,
        safeguards=safeguards,
        visit=header.visit,
        protocol=header.protocol,
    )
    session.continue_from(
        replayed.trials,
        as_resumed(session.header, header, replayed),
        partial(LogWriter.continuing, path, salvaged, header),
        (*replayed.unknown, resumption(record, replayed, limits)),
        partial(ages_s, salvaged, len(replayed.trials)),
        record.events,
    )
    return session


def limits_of_log(header: Header) -> Limits:
    """The limits that a device goes on with where none are stated: those that were logged last.

    A loop of the lab's own keeps its intervals itself, and has none by default; a device that takes it over has at
    least the default one.

    Args:
        header: the log's.
    """
    limits = header.limits
    if header.device.name != OWN_LOOP or limits.min_iti_s >= Limits.min_iti_s:
        return limits
    return dataclasses.replace(limits, min_iti_s=Limits.min_iti_s)
