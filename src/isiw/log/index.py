"""The index at the end of a closed log, which counts its records."""

from __future__ import annotations

import io
import struct
import zlib
from typing import IO, Final

from mcap import records as mcap
from mcap.stream_reader import StreamReader

from isiw.log.blocks import UNREADABLE

RECORD_HEAD_BYTES: Final = 1 + 8
"""What a record is, and its length."""

_FOOTER_BYTES = 1 + 8 + 8 + 8 + 4
_MAGIC = b"\x89MCAP0\r\n"


def counted_records(file: IO[bytes]) -> mcap.Statistics | None:
    """What the index of a file counts, if it agrees with its checksum, which the library leaves unchecked."""
    file.seek(0)
    data = file.read()
    footer_at = len(data) - len(_MAGIC) - _FOOTER_BYTES
    if footer_at < 0 or not data.endswith(_MAGIC):
        return None
    index_at, _, checksum = struct.unpack_from("<QQI", data, footer_at + RECORD_HEAD_BYTES)
    index = data[index_at : len(data) - len(_MAGIC)]
    if zlib.crc32(index[:-4]) != checksum:
        return None
    try:
        records = list(StreamReader(io.BytesIO(index + _MAGIC), skip_magic=True).records)
    except UNREADABLE:
        return None
    return next((record for record in records if isinstance(record, mcap.Statistics)), None)
