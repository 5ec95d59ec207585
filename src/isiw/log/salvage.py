"""Salvage: everything that can still be read from a log, be it finished, torn or damaged, and what cannot, in words.

A log may come from anywhere, so what it unpacks to is limited by its own size, and so is the number of its records.
"""

from __future__ import annotations

import io
import itertools
import os
import re
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Final, cast

import zstandard
from mcap import records as mcap
from mcap.exceptions import EndOfFile, McapError
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk

from isiw.errors import DamagedLogError, LogError
from isiw.log.durable import Fingerprint, disk_errors, log_of, part_of
from isiw.log.schema import ANNOUNCEMENT, CHANNEL_IDS

__all__ = ["Message", "Salvage", "current_file", "holds", "salvage", "salvage_file"]

_UNREADABLE = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, MemoryError, OverflowError)
"""What the MCAP reader raises on damaged bytes; a failed checksum is a ValueError."""

_CHUNK_MARK = b"\x04\x00\x00\x00zstd"
_CHUNK_MARK_AT = 8 + 8 + 8 + 4  # behind a chunk's two times, size and checksum
_CHUNK_HEAD: Final = struct.Struct("<QQQI4x4xQ")
"""A chunk's two times, size and checksum, then the mark, and the length of its data."""

_RECORD_HEAD_BYTES = 1 + 8  # what it is, and its length
_FOOTER_BYTES = 1 + 8 + 8 + 8 + 4
_MAGIC = b"\x89MCAP0\r\n"

MOST_UNPACKED: Final = (64 * 2**20, 100)
"""What a log may unpack to [bytes], and how many times its own size besides; one of constant waveforms comes to 50."""

MOST_RECORDS: Final = 500_000
"""What a log may hold; two thousand trials of ten channels come to 30,000."""


@dataclass(frozen=True)
class Message:
    """One record, still as bytes.

    Args:
        topic: its topic.
        data: its JSON.
        log_time_ns: when it was logged [ns since 1970].
        sequence: its number in the file, from 0.
    """

    topic: str
    data: bytes
    log_time_ns: int
    sequence: int = 0


@dataclass
class Salvage:
    """What was read.

    Args:
        path: the file that was read.
        size: its size [bytes].
        fingerprint: which file it was, and in which state.
        messages: the records, in the order in which they were written.
        attachments: by name.
        losses: what could not be read, a sentence each; empty where nothing is missing.
        finished: whether the session closed its log.
        end_lost: whether the end of a closed log is missing, so that nobody knows how many stimuli it told of.
        delivered: how many stimuli the index at the end of the log counts; 0 where there is no such index.
        topics: by channel number; known beforehand, in case the chunk that defines the channels is lost.
    """

    path: Path
    size: int = 0
    fingerprint: Fingerprint | None = None
    messages: list[Message] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    losses: list[str] = field(default_factory=list)
    finished: bool = False
    end_lost: bool = False
    delivered: int = 0
    topics: dict[int, str] = field(default_factory=lambda: {number: topic for topic, number in CHANNEL_IDS.items()})


def current_file(path: str | Path) -> Path:
    """The file that holds the most of a log: `FILE.part` where there is one, as it began as a copy of `FILE`.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: there is neither.
    """
    log = log_of(Path(path))
    for candidate in (part_of(log), log):
        if candidate.is_file():
            return candidate
    raise LogError("there is no such log", got=str(path), remedy="Check the path; isiw run prints it at its end.")


def salvage(path: str | Path) -> Salvage:
    """Read everything that can be read from a log.

    Where there are both `FILE.part` and `FILE`, the first is the second's continuation and is read; where it is not,
    the file that was named is.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one that may not be read.
        DamagedLogError: a log of which nothing can be read.
    """
    if not isinstance(path, str | os.PathLike):
        raise LogError("a log is named by its path", got=path, expected="text or a path")
    with disk_errors(Path(path), "the log cannot be read", "Check its permissions and those of its folder."):
        current, closed = current_file(path), log_of(Path(path))
        if Path(path) == current or not closed.is_file():
            return salvage_file(current)
        return _continuation(current, closed)


def _continuation(part: Path, closed: Path) -> Salvage:
    """What a log's `.part` holds, if that goes on from the closed log; else the closed log."""
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
    """Whether a log holds every record of another, as its continuation does.

    Args:
        later: the log.
        earlier: the other one.
    """
    every, needed = (Counter((m.topic, m.data) for m in found.messages) for found in (later, earlier))
    return needed <= every


