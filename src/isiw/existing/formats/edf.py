"""EDF and BDF with their extensions EDF+ and BDF+, where each record has a time of its own."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Final

from isiw.existing.formats.beside import bids_events
from isiw.existing.formats.contents import Contents, Stretch, Track, with_codes
from isiw.existing.formats.edf_records import Header, header_of, text_of
from isiw.existing.layout import Layout

_ROUNDED_S: Final = 1e-3
"""Times of records are rounded by so much; what is farther from the end of the record before is a gap."""


_AT_ONCE: Final = 100
"""So many records are read at once for their annotations."""


def read(path: Path, _layout: Layout) -> Contents:
    """The signals and annotations of an EDF or BDF file, each record at its own time."""
    header = header_of(path)
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
    beside = bids_events(path)
    return Contents(path.name, tuple(tracks), with_codes(events, tracks) if beside is None else beside)


def _annotations(header: Header, signal: int) -> Iterator[list[tuple[float, float, str]]]:
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
            found += [(float(at), float(lasts or 0), text_of(text)) for text in texts or [b""]]
    return found


def _stretches(starts: list[float], header: Header, count: int) -> Iterator[Stretch]:
    """Records that follow each other without a gap, by their own times."""
    begun, slack_s = 0, max(_ROUNDED_S, 1.5 * header.record_s / count)
    starts = starts or [n * header.record_s for n in range(header.records)]
    for n in range(1, header.records + 1):
        if n == header.records or abs(starts[n] - starts[begun] - (n - begun) * header.record_s) > slack_s:
            yield Stretch(begun * count, (n - begun) * count, starts[begun])
            begun = n
