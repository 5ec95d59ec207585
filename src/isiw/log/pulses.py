"""When a person was stimulated, by the logs; what is uncertain counts as given at the latest time that is possible.

Within one start of the computer the time that passed is measured, whatever its clock was set to meanwhile. Otherwise
its clock is trusted, unless that says that a stimulus is still to come: then it counts as given just now.
"""

from __future__ import annotations

import datetime as dt
import hashlib
import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from isiw.errors import DamagedLogError, LogError
from isiw.files import is_mcap
from isiw.log.codes import is_same_person
from isiw.log.durable import kept_for
from isiw.log.headers import Header
from isiw.log.kinds import LogKind
from isiw.log.moments import Ages, Moment
from isiw.log.places import log_exists, log_of
from isiw.log.reader import LoggedSession, of_production, read_any
from isiw.log.salvage import Salvage, holds, salvage
from isiw.log.schema import Event, Intent, Message, Record, decode
from isiw.opening import opened
from isiw.text.sanitize import counted, plain
from isiw.trials import Trial

_SUFFIXES = {".mcap", ".part"}
"""Of logs as they are usually named; one that is damaged is no log by its content."""

_TIMED = ("/intent", "/trial", "/event")


_NOTABLE_S: Final = 60.0
"""A clock that differs by less was put right, as a computer does by itself."""

_HEAD_BYTES: Final = 1 << 18
"""Within so many first bytes every log says, without compression, in which start of the computer it was written."""


class Given(NamedTuple):
    """A stimulus that was about to be delivered: its number, when that was, and where it was imported all trials."""

    trial: int
    at: Moment
    table: bytes = b""


def pulse_ages(salvaged: Salvage, now: Moment | None = None) -> Ages:
    """The age of each stimulus of a log, refused ones left out; without an intent its trial's record counts."""
    return _aged(_given(salvaged), now or Moment.now())


def _given(salvaged: Salvage) -> list[Given]:
    """The stimuli that were about to be delivered."""
    at: dict[int, Moment] = {}
    for message in salvaged.messages:
        record = _timed(message)
        if isinstance(record, Intent):
            at[record.trial] = Moment(message.log_time_ns, record.boot_id, record.boot_s)
        elif isinstance(record, Trial):
            at.setdefault(record.index, Moment(message.log_time_ns))
        elif isinstance(record, Event) and record.kind == "refused" and record.trial is not None:
            at.pop(record.trial, None)
    return [Given(*each) for each in at.items()]


def _aged(given: Iterable[Given], now: Moment, most_s: float = math.inf) -> Ages:
    """The ages of stimuli, those older than `most_s` left out [s]."""
    moments = [each.at for each in given]
    last = {at.boot_id: at for at in sorted(moments, key=lambda at: at.boot_s or 0.0)}  # of each start of a computer
    ages_s, set_by_s, ahead = [], 0.0, 0
    for at in moments:
        by_clock_s = (now.wall_ns - at.wall_ns) / 1e9
        age_s = now.since_s(at)
        if age_s is not None:
            moved_s = by_clock_s - age_s
        else:  # the clock may have been set while stimuli were given, so that the last one's time is nearest to today's
            since_s = last[at.boot_id].since_s(at)
            age_s = by_clock_s if since_s is None else (now.wall_ns - last[at.boot_id].wall_ns) / 1e9 + since_s
            moved_s, ahead = 0.0, ahead + (age_s < -_NOTABLE_S)
        if age_s <= most_s:
            ages_s.append(max(0.0, age_s))
            set_by_s = max(set_by_s, moved_s, key=abs)
    return Ages(tuple(sorted(ages_s, reverse=True)), tuple(_doubts(set_by_s, ahead)))


def _doubts(set_by_s: float, ahead: int) -> Iterator[str]:
    if abs(set_by_s) > _NOTABLE_S:
        way, moved = "forward" if set_by_s > 0 else "back", dt.timedelta(seconds=round(abs(set_by_s)))
        yield (
            f"The computer's clock was set {way} by {moved} since earlier stimuli were given. For the limits they "
            "count by the time that really passed since then, which the computer measures besides."
        )
    if ahead:
        yield (
            f"By the computer's clock {counted(ahead, 'earlier stimulus is', 'earlier stimuli are')} still to come, so "
            "that the clock is wrong, or was. For the limits they count as given just now. Set the clock before the "
            "next session."
        )


