"""Salvage: everything that can still be read from a log, be it finished, torn or damaged, and what cannot, in words."""

from __future__ import annotations

import itertools
import os
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Final, cast

from mcap import records as mcap
from mcap.exceptions import EndOfFile
from mcap.stream_reader import CRCValidationError, StreamReader

from isiw.errors import DamagedLogError, LogError, os_errors
from isiw.log.blocks import RECORD_HEAD_BYTES, UNREADABLE, LostBlockError, Unpacking, counted_records, marked
from isiw.log.places import Fingerprint, log_of, part_of
from isiw.log.schema import ANNOUNCEMENT, CHANNEL_IDS, Message, is_of_isiw, without_samples
from isiw.opening import opened
from isiw.text.sanitize import counted

_PERMISSIONS: Final = "Check its permissions and those of its folder."


@dataclass
class Salvage:
    """All that was read of a log; `losses` are sentences, and topics are known even if their definition is lost.

    Those of them in `harmless` cost no record, or one that was never finished, so that nothing rested on it. With
    `end_lost` nobody knows how many stimuli there were; `counted` has the index's counts by topic. Of waveforms on
    other `topics_kept` the samples are not kept; with None all are.
    """

    path: Path
    topics_kept: frozenset[str] | None = None
    size: int = 0
    fingerprint: Fingerprint | None = None
    messages: list[Message] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    losses: list[str] = field(default_factory=list)
    harmless: set[str] = field(default_factory=set)
    finished: bool = False
    end_lost: bool = False
    counted: dict[str, int] = field(default_factory=dict)
    topics: dict[int, str] = field(default_factory=lambda: {number: topic for topic, number in CHANNEL_IDS.items()})

    @property
    def lost_records(self) -> list[str]:
        """The losses that cost records, or may have."""
        return [loss for loss in self.losses if loss not in self.harmless]

    def note_harmless(self, sentence: str) -> None:
        """Note damage that cost no record."""
        self.losses.append(sentence)
        self.harmless.add(sentence)


def current_file(path: str | Path) -> Path:
    """The file that holds the most of a log: `FILE.part` where there is one, as it began as a copy of `FILE`."""
    log = log_of(Path(path))
    for candidate in (part_of(log), log):
        if candidate.is_file():
            return candidate
    raise LogError(
        "there is no such log",
        got=str(path),
        remedy="Check the path; isiw run prints it when it begins and when it ends.",
    )


def salvage(path: str | Path, topics_kept: frozenset[str] | None = None) -> Salvage:
    """Read everything that can be read from a log, of waveforms on other topics than these all but the samples.

    Where there are both `FILE.part` and `FILE`, the first is the second's continuation and is read; if it is not,
    the file that was named is.
    """
    if not isinstance(path, str | os.PathLike):
        raise LogError("a log is named by its path", got=path, expected="text or a path")
    with os_errors(LogError, "the log cannot be read", path, _PERMISSIONS):
        current, closed = current_file(path), log_of(Path(path))
        if Path(path) == current or not closed.is_file():
            return salvage_file(current, topics_kept)
        return _continuation(current, closed)


def _continuation(part: Path, closed: Path) -> Salvage:
    """The contents of a log's `.part`, if that goes on from the closed log; else the closed log."""
    found = []
    for path in (part, closed):
        try:
            found.append(salvage_file(path))
        except LogError as error:
            unreadable = error
    if not found:
        raise unreadable
    return found[0] if holds(found[0], found[-1]) else found[-1]


def holds(later: Salvage, earlier: Salvage) -> bool:
    """True if a log holds every record of another, as its continuation does."""
    return not only_in(earlier, later)


def only_in(found: Salvage, other: Salvage) -> int:
    """The number of records that a log has and another one has not."""
    own, others = (Counter((m.topic, m.data) for m in each.messages) for each in (found, other))
    return (own - others).total()


def salvage_file(path: Path, topics_kept: frozenset[str] | None = None) -> Salvage:
    """Read everything that can be read from one file, whatever else is beside it; `topics_kept` as in `Salvage`."""
    found = Salvage(path, topics_kept)
    with os_errors(LogError, "the log cannot be read", path, _PERMISSIONS), opened(path) as file:
        found.fingerprint = Fingerprint.of(file)
        found.size = found.fingerprint.size
        _read_file(file, found)
    if not found.messages and not found.attachments:
        raise DamagedLogError(
            "nothing can be read from this file as a log",
            got=str(found.path),
            remedy="Name the log that isiw wrote, an MCAP file; a configuration (TOML) is none.",
        )
    return found


