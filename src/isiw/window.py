"""The window: the ISIs that enhance the MEP, and the least-excess rule that defines it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, BoolArray, FloatArray

EDGE_LEVEL = 0.135
"""The share of the largest excess that a window's edge has: two SDs down a Gaussian [Kim2020, 4.3]."""

MIN_EXCESS_MV = 0.002
MIN_EXCESS_OF_BASELINE = 0.10

LEAST_DEPRESSED_MV = 0.05
"""Where the expected MEP without a tap is smaller there is none to depress: what counts as an MEP [Rossini2015]."""

SURE = 0.95
"""Probability from which on it is said outright that there is a window, or none; below it "probably", or undecided."""

LEAST_FACTOR = 3.0
"""Bayes factor below which trials hardly speak for a window: "not worth more than a bare mention" [Kass1995]."""

Interval: TypeAlias = tuple[float, float]


def rules_out(probability: float | None) -> bool:
    """True if nothing reported means that there is none; with more probability than this it is undecided."""
    return probability is None or 1 - probability >= SURE


def bayes_factor(probability: float | None, beforehand: float | None) -> float | None:
    """By what the trials multiplied the odds of a window; None if one of the probabilities is not known."""
    if probability is None or beforehand is None or not 0 < beforehand < 1:
        return None
    odds = math.inf if probability == 1 else probability / (1 - probability)
    return odds * (1 - beforehand) / beforehand


@dataclass(frozen=True)
class Window:
    """The ISIs that enhance the MEP: disjoint segments and their hull.

    Args:
        start_ms: first enhancing ISI [ms].
        end_ms: last enhancing ISI [ms].
        segments: disjoint intervals (start, end) [ms] in ascending order; one by default.

    Raises:
        InvalidValueError: values that are not finite, an end before a start, or segments that overlap or miss the hull.
    """

    start_ms: float
    end_ms: float
    segments: tuple[Interval, ...] = ()

    def __post_init__(self) -> None:
        segments = tuple((float(a), float(b)) for a, b in self.segments) or (
            (float(self.start_ms), float(self.end_ms)),
        )
        flat = [edge for segment in segments for edge in segment]
        if not all(math.isfinite(edge) for edge in flat):
            raise InvalidValueError("a window's edges must be finite", got=segments)
        if any(b < a for a, b in segments) or any(b >= a for (_, b), (a, _) in itertools.pairwise(segments)):
            raise InvalidValueError("a window's segments must ascend without overlap", got=segments)
        if (self.start_ms, self.end_ms) != (flat[0], flat[-1]):
            raise InvalidValueError(
                "start and end are the hull of the segments", got=(self.start_ms, self.end_ms), expected=str(flat)
            )
        object.__setattr__(self, "segments", segments)
        object.__setattr__(self, "start_ms", flat[0])
        object.__setattr__(self, "end_ms", flat[-1])

    @classmethod
    def from_mask(cls, grid_ms: ArrayLike, mask: ArrayLike) -> Window | None:
        """The window of the marked grid points, or None if none is marked.

        Args:
            grid_ms: ascending ISIs [ms], shape (t,).
            mask: which of them enhance the MEP, shape (t,).

        Raises:
            InvalidValueError: not one value of the mask for each ISI.
        """
        grid, inside = np.asarray(grid_ms, dtype=float), np.asarray(mask, dtype=bool)
        if grid.shape != inside.shape or grid.ndim != 1:
            raise InvalidValueError(
                "each ISI needs one value",
                got=f"{inside.size} values for {grid.size} ISIs",
                remedy="Give both on the same grid, as space.grid_ms and person.expected_mep_mv(space) are.",
            )
        if not inside.any():
            return None
        steps = np.flatnonzero(np.diff(np.concatenate(([False], inside, [False])).astype(int)))
        segments = tuple((float(grid[a]), float(grid[b - 1])) for a, b in zip(steps[::2], steps[1::2], strict=True))
        return cls(segments[0][0], segments[-1][1], segments)

    @classmethod
    def of_edges(cls, edges_ms: Sequence[float]) -> Window | None:
        """The window whose segments start and end at these ISIs in turn; None if there are none.

        Args:
            edges_ms: start and end of each segment in turn [ms], ascending, shape (2 k,) for k segments.

        Raises:
            InvalidValueError: ISIs that do not ascend.
        """
        segments = tuple(zip(edges_ms[::2], edges_ms[1::2], strict=True))
        return cls(edges_ms[0], edges_ms[-1], segments) if segments else None

    @property
    def edges_ms(self) -> tuple[float, ...]:
        """Starts and ends of the segments in turn [ms]."""
        return tuple(itertools.chain(*self.segments))

    @property
    def width_ms(self) -> float:
        """Width of the hull [ms]."""
        return self.end_ms - self.start_ms

    def mask(self, grid_ms: ArrayLike) -> BoolArray:
        """Which of the grid points [ms] lie in the window, shape of `grid_ms`."""
        grid = np.asarray(grid_ms, dtype=float)
        inside = np.zeros(grid.shape, dtype=bool)
        for start, end in self.segments:
            inside |= (grid >= start - 1e-9) & (grid <= end + 1e-9)
        return inside

    def __str__(self) -> str:
        return " and ".join(f"{a:g}–{b:g} ms" for a, b in self.segments)


class Enhancement(NamedTuple):
    """By how much the tap enlarges the expected MEP [mV], and the shift of the recruitment curve's input [% RMT]."""

    mep_mv: float
    shift_pct_rmt: float | None = None


class Magnitude(NamedTuple):
    """The size of the enhancement at the best ISI, given that there is a window: medians and 90 % intervals.

    Args:
        mep_mv: by how much the expected MEP is larger than without a tap [mV].
        ratio: how many times as large as that of TMS alone it is, the EMG floor in both.
    """

    mep_mv: tuple[float, float, float]
    ratio: tuple[float, float, float]


def least_excess_mv(peak_mv: ArrayLike, baseline_mv: ArrayLike, share: float = EDGE_LEVEL) -> FloatArray:
    """The least-excess rule: what the expected MEP at an ISI inside the window exceeds the baseline by, at least [mV].

    It is a share of the largest excess. Where that is below 10 % of the baseline or below 2 µV nothing is enhanced, and
    the least excess is infinite.
    """
    peak = np.asarray(peak_mv, dtype=float)
    enough_mv = np.maximum(MIN_EXCESS_OF_BASELINE * np.asarray(baseline_mv, dtype=float), MIN_EXCESS_MV)
    return np.where(peak >= enough_mv, share * peak, np.inf)


def window_from_excess(grid_ms: ArrayLike, excess_mv: ArrayLike, baseline_mv: float) -> Window | None:
    """The window by the least-excess rule, or None if nothing is enhanced."""
    excess = np.asarray(excess_mv, dtype=float)
    if not (np.isfinite(excess).all() and math.isfinite(baseline_mv)):
        raise InvalidValueError("the expected MEP must be finite at every ISI", got=(float(excess.max()), baseline_mv))
    return Window.from_mask(grid_ms, excess >= least_excess_mv(excess.max(), baseline_mv))
