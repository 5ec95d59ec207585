"""Taking up a session from its log, whoever drives its loop: whether it may go on, and what holds from here on."""

from __future__ import annotations

import dataclasses
from functools import partial

from isiw.checks import whole
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import DeviceError, InvalidValueError, OtherVersionsWarning, warn
from isiw.log.kinds import OWN_LOOP
from isiw.log.pulses import pulses_s
from isiw.log.reader import SessionRecord
from isiw.log.salvage import Salvage
from isiw.log.schema import MOST_TRIALS, Event, Header
from isiw.log.writer import LogWriter
from isiw.session.header import Earlier
from isiw.session.replay import Replayed, replay, strategy_of, versions_text
from isiw.strategy.strategy import Strategy


def taken_up(
    salvaged: Salvage,
    record: SessionRecord,
    strategy: Strategy | None,
    limits: Limits,
    lost_pulses: int | None,
    *,
    verify: bool = True,
) -> tuple[Strategy, Earlier]:
    """The strategy that has learnt a log, and where the log ends.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged it would have asked something else.
    """
    record = _with_lost_pulses(record, lost_pulses)
    header, replayed = record.header, replay(record, strategy or strategy_of(record.header), verify=verify)
    if replayed.differing:
        warn(_differing_text(replayed, header), OtherVersionsWarning)
    return replayed.strategy, Earlier(
        partial(LogWriter.continuing, salvaged.path, salvaged, header),
        replayed.trials,
        record.events,
        {"created": header.created, "asks_from": replayed.asks_from},
        (*replayed.unknown, _resumption(record, replayed, limits)),
        partial(_ages_s, salvaged, len(replayed.trials)),
    )


def _with_lost_pulses(record: SessionRecord, lost_pulses: int | None) -> SessionRecord:
    """A log with the stimuli that its missing end told of."""
    if lost_pulses is None:
        record.require_end()
        return record
    lost_pulses = whole("lost_pulses", lost_pulses, least=0, below=MOST_TRIALS)
    if not record.end_lost:
        raise InvalidValueError(
            "lost_pulses is for a log whose end is missing, and this one's is there", got=lost_pulses
        )
    return dataclasses.replace(record, delivered=record.given + lost_pulses)


def require_as_real(info: DeviceInfo, was: DeviceInfo) -> None:
    """Raise where the session would go on without waiting or with answers from nobody, or a simulation on a person."""
    if info.simulated and not was.simulated:
        raise DeviceError(
            "the session was run with a real device, and cannot go on with a simulated one",
            got=info.name,
            expected=f"a real one, as {was.name} was",
            remedy="If this device is the real rig, set simulated = false (in its settings or DeviceInfo). If it is a "
            "simulation, start a new session with it.",
        )
    if was.simulated and not info.simulated:
        raise DeviceError(
            "the session was run with a simulated device, so its trials are not from a person",
            got=info.name,
            expected=f"a simulated one, as {was.name} was",
            remedy="Start a new session: isiw run CONFIG, or in Python isiw.Session(device, strategy, log=NEW_PATH), "
            "or isiw.open_session(strategy, log=NEW_PATH).",
        )


def require_same_person(subject: str, logged: Header) -> None:
    """Raise where the trials of a log that a loop of the lab's own continues are another person's, or nobody's.

    Args:
        subject: the person's code; empty where nobody said it.
        logged: the header of the log.

    Raises:
        DeviceError: the log is of a simulated device.
        InvalidValueError: the log is another person's.
    """
    require_as_real(DeviceInfo(OWN_LOOP, logged.space.reference), logged.device)
    if subject and logged.subject and subject != logged.subject:
        raise InvalidValueError(
            "the log is another person's",
            got=subject,
            expected=logged.subject,
            remedy="Begin a log of its own for each person: isiw.open_session(strategy, log=NEW_PATH, subject=...).",
        )


def _differing_text(replayed: Replayed, header: Header) -> str:
    return (
        f"The session was logged with {versions_text(header)}, log schema {header.schema_version}. With the versions "
        f"installed here the strategy would have asked something else in {len(replayed.differing)} of "
        f"{len(replayed.trials)} trials. The logged trials count as they were; asks from here on may differ from those "
        "of an uninterrupted session."
    )


def _resumption(record: SessionRecord, replayed: Replayed, limits: Limits) -> Event:
    """What the log says about a resumption."""
    was_s, now_s = record.header.limits.min_iti_s, limits.min_iti_s
    sentences = [f"Resumed after {len(replayed.trials)} trials."]
    if replayed.differing:
        sentences.append(_differing_text(replayed, record.header))
    if replayed.unknown:
        numbers = ", ".join(str(trial.index) for trial in replayed.unknown)
        sentences.append(f"Outcome unknown: {numbers}.")
    if was_s != now_s:
        sentences.append(f"At least {now_s:g} s between two stimuli from here on; it was {was_s:g} s.")
    last = len(replayed.trials) - 1 if replayed.trials else None
    return Event(kind="resume", trial=last, text=" ".join((*sentences, *record.losses)))


def _ages_s(salvaged: Salvage, trials: int) -> list[float]:
    """How long ago each stimulus of a log was [s]; 0 for those of which nobody knows when they were."""
    known_s = pulses_s(salvaged)
    return [*known_s, *[0.0] * (trials - len(known_s))]
