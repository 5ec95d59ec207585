"""XDF of LabRecorder (Lab Streaming Layer): streams with clock offsets, of which those with texts are markers.

pyxdf reads all samples one by one and as a whole. It gets a file in which a stream of numbers at a rate has texts: each
says where some samples in a row are, and has the time of the first of them.
"""

from __future__ import annotations

import gzip
import io
import struct
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache, partial
from itertools import accumulate
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from isiw.existing.formats.contents import Contents, Track, events_of, text_of
from isiw.existing.formats.stamps import clocked
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray, IntArray

BOUNDARY: Final = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_HEADER, _SAMPLES, _FOOTER = 2, 3, 6
_LATE_S: Final = 1e-3
_MOST: Final = 2**31
"""A chunk that is longer [bytes] is damaged."""


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and markers of all streams, on one clock; gaps are found here, since pyxdf smooths them away."""
    load, numbers = library("pyxdf", "import").load_xdf, dict[int, _Numbers]()
    streams, _ = load(_shortened(path, numbers), dejitter_timestamps=False, verbose=False)
    streams = [stream for stream in streams if len(stream["time_stamps"])]
    begun_s = min((float(stream["time_stamps"][0]) for stream in streams), default=0.0)
    hosts = {_said(stream["info"], "hostname") for stream in streams}
    tracks, rows, notes = list[Track](), list[tuple[str, float, float]](), list[str]()
    for stream in streams:
        info, times_s = stream["info"], np.asarray(stream["time_stamps"]) - begun_s
        name, held = _said(info, "name"), numbers.get(info["stream_id"])
        if len(hosts) > 1 and not len(stream["clock_times"]):
            notes.append(f"The stream {name} has no clock offsets, and another computer recorded beside it.")
        if held is not None:
            firsts = held.places([text for (text,) in stream["time_series"]])
            found = clocked(times_s, held.rate_hz, f"the stream {name}", firsts[:-1], int(firsts[-1]))
            notes += found.notes
            for channel, (label, unit, kind) in enumerate(_channels(info, held.count)):
                part = partial(held.read, channel)
                tracks.append(Track(label, found.rate_hz, found.stretches, part, unit, kind))
        elif _are_markers(info):  # no EMG has numbers at no rate
            rows += [(text_of(*one), at, 0.0) for one, at in zip(stream["time_series"], times_s.tolist(), strict=True)]
    return Contents(path.name, tuple(tracks), events_of(rows), notes=tuple(notes))


def _are_markers(info: Mapping[str, Any]) -> bool:
    """True for texts, and for numbers that are whole ones, or of a type that says so."""
    form, kind = (_said(info, key).casefold() for key in ("channel_format", "type"))
    return form.startswith(("string", "int")) or any(
        word in kind for word in ("marker", "trig", "ttl", "stim", "event")
    )


def _said(info: Mapping[str, Any] | None, key: str) -> Any:
    """What a description says, whose every entry is a list: a text, or a description; empty if nothing."""
    return ((info or {}).get(key) or [""])[0] or ""


def _channels(info: Mapping[str, Any], count: int) -> Iterator[tuple[str, str, str]]:
    """The label, unit and type of each channel of a stream."""
    described, name = _said(_said(info, "desc") or None, "channels") or {}, _said(info, "name")
    each = [*described.get("channel", ())[:count], *[None] * count][:count]
    for number, said in enumerate(each, 1):
        label = _said(said, "label") or (name if count == 1 else f"{name} {number}")
        yield label, _said(said, "unit"), (_said(said, "type") or _said(info, "type")).casefold()


class _Numbers:
    """The samples of a stream of numbers in a file, of which those in a row are as far from each other."""

    def __init__(self, path: Path, said: ET.Element, rate_hz: float) -> None:
        self.path, self.rate_hz, self.count = path, rate_hz, int(said.findtext("channel_count", ""))
        self.type = np.dtype(said.findtext("channel_format", "").strip().replace("double", "float")).newbyteorder("<")
        self.last_s, self.samples, self.texts = 0.0, 0, 0  # so far
        self.firsts, self.rows = [0], list[list[int]]()

    def shortened(self, at: int, content: bytes) -> bytes:
        """A chunk, whose content begins at a byte of the file, with texts in the place of samples."""
        head, width = 5 + content[4], self.count * self.type.itemsize
        count, begins, end = int.from_bytes(content[5:head], "little"), list[int](), head
        for _ in range(count):  # numbers are behind the sample's time, if it has one
            begins.append(end + 9 if content[end] else end + 1)
            end = begins[-1] + width
        if not count or end > len(content):
            raise IndexError("the chunk holds no samples, or is damaged")
        number, steps = np.arange(count), np.diff(begins, prepend=head - width)
        stamped = np.flatnonzero(steps > 1 + width)
        stamps_s = [struct.unpack_from("<d", content, begins[one] - 8)[0] for one in stamped]
        since = np.searchsorted(stamped, number, side="right")
        known, known_s = np.append(-1, stamped)[since], np.append(self.last_s, stamps_s)[since]
        times_s = known_s + (number - known) / self.rate_hz
        late = np.abs(np.diff(times_s) - 1 / self.rate_hz) > _LATE_S
        uneven = np.diff(steps, append=steps[-1])[1:] != 0
        firsts = np.unique([0, *np.flatnonzero(late | uneven) + 1, count - 1]).tolist()
        self.last_s, self.samples, self.texts = float(times_s[-1]), self.samples + count, self.texts + len(firsts)
        found = [content[:4], b"\x08", len(firsts).to_bytes(8, "little")]
        for first, after in zip(firsts, [*firsts[1:], count], strict=True):
            step = int(steps[first + 1]) if after > first + 1 else 0
            text = f"{at + begins[first]} {step} {after - first}".encode()
            found.append(struct.pack("<Bd", 8, times_s[first]) + bytes([1, len(text)]) + text)
        return b"".join(found)

    def places(self, texts: Iterable[str]) -> IntArray:
        """Of the samples in a row the first, by what pyxdf has kept of their texts, and how many samples there are."""
        self.rows = [[int(word) for word in text.split()] for text in texts]
        self.firsts = [0, *accumulate(count for _, _, count in self.rows)]
        return np.array(self.firsts)

    def read(self, channel: int, first: int, last: int) -> FloatArray:
        """The numbers of a channel from one sample to before another."""
        found, begins = [np.empty(0)], channel * self.type.itemsize
        with _opened(self.path) as file:
            for n in range(bisect_right(self.firsts, first) - 1, bisect_left(self.firsts, last)):
                (place, step, count), skipped = self.rows[n], max(0, first - self.firsts[n])
                count = min(count, last - self.firsts[n]) - skipped
                file.seek(place + skipped * step + begins)
                raw = file.read((count - 1) * step + self.type.itemsize)
                found.append(np.ndarray(count, self.type, raw, strides=step).astype(np.float64))
        return np.concatenate(found)


def _shortened(path: Path, numbers: dict[int, _Numbers]) -> io.BytesIO:
    """A file in which streams of numbers at a rate, which are gathered, have texts in place of their samples."""
    parts = [b"XDF:"]
    for at, tag, content in _chunks(path):
        stream, kept = int.from_bytes(content[:4], "little"), content
        if tag in {_HEADER, _FOOTER}:
            with suppress(ET.ParseError):
                said = ET.fromstring(content[4:].decode("utf-8", "replace"))  # noqa: S314 - as pyxdf does; see apart.py
                kept = content[:4] + _described(path, stream, said, numbers)
        elif tag == _SAMPLES and stream in numbers:
            try:
                kept = numbers[stream].shortened(at, content)
            except (IndexError, struct.error):  # a damaged chunk is left out
                continue
        parts.append(b"\x08" + (len(kept) + 2).to_bytes(8, "little") + tag.to_bytes(2, "little") + kept)
    return io.BytesIO(b"".join(parts))


def _described(path: Path, stream: int, said: ET.Element, numbers: dict[int, _Numbers]) -> bytes:
    """What the header or the footer of a stream says of itself, once its numbers are texts."""
    rate_hz, held = float(said.findtext("nominal_srate") or 0.0), numbers.get(stream)
    if rate_hz and said.findtext("channel_format") != "string":
        numbers[stream] = _Numbers(path, said, rate_hz)
        for one in said:
            one.text = {"channel_format": "string", "channel_count": "1"}.get(one.tag, one.text)
    if held is not None and (counted := said.find("sample_count")) is not None:  # by which pyxdf sees those too many
        counted.text = f"{held.texts - max(0, held.samples - int(counted.text or 0))}"
    return ET.tostring(said)


def _chunks(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Where the content of each chunk begins, its tag, and its content; after damage, from the next boundary on."""
    with _opened(path) as file:
        if file.read(4) != b"XDF:":
            raise ValueError("it does not begin as XDF does")
        while (size := file.read(1)) != b"":
            length = int.from_bytes(file.read(size[0]), "little") if size[0] in {1, 4, 8} else 0
            at = file.tell()
            content = file.read(length if length < _MOST else 0)
            if 2 <= length == len(content):
                yield at + 2, int.from_bytes(content[:2], "little"), content[2:]
                continue
            file.seek(at)
            if (found := file.read().find(BOUNDARY)) < 0:
                return
            file.seek(at + found + len(BOUNDARY))


def _opened(path: Path) -> Any:
    return io.BytesIO(_unpacked(path)) if path.suffix.casefold() == ".xdfz" else opened(path)


@lru_cache(maxsize=1)
def _unpacked(path: Path) -> bytes:
    with opened(path) as packed:
        return gzip.decompress(packed.read())
