"""Damage to logs, as disks and copies do it."""

from __future__ import annotations

import re
from pathlib import Path


def cut_after(log: Path, trials: int) -> None:
    """Leave of a closed log what a copy in part leaves: so many trials, cut at the end of a record."""
    begins, _ = blocks_of(log)[3 * trials + 1]  # a header, then intent, trial and estimate of each
    log.write_bytes(log.read_bytes()[:begins])


def blocks_of(log: Path) -> list[tuple[int, int]]:
    """Where each block of records of a log begins and ends, closed or not."""
    whole = log.read_bytes()
    starts = [match.start() - 37 for match in re.finditer(b"\x04\x00\x00\x00zstd", whole)]
    blocks = [(start, start + 9 + int.from_bytes(whole[start + 1 : start + 9], "little")) for start in starts]
    return [(start, end) for start, end in blocks if whole[start] == 6]  # in the index each is named once more


def damage(log: Path, block: int = -1) -> None:
    """Change a bit of one block of a log."""
    content = bytearray(log.read_bytes())
    content[blocks_of(log)[block][1] - 20] ^= 0x10
    log.write_bytes(content)
