"""Which code of isiw runs: a version says nothing of a checkout that was updated in between."""

from __future__ import annotations

import zlib
from functools import cache
from pathlib import Path

import isiw


@cache
def code_checksum() -> str:
    """The CRC-32 of isiw's modules, whatever their line endings."""
    root, checksum = Path(isiw.__file__).parent, 0
    for path in sorted(root.rglob("*.py")):
        checksum = zlib.crc32(path.relative_to(root).as_posix().encode(), checksum)
        checksum = zlib.crc32(path.read_bytes().replace(b"\r\n", b"\n"), checksum)
    return f"{checksum:08x}"
