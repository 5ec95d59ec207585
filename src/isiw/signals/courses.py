"""The EMG of sweeps after the hit, a row a sweep: written once, and from then on shared by all that is learnt later."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from isiw.signals.spans import TAP_MS
from isiw.types import BoolArray, FloatArray, IntArray

STEP_MS: Final = 0.25
APART_MS = 40.0
"""How far from the usual delay of the hit it may be."""

GRID_MS: Final = np.arange(-APART_MS, TAP_MS + APART_MS, STEP_MS)
_ROOM: Final = 16


class Span(NamedTuple):
    """Some of `GRID_MS`: from which place on, and before which."""

    first: int
    end: int

    @classmethod
    def between(cls, from_ms: float, until_ms: float) -> Span:
        """The times that are not outside two others."""
        first, end = np.searchsorted(GRID_MS, from_ms), np.searchsorted(GRID_MS, until_ms, side="right")
        return cls(int(first), int(end))

    @property
    def places(self) -> slice:
        """The same as a slice."""
        return slice(self.first, max(self.first, self.end))


@dataclass(eq=False)
class _Rows:
    """Rows for sweeps, of which the first `used` are written, and never again."""

    courses_mv: FloatArray  # at `GRID_MS`; 0 where a sweep does not show it, (rows, g)
    spans: IntArray  # what of `GRID_MS` it shows, (rows, 2)
    rests_mv: FloatArray  # (rows,)
    used: int

    @classmethod
    def room(cls, rows: int) -> _Rows:
        return cls(np.zeros((rows, GRID_MS.size)), np.zeros((rows, 2), dtype=np.int64), np.zeros(rows), 0)


class Sums(NamedTuple):
    """Of sweeps whose responses have sizes, at `GRID_MS`: what sizes and courses sum up to, and how many show it."""

    courses_mv: FloatArray
    weights: FloatArray
    shown: IntArray


@dataclass(frozen=True, eq=False)
class Courses:
    """The EMG of sweeps after the hit at `GRID_MS`, which of it each sweep shows, and its size at rest.

    The size is the mean from peak to peak over the length of the MEP window; NaN if the rest is shorter.
    """

    _rows: _Rows
    count: int = 0

    @classmethod
    def none(cls) -> Courses:
        """Those of no sweep."""
        return cls(_Rows.room(_ROOM))

    def appended(self, course_mv: FloatArray, span: Span, rest_mv: float) -> Courses:
        """The same and one more sweep."""
        rows = self._rows
        if rows.used != self.count or rows.used == len(rows.rests_mv):
            rows = _Rows.room(max(_ROOM, 2 * self.count))
            rows.courses_mv[: self.count] = self.courses_mv
            rows.spans[: self.count] = self.spans
            rows.rests_mv[: self.count] = self.rests_mv
        rows.courses_mv[self.count, span.places] = course_mv[span.places]
        rows.spans[self.count] = span
        rows.rests_mv[self.count] = rest_mv
        rows.used = self.count + 1
        return Courses(rows, self.count + 1)

    @property
    def courses_mv(self) -> FloatArray:
        """The EMG of each sweep, shape (k, g)."""
        return self._rows.courses_mv[: self.count]

    @property
    def spans(self) -> IntArray:
        """From which place of `GRID_MS` each sweep shows it, and before which, shape (k, 2)."""
        return self._rows.spans[: self.count]

    @property
    def rests_mv(self) -> FloatArray:
        """The size of each at rest, shape (k,)."""
        return self._rows.rests_mv[: self.count]

    @property
    def has_rest(self) -> bool:
        """Whether any sweep shows EMG at rest for long enough."""
        return not bool(np.isnan(self.rests_mv).all())

    def showing(self, span: Span) -> BoolArray:
        """Which sweeps show all of a span, shape (k,)."""
        return np.asarray((self.spans[:, 0] <= span.first) & (self.spans[:, 1] >= span.end))

    def rest_mv(self, which: BoolArray) -> float:
        """The mean size at rest of some sweeps; of all of them where none of these shows it."""
        own = self.rests_mv[which]
        return float(np.nanmean(self.rests_mv if np.isnan(own).all() else own))

    def sums(self, which: BoolArray, sizes: FloatArray) -> Sums:
        """The sums of some sweeps by the sizes of their responses."""
        by_sweep = np.zeros(self.count)
        by_sweep[which] = sizes
        spans = self.spans[which]
        return Sums(by_sweep @ self.courses_mv, _over(spans, sizes**2), _over(spans).round().astype(np.int64))

    def mean_mv(self, least: int) -> FloatArray:
        """The mean course where so many sweeps show it, and 0 elsewhere, shape (g,)."""
        count = _over(self.spans).round()
        return np.where(count >= least, self.courses_mv.sum(axis=0) / np.maximum(count, 1), 0.0)


def within(spans: IntArray, values: FloatArray) -> FloatArray:
    """The sums of values at `GRID_MS` over some spans, shape (k,)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[np.maximum(spans[:, 0], spans[:, 1])] - total[spans[:, 0]])


def _over(spans: IntArray, weights: FloatArray | None = None) -> FloatArray:
    """What the weights of the spans that hold a place sum up to, at each of `GRID_MS`, shape (g,)."""
    ends = np.maximum(spans[:, 0], spans[:, 1])
    begun, ended = (np.bincount(at, weights, GRID_MS.size + 1) for at in (spans[:, 0], ends))
    return np.asarray(np.cumsum(begun - ended)[:-1], dtype=np.float64)


def size_at_rest_mv(values_mv: FloatArray, each: int) -> float:
    """The mean from peak to peak of pieces of EMG at rest, each of so many samples, the last first; NaN if shorter."""
    pieces = values_mv[values_mv.size % each :].reshape(-1, each)
    return float(np.ptp(pieces, axis=-1).mean()) if pieces.size else math.nan
