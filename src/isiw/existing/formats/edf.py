"""EDF and BDF with their extensions EDF+ and BDF+, where each record has a time of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.formats.contents import Contents, Stretch, Track, with_codes
from isiw.existing.frames import decoded
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.types import FloatArray

_FIELDS: Final = {"label": 16, "transducer": 80, "unit": 8, "least": 8, "most": 8, "lowest": 8, "highest": 8,
                  "filter": 80, "count": 8, "reserved": 32}  # fmt: skip # of each signal in a header, in bytes
_ROUNDED_S: Final = 1e-3  # times of records are rounded by so much; what is farther from the record before is a gap
_AT_ONCE: Final = 100  # so many records are read at once for their annotations


class _Header(NamedTuple):
    """What a header says of the records, and of each signal by the names of its fields."""

    path: Path
    begins: int  # where the first record does [bytes]
    record: np.dtype[Any]  # whose fields are the signals, by their number
    record_s: float
    records: int
    fields: dict[str, list[str]]
    counts: list[int]  # how many samples of each signal a record has

    def raw(self, signal: int, first: int, last: int) -> np.ndarray[Any, np.dtype[Any]]:
        """One signal in some records, a row each."""
        offset = self.begins + first * self.record.itemsize
        return np.fromfile(self.path, self.record, last - first, offset=offset)[f"{signal}"]

    def samples(self, signal: int, first: int, last: int) -> FloatArray:
        """The numbers of one signal from one sample to before another, in its unit."""
        begin = first // (count := self.counts[signal])
        digital = self.raw(signal, begin, -(-last // count))
        if digital.ndim > 2:  # of three bytes
            digital = np.pad(digital.reshape(-1, 3), ((0, 0), (1, 0))).view("<i4") >> 8
        digital = digital.ravel()[first - begin * count : last - begin * count]
        if self.is_status(signal):  # of which the lower bits are the triggers
            return (digital & 0xFFFF).astype(np.float64)
        least, most, low, high = (float(self.fields[key][signal]) for key in ("least", "most", "lowest", "highest"))
        return (digital - low) * ((most - least) / (high - low)) + least

    def is_status(self, signal: int) -> bool:
        """True of the signal in which BDF has the codes of triggers."""
        return self.record[signal].ndim > 1 and self.fields["label"][signal].casefold() in {"status", "trigger"}


def read(path: Path, _layout: Layout) -> Contents:
    """The signals and annotations of an EDF or BDF file, each record at its own time."""
    header = _header(path)
    labels = header.fields["label"]
    noted = [signal for signal, label in enumerate(labels) if label in {"EDF Annotations", "BDF Annotations"}]
    lists = [list(_annotations(header, signal)) for signal in noted]
    of_records = lists[0] if lists else [[]] * header.records  # the first annotation is of the record
    starts = [row[0][1] if row else n * header.record_s for n, row in enumerate(of_records)]
    tracks = []
    for signal, label in enumerate(labels):
        if signal not in noted and (count := header.counts[signal]):
            kind = "stim" if header.is_status(signal) else "emg" if label.casefold().startswith("emg") else ""
            stretches, part = tuple(_stretches(starts, header.record_s, count)), partial(header.samples, signal)
            unit, said = header.fields["unit"][signal], header.fields["filter"][signal]
            tracks.append(Track(label, count / header.record_s, stretches, part, unit, kind, said))
    events = [event for each in lists for row in each for event in row if event[0]]
    return Contents(path.name, tuple(tracks), with_codes(events, tracks)).with_bids(path)


def _annotations(header: _Header, signal: int) -> Iterator[list[tuple[str, float, float]]]:
    """The annotations of each record: what, when, and how long [s]; the first is without a text, and of the record."""
    for first in range(0, header.records, _AT_ONCE):
        for record in header.raw(signal, first, min(first + _AT_ONCE, header.records)):
            found = []
            for each in record.tobytes().split(b"\x14\0"):
                when, *texts = each.lstrip(b"\0").split(b"\x14")
                at, _, lasts = when.partition(b"\x15")
                if at[:1] in {b"+", b"-"}:
                    found += [(_text(text), float(at), float(lasts or 0)) for text in texts or [b""]]
            yield found


def _stretches(starts: Sequence[float], record_s: float, count: int) -> Iterator[Stretch]:
    """Records that follow each other without a gap, by their own times."""
    begun, slack_s = 0, max(_ROUNDED_S, 1.5 * record_s / count)
    for n in range(1, len(starts) + 1):
        if n == len(starts) or abs(starts[n] - starts[begun] - (n - begun) * record_s) > slack_s:
            yield Stretch(begun * count, (n - begun) * count, starts[begun])
            begun = n


def _header(path: Path) -> _Header:
    with opened(path) as file:
        head = file.read(256)
        signals = int(head[252:256])
        texts = file.read(256 * signals)
        size = file.seek(0, 2)
    spans = zip(_FIELDS.items(), accumulate(_FIELDS.values(), initial=0), strict=False)
    fields = {name: [_text(texts[signals * begin + n * width :][:width]) for n in range(signals)]
              for (name, width), begin in spans}  # fmt: skip
    length, record_s, stated = int(head[184:192]), float(head[244:252]), int(head[236:244])
    counts, is_bdf = [int(count) for count in fields["count"]], head[:1] == b"\xff"
    record = np.dtype([(f"{n}", "u1", (count, 3)) if is_bdf else (f"{n}", "<i2", (count,))
                       for n, count in enumerate(counts)])  # fmt: skip
    records = (size - length) // record.itemsize
    if not record_s > 0 or not records:
        raise InvalidValueError("the file has no records of signals", got=f"{records} records of {record_s:g} s")
    return _Header(path, length, record, record_s, records if stated < 0 else min(records, stated), fields, counts)


def _text(field: bytes) -> str:
    return decoded(field.strip(b" \0"))
