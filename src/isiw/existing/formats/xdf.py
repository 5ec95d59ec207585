"""XDF of LabRecorder (Lab Streaming Layer): streams with clock offsets, of which those with texts are markers.

pyxdf reads all samples one by one and as a whole. It gets a file in which a stream of numbers at a rate has the first
and the last sample of each chunk, and those that come late; what it does with clocks and markers is done with these.
"""

from __future__ import annotations

import gzip
import io
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.existing.formats.contents import Contents, Track, events_of
from isiw.existing.formats.stamps import clocked
from isiw.existing.layout import Layout
from isiw.files import opened
from isiw.text.named_code import library
from isiw.types import FloatArray, IntArray

BOUNDARY: Final = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_TYPES: Final = {"float32": "<f4", "double64": "<f8", "int8": "<i1", "int16": "<i2", "int32": "<i4", "int64": "<i8"}
_HEADER, _SAMPLES, _FOOTER = 2, 3, 6
_LATE_S: Final = 1e-3
_SCATTER_S: Final = 2e-3
_MOST: Final = 2**31
"""A chunk that is longer [bytes] is damaged."""


def read(path: Path, _layout: Layout) -> Contents:
    """The channels and markers of all streams, on one clock; gaps are found here, since pyxdf smooths them away."""
    load = library("pyxdf", "import").load_xdf
    numbers, shorter = _shortened(path)
    streams, _ = load(shorter, dejitter_timestamps=False, verbose=False)
    streams = [stream for stream in streams if len(stream["time_stamps"])]
    begun_s = min((float(stream["time_stamps"][0]) for stream in streams), default=0.0)
    hosts = {_said(stream["info"], "hostname") for stream in streams}
    tracks, rows, notes = list[Track](), list[tuple[str, float, float]](), list[str]()
    for stream in streams:
        name, times_s = _said(stream["info"], "name"), np.asarray(stream["time_stamps"]) - begun_s
        if len(hosts) > 1 and not len(stream.get("clock_times", ())):
            notes.append(f"The stream {name} has no clock offsets, and another computer recorded beside it.")
        if _is_of_markers(stream):
            rows += [(_text(one), at, 0.0) for one, at in zip(stream["time_series"], times_s.tolist(), strict=True)]
            continue
        if (held := numbers.get(stream["info"]["stream_id"])) is None:
            continue  # numbers at no rate, which no EMG has
        index = np.asarray(held.index[: len(times_s)])
        of_stream = clocked(times_s, 1.0 / held.period_s, f"the stream {name}", index, held.firsts[-1])
        if of_stream.scatter_s > _SCATTER_S:
            notes.append(
                f"The times of the stream {name} scatter by {1e3 * of_stream.scatter_s:.1f} ms: MEPs may lie elsewhere."
            )
        for channel, (label, unit, kind) in enumerate(_channels(stream)):
            part = partial(held.read, channel)
            tracks.append(Track(label, of_stream.rate_hz, of_stream.stretches, part, unit, kind))
    return Contents(path.name, tuple(tracks), events_of(rows), notes=tuple(notes))


def _is_of_markers(stream: Mapping[str, Any]) -> bool:
    """True for texts, and for numbers that come at no rate: whole ones, or of a type that says so."""
    form, kind = (_said(stream["info"], key).casefold() for key in ("channel_format", "type"))
    coded = form.startswith("int") or any(word in kind for word in ("marker", "trig", "ttl", "stim", "event"))
    return form == "string" or (float(_said(stream["info"], "nominal_srate") or 0.0) == 0.0 and coded)


def _said(info: Mapping[str, Any] | None, key: str) -> str:
    """What the description of a stream says, whose every entry is a list."""
    value = (info or {}).get(key)
    value = value[0] if isinstance(value, list) and value else value
    return "" if value is None or isinstance(value, list | dict) else str(value)


def _text(marker: Any) -> str:
    """What a marker says; a whole number has no decimal sign."""
    first = marker[0] if len(marker) == 1 else " ".join(map(str, marker))
    return first if isinstance(first, str) else f"{float(first):g}"


