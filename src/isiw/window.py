"""The window: the ISIs that enhance the MEP, as `excess` defines it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, BoolArray

Interval: TypeAlias = tuple[float, float]


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
        padded = np.concatenate(([False], inside, [False]))
        steps = np.flatnonzero(padded[1:] != padded[:-1])
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