def _read_file(file: IO[bytes], found: Salvage) -> None:
    if not found.size:
        raise DamagedLogError("the log is empty", got=str(found.path), remedy="Nothing was recorded in it; delete it.")
    reading = _Reading(file, found)
    reading.read()
    counted = counted_records(file)
    if counted is None and found.finished and not found.losses:
        found.note_harmless("The index at the end of the file fails its checksum. No record is affected.")
    _put_in_order(found)
    _report_gaps(found, 0 if counted is None else counted.message_count)
    if counted is not None:
        found.counted = {topic: counted.channel_message_counts.get(number, 0) for topic, number in CHANNEL_IDS.items()}
    found.end_lost = found.path.suffix != ".part" and counted is None and not reading.whole


class _Reading:
    """Reading one file record after record; a chunk that fails is left out, and reading goes on behind it."""

    def __init__(self, file: IO[bytes], found: Salvage) -> None:
        self.file, self.found = file, found
        self.sealed = False
        """True if the end of the records was reached."""
        self.whole = False
        """True if everything up to there agrees with its checksum."""
        self._readable_to = 0
        self._met: set[int] = set()
        """Where the chunks are that were met."""
        self._unpacking = Unpacking(found.size)

    def read(self) -> None:
        """Read to the end, or to where records can no longer be followed, and search for the rest."""
        found = self.found
        try:
            self._read_records()
            self.whole = True
        except CRCValidationError:
            found.finished = self.sealed = True
            if self._has_missed_some():
                self._search()
            if not found.losses:
                found.note_harmless("The checksum of the whole file fails, though every record's own is good.")
        except UNREADABLE as error:
            at_a_records_end = isinstance(error, EndOfFile) and self.file.tell() == self._readable_to
            self.sealed = self.whole = self.sealed and not self._has_missed_some()
            if not self.sealed:
                self._read_torn(at_a_records_end=at_a_records_end)
            elif found.path.suffix != ".part":  # a session that was killed while it closed its log has lost nothing
                found.note_harmless("The index at the end of the file is damaged. No record is affected.")
        if found.finished and not self.sealed:
            found.note_harmless("The mark behind the last record is damaged. No record is affected.")

    def _read_records(self) -> None:
        whole = cast("IO[bytes]", _Exact(self.file))
        reader = StreamReader(whole, emit_chunks=True, validate_crcs=True, record_size_limit=self.found.size)
        for record in reader.records:
            self._keep(record)
            self._readable_to = self.file.tell()

    def _keep(self, record: mcap.McapRecord) -> None:
        """Keep what a record that has just been read holds."""
        found = self.found
        if isinstance(record, mcap.Chunk):
            self._met.add(self._readable_to)
            self._unpack(record, self._readable_to)
        elif isinstance(record, mcap.Attachment):
            _keep_attachment(record, self.file, self._readable_to, found)
        elif isinstance(record, mcap.Metadata) and record.name.startswith(ANNOUNCEMENT):
            found.topics[int(record.metadata["id"])] = record.metadata["topic"]
        elif isinstance(record, mcap.DataEnd):
            self.sealed = self.sealed or self._is_as_long_as_it_says()
        found.finished = found.finished or isinstance(record, mcap.Footer)

    def _is_as_long_as_it_says(self) -> bool:
        """True if the record that has just been read has the length that it states."""
        end = self.file.tell()
        self.file.seek(self._readable_to + 1)
        length = int.from_bytes(self.file.read(8), "little")
        self.file.seek(end)
        return self._readable_to + RECORD_HEAD_BYTES + length == end

    def _read_torn(self, *, at_a_records_end: bool) -> None:
        """Read a file that ends before its records do."""
        found, closed = self.found, self.found.path.suffix != ".part"
        if at_a_records_end and not self._has_missed_some():
            if closed:
                found.losses.append(
                    f"The log ends at byte {found.size} without the mark that closes it: it was cut off, and nobody "
                    "knows how many records are lost."
                )
            return
        self._search()
        if not closed and self._is_unfinished():
            found.note_harmless(
                f"The last record, at byte {self._readable_to} of {found.size}, was not finished when the session "
                "died. Nothing is lost that was on the disk before."
            )
            return
        found.losses.insert(0, f"The log is torn or damaged at byte {self._readable_to} of {found.size}.")

    def _is_unfinished(self) -> bool:
        """True if the file ends within the record at which reading ended: it was never synced, nothing followed it."""
        self.file.seek(self._readable_to)
        rest = self.file.read()
        if not rest.strip(b"\0"):  # a file may be longer than what was written when the power went
            return True
        ends = self._readable_to + RECORD_HEAD_BYTES + int.from_bytes(rest[1:RECORD_HEAD_BYTES], "little")
        is_cut = len(rest) < RECORD_HEAD_BYTES or ends > self.found.size
        return is_cut and all(start < self._readable_to for start, _ in self._marked())

    def _has_missed_some(self) -> bool:
        """True if there are chunks that were not met, as a damaged record was taken for another or for a longer one."""
        return not self._met.issuperset(start for start, _ in self._marked())

    def _search(self) -> None:
        """Read all chunks of a file in which the records' lengths can no longer be followed from one to the next."""
        self.found.messages.clear()
        self.found.losses.clear()
        self.found.harmless.clear()
        self._unpacking = Unpacking(self.found.size)
        for start, chunk in self._marked():
            self._unpack(chunk, start)

    def _marked(self) -> Iterator[tuple[int, mcap.Chunk]]:
        self.file.seek(0)
        return marked(self.file.read(), self.found.size)

    def _unpack(self, chunk: mcap.Chunk, offset: int) -> None:
        """Keep what a chunk holds, or say why not."""
        found = self.found
        try:
            contents = self._unpacking.records(chunk, offset)
        except LostBlockError as error:
            found.losses.append(str(error))
            return
        for record in contents:
            if isinstance(record, mcap.Channel):
                found.topics[record.id] = record.topic
            elif isinstance(record, mcap.Message) and record.channel_id in found.topics:
                topic = found.topics[record.channel_id]
                found.messages.append(Message(topic, self._kept(topic, record.data), record.log_time, record.sequence))

    def _kept(self, topic: str, data: bytes) -> bytes:
        """What is kept of a record."""
        kept = self.found.topics_kept
        if kept is None or topic in kept or is_of_isiw(topic):
            return data
        return without_samples(data) or data


