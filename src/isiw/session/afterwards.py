"""Verdicts on the trials of a log that nobody writes, and its estimate made again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import isiw
from isiw.checks import text
from isiw.errors import InvalidValueError, LogError
from isiw.intervention import Arm
from isiw.log.continuing import require_session
from isiw.log.headers import Header
from isiw.log.kinds import LogKind, kind_of, of_another_kind
from isiw.log.new_verdicts import exclusion, inclusion
from isiw.log.record import read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import Event, Record
from isiw.log.verdicts import changed_after
from isiw.log.writer import LogWriter
from isiw.session.examination import estimate_record
from isiw.session.replay import require_end, strategy_of
from isiw.strategy.strategy import Strategy
from isiw.trials import TrialTable


def estimate_again(
    path: str | Path, strategy: Strategy | None = None, *, replayed: Callable[[int], None] = lambda _: None
) -> None:
    """Compute a session's estimate from its trials as they count now, and append it to the log. Delivers nothing.

    Args:
        path: the log, with or without `.part`; no session may be writing it.
        strategy: needed if the session's strategy was built from a user's own objects: the same again.
        replayed: called after each trial with how many the strategy knows.

    Raises:
        LogError: no such log, one without trials, or one that is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        StrategyError: the strategy cannot be made again.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    require_end(record)
    record.require_read()
    if not record.table:
        raise LogError("there is no trial to estimate from", got=str(record.path))
    made = strategy_of(record.header) if strategy is None else strategy.restarted()
    trials = sorted([*record.table, *record.unknown_trials], key=lambda trial: trial.index)
    changes = changed_after(record.events)
    for number, trial in enumerate(trials, start=1):
        made.learn(trial)
        if trial.index in changes:
            made.note_change()
        replayed(number)
    made.in_doubt = record.in_doubt
    last = record.table[-1].index
    said = f"Estimated again with isiw {isiw.__version__} from the trials as they count now."
    estimate = estimate_record(made, last, made.decision(), None)
    _append(path, salvaged, record.header, Event(kind="note", trial=last, text=said), estimate)


def exclude(path: str | Path, trial: int, reason: str) -> None:
    """Exclude a trial afterwards: an event is appended to the log, nothing is erased. Resuming learns without it.

    Args:
        path: the log, with or without `.part`.
        trial: the trial's number.
        reason: why, for whoever reads the log.

    Raises:
        LogError: no such log, or it is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        InvalidValueError: no reason, no such trial, or one that counts for nothing anyway.
    """
    if not text("the reason of an exclusion", reason).strip():
        raise InvalidValueError(
            "a trial that is excluded afterwards needs a reason",
            got=reason,
            expected='a few words for readers of the log, such as "coughed"',
        )
    _judge(path, lambda trials, events: exclusion(trials, trial, reason, events=events))


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
    _judge(path, lambda trials, _: inclusion(trials, trial))


def open_arm(path: str | Path) -> Arm:
    """Open the concealed arm of an intervention, so that it may be shown: an event says so, and when, in the log.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such log, one of no intervention, or one that is still being written.
        DamagedLogError: the log's end is missing.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    intervention = record.header.intervention
    if intervention is None:
        raise of_another_kind(record.path, kind_of(record.header), LogKind.INTERVENTION)
    if record.conceals:
        require_end(record)
        record.require_read()
        last = record.table[-1].index if record.table else None
        said = f"The arm was opened: {intervention.arm.words}."
        _append(path, salvaged, record.header, Event(kind="opening", trial=last, text=said))
    return intervention.arm


def _judge(path: str | Path, verdict: Callable[[TrialTable, Sequence[Event]], Event]) -> None:
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    require_session(record.path, record.header)
    event = verdict(record.table, record.events)
    require_end(record)
    if record.losses:  # then the header may be written again
        record.require_read()
    _append(path, salvaged, record.header, event)


def _append(path: str | Path, salvaged: Salvage, header: Header, *records: Record) -> None:
    """Append records to a log that nobody writes; a closed one stays as it was where that fails, as on a full disk."""
    log = LogWriter.continuing(path, salvaged, header)
    try:
        for record in records:
            log.append(record)
        log.close()
    except BaseException as error:
        if not log.abandon(salvaged.path) or not isinstance(error, LogError):
            raise
        raise LogError(
            error.what, got=str(log.path), remedy="The log stays as it was. Make room, and give the command again."
        ) from error
