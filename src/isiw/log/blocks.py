"""The blocks of records in a log's file: found by their marks, and unpacked within limits, whoever made the log."""

from __future__ import annotations

import io
import os
import re
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import IO, Final

import zstandard
from mcap import records as mcap
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader, breakup_chunk

UNREADABLE: Final = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, MemoryError, OverflowError)
"""Errors that the MCAP reader raises on damaged bytes; a failed checksum is a ValueError."""

MOST_UNPACKED: Final = (64 * 2**20, 100)
"""The most that a log may unpack to: bytes, and times its own size; one of constant waveforms comes to 50."""

MOST_RECORDS: Final = 500_000
"""The most records of a log; two thousand trials of ten channels come to 30,000."""

_MARK = b"\x04\x00\x00\x00zstd"
_MARK_AT = 1 + 8 + 8 + 8 + 8 + 4  # behind the record's head, and the block's two times, size and checksum
_HEAD: Final = struct.Struct("<BQQQQI4x4xQ")
"""The head of a block: a record's kind and length, two times, size and checksum, the mark, and its data's length."""

_RECORD_HEAD: Final = struct.Struct("<BQ")
"""The head of a record: its kind, and its length."""

RECORD_HEAD_BYTES: Final = _RECORD_HEAD.size

_PACKED = b"\x28\xb5\x2f\xfd"
"""The beginning of a block's data (RFC 8878, section 3.1.1)."""


class LostBlockError(Exception):
    """A block that cannot be read; its text is a sentence for the reader of the log."""


def marked(data: bytes, size: int) -> Iterator[tuple[int, mcap.Chunk]]:
    """All blocks that are there as a whole, and where each record begins; a torn one shows in its records' numbers.

    The index at the end of a file bears the same marks. A mark is taken to be the index's where no packed data follow
    it and no record of the right length holds it; one flipped bit cannot make a block look so.
    """
    copied = 0
    for match in re.finditer(re.escape(_MARK), data):
        start = match.start() - _MARK_AT
        begin = start + _HEAD.size
        if start < 0 or begin > len(data):
            continue
        kind, record_length, first, last, unpacked, checksum, length = _HEAD.unpack_from(data, start)
        end = begin + length
        is_headed = kind == Opcode.CHUNK and start + _RECORD_HEAD.size + record_length == end
        if end > len(data) or not (is_headed or data.startswith(_PACKED, begin)):
            continue
        if (copied := copied + length) > _most_unpacked(size):
            continue
        yield start, mcap.Chunk("zstd", data[begin:end], last, first, checksum, unpacked)


class Unpacking:
    """Unpacks block after block of a file, as far as a file of its size may go."""

    def __init__(self, size: int) -> None:
        self._bytes_left, self._records_left = _most_unpacked(size), MOST_RECORDS

    def records(self, block: mcap.Chunk, offset: int) -> Sequence[mcap.McapRecord]:
        """The records of a block."""
        packed = len(block.data)
        try:
            size = _honest_size(block)
            _require_room(offset, self._bytes_left, size)
            self._bytes_left -= size  # whatever becomes of it, as unpacking it takes time
            if block.compression:
                block = replace(block, compression="", data=zstandard.decompress(block.data, size))
            number, left = _count(block.data, self._records_left + 1), self._records_left
            self._records_left = max(0, left - number)
            _require_room(offset, left, number)
            return breakup_chunk(block, validate_crc=True)
        except UNREADABLE as error:
            raise LostBlockError(
                f"A block of {packed} bytes at byte {offset} fails its checksum and is lost."
            ) from error


def _require_room(offset: int, left: int, needed: int) -> None:
    if needed > left:
        raise LostBlockError(f"The block at byte {offset} makes the log too large to be one, and is left out.")


def _count(data: bytes, most: int) -> int:
    """The number of records in an unpacked block; counting ends at the most, whatever follows."""
    at = number = 0
    while at < len(data) and number < most:
        at += _RECORD_HEAD.size + _RECORD_HEAD.unpack_from(data, at)[1]
        number += 1
    return number


def _most_unpacked(size: int) -> int:
    """The most that a log of a size may unpack to [bytes]."""
    least, times = MOST_UNPACKED
    return least + times * size


def _honest_size(block: mcap.Chunk) -> int:
    """The size that a block unpacks to [bytes]."""
    packed = {"": len, "zstd": zstandard.frame_content_size}
    if block.compression not in packed or packed[block.compression](block.data) != block.uncompressed_size:
        raise McapError(block.compression)
    return block.uncompressed_size


_FOOTER_BYTES = 1 + 8 + 8 + 8 + 4
_MAGIC = b"\x89MCAP0\r\n"


def counted_records(file: IO[bytes]) -> mcap.Statistics | None:
    """The counts of a file's index, if it agrees with its checksum, which the library leaves unchecked."""
    end = file.seek(0, os.SEEK_END) - len(_MAGIC)
    footer_at = end - _FOOTER_BYTES
    if footer_at < 0:
        return None
    file.seek(footer_at)
    footer = file.read()
    index_at, _, checksum = struct.unpack_from("<QQI", footer, RECORD_HEAD_BYTES)
    if not footer.endswith(_MAGIC) or index_at > end:
        return None
    file.seek(index_at)
    index = file.read()[: -len(_MAGIC)]
    if zlib.crc32(index[:-4]) != checksum:
        return None
    try:
        records = list(StreamReader(io.BytesIO(index + _MAGIC), skip_magic=True).records)
    except UNREADABLE:
        return None
    return next((record for record in records if isinstance(record, mcap.Statistics)), None)