def _keep_attachment(attachment: mcap.Attachment, file: IO[bytes], start: int, found: Salvage) -> None:
    """Keep an attachment that has just been read, if it agrees with its checksum; the library leaves that unchecked."""
    end = file.tell()
    file.seek(start + RECORD_HEAD_BYTES)
    content = file.read(end - file.tell())
    if zlib.crc32(content[:-4]) == int.from_bytes(content[-4:], "little"):
        found.attachments[attachment.name] = attachment.data
    else:
        found.losses.append(f"The attachment {attachment.name} fails its checksum and is lost.")


class _Exact:
    """A file that raises if it ends too early; the reader would take half a record for a whole one."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def read(self, size: int) -> bytes:
        data = self._file.read(size)
        if len(data) < size:
            raise EndOfFile
        return data


def _put_in_order(found: Salvage) -> None:
    """Put the records in the order of their numbers, each once."""
    first_of = dict[int, Message]()
    for message in found.messages:
        first_of.setdefault(message.sequence, message)
    ordered = [first_of[number] for number in sorted(first_of)]
    if twice := len(found.messages) - len(ordered):
        found.losses.append(
            f"{counted(twice, 'record is', 'records are')} in the file twice; the first of each counts."
        )
    elif ordered != found.messages:
        found.note_harmless(
            "Blocks of the file were out of order; their records are read in the order of their numbers."
        )
    found.messages[:] = ordered


def _report_gaps(found: Salvage, counted: int) -> None:
    """Say which numbers are missing, up to the last record and to what the index counts."""
    numbers = [message.sequence for message in found.messages]
    for before, after in itertools.pairwise([-1, *numbers, max(counted, numbers[-1] + 1 if numbers else 0)]):
        if after - before == 2:
            found.losses.append(f"Record {before + 1} is lost.")
        elif after - before > 2:
            found.losses.append(f"Records {before + 1} to {after - 1} are lost.")
