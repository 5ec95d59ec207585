"""XDF of LabRecorder (Lab Streaming Layer): streams with clock offsets, of which those with texts are markers.

pyxdf reads all samples one by one and as a whole. In the file that it gets, a stream of numbers at a rate has others:
where samples in a row begin, how far they are apart, and how many they are, at the time of the first of them.
"""

from __future__ import annotations

import gzip
import io
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache, partial
from itertools import accumulate
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from isiw.existing.formats.contents import Contents, Track, clocked, events_of, text_of
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray

BOUNDARY: Final = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_HEADER, _SAMPLES, _FOOTER = 2, 3, 6
_LATE_S: Final = 1e-3
_MOST: Final = 2**31  # a chunk that is longer [bytes] is damaged
_ROW: Final = np.dtype([("stamped", "u1"), ("at_s", "<f8"), ("place", "<f8"), ("step", "<f8"), ("count", "<f8")])
_OF_MARKERS: Final = ("marker", "trig", "ttl", "stim", "event")


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and markers of all streams, on one clock; gaps are found here, since pyxdf smooths them away."""
    load, held = library("pyxdf", "import").load_xdf, dict[int, _Stream]()
    found, _ = load(_shortened(path, held), dejitter_timestamps=False, verbose=False)
    streams = [(held[one["info"]["stream_id"]], one) for one in found if len(one["time_stamps"])]
    begun_s = min((float(stream["time_stamps"][0]) for _, stream in streams), default=0.0)
    several = len({own.said.findtext("hostname") for own, _ in streams}) > 1
    tracks, rows, notes = list[Track](), list[tuple[str, float, float]](), list[str]()
    for own, stream in streams:
        times_s, values = np.asarray(stream["time_stamps"]) - begun_s, stream["time_series"]
        if several and not len(stream["clock_times"]):
            notes.append(f"The stream {own.name} has no clock offsets, and another computer recorded beside it.")
        if own.has_numbers:
            own.rows = np.asarray(values, dtype=np.int64).tolist()
            own.firsts = [0, *accumulate(count for _, _, count in own.rows)]
            firsts = np.array(own.firsts[:-1])
            rate_hz, stretches, said = clocked(times_s, own.rate_hz, f"the stream {own.name}", firsts, own.firsts[-1])
            notes += said
            for n, (label, unit, kind) in enumerate(own.channels()):
                tracks.append(Track(label, rate_hz, stretches, partial(own.read, n), unit, kind))
        elif own.form.startswith(("string", "int")) or any(word in own.kind for word in _OF_MARKERS):
            rows += [(text_of(*one), at, 0.0) for one, at in zip(values, times_s.tolist(), strict=True)]
    return Contents(path.name, tuple(tracks), events_of(rows), notes=tuple(notes))  # no EMG has numbers at no rate


class _Stream:
    """A stream by its header, and where in the file its samples are if they are numbers at a rate."""

    def __init__(self, path: Path, said: ET.Element) -> None:
        self.path, self.said, self.name = path, said, said.findtext("name") or ""
        self.form, self.kind = (said.findtext(key, "").strip().casefold() for key in ("channel_format", "type"))
        self.count, self.rate_hz = int(said.findtext("channel_count", "")), float(said.findtext("nominal_srate") or 0.0)
        self.has_numbers = self.rate_hz > 0 and self.form != "string"
        self.type = np.dtype(self.form.replace("double", "float") if self.has_numbers else "u1").newbyteorder("<")
        self.last_s, self.samples, self.shown = 0.0, 0, 0  # so far
        self.rows, self.firsts = list[list[int]](), list[int]()

    def channels(self) -> Iterator[tuple[str, str, str]]:
        """The label, unit and type of each channel."""
        described = self.said.findall("desc/channels/channel")
        for n in range(self.count):
            one = described[n] if n < len(described) else ET.Element("channel")
            label = one.findtext("label") or (self.name if self.count == 1 else f"{self.name} {n + 1}")
            yield label, one.findtext("unit") or "", (one.findtext("type") or self.kind).casefold()

    def described(self, said: ET.Element) -> bytes:
        """A header, or the footer, by what pyxdf gets of the samples."""
        for one in said if self.has_numbers else ():
            one.text = {"channel_format": "double64", "channel_count": "3"}.get(one.tag, one.text)
            if one.tag == "sample_count":  # by which pyxdf sees those too many
                one.text = f"{self.shown - max(0, self.samples - int(one.text or 0))}"
        return ET.tostring(said)

    def shortened(self, at: int, content: bytes) -> bytes:
        """A chunk, whose content begins at a byte of the file, by the samples in a row."""
        head, width = 5 + content[4], self.count * self.type.itemsize
        count, begins, end = int.from_bytes(content[5:head], "little"), list[int](), head
        for _ in range(count):  # numbers are behind the sample's time, if it has one
            begins.append(end + (9 if content[end] else 1))
            end = begins[-1] + width
        if not count or end > len(content):
            raise IndexError("the chunk holds no samples, or is damaged")
        places, steps = np.array(begins), np.diff(begins, prepend=head - width)
        stamped = np.flatnonzero(steps > 1 + width)
        stamps = np.frombuffer(content, np.uint8)[places[stamped, None] + np.arange(-8, 0)]
        since = np.searchsorted(stamped, np.arange(count), side="right")
        last_s = np.append(self.last_s, stamps.copy().view("<f8"))[since]
        times_s = last_s + (np.arange(count) - np.append(-1, stamped)[since]) / self.rate_hz
        late = np.abs(np.diff(times_s) - 1 / self.rate_hz) > _LATE_S
        uneven = np.diff(steps, append=steps[-1])[1:] != 0
        firsts = np.unique([0, *np.flatnonzero(late | uneven) + 1, count - 1])
        rows = np.zeros(len(firsts), _ROW)
        rows["stamped"], rows["at_s"], rows["place"] = 8, times_s[firsts], at + places[firsts]
        rows["step"], rows["count"] = np.append(steps, 0)[firsts + 1], np.diff(firsts, append=count)
        self.last_s, self.samples, self.shown = float(times_s[-1]), self.samples + count, self.shown + len(rows)
        return content[:4] + b"\x08" + len(rows).to_bytes(8, "little") + rows.tobytes()

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


def _shortened(path: Path, held: dict[int, _Stream]) -> io.BytesIO:
    """A file with rows of samples in the place of numbers at a rate; its streams are gathered."""
    parts = [b"XDF:"]
    for at, tag, content in _chunks(path):
        stream, kept = int.from_bytes(content[:4], "little"), content
        with suppress(ET.ParseError, KeyError):  # of which pyxdf makes what it can
            if tag in {_HEADER, _FOOTER}:
                said = ET.fromstring(content[4:].decode("utf-8", "replace"))  # noqa: S314 - as pyxdf does; see apart.py
                held |= {stream: _Stream(path, said)} if tag == _HEADER else {}
                kept = content[:4] + held[stream].described(said)
            elif tag == _SAMPLES and held[stream].has_numbers:
                kept = b""
                with suppress(IndexError):  # a damaged chunk is left out
                    kept = held[stream].shortened(at, content)
        if kept:
            parts.append(b"\x08" + (len(kept) + 2).to_bytes(8, "little") + tag.to_bytes(2, "little") + kept)
    return io.BytesIO(b"".join(parts))


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


@lru_cache(maxsize=1)
def _unpacked(path: Path) -> bytes:
    with opened(path) as packed:
        return gzip.decompress(packed.read())


def _opened(path: Path) -> Any:
    return io.BytesIO(_unpacked(path)) if path.suffix.casefold() == ".xdfz" else opened(path)
