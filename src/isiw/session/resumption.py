"""What a session that goes on needs of its log: whether it may, what holds from here on, and what the log says."""

from __future__ import annotations

import dataclasses

from isiw.checks import whole
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import DeviceError, InvalidValueError, OtherVersionsWarning, warn
from isiw.log.pulses import pulses_s
from isiw.log.reader import SessionRecord
from isiw.log.salvage import Salvage
from isiw.log.schema import MOST_TRIALS, Event, Header
from isiw.session.replay import Replayed, versions_text

__all__ = [
    "ages_s",
    "as_resumed",
    "require_as_real",
    "require_same_person",
    "resumption",
    "warn_where_differing",
    "with_lost_pulses",
]


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
        record.require_end()
        return record
    lost_pulses = whole("lost_pulses", lost_pulses, least=0, below=MOST_TRIALS)
    if not record.end_lost:
        raise InvalidValueError(
            "lost_pulses is for a log whose end is missing, and this one's is there", got=lost_pulses
        )
    return dataclasses.replace(record, delivered=record.given + lost_pulses)


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


def warn_where_differing(replayed: Replayed, header: Header) -> None:
    """Warn whoever resumes a session that other versions would have asked something else.

    Args:
        replayed: the strategy that has learned the log.
        header: the log's.
    """
    if replayed.differing:
        warn(_differing_text(replayed, header), OtherVersionsWarning)


def _differing_text(replayed: Replayed, header: Header) -> str:
    return (
        f"The session was logged with {versions_text(header)}, log schema {header.schema_version}. With the versions "
        f"installed here the strategy would have asked something else in {len(replayed.differing)} of "
        f"{len(replayed.trials)} trials. The logged trials count as they were; asks from here on may differ from those "
        "of an uninterrupted session."
    )


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


def ages_s(salvaged: Salvage, trials: int) -> list[float]:
    """How long ago each stimulus of a log was [s]; 0 for those of which nobody knows when they were.

    Args:
        salvaged: the log.
        trials: how many stimuli there were.
    """
    known_s = pulses_s(salvaged)
    return [*known_s, *[0.0] * (trials - len(known_s))]
