"""Salvage: everything that can still be read from a log, be it finished, torn or damaged, and what cannot, in words."""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, cast

import zstandard
from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk

from isiw.errors import DamagedLogError, LogError
from isiw.log.durable import disk_errors, log_of, part_of
from isiw.log.schema import ANNOUNCEMENT, CHANNEL_IDS

__all__ = ["Message", "Salvage", "current_file", "salvage"]

_UNREADABLE = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, MemoryError, OverflowError)
"""What the MCAP reader raises on damaged bytes; a failed checksum is a ValueError."""

_CHUNK_MARK = b"\x04\x00\x00\x00zstd"
_CHUNK_MARK_AT = 8 + 8 + 8 + 4  # behind a chunk's two times, size and checksum

_RECORD_HEAD_BYTES = 1 + 8  # what it is, and its length
_FOOTER_BYTES = 1 + 8 + 8 + 8 + 4
_MAGIC = b"\x89MCAP0\r\n"


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
        messages: the records, in the order in which they were written.
        attachments: by name.
        losses: what could not be read, a sentence each; empty where nothing is missing.
        finished: whether the session closed its log.
        topics: by channel number; known beforehand, in case the chunk that defines the channels is lost.
    """

    path: Path
    size: int = 0
    messages: list[Message] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    losses: list[str] = field(default_factory=list)
    finished: bool = False
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

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one that may not be read.
        DamagedLogError: a log of which nothing can be read.
    """
    with disk_errors(Path(path), "the log cannot be read", "Check its permissions and those of its folder."):
        found = Salvage(current_file(path))
        with found.path.open("rb") as file:
            _read_file(file, found)
    _report_gaps(found)
    if not found.messages and not found.attachments:
        raise DamagedLogError(
            "nothing can be read from the log", got=str(found.path), remedy="Is it an isiw log (MCAP)?"
        )
    return found


def _read_file(file: IO[bytes], found: Salvage) -> None:
    if not file.read(len(_MAGIC)):
        raise DamagedLogError("the log is empty", got=str(found.path), remedy="Nothing was recorded in it; delete it.")
    file.seek(0)
    found.size = found.path.stat().st_size
    _read(file, found)
    if found.finished and not found.losses:
        _check_summary(file, found)


def _read(file: IO[bytes], found: Salvage) -> None:
    """Read record after record; a chunk that fails is left out, and reading goes on behind it."""
    whole = cast("IO[bytes]", _Exact(file))
    reader = StreamReader(whole, emit_chunks=True, validate_crcs=True, record_size_limit=found.size)
    readable_to, chunks, sealed = 0, 0, False
    try:
        for record in reader.records:
            _keep(record, file, readable_to, found)
            chunks += isinstance(record, mcap.Chunk)
            readable_to = file.tell()
            sealed = sealed or isinstance(record, mcap.DataEnd)
            found.finished = found.finished or isinstance(record, mcap.Footer)
    except CRCValidationError:
        found.finished = sealed = True
        _search_swallowed(file, found, chunks, readable_to)
        if not found.losses:
            found.losses.append("The checksum of the whole file fails, though every record's own is good.")
    except _UNREADABLE as error:
        if isinstance(error, EndOfFile) and file.tell() == readable_to and chunks == sum(1 for _ in _chunks(file)):
            pass  # a session that never closed its log; nothing is torn, and no chunk was taken for something else
        elif sealed:
            found.losses.append("The index at the end of the file is damaged. No record is affected.")
        else:
            _search_chunks(file, found)
            found.losses.insert(0, f"The log is torn or damaged at byte {readable_to} of {found.size}.")
    if found.finished and not sealed:
        found.losses.append("The mark behind the last record is damaged. No record is affected.")


def _keep(record: mcap.McapRecord, file: IO[bytes], start: int, found: Salvage) -> None:
    """Keep what a record that has just been read holds."""
    if isinstance(record, mcap.Chunk):
        _read_chunk(record, start, found)
    elif isinstance(record, mcap.Attachment):
        _keep_attachment(record, file, start, found)
    elif isinstance(record, mcap.Metadata) and record.name.startswith(ANNOUNCEMENT):
        found.topics[int(record.metadata["id"])] = record.metadata["topic"]


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


def _search_swallowed(file: IO[bytes], found: Salvage, chunks: int, size: int) -> None:
    """Read all chunks again where fewer were found than there are: a damaged length has skipped some."""
    if chunks < sum(1 for _ in _chunks(file, size)):
        _search_chunks(file, found, size)


def _search_chunks(file: IO[bytes], found: Salvage, size: int = -1) -> None:
    """Read all chunks of a file in which the records' lengths can no longer be followed from one to the next."""
    found.messages.clear()
    found.losses.clear()
    for start, chunk in _chunks(file, size):
        _read_chunk(chunk, start, found)


def _chunks(file: IO[bytes], size: int = -1) -> Iterator[tuple[int, mcap.Chunk]]:
    """All chunks that can be read, wherever they are, and where; a torn one shows in the numbers of its records.

    Behind the first `size` bytes nothing is searched: the index at the end of a file looks like chunks.
    """
    file.seek(0)
    data = file.read(size)
    for match in re.finditer(re.escape(_CHUNK_MARK), data):
        start = max(0, match.start() - _CHUNK_MARK_AT)
        try:
            yield start, mcap.Chunk.read(ReadDataStream(cast("IO[bytes]", _Exact(io.BytesIO(data[start:])))))
        except _UNREADABLE:
            continue


def _read_chunk(chunk: mcap.Chunk, offset: int, found: Salvage) -> None:
    try:
        contents = list(breakup_chunk(chunk, validate_crc=True))
    except _UNREADABLE:
        found.losses.append(f"A block of {len(chunk.data)} bytes at byte {offset} fails its checksum and is lost.")
        return
    for record in contents:
        if isinstance(record, mcap.Channel):
            found.topics[record.id] = record.topic
        elif isinstance(record, mcap.Message) and record.channel_id in found.topics:
            found.messages.append(
                Message(found.topics[record.channel_id], record.data, record.log_time, record.sequence)
            )


def _check_summary(file: IO[bytes], found: Salvage) -> None:
    """The library leaves the summary's checksum unchecked; it holds no record, but damage is damage."""
    file.seek(0)
    data = file.read()
    footer_at = len(data) - len(_MAGIC) - _FOOTER_BYTES
    summary_at, _, checksum = struct.unpack("<QQI", data[footer_at + 9 : footer_at + _FOOTER_BYTES])
    if zlib.crc32(data[summary_at : footer_at + _FOOTER_BYTES - 4]) != checksum:
        found.losses.append("The index at the end of the file fails its checksum. No record is affected.")


def _report_gaps(found: Salvage) -> None:
    for first, last in _gaps(message.sequence for message in found.messages):
        found.losses.append(f"Record {first} is lost." if first == last else f"Records {first} to {last} are lost.")


def _gaps(sequence: Iterator[int]) -> Iterator[tuple[int, int]]:
    expected = 0
    for number in sequence:
        if number > expected:
            yield expected, number - 1
        expected = number + 1
