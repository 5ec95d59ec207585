"""Judging a trial of a log that no session is writing: an event is appended, and nothing is erased."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from isiw.log.kinds import require_session
from isiw.log.reader import read_salvaged
from isiw.log.salvage import salvage
from isiw.log.schema import Event
from isiw.log.verdicts import exclusion, inclusion
from isiw.log.writer import LogWriter
from isiw.trials import TrialTable


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
    require_session(record.path, record.header)
    event = verdict(record.table)
    record.require_end()
    if record.losses:  # then the header may be written again
        record.require_read()
    with LogWriter.continuing(path, salvaged, record.header) as log:
        log.append(event)
        if record.losses:
            log.append(Event(kind="fault", trial=event.trial, text=" ".join(record.losses)))
