"""Going on with a session from its log: the strategy is made again, and the loop continues where it stood."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable
from functools import partial
from pathlib import Path

from isiw.checks import whole
from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device, DeviceInfo, HasMemory
from isiw.errors import DamagedLogError, DeviceError, InvalidValueError
from isiw.log.pulses import pulses_s
from isiw.log.reader import SessionRecord, read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import MOST_TRIALS, Event, Header
from isiw.log.verdicts import exclusion, inclusion
from isiw.log.writer import LogWriter
from isiw.session.header import OWN_LOOP
from isiw.session.loop import Session
from isiw.session.replay import Replayed, replay, resumption_text, strategy_of, warn_where_differing
from isiw.session.safeguards import Safeguards
from isiw.session.updates import SessionUpdate
from isiw.signals.limits import SignalLimits
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, TrialTable

__all__ = ["ages_s", "as_resumed", "exclude", "include", "limits_of_log", "resume", "resumption", "with_lost_pulses"]


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
        [event.text for event in record.events if event.kind == "pause"],
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


def as_resumed(header: Header, logged: Header, replayed: Replayed) -> Header:
    """The header that holds from here on.

    Args:
        header: of the session that goes on.
        logged: the one that held so far; what never changes stays as it says.
        replayed: what the strategy has learned of the log.
    """
    return header.model_copy(update={"created": logged.created, "asks_from": replayed.asks_from})


def resumption(record: SessionRecord, replayed: Replayed, limits: Limits) -> Event:
    """What the log says about a resumption.

    Args:
        record: the log so far.
        replayed: what the strategy has learned of it.
        limits: those that hold from here on.
    """
    last = len(replayed.trials) - 1 if replayed.trials else None
    return Event(kind="resume", trial=last, text=resumption_text(record, replayed, limits))


def ages_s(salvaged: Salvage, trials: int) -> list[float]:
    """How long ago each stimulus of a log was [s]; 0 for those of which nobody knows when they were.

    Args:
        salvaged: the log.
        trials: how many stimuli there were.
    """
    known_s = pulses_s(salvaged)
    return [*known_s, *[0.0] * (trials - len(known_s))]


def exclude(path: str | Path, trial: int, reason: str) -> None:
    """Exclude a trial afterwards: an event is appended to the log, nothing is erased. Resuming learns without it.

    Args:
        path: the log, with or without `.part`.
        trial: the trial's number.
        reason: why, for whoever reads the log.

    Raises:
        LogError: no such log, or it is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        InvalidValueError: no such trial, or one that counts for nothing anyway.
    """
    _judge(path, lambda trials: exclusion(trials, trial, reason))


def include(path: str | Path, trial: int) -> None:
    """Let a trial count again that was excluded: an event is appended to the log. Resuming learns with it.

    Args:
        path: the log, with or without `.part`.
        trial: the trial's number.

    Raises:
        LogError: no such log, or it is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        InvalidValueError: no excluded trial has this number.
    """
    _judge(path, lambda trials: inclusion(trials, trial))


def _judge(path: str | Path, verdict: Callable[[TrialTable], Event]) -> None:
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    event = verdict(record.table)
    _require_end(record)
    with LogWriter.continuing(path, salvaged, record.header) as log:
        log.append(event)
        if record.losses:
            log.append(Event(kind="fault", trial=event.trial, text=" ".join(record.losses)))


def with_lost_pulses(record: SessionRecord, lost_pulses: int | None) -> SessionRecord:
    """A log with the stimuli that its missing end told of.

    Args:
        record: the log.
        lost_pulses: how many stimuli were given that are not in it any more; None where it has its end.

    Raises:
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there.
    """
    if lost_pulses is None:
        _require_end(record)
        return record
    lost_pulses = whole("lost_pulses", lost_pulses, least=0, below=MOST_TRIALS)
    if not record.end_lost:
        raise InvalidValueError(
            "lost_pulses is for a log whose end is missing, and this one's is there", got=lost_pulses
        )
    return dataclasses.replace(record, delivered=record.given + lost_pulses)


def _require_end(record: SessionRecord) -> None:
    if record.end_lost:
        raise DamagedLogError(
            "the log's end is missing, so nobody knows how many stimuli were given",
            got=str(record.path),
            remedy="Look at the stimulator's counter, and resume with the number N of pulses that isiw show does not "
            f"list: isiw resume --lost-pulses N {shlex.quote(str(record.path))}, or isiw.resume(..., lost_pulses=N).",
        )


def require_as_real(info: DeviceInfo, was: DeviceInfo) -> None:
    """Raise where the session would go on without waiting or with answers from nobody, or a simulation on a person.

    Args:
        info: what the session would go on with.
        was: what it was run with.

    Raises:
        DeviceError: one of them is simulated, and the other is not.
    """
    if info.simulated and not was.simulated:
        raise DeviceError(
            "the session was run with a real device, and cannot go on with a simulated one",
            got=info.name,
            expected=f"a real one, as {was.name} was",
            remedy="Describe the device with DeviceInfo(..., simulated=False), which makes the session wait between "
            "trials in real time.",
        )
    if was.simulated and not info.simulated:
        raise DeviceError(
            "the session was run with a simulated device, and its limits and trials are no person's",
            got=info.name,
            expected=f"a simulated one, as {was.name} was",
            remedy="Start a session of its own: isiw.Session(device, strategy, log=NEW_PATH), or "
            "isiw.open_session(strategy, log=NEW_PATH).",
        )


def require_same_person(header: Header, logged: Header) -> None:
    """Raise where a log's trials are another person's, or nobody's.

    Args:
        header: of the session that would go on.
        logged: of the log.

    Raises:
        DeviceError: one of them is simulated, and the other is not.
        InvalidValueError: the log is another person's.
    """
    require_as_real(header.device, logged.device)
    if header.subject and logged.subject and header.subject != logged.subject:
        raise InvalidValueError(
            "the log is another person's",
            got=header.subject,
            expected=logged.subject,
            remedy="Begin a log of its own for each person: isiw.open_session(strategy, log=NEW_PATH, subject=...).",
        )
