"""Salvage: everything that can still be read from a log, finished or torn or damaged, and in words what cannot."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import zstandard
from mcap import records as mcap
from mcap.exceptions import EndOfFile, McapError
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk

from isiw.errors import DamagedLogError, LogError
from isiw.log.schema import TOPICS
from isiw.log.storage import log_of, part_of

__all__ = ["Message", "Salvage", "current_file", "salvage"]

_UNREADABLE = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, MemoryError, OverflowError)
"""What the MCAP reader raises on damaged bytes; a failed checksum is a ValueError."""

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
        messages: the records, in the order in which they were written.
        attachments: by name.
        losses: what could not be read, a sentence each; empty where nothing is missing.
        finished: whether the session closed its log.
    """

    path: Path
    messages: list[Message] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    losses: list[str] = field(default_factory=list)
    finished: bool = False


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
        LogError: no such file, or not a log.
        DamagedLogError: a log of which nothing can be read.
    """
    found = Salvage(current_file(path))
    with found.path.open("rb") as file:
        if not file.read(len(_MAGIC)):
            raise DamagedLogError("the log is empty", got=str(found.path), remedy="No trial was recorded in it.")
        file.seek(0)
        size = found.path.stat().st_size
        reader = StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=size)
        _read(reader, file, size, found)
        if found.finished:
            _check_summary(file, found)
    _report_gaps(found)
    if not found.messages and not found.attachments:
        raise DamagedLogError(
            "nothing can be read from the log", got=str(found.path), remedy="Is it an isiw log (MCAP)?"
        )
    return found


def _read(reader: StreamReader, file: IO[bytes], size: int, found: Salvage) -> None:
    """Read record after record; a chunk that fails is left out, and reading goes on behind it."""
    topics = dict(enumerate(TOPICS, start=1))  # what the channels are, even where the first chunk is lost
    readable_to = 0
    try:
        for record in reader.records:
            if isinstance(record, mcap.Chunk):
                _read_chunk(record, readable_to, topics, found)
            elif isinstance(record, mcap.Attachment):
                found.attachments[record.name] = record.data
            readable_to = file.tell()
            found.finished = found.finished or isinstance(record, mcap.Footer)
    except CRCValidationError:
        found.finished = True
        if not found.losses:
            found.losses.append("The checksum of the whole file fails, though every record's own is good.")
    except EndOfFile:
        if file.tell() != readable_to and not found.finished:
            found.losses.append(_tear(readable_to, size))
    except _UNREADABLE:
        found.losses.append(_tear(readable_to, size))


def _tear(readable_to: int, size: int) -> str:
    return f"The log is unreadable from byte {readable_to} of {size} on; what was written there is lost."


def _read_chunk(chunk: mcap.Chunk, offset: int, topics: dict[int, str], found: Salvage) -> None:
    try:
        contents = list(breakup_chunk(chunk, validate_crc=True))
    except _UNREADABLE:
        found.losses.append(f"A block of {len(chunk.data)} bytes at byte {offset} fails its checksum and is lost.")
        return
    for record in contents:
        if isinstance(record, mcap.Channel):
            topics[record.id] = record.topic
        elif isinstance(record, mcap.Message) and record.channel_id in topics:
            found.messages.append(Message(topics[record.channel_id], record.data, record.log_time, record.sequence))


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
