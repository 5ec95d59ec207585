"""XDF of LabRecorder (Lab Streaming Layer): streams with clock offsets, of which those with texts are markers.

pyxdf reads all samples one by one and as a whole. In the file that it gets, a stream of numbers at a rate has, of those
in a row, only the first one, with its time.
"""

from __future__ import annotations

import gzip
import io
import mmap
import struct
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from isiw.existing.formats.contents import Contents, Event, Track, clocked, events_of, text_of
from isiw.existing.layout import Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray, IntArray

BOUNDARY: Final = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_HEADER, _SAMPLES, _FOOTER = 2, 3, 6
_LATE_S: Final = 1e-3
_OF_MARKERS: Final = ("marker", "trig", "ttl", "stim", "event")


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and markers of all streams, on one clock; gaps are found here, since pyxdf smooths them away."""
    with opened(path) as file:
        is_packed = path.suffix.casefold() == ".xdfz"
        whole: Any = gzip.decompress(file.read()) if is_packed else mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    if whole[:4] != b"XDF:":
        raise ValueError("it does not begin as XDF does")
    load, held = library("pyxdf", "import").load_xdf, dict[int, _Stream]()
    found, _ = load(io.BytesIO(b"XDF:" + b"".join(_shortened(whole, held))), dejitter_timestamps=False, verbose=False)
    streams = [(own, one) for one in found  # of fewer rows of numbers nobody knows the rate
               if len(one["time_stamps"]) > 2 * (own := held[one["info"]["stream_id"]]).has_numbers]  # fmt: skip
    begun_s = min((float(stream["time_stamps"][0]) for _, stream in streams), default=0.0)
    several = len({own.said.findtext("hostname") for own, _ in streams}) > 1
    tracks, rows, notes = list[Track](), list[Event](), list[str]()
    for own, stream in streams:
        times_s = np.asarray(stream["time_stamps"]) - begun_s
        if several and not len(stream["clock_times"]):
            notes.append(f"The stream {own.name} has no clock offsets, and another computer recorded beside it.")
        if own.has_numbers:
            own.rows = np.ascontiguousarray(np.concatenate(own.chunks).T)
            what, samples = f"the stream {own.name}", int(own.rows[1, -1])
            rate_hz, stretches, said = clocked(times_s, own.rate_hz, what, own.rows[0], samples)
            notes += said
            tracks += [Track(label, rate_hz, stretches, partial(own.read, n), unit, kind)
                       for n, (label, unit, kind) in enumerate(own.channels())]  # fmt: skip
        elif own.form.startswith(("string", "int")) or any(word in own.kind for word in _OF_MARKERS):
            noted = zip(stream["time_series"], times_s.tolist(), strict=True)
            rows += [(text_of(*said), at, 0.0) for said, at in noted]
    return Contents(path.name, tuple(tracks), events_of(rows), notes=tuple(notes))


class _Stream:
    """A stream by its header, and where in the file its samples are if they are numbers at a rate."""

    def __init__(self, whole: Any, header: bytes) -> None:
        said = ET.fromstring(header.decode("utf-8", "replace"))  # noqa: S314 - as pyxdf does; see apart.py
        self.whole, self.said, self.name = whole, said, said.findtext("name") or ""
        self.form, self.kind = (said.findtext(key, "").strip().casefold() for key in ("channel_format", "type"))
        self.count, self.rate_hz = int(said.findtext("channel_count", "")), float(said.findtext("nominal_srate") or 0.0)
        self.has_numbers = self.rate_hz > 0 and self.form != "string"
        self.type = np.dtype(self.form.replace("double", "float") if self.has_numbers else "u1").newbyteorder("<")
        self.last_s, self.samples, self.chunks = 0.0, 0, list[IntArray]()  # so far
        self.rows = np.empty((4, 0), np.int64)  # from and to a sample, where the first is, and how far to the next

    def channels(self) -> Iterator[tuple[str, str, str]]:
        """The label, unit and type of each channel."""
        described = self.said.findall("desc/channels/channel")
        for n in range(self.count):
            one = described[n] if n < len(described) else ET.Element("channel")
            label = one.findtext("label") or (self.name if self.count == 1 else f"{self.name} {n + 1}")
            yield label, one.findtext("unit") or "", (one.findtext("type") or self.kind).casefold()

    def shortened(self, at: int, content: bytes) -> bytes:
        """A chunk, whose content begins at a byte of the file, with the first of samples in a row."""
        end, width = 5 + content[4], self.count * self.type.itemsize
        times_s, places, at_s, step_s = list[float](), list[int](), self.last_s, 1 / self.rate_hz
        for _ in range(int.from_bytes(content[5:end], "little")):  # numbers are behind the sample's time, if it has one
            stamped = content[end] != 0
            at_s = struct.unpack_from("<d", content, end + 1)[0] if stamped else at_s + step_s
            times_s.append(at_s)
            places.append(end + (9 if stamped else 1))
            end = places[-1] + width
        if not places or end > len(content):
            raise IndexError("the chunk holds no samples, or is damaged")
        turns = np.abs(np.diff(times_s) - step_s) > _LATE_S
        turns[:-1] |= np.diff(places, 2) != 0
        begins = np.unique([0, *np.flatnonzero(turns) + 1, len(places) - 1])
        steps, ends = np.diff(places, append=places[-1])[begins], np.append(begins[1:], len(places))
        firsts = np.array(places)[begins]
        self.chunks.append(np.column_stack([self.samples + begins, self.samples + ends, at + firsts, steps]))
        kept = [struct.pack("<Bd", 8, times_s[begin]) + content[place : place + width]
                for begin, place in zip(begins.tolist(), firsts.tolist(), strict=True)]  # fmt: skip
        self.last_s, self.samples = at_s, self.samples + len(places)
        return content[:4] + b"\x08" + len(kept).to_bytes(8, "little") + b"".join(kept)

    def read(self, channel: int, first: int, last: int) -> FloatArray:
        """The numbers of a channel from one sample to before another."""
        found, (begins, ends, *_) = [np.empty(0)], self.rows
        for begin, end, place, step in self.rows[:, (ends > first) & (begins < last)].T.tolist():
            count, at = min(end, last) - max(begin, first), place + max(0, first - begin) * step
            values = np.ndarray(count, self.type, self.whole, at + channel * self.type.itemsize, step)
            found.append(values.astype(np.float64))
        return np.concatenate(found)


def _shortened(whole: Any, held: dict[int, _Stream]) -> Iterator[bytes]:
    """The chunks of a file with the first of numbers in a row; its streams are gathered, a damaged chunk is left out.

    Of a stream of numbers the footer is, too, by whose count of samples pyxdf would cut off what is shortened.
    """
    at = 4
    while 0 <= at < len(whole):
        begin = at + 1 + whole[at]
        end = begin + int.from_bytes(whole[at + 1 : begin], "little")
        if whole[at] not in {1, 4, 8} or not begin + 2 <= end <= len(whole):  # it goes on at the next boundary
            found = whole.find(BOUNDARY, at + 1)
            at = found + len(BOUNDARY) if found >= 0 else -1
            continue
        tag, content, at = int.from_bytes(whole[begin : begin + 2], "little"), whole[begin + 2 : end], end
        stream, kept = int.from_bytes(content[:4], "little"), content
        with suppress(ET.ParseError, IndexError, struct.error):  # pyxdf makes of a header what it can
            if tag == _HEADER:
                held[stream] = _Stream(whole, content[4:])
            elif stream in held and held[stream].has_numbers and tag in {_SAMPLES, _FOOTER}:
                kept = b""
                kept = held[stream].shortened(begin + 2, content) if tag == _SAMPLES else b""
        if kept:
            yield b"\x08" + (len(kept) + 2).to_bytes(8, "little") + tag.to_bytes(2, "little") + kept
