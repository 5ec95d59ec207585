"""Damage to logs, as disks and copies do it."""

from __future__ import annotations

import re
from pathlib import Path

from mcap.reader import make_reader

from known import known


def cut_after(log: Path, trials: int) -> None:
    """Leave of a closed log what a copy in part leaves: so many trials, cut at the end of a record."""
    whole = log.read_bytes()
    blocks = [match.start() - 37 for match in re.finditer(b"\x04\x00\x00\x00zstd", whole)]
    log.write_bytes(whole[: blocks[3 * trials + 1]])  # a header, then intent, trial and estimate of each


def blocks_of(log: Path) -> list[tuple[int, int]]:
    """Where each block of records of a closed log begins and ends."""
    with log.open("rb") as file:
        chunks = known(make_reader(file).get_summary()).chunk_indexes
    return [(chunk.chunk_start_offset, chunk.chunk_start_offset + chunk.chunk_length) for chunk in chunks]


def damage(log: Path, block: int = -1) -> None:
    """Change a bit of one block of a closed log."""
    content = bytearray(log.read_bytes())
    content[blocks_of(log)[block][1] - 20] ^= 0x10
    log.write_bytes(content)
