"""Blocks are found by their marks, and unpacked as far as a file of their size may go."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import pytest
import zstandard
from mcap.records import Chunk

from isiw.log.blocks import MOST_RECORDS, LostBlockError, Unpacking, counted_records, marked
from isiw.log.salvage import salvage


def block(content: bytes, *, said: int | None = None, compression: str = "zstd") -> Chunk:
    """A block of some bytes; 0 is no checksum."""
    size = len(content) if said is None else said
    return Chunk(compression, zstandard.compress(content), 0, 0, 0, size)


def test_every_block_of_a_log_is_found_by_its_mark(finished_log: object) -> None:
    data = salvage(str(finished_log)).path.read_bytes()
    found = list(marked(data, len(data)))
    unpacking = Unpacking(len(data))
    first = unpacking.records(found[0][1], found[0][0])
    assert len(found) > 8
    assert [data[start] for start, _ in found[:3]] == [6, 6, 6]  # the code of a block
    assert first


def test_a_block_that_ends_behind_the_file_is_not_found(finished_log: object) -> None:
    data = salvage(str(finished_log)).path.read_bytes()
    (start, first), *_ = marked(data, len(data))
    torn = data[: start + len(first.data)]
    assert list(marked(torn, len(torn))) == []


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (block(bytes(100), said=99), "fails its checksum"),
        (block(bytes(100), compression="lz4"), "fails its checksum"),
        (block(bytes(70 * 2**20)), "too large"),
    ],
)
def test_a_block_that_lies_about_itself_is_lost_and_says_where(wrong: Chunk, reason: str) -> None:
    with pytest.raises(LostBlockError, match=rf"at byte 37.*{reason}"):
        Unpacking(1000).records(wrong, 37)


def test_blocks_that_cannot_be_read_use_up_what_a_file_may_unpack_to() -> None:
    unpacking, some = Unpacking(0), block(b"\xff" * 40 * 2**20)
    with pytest.raises(LostBlockError, match="fails its checksum"):
        unpacking.records(some, 0)
    with pytest.raises(LostBlockError, match="too large"):
        unpacking.records(some, 0)


def test_more_empty_records_than_a_log_may_hold_are_not_even_read() -> None:
    with pytest.raises(LostBlockError, match="too large"):
        Unpacking(0).records(block(bytes(9 * (MOST_RECORDS + 1))), 0)


def test_counts_are_those_of_an_index_whose_checksum_and_end_are_right(finished_log: Path) -> None:
    data = finished_log.read_bytes()
    footer_at, beyond = len(data) - 37, struct.pack("<Q", 2**64 - 1)
    lies = [data[:-1] + b"x", data[: footer_at + 9] + beyond + data[footer_at + 17 :], data[:9]]
    found = counted_records(io.BytesIO(data))
    assert found is not None
    assert found.message_count > 8
    assert [counted_records(io.BytesIO(each)) for each in lies] == [None, None, None]


def test_blocks_behind_a_mark_of_nothing_are_found(finished_log: Path) -> None:
    data = finished_log.read_bytes()
    found = list(marked(data, len(data)))
    (start, first), *_ = found
    begin = data.index(first.data)
    nothing = bytearray(data[start:begin] + bytes(4))
    nothing[1] ^= 1  # the length of the record
    both = bytes(nothing) + data
    assert [block for _, block in marked(both, len(both))] == [block for _, block in found]
