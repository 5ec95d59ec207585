"""Which sessions are exported: the logs, whose they are, and which visit of the person each is."""

from __future__ import annotations

import hashlib
import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from isiw.errors import LogError
from isiw.log.durable import log_of
from isiw.log.reader import SessionRecord, read_session
from isiw.text.stimuli import StimulusWords, words_of

__all__ = ["Part", "log_losses", "numbered", "read_logs", "stimulus_of"]


@dataclass(frozen=True, eq=False)
class Part:
    """One session of an export.

    Args:
        subject: the person's code.
        session: the number of the person's session, such as "01".
        record: what the log says.
    """

    subject: str
    session: str
    record: SessionRecord

    def __str__(self) -> str:
        return f"{self.subject}, session {self.session}"

    @property
    def whose(self) -> dict[str, str]:
        """What the rows of this session begin with in every table."""
        return {"subject": self.subject, "session": self.session}


def read_logs(source: str | Path) -> tuple[list[SessionRecord], list[str]]:
    """The sessions of a log or of a folder with logs, and a sentence for each log that is left out.

    Copies of a log, such as those in an earlier export, count once, and so does one that was copied before its end.

    Args:
        source: a log, with or without `.part`, or a folder, whose folders are looked into, too.

    Raises:
        LogError: there is no such log, no log in the folder, or none of them can be read.
    """
    if not Path(source).is_dir():
        return [read_session(source)], []
    records: dict[str, SessionRecord] = {}
    left_out = []
    for log in _logs_of(Path(source)):
        try:
            record = read_session(log)
        except LogError as error:
            left_out.append(f"{log.name} is left out: {error.what}.")
            continue
        first = records.setdefault(hashlib.sha256(record.path.read_bytes()).hexdigest(), record)
        if first is not record:
            left_out.append(f"{log.name} is left out: it is a copy of {first.path.name}.")
    if not records:
        what = "no log in the folder can be read" if left_out else "there is no log in the folder"
        raise LogError(what, got=str(source), expected="files called .mcap or .mcap.part")
    whole, parts = _without_parts(list(records.values()))
    return whole, left_out + parts


def _without_parts(records: Sequence[SessionRecord]) -> tuple[list[SessionRecord], list[str]]:
    """The records that are no part of another one, and a sentence for each that is."""
    kept: list[SessionRecord] = []
    left_out = []
    for record in sorted(records, key=lambda each: len(each.history), reverse=True):
        longer = next((each for each in kept if _is_part(record, each)), None)
        if longer is None:
            kept.append(record)
        else:
            left_out.append(f"{record.path.name} is left out: it is a part of {longer.path.name}.")
    return kept, left_out


def _is_part(record: SessionRecord, longer: SessionRecord) -> bool:
    """Whether all that a log tells is told by another one of the same session as well."""
    one, other = record.header, longer.header
    same = (one.created, one.subject, one.seed) == (other.created, other.subject, other.seed)
    return same and record.history == longer.history[: len(record.history)]


def _logs_of(folder: Path) -> list[Path]:
    """Its logs, each once, whether it is finished or not."""
    files = (file for file in folder.rglob("*.mcap*") if file.suffix in {".mcap", ".part"} and file.is_file())
    return sorted({log_of(file) for file in files})


def numbered(records: Iterable[SessionRecord]) -> list[Part]:
    """Sessions with their person's code and their number, in the order in which they were begun.

    People without a code cannot be told apart, so each of their sessions is taken for another person's.

    Args:
        records: the sessions.
    """
    sessions: Counter[str] = Counter()
    unnamed = (f"unnamed{number}" for number in itertools.count(1))
    parts = []
    for record in sorted(records, key=lambda each: each.header.created):
        subject = record.header.subject or next(unnamed)
        sessions[subject] += 1
        parts.append(Part(subject, f"{sessions[subject]:02d}", record))
    return sorted(parts, key=lambda part: (part.subject, part.session))


def stimulus_of(parts: Iterable[Part]) -> StimulusWords:
    """What the conditioning stimulus of some sessions is called.

    Args:
        parts: the sessions.
    """
    return words_of(part.record.header.conditioning for part in parts)


def log_losses(record: SessionRecord) -> list[str]:
    """What a log lacks, a sentence each.

    Args:
        record: the session.
    """
    unknown = [str(intent.trial) for intent in record.unknown]
    timeless = [str(trial.index) for trial in record.table if trial.index not in record.onsets]
    said: Sequence[tuple[object, str]] = (
        (record.end_lost, "The end of the log is missing; nobody knows how many stimuli it told of."),
        (unknown, f"The outcome of stimuli that may have been given is not known: trials {', '.join(unknown)}."),
        (timeless, f"The onset is not known of trials {', '.join(timeless)}."),
        (not record.finished and not record.losses, "The session had not closed its log."),
    )
    return [*record.losses, *(sentence for lacks, sentence in said if lacks)]
