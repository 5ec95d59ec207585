"""Which sessions are exported: the logs, whose they are, and which visit of the person each is."""

from __future__ import annotations

import hashlib
import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from isiw.errors import LogError
from isiw.export.copies import once_each, stimuli
from isiw.log.durable import kept_for
from isiw.log.reader import SessionRecord, read_salvaged, read_session
from isiw.log.salvage import salvage_file
from isiw.text.stimuli import StimulusWords, words_of


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

    Copies of a log, such as those in an earlier export, count once, and so does one that was copied before its end, or
    was damaged: of a session that is there several times the log counts that tells of most.
    """
    if not Path(source).is_dir():
        return [read_session(source)], []
    records: dict[str, SessionRecord] = {}
    left_out = []
    for file in _files_of(Path(source)):
        try:
            record = read_salvaged(salvage_file(file))
        except LogError as error:
            left_out.append(f"{file.name} is left out: {error.what}.")
            continue
        first = records.setdefault(hashlib.sha256(file.read_bytes()).hexdigest(), record)
        if first is not record:
            left_out.append(f"{file.name} is left out: it is a copy of {first.path.name}.")
    if not records:
        what = "no log in the folder can be read" if left_out else "there is no log in the folder"
        raise LogError(what, got=str(source), expected="files called .mcap or .mcap.part")
    kept, copies = once_each(list(records.values()))
    return kept, left_out + copies


def _files_of(folder: Path) -> list[Path]:
    """Its logs: finished ones, unfinished ones, and what was kept of damaged ones."""
    files = (file for file in folder.rglob("*.mcap*") if file.is_file())
    return sorted(file for file in files if file.suffix in {".mcap", ".part"} or kept_for(file) is not None)


def numbered(records: Iterable[SessionRecord]) -> list[Part]:
    """Sessions with their person's code and their number, in the order in which they were begun.

    People without a code cannot be told apart, so each of their sessions is taken for another person's.
    """
    sessions: Counter[str] = Counter()
    unnamed = (f"unnamed{number}" for number in itertools.count(1))
    parts = []
    for record in sorted(records, key=lambda each: each.header.created):
        subject = record.header.subject or next(unnamed)
        sessions[subject] += 1
        parts.append(Part(subject, f"{sessions[subject]:02d}", record))
    return sorted(parts, key=lambda part: (part.subject, part.session))


def told_twice(parts: Iterable[Part]) -> list[str]:
    """A sentence for each two sessions that have trials in common."""
    of_stimulus: dict[tuple[int, int], Part] = {}
    said = []
    for part in parts:
        others = Counter(str(of_stimulus.setdefault(each, part)) for each in stimuli(part.record).items())
        said += [
            f"{part}: {number} of its trials are in {other} as well, as copies of a log went on differently; "
            "export one of them."
            for other, number in others.items()
            if other != str(part)
        ]
    return said


def stimulus_of(parts: Iterable[Part]) -> StimulusWords:
    """What the conditioning stimulus of some sessions is called."""
    return words_of(part.record.header.conditioning for part in parts)


def log_losses(record: SessionRecord) -> list[str]:
    """What a log lacks, a sentence each."""
    unknown = [str(intent.trial) for intent in record.unknown]
    timeless = [str(trial.index) for trial in record.table if trial.index not in record.onsets]
    said: Sequence[tuple[object, str]] = (
        (record.end_lost, "The end of the log is missing; nobody knows how many stimuli it told of."),
        (unknown, f"The outcome of stimuli that may have been given is not known: trials {', '.join(unknown)}."),
        (timeless, f"The onset is not known of trials {', '.join(timeless)}."),
        (not record.finished and not record.losses, "The session had not closed its log."),
    )
    unread = (f"The log's {part} cannot be read by this version of isiw." for part in record.unread)
    return [*record.losses, *unread, *(sentence for lacks, sentence in said if lacks)]
