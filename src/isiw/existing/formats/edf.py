"""EDF and BDF with their extensions EDF+ and BDF+, where each record has a time of its own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.formats.contents import Contents, Stretch, Track, with_codes
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.types import FloatArray

_FIELDS: Final = {"label": 16, "transducer": 80, "unit": 8, "least": 8, "most": 8, "lowest": 8, "highest": 8,
                  "filter": 80, "count": 8}  # fmt: skip
"""The fields of each signal in a header, and their bytes."""

_ROUNDED_S: Final = 1e-3
"""Times of records are rounded by so much; what is farther from the end of the record before is a gap."""

_AT_ONCE: Final = 100
"""So many records are read at once for their annotations."""


class _Header(NamedTuple):
    """What a header says of the records, and of each signal by the names of its fields."""

    path: Path
    begins: int  # where the first record does [bytes]
    width: int  # of a sample [bytes]
    record_s: float
    records: int
    fields: dict[str, list[str]]
    counts: list[int]  # how many samples of each signal a record has

    def raw(self, signal: int, first: int, last: int) -> bytes:
        """The bytes of one signal in some records."""
        width, size = self.width, self.width * sum(self.counts)
        at = width * sum(self.counts[:signal])
        with opened(self.path) as file:
            file.seek(self.begins + first * size)
            whole = np.frombuffer(file.read((last - first) * size), np.uint8)
        return whole.reshape(last - first, size)[:, at : at + width * self.counts[signal]].tobytes()

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


def read(path: Path, _layout: Layout) -> Contents:
    """The signals and annotations of an EDF or BDF file, each record at its own time."""
    header = _header(path)
    labels = header.fields["label"]
    noted = [signal for signal, label in enumerate(labels) if label in {"EDF Annotations", "BDF Annotations"}]
    lists = [list(_annotations(header, signal)) for signal in noted]
    starts = [row[0][0] if row else n * header.record_s for n, row in enumerate(lists[0] if lists else ())]
    events = [(name, at, lasts) for each in lists for row in each for at, lasts, name in row if name]
    tracks = []
    for signal, label in enumerate(labels):
        if signal not in noted and header.counts[signal]:
            rate_hz = header.counts[signal] / header.record_s
            kind = "stim" if header.is_status(signal) else "emg" if label.casefold().startswith("emg") else ""
            stretches = tuple(_stretches(starts, header, header.counts[signal]))
            unit = header.fields["unit"][signal]
            tracks.append(Track(label, rate_hz, stretches, partial(header.samples, signal), unit, kind))
    return Contents(path.name, tuple(tracks), with_codes(events, tracks)).with_bids(path)


def _annotations(header: _Header, signal: int) -> Iterator[list[tuple[float, float, str]]]:
    """The annotations of each record."""
    size = header.width * header.counts[signal]
    for first in range(0, header.records, _AT_ONCE):
        raw = header.raw(signal, first, min(first + _AT_ONCE, header.records))
        yield from (_noted(raw[at : at + size]) for at in range(0, len(raw), size))


def _noted(raw: bytes) -> list[tuple[float, float, str]]:
    """The annotations in a record: when, how long [s], and what; the first is without a text, and of the record."""
    found = []
    for each in raw.split(b"\x14\0"):
        when, *texts = each.lstrip(b"\0").split(b"\x14")
        at, _, lasts = when.partition(b"\x15")
        if at[:1] in {b"+", b"-"}:
            found += [(float(at), float(lasts or 0), _text(text)) for text in texts or [b""]]
    return found


def _stretches(starts: list[float], header: _Header, count: int) -> Iterator[Stretch]:
    """Records that follow each other without a gap, by their own times."""
    begun, slack_s = 0, max(_ROUNDED_S, 1.5 * header.record_s / count)
    starts = starts or [n * header.record_s for n in range(header.records)]
    for n in range(1, header.records + 1):
        if n == header.records or abs(starts[n] - starts[begun] - (n - begun) * header.record_s) > slack_s:
            yield Stretch(begun * count, (n - begun) * count, starts[begun])
            begun = n


def _header(path: Path) -> _Header:
    """The header of a file."""
    with opened(path) as file:
        head = file.read(256)
        signals = int(head[252:256])
        texts = file.read(256 * signals)
        size = file.seek(0, 2)
    begins = [0, *accumulate(width * signals for width in _FIELDS.values())]
    fields = {
        name: [_text(texts[begin + n * width : begin + (n + 1) * width]) for n in range(signals)]
        for (name, width), begin in zip(_FIELDS.items(), begins, strict=False)
    }
    width = 3 if head[:1] == b"\xff" else 2
    length, record_s = int(head[184:192]), float(head[244:252])
    counts, stated = [int(count) for count in fields["count"]], int(head[236:244])
    records = (size - length) // (width * sum(counts))
    if not record_s > 0 or not records:
        raise InvalidValueError("the file has no records of signals", got=f"{records} records of {record_s:g} s")
    return _Header(path, length, width, record_s, records if stated < 0 else min(records, stated), fields, counts)


def _text(field: bytes) -> str:
    """A text as headers and annotations have it."""
    with suppress(UnicodeDecodeError):
        return field.decode("utf-8").strip(" \0")
    return field.decode("latin-1").strip(" \0")
