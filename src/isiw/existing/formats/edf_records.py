"""The header of EDF and BDF, and the numbers in their records."""

from __future__ import annotations

from itertools import accumulate
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.files import opened
from isiw.types import FloatArray

_FIELDS: Final = {"label": 16, "transducer": 80, "unit": 8, "least": 8, "most": 8, "lowest": 8, "highest": 8,
                  "filter": 80, "count": 8}  # fmt: skip
"""The fields of each signal in a header, and their bytes."""


class Header(NamedTuple):
    """What a header says of the records, and of each signal by the names of its fields."""

    path: Path
    begins: int  # where the first record does [bytes]
    width: int  # of a sample [bytes]
    record_s: float
    records: int
    fields: dict[str, list[str]]

    @property
    def counts(self) -> list[int]:
        """How many samples of each signal a record has."""
        return [int(count) for count in self.fields["count"]]

    def raw(self, signal: int, first: int, last: int) -> bytes:
        """The bytes of one signal in some records."""
        counts, width = self.counts, self.width
        at, size = width * sum(counts[:signal]), width * sum(counts)
        with opened(self.path) as file:
            file.seek(self.begins + first * size)
            whole = np.frombuffer(file.read((last - first) * size), np.uint8)
        return whole.reshape(last - first, size)[:, at : at + width * counts[signal]].tobytes()

    def samples(self, signal: int, first: int, last: int) -> FloatArray:
        """The numbers of one signal from one sample to before another, in its unit."""
        count = self.counts[signal]
        begin, end = first // count, -(-last // count)
        raw = self.raw(signal, begin, end)
        if self.width == 2:
            digital = np.frombuffer(raw, "<i2").astype(np.float64)
        else:
            triples = np.frombuffer(raw, np.uint8).reshape(-1, 3)
            digital = np.pad(triples, ((0, 0), (1, 0))).copy().view("<i4").ravel() / 256.0
        digital = digital[first - begin * count : last - begin * count]
        if self.is_status(signal):  # of which the lower bits are the triggers
            return (digital.astype(np.int64) & 0xFFFF).astype(np.float64)
        least, most, lowest, highest = (
            float(self.fields[key][signal]) for key in ("least", "most", "lowest", "highest")
        )
        return (digital - lowest) * ((most - least) / (highest - lowest)) + least

    def is_status(self, signal: int) -> bool:
        """True of the signal in which BDF has the codes of triggers."""
        return self.width == 3 and self.fields["label"][signal].casefold() in {"status", "trigger"}


def header_of(path: Path) -> Header:
    """The header of a file."""
    with opened(path) as file:
        head = file.read(256)
        signals = int(head[252:256])
        texts = file.read(256 * signals)
        size = file.seek(0, 2)
    begins = [0, *accumulate(width * signals for width in _FIELDS.values())]
    fields = {
        name: [text_of(texts[begin + n * width : begin + (n + 1) * width]) for n in range(signals)]
        for (name, width), begin in zip(_FIELDS.items(), begins, strict=False)
    }
    width = 3 if head[:1] == b"\xff" else 2
    length, record_s = int(head[184:192]), float(head[244:252])
    records = (size - length) // (width * sum(map(int, fields["count"])))
    stated = int(head[236:244])
    if not record_s > 0 or not records:
        raise InvalidValueError("the file has no records of signals", got=f"{records} records of {record_s:g} s")
    return Header(path, length, width, record_s, records if stated < 0 else min(records, stated), fields)


def text_of(field: bytes) -> str:
    """A text as headers and annotations have it."""
    try:
        return field.decode("utf-8").strip(" \0")
    except UnicodeDecodeError:
        return field.decode("latin-1").strip(" \0")