def salvage_file(path: Path) -> Salvage:
    """Read everything that can be read from one file, whatever else is beside it.

    Raises:
        LogError: no such file, not a log, or one that may not be read.
        DamagedLogError: a log of which nothing can be read.
    """
    found = Salvage(path)
    with (
        disk_errors(path, "the log cannot be read", "Check its permissions and those of its folder."),
        path.open("rb") as file,
    ):
        found.fingerprint = Fingerprint.of(file)
        found.size = found.fingerprint.size
        _read_file(file, found)
    if not found.messages and not found.attachments:
        raise DamagedLogError(
            "nothing can be read from the log", got=str(found.path), remedy="Is it an isiw log (MCAP)?"
        )
    return found


def _read_file(file: IO[bytes], found: Salvage) -> None:
    if not file.read(len(_MAGIC)):
        raise DamagedLogError("the log is empty", got=str(found.path), remedy="Nothing was recorded in it; delete it.")
    file.seek(0)
    reading = _Reading(file, found)
    reading.read()
    counted = _counted(file)
    if counted is None and found.finished and not found.losses:
        found.losses.append("The index at the end of the file fails its checksum. No record is affected.")
    _put_in_order(found)
    _report_gaps(found, 0 if counted is None else counted.message_count)
    if counted is not None:
        found.delivered = max(counted.channel_message_counts.get(CHANNEL_IDS[t], 0) for t in ("/intent", "/trial"))
    found.end_lost = found.path.suffix != ".part" and counted is None and not reading.whole


class _Reading:
    """Reading one file record after record; a chunk that fails is left out, and reading goes on behind it."""

    def __init__(self, file: IO[bytes], found: Salvage) -> None:
        self.file, self.found = file, found
        self.sealed = False
        """Whether the end of the records was reached."""
        self.whole = False
        """Whether everything up to there agrees with its checksum."""
        self._readable_to = self._chunks = 0
        self._unpacking = _Unpacking(found.size)

    def read(self) -> None:
        """Read to the end, or to where records can no longer be followed, and search for the rest."""
        found = self.found
        try:
            self._read_records()
            self.whole = True
        except CRCValidationError:
            found.finished = self.sealed = True
            self._search_swallowed()
            if not found.losses:
                found.losses.append("The checksum of the whole file fails, though every record's own is good.")
        except _UNREADABLE as error:
            self.whole = self.sealed
            if not self.sealed:
                self._read_torn(at_a_records_end=isinstance(error, EndOfFile) and self.file.tell() == self._readable_to)
            elif found.path.suffix != ".part":  # a session that was killed while it closed its log has lost nothing
                found.losses.append("The index at the end of the file is damaged. No record is affected.")
        if found.finished and not self.sealed:
            found.losses.append("The mark behind the last record is damaged. No record is affected.")

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
            self._chunks += 1
            self._unpacking.read(record, self._readable_to, found)
        elif isinstance(record, mcap.Attachment):
            _keep_attachment(record, self.file, self._readable_to, found)
        elif isinstance(record, mcap.Metadata) and record.name.startswith(ANNOUNCEMENT):
            found.topics[int(record.metadata["id"])] = record.metadata["topic"]
        self.sealed = self.sealed or isinstance(record, mcap.DataEnd)
        found.finished = found.finished or isinstance(record, mcap.Footer)

    def _read_torn(self, *, at_a_records_end: bool) -> None:
        """Read a file that ends before its records do."""
        found, closed = self.found, self.found.path.suffix != ".part"
        if at_a_records_end and self._chunks == sum(1 for _ in self._marked()):  # no chunk was taken for something else
            if closed:
                found.losses.append(
                    f"The log ends at byte {found.size} without the mark that closes it: it was cut off, and nobody "
                    "knows how many records are lost."
                )
            return
        self._search()
        found.losses.insert(0, f"The log is torn or damaged at byte {self._readable_to} of {found.size}.")

    def _search_swallowed(self) -> None:
        """Read all chunks again where fewer were met than there are: a damaged length has swallowed some."""
        if self._chunks < sum(1 for _ in self._marked(self._readable_to)):
            self._search(self._readable_to)

    def _search(self, size: int = -1) -> None:
        """Read all chunks of a file in which the records' lengths can no longer be followed from one to the next."""
        self.found.messages.clear()
        self.found.losses.clear()
        self._unpacking = _Unpacking(self.found.size)
        for start, chunk in self._marked(size):
            self._unpacking.read(chunk, start, self.found)

    def _marked(self, size: int = -1) -> Iterator[tuple[int, mcap.Chunk]]:
        """All chunks that are there as a whole, and where; a torn one shows in the numbers of its records.

        Behind the first `size` bytes nothing is searched: the index at the end of a file looks like chunks.
        """
        self.file.seek(0)
        data, copied = self.file.read(size), 0
        for match in re.finditer(re.escape(_CHUNK_MARK), data):
            start = match.start() - _CHUNK_MARK_AT
            begin = start + _CHUNK_HEAD.size
            if start < 0 or begin > len(data):
                continue
            first, last, unpacked, checksum, length = _CHUNK_HEAD.unpack_from(data, start)
            if begin + length > len(data) or (copied := copied + length) > _most_unpacked(self.found.size):
                continue
            yield start, mcap.Chunk("zstd", data[begin : begin + length], last, first, checksum, unpacked)


