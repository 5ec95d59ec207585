"""The chunks of XDF: where the numbers of each stream are, and a short file of everything else.

pyxdf reads all samples one by one and as a whole. It gets a file in which a stream of numbers at a rate has the first
and the last sample of each chunk, and those that come late; what it does with clocks and markers is done with these.
"""

from __future__ import annotations

import gzip
import io
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.files import opened
from isiw.types import FloatArray, IntArray

BOUNDARY: Final = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_TYPES: Final = {"float32": "<f4", "double64": "<f8", "int8": "<i1", "int16": "<i2", "int32": "<i4", "int64": "<i8"}
_HEADER, _SAMPLES, _FOOTER = 2, 3, 6
_LATE_S: Final = 1e-3
_MOST: Final = 2**31
"""A chunk that is longer [bytes] is damaged."""


class Numbers:
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


def shortened(path: Path) -> tuple[dict[int, Numbers], io.BytesIO]:
    """The streams of numbers at a rate, by their numbers, and a file of the others and of some of their samples."""
    held, rest, ends = dict[int, Numbers](), [b"XDF:"], dict[int, bytes]()
    for at, tag, content in _chunks(path):
        stream = int.from_bytes(content[:4], "little")
        if tag == _HEADER and _of(content, "channel_format") in _TYPES and float(_of(content, "nominal_srate") or 0):
            held[stream] = Numbers(path, content)
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