def _timed(message: Message) -> Record | None:
    """A record that says when a stimulus was; None for any other, and for one that makes no sense."""
    try:
        return decode(message.topic, message.data) if message.topic in _TIMED else None
    except ValueError:
        return None


def earlier_pulse_ages(folder: str | Path, subject: str, period_s: float, *, but: Path) -> Ages:
    """The ages of a subject's stimuli of a period in a folder's logs, each once; those of simulations do not count."""
    now = Moment.now()
    folder = Path(folder)
    if not folder.is_dir():
        raise LogError("there is no such folder of logs", got=str(folder), remedy="Check Safeguards.earlier_logs.")
    own = log_of(but.resolve())
    given, codes = set[Given](), set[str]()
    for log in sorted(_recent(folder, period_s, now) - {own}):
        code, stimuli = _of_subject(log, subject)
        given.update(stimuli)
        codes |= {code} if stimuli else set()
    if log_exists(own):
        given -= set(_given(salvage(own)))  # of which there may be a copy
    ages = _aged(given, now, period_s)
    return replace(ages, doubts=(*ages.doubts, *_spelt_otherwise(codes - {subject}, subject)))


def _spelt_otherwise(codes: Iterable[str], subject: str) -> Iterator[str]:
    if names := ", ".join(sorted(codes)):
        yield (
            f"Earlier stimuli of {plain(names)} count for {plain(subject)}, too: the codes differ only in case, "
            "spaces, hyphens or underscores."
        )


def _recent(folder: Path, period_s: float, now: Moment) -> set[Path]:
    """The logs of a folder, and of its folders, that something was written to in a period, or in this start.

    How old a file looks is up to the clock; in which start of the computer it was written is not.
    """
    since_s, this_start = now.wall_ns / 1e9 - period_s, now.boot_id.encode()

    def may_count(file: Path) -> bool:
        return file.stat().st_mtime >= since_s or bool(this_start and this_start in _head(file))

    try:
        recent = [file for file in _files(folder) if file.is_file() and may_count(file)]
        return {log_of(file.resolve()) for file in recent if file.suffix in _SUFFIXES or is_mcap(file)}
    except OSError as error:
        raise LogError(
            f"a folder of earlier logs cannot be read: {error.strerror}",
            got=str(error.filename),
            remedy="Give isiw the right to read all of Safeguards.earlier_logs, or name another folder.",
        ) from error


def _head(file: Path) -> bytes:
    with opened(file) as found:
        return found.read(_HEAD_BYTES)


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


def _of_subject(log: Path, subject: str) -> tuple[str, list[Given]]:
    """The stimuli of a log if it is of a person, and the code by which it says so."""
    salvaged = salvage(log)
    if of_production(salvaged) and not _given(salvaged):  # nobody is stimulated in such a task
        return "", []
    record = read_any(salvaged, LogKind.SEARCH, LoggedSession)
    record.require_read("subject", "device")
    header = record.header
    if not is_same_person(header.subject, subject) or header.device.simulated:
        return "", []
    if salvaged.end_lost and not _went_on(salvaged):
        raise DamagedLogError(
            "the end of an earlier log of this subject is missing, so the number of stimuli given is unknown",
            got=str(log),
            remedy="Resume that session with the number of pulses that were lost, or wait until the period is over.",
        )
    given = _given(salvaged)
    if not isinstance(header, Header) or not header.imported or not header.given_by:
        return header.subject, given
    table = b"".join(message.data for message in salvaged.messages if message.topic == "/trial")
    return header.subject, _dated(given, header.given_by, hashlib.sha256(table).digest())


def _dated(given: Iterable[Given], given_by: str, table: bytes) -> list[Given]:
    """The stimuli of an imported log by the last date of its data, which other tables may share, or its import."""
    latest_ns = round(dt.datetime.fromisoformat(given_by).timestamp() * 1e9)
    return [Given(each.trial, Moment(min(latest_ns, each.at.wall_ns)), table) for each in given]