def _keep_attachment(attachment: mcap.Attachment, file: IO[bytes], start: int, found: Salvage) -> None:
    """Keep an attachment that has just been read, if it agrees with its checksum; the library leaves that unchecked."""
    end = file.tell()
    file.seek(start + _RECORD_HEAD_BYTES)
    content = file.read(end - file.tell())
    if zlib.crc32(content[:-4]) == int.from_bytes(content[-4:], "little"):
        found.attachments[attachment.name] = attachment.data
    else:
        found.losses.append(f"The attachment {attachment.name} fails its checksum and is lost.")


class _Exact:
    """A file that raises where it ends too early; the reader would take half a record for a whole one."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def read(self, size: int) -> bytes:
        data = self._file.read(size)
        if len(data) < size:
            raise EndOfFile
        return data


def _most_unpacked(size: int) -> int:
    """How much a log of a size may unpack to [bytes]."""
    least, times = MOST_UNPACKED
    return least + times * size


class _Unpacking:
    """Unpacks chunk after chunk of a file, as far as a file of its size may go."""

    def __init__(self, size: int) -> None:
        self._bytes_left, self._records_left = _most_unpacked(size), MOST_RECORDS

    def read(self, chunk: mcap.Chunk, offset: int, found: Salvage) -> None:
        """Keep the records of a chunk, or say why not."""
        try:
            size = _honest_size(chunk)
            if size > self._bytes_left or not self._records_left:
                found.losses.append(f"The block at byte {offset} makes the log too large to be one, and is left out.")
                return
            contents = breakup_chunk(chunk, validate_crc=True)
        except _UNREADABLE:
            found.losses.append(f"A block of {len(chunk.data)} bytes at byte {offset} fails its checksum and is lost.")
            return
        self._bytes_left -= size
        self._records_left = max(0, self._records_left - len(contents))
        for record in contents:
            if isinstance(record, mcap.Channel):
                found.topics[record.id] = record.topic
            elif isinstance(record, mcap.Message) and record.channel_id in found.topics:
                found.messages.append(
                    Message(found.topics[record.channel_id], record.data, record.log_time, record.sequence)
                )


def _honest_size(chunk: mcap.Chunk) -> int:
    """What a chunk unpacks to [bytes].

    Raises:
        McapError: it is packed in another way than isiw's, or unpacks to something else than it says.
    """
    packed = {"": len, "zstd": zstandard.frame_content_size}
    if chunk.compression not in packed or packed[chunk.compression](chunk.data) != chunk.uncompressed_size:
        raise McapError(chunk.compression)
    return chunk.uncompressed_size


def _counted(file: IO[bytes]) -> mcap.Statistics | None:
    """What the index at the end of a log counts, if it agrees with its checksum, which the library leaves unchecked."""
    file.seek(0)
    data = file.read()
    footer_at = len(data) - len(_MAGIC) - _FOOTER_BYTES
    if footer_at < 0 or not data.endswith(_MAGIC):
        return None
    index_at, _, checksum = struct.unpack_from("<QQI", data, footer_at + _RECORD_HEAD_BYTES)
    index = data[index_at : len(data) - len(_MAGIC)]
    if zlib.crc32(index[:-4]) != checksum:
        return None
    try:
        records = list(StreamReader(io.BytesIO(index + _MAGIC), skip_magic=True).records)
    except _UNREADABLE:
        return None
    return next((record for record in records if isinstance(record, mcap.Statistics)), None)


def _put_in_order(found: Salvage) -> None:
    """Put the records in the order of their numbers, each once."""
    first_of = dict[int, Message]()
    for message in found.messages:
        first_of.setdefault(message.sequence, message)
    ordered = [first_of[number] for number in sorted(first_of)]
    if twice := len(found.messages) - len(ordered):
        found.losses.append(
            f"{twice} {'record is' if twice == 1 else 'records are'} in the file twice; the first of each counts."
        )
    elif ordered != found.messages:
        found.losses.append(
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