def _channels(stream: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The label, unit and type of each channel of a stream."""
    info, name = stream["info"], _said(stream["info"], "name")
    described = (info.get("desc") or [None])[0] or {}
    inner = (described.get("channels") or [None])[0] or {}
    each, count, found = inner.get("channel") or [], int(_said(info, "channel_count")), []
    for channel in range(count):
        said = each[channel] if channel < len(each) else None
        label = _said(said, "label") or (name if count == 1 else f"{name} {channel + 1}")
        found.append((label, _said(said, "unit"), (_said(said, "type") or _said(info, "type")).casefold()))
    return found


class _Numbers:
    """The samples of a stream of numbers: where they are in the file, and when some of them were taken."""

    def __init__(self, path: Path, said: bytes) -> None:
        self.path, self.type = path, np.dtype(_TYPES[_of(said, "channel_format")])
        self.width = int(_of(said, "channel_count")) * self.type.itemsize
        self.period_s = 1.0 / float(_of(said, "nominal_srate"))
        self.firsts, self.places = [0], list[tuple[int, int]]()  # of each chunk
        self.index, self.times_s, self.last_s = list[int](), list[float](), 0.0

    def add(self, at: int, count: int, raw: bytes) -> None:
        """A chunk whose samples begin at a byte of the file."""
        begins, number = self._begins(raw, count), np.arange(count)
        stamped = np.flatnonzero(np.diff(begins, prepend=-self.width) > 1 + self.width)
        known, known_s = np.append(-1, stamped), np.append(self.last_s, _picked(raw, begins[stamped] - 8, "<f8"))
        since = np.searchsorted(stamped, number, side="right")
        times_s = known_s[since] + self.period_s * (number - known[since])
        late = np.flatnonzero(np.abs(np.diff(times_s) - self.period_s) > _LATE_S) + 1
        chosen = np.unique([0, *late, count - 1])
        self.last_s = float(times_s[-1])
        self.index += (self.firsts[-1] + chosen).tolist()
        self.times_s += times_s[chosen].tolist()
        self.places.append((at, len(raw)))
        self.firsts.append(self.firsts[-1] + count)

    def _begins(self, raw: bytes, count: int) -> IntArray:
        """Where the numbers of each sample begin in a chunk [bytes]: behind its time, if it has one."""
        found, at = list[int](), 0
        for _ in range(count):
            found.append(at + 9 if raw[at] else at + 1)
            at = found[-1] + self.width
        return np.array(found, dtype=np.int64)

    def read(self, channel: int, first: int, last: int) -> FloatArray:
        """The numbers of a channel from one sample to before another."""
        found = [np.empty(0)]
        with _opened(self.path) as file:
            for n in range(bisect_right(self.firsts, first) - 1, bisect_left(self.firsts, last)):
                file.seek(self.places[n][0])
                raw, begin = file.read(self.places[n][1]), self.firsts[n]
                begins = self._begins(raw, self.firsts[n + 1] - begin)[max(0, first - begin) : last - begin]
                found.append(_picked(raw, begins + channel * self.type.itemsize, self.type))
        return np.concatenate(found)


def _picked(raw: bytes, begins: Any, kind: Any) -> FloatArray:
    """The numbers that begin at some bytes."""
    places = begins[:, None] + np.arange(np.dtype(kind).itemsize)
    values: FloatArray = np.frombuffer(raw, np.uint8)[places].view(kind).ravel().astype(np.float64)
    return values


def _shortened(path: Path) -> tuple[dict[int, _Numbers], io.BytesIO]:
    """The streams of numbers at a rate, by their numbers, and a file of the others and of some of their samples."""
    held, rest, ends = dict[int, _Numbers](), [b"XDF:"], dict[int, bytes]()
    for at, tag, content in _chunks(path):
        stream = int.from_bytes(content[:4], "little")
        if tag == _HEADER and _of(content, "channel_format") in _TYPES and float(_of(content, "nominal_srate") or 0):
            held[stream] = _Numbers(path, content)
        if tag == _SAMPLES and stream in held:
            begin = 5 + content[4]
            with suppress(IndexError, ValueError):  # of a damaged chunk, which is left out
                held[stream].add(at + begin, int.from_bytes(content[5:begin], "little"), content[begin:])
        elif tag == _FOOTER and stream in held:
            ends[stream] = content
        else:
            rest.append(_chunk(tag, content))
    for stream, numbers in held.items():
        row = np.dtype([("size", "u1"), ("time", "<f8"), ("values", f"V{numbers.width}")])
        rows = np.zeros(len(numbers.index), row)
        rows["size"], rows["time"] = 8, numbers.times_s
        kept = stream.to_bytes(4, "little")
        rest.append(_chunk(_SAMPLES, kept + b"\x08" + len(rows).to_bytes(8, "little") + rows.tobytes()))
        if stream in ends:  # in which pyxdf sees whether there are samples too many
            extra = max(0, numbers.firsts[-1] - int(_of(ends[stream], "sample_count") or 2**62))
            said = b"<sample_count>%d<" % (len(rows) - extra)
            rest.append(_chunk(_FOOTER, re.sub(rb"<sample_count>[^<]*<", said, ends[stream])))
    return held, io.BytesIO(b"".join(rest))


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


def _chunk(tag: int, content: bytes) -> bytes:
    return b"\x08" + (len(content) + 2).to_bytes(8, "little") + tag.to_bytes(2, "little") + content


def _of(said: bytes, key: str) -> str:
    """What the header of a stream says of itself."""
    found = re.search(rf"<{key}>([^<]*)<".encode(), said)
    return "" if found is None else found[1].decode().strip()


def _opened(path: Path) -> Any:
    return io.BytesIO(_unpacked(path)) if path.suffix.casefold() == ".xdfz" else opened(path)


@lru_cache(maxsize=1)
def _unpacked(path: Path) -> bytes:
    with opened(path) as packed:
        return gzip.decompress(packed.read())
