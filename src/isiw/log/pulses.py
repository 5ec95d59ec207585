"""When a person was stimulated, by the logs."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from isiw.errors import DamagedLogError, LogError
from isiw.files import is_mcap
from isiw.log.durable import kept_for, log_exists, log_of
from isiw.log.reader import of_production, read_any
from isiw.log.salvage import Salvage, holds, salvage
from isiw.log.schema import Event, Intent, Message, Record, decode
from isiw.trials import Trial

_SUFFIXES = {".mcap", ".part"}
"""Of logs as they are usually named; one that is damaged is no log by its content."""

_TIMED = ("/intent", "/trial", "/event")


def pulses_s(salvaged: Salvage, now_ns: int | None = None) -> list[float]:
    """The age of each stimulus of a log [s], refused ones left out; without an intent its trial's record counts."""
    return _ages_s(_given(salvaged), now_ns)


def _given(salvaged: Salvage) -> list[tuple[int, int]]:
    """The number of each stimulus that was about to be delivered, and when that was [ns since 1970]."""
    at_ns: dict[int, int] = {}
    for message in salvaged.messages:
        record = _timed(message)
        if isinstance(record, Intent):
            at_ns[record.trial] = message.log_time_ns
        elif isinstance(record, Trial):
            at_ns.setdefault(record.index, message.log_time_ns)
        elif isinstance(record, Event) and record.kind == "refused" and record.trial is not None:
            at_ns.pop(record.trial, None)
    return list(at_ns.items())


def _ages_s(given: Iterable[tuple[int, int]], now_ns: int | None = None) -> list[float]:
    now_ns = time.time_ns() if now_ns is None else now_ns
    return [max(0.0, (now_ns - each_ns) / 1e9) for _, each_ns in given]


def _timed(message: Message) -> Record | None:
    """A record that says when a stimulus was; None for any other, and for one that makes no sense."""
    try:
        return decode(message.topic, message.data) if message.topic in _TIMED else None
    except ValueError:
        return None


def earlier_pulses_s(folder: str | Path, subject: str, period_s: float, *, but: Path) -> list[float]:
    """The ages of a subject's stimuli in a folder's logs [s], each once; those of simulations do not count."""
    folder = Path(folder)
    if not folder.is_dir():
        raise LogError("there is no such folder of logs", got=str(folder), remedy="Check Safeguards.earlier_logs.")
    own = log_of(but.resolve())
    given = {stimulus for log in sorted(_recent(folder, period_s) - {own}) for stimulus in _of_subject(log, subject)}
    if log_exists(own):
        given -= set(_given(salvage(own)))  # of which there may be a copy
    return sorted((age_s for age_s in _ages_s(given) if age_s <= period_s), reverse=True)


def _recent(folder: Path, period_s: float) -> set[Path]:
    """The logs of a folder, and of its folders, that something was written to in a period."""
    since_s = time.time() - period_s
    try:
        recent = [file for file in _files(folder) if file.is_file() and file.stat().st_mtime >= since_s]
        return {log_of(file.resolve()) for file in recent if file.suffix in _SUFFIXES or is_mcap(file)}
    except OSError as error:
        raise LogError(
            f"a folder of earlier logs cannot be read: {error.strerror}",
            got=str(error.filename),
            remedy="Give isiw the right to read all of Safeguards.earlier_logs, or name another folder.",
        ) from error


def _files(folder: Path) -> Iterator[Path]:
    """The files of a folder and of its folders, each folder once, whatever links lead to it."""
    seen = set()
    for place, folders, names in os.walk(folder, onerror=_raise, followlinks=True):
        if (real := os.path.realpath(place)) in seen:
            folders.clear()
            continue
        seen.add(real)
        yield from (Path(place, name) for name in names)


def _raise(error: OSError) -> None:
    raise error


def _went_on(damaged: Salvage) -> bool:
    """True if a damaged file is only kept, and its log was resumed with all that was left: its pulses count there."""
    log = kept_for(damaged.path)
    if log is None or not log_exists(log):
        return False
    later = salvage(log)
    return holds(later, damaged) and _resumed(later) > _resumed(damaged)


def _resumed(salvaged: Salvage) -> int:
    """The number of resumptions, each with a word on disk for each stimulus that may have been given before."""
    records = (_timed(message) for message in salvaged.messages)
    return sum(isinstance(record, Event) and record.kind == "resume" for record in records)


def _of_subject(log: Path, subject: str) -> list[tuple[int, int]]:
    salvaged = salvage(log)
    if of_production(salvaged) and not _given(salvaged):  # nobody is stimulated in such a task
        return []
    record = read_any(salvaged)
    record.require_read("subject", "device")
    header = record.header
    if header.subject != subject or header.device.simulated:
        return []
    if salvaged.end_lost and not _went_on(salvaged):
        raise DamagedLogError(
            "the end of an earlier log of this subject is missing, so the number of stimuli given is unknown",
            got=str(log),
            remedy="Resume that session with the number of pulses that were lost, or wait until the period is over.",
        )
    return _given(salvaged)
