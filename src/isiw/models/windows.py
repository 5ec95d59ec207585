"""From sampled windows to an estimate: the reported window is the one of largest expected F1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final, NamedTuple

import numpy as np

from isiw.design import DesignSpace
from isiw.estimate import Enhancement, Magnitude, WindowEstimate
from isiw.excess import least_excess_mv
from isiw.figures import BestISI
from isiw.lazy import Later
from isiw.native.engine import expected_f1
from isiw.types import Array, BoolArray, FloatArray, IntArray, Singles
from isiw.window import Window

PROFILE_POINTS = 101
"""ISIs at which the expected MEP and its band are reported, at least."""

PROFILE_STEP_MS = 4.0
"""They are no further apart than this, if the space has ISIs between them: narrow peaks are 20 ms wide."""


EXCLUDED_AT = 0.9
"""With which probability `WindowEstimate.largest_excluded` is larger than the largest enhancement."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Sampled windows as runs of ISIs next to each other, sample by sample."""

    sample: IntArray  # which sample each run is of, ascending, (r,)
    first: IntArray  # index of its first ISI, (r,)
    behind: IntArray  # index behind its last, (r,)
    samples: int
    points: int  # how many ISIs

    @classmethod
    def of_masks(cls, masks: Array) -> Runs:
        """The runs of windows given as 0 or 1, shape (s, t)."""
        samples, points = masks.shape
        inside = np.zeros((samples, points + 2), dtype=np.int8)
        inside[:, 1:-1] = masks > 0
        steps = np.diff(inside, axis=-1)
        (sample, first), behind = np.nonzero(steps > 0), np.nonzero(steps < 0)[1]
        return cls(sample, first, behind, samples, points)

    @classmethod
    def of_pairs(cls, pairs: IntArray, points: int) -> Runs:
        """The runs of windows given as pairs of indices, shape (s, 2 k): of the first ISI, and behind the last."""
        every = pairs.reshape(-1, 2)
        runs = np.flatnonzero(every[:, 0] < every[:, 1])
        first, behind = every.take(runs, axis=0).T
        return cls(runs // (pairs.shape[1] // 2), first, behind, len(pairs), points)

    @cached_property
    def _leads(self) -> IntArray:
        """The first run of each window, shape (w,)."""
        others = np.ones(len(self.sample), dtype=bool)
        np.not_equal(self.sample[1:], self.sample[:-1], out=others[1:])
        return np.flatnonzero(others)

    @cached_property
    def found(self) -> IntArray:
        """The samples that have a window, shape (w,)."""
        return self.sample[self._leads]

    @cached_property
    def hulls(self) -> tuple[IntArray, IntArray]:
        """Index of the first and of the last ISI of each window, each of shape (w,)."""
        lasts = np.append(self._leads[1:], len(self.sample))[: len(self._leads)] - 1
        return self.first[self._leads], self.behind[lasts] - 1

    def summed(self, values: FloatArray) -> FloatArray:
        """Sum of what each window has at its runs (r, ...), shape (w, ...)."""
        if len(self._leads) == len(values):  # each has one
            return values
        return np.add.reduceat(values, self._leads, axis=0)

    @cached_property
    def sizes(self) -> FloatArray:
        """Number of ISIs of each window, shape (w,)."""
        return self.summed((self.behind - self.first).astype(float))

    @property
    def membership(self) -> FloatArray:
        """The share of the windows that holds each ISI, shape (t,)."""
        steps = [np.bincount(ends, minlength=self.points + 1) for ends in (self.first, self.behind)]
        return np.cumsum(steps[0] - steps[1])[:-1] / max(1, len(self._leads))


_LEVELS: Final = np.linspace(0.1, 0.9, 17)


def best_window(windows: Runs, grid_ms: FloatArray) -> tuple[Window | None, float]:
    """The window of largest expected F1 among the level sets of the posterior's membership, and that F1."""
    membership = windows.membership
    candidates = membership >= _LEVELS[:, np.newaxis] * membership.max()
    f1 = expected_f1(candidates, windows.sample, windows.first, windows.behind)
    best = int(f1.argmax())
    return Window.from_mask(grid_ms, candidates[best]), float(f1[best])


def edge_samples(windows: Runs, space: DesignSpace) -> FloatArray:
    """Start and end of sampled windows [ms], ±inf if a window runs out of the range, shape (w, 2)."""
    first, last = windows.hulls
    start = np.where(first == 0, -np.inf, space.grid_ms[first])
    end = np.where(last == windows.points - 1, np.inf, space.grid_ms[last])
    return np.stack((start, end), axis=-1)


@cache
def profile_grid(space: DesignSpace) -> Singles:
    """The ISIs at which profiles are reported [ms], shape (t,); one array for all callers, who leave it as it is."""
    every = max(1, min(len(space.grid_ms) // PROFILE_POINTS, int(PROFILE_STEP_MS / space.step_ms)))
    return np.array(sorted({*space.grid_ms[::every], space.grid_ms[-1]}), dtype=np.float32)


@cache
def grid_of(space: DesignSpace) -> Singles:
    """The ISIs of the space's grid [ms], likewise."""
    return space.grid_ms.astype(np.float32)


class SampledProfiles(NamedTuple):
    """Sampled profiles of one person."""

    mep_mv: Array  # expected at the ISIs of `profile_grid`, (s, t)
    baseline_mv: Array  # expected without a tap, (s,)

    @property
    def excess_mv(self) -> Array:
        """Largest enhancement at any ISI [mV], shape (s,)."""
        excess_mv: Array = np.maximum(self.mep_mv.max(-1) - self.baseline_mv, 0.0)
        return excess_mv

    @property
    def enhanced(self) -> BoolArray:
        """Which samples have a window, shape (s,)."""
        return np.isfinite(least_excess_mv(self.excess_mv, self.baseline_mv))


class SampledHypotheses(NamedTuple):
    """The hypotheses that sampled windows belong to: an index of the names for each sample, shape (s,)."""

    kinds: IntArray
    names: tuple[str, ...]


def sampled_estimate(
    windows: Runs,
    profiles: Callable[[], SampledProfiles],
    space: DesignSpace,
    hypotheses: SampledHypotheses | None = None,
    shift_pct_rmt: Callable[[], float | None] = lambda: None,
    most_probable: float = 1.0,
) -> WindowEstimate:
    """The estimate of the window of one person by equally weighted samples, at most so probable."""
    probability = min(len(windows.found) / windows.samples, most_probable)
    first, last = windows.hulls
    edges = edge_samples(windows, space)
    middle = (len(edges) - 1) // 2
    start, end = np.sort(edges, axis=0)[middle].tolist() if len(edges) else (None, None)
    reported, f1 = best_window(windows, space.grid_ms) if probability >= 0.5 else (None, 1.0)
    profiles = cache(profiles)
    return WindowEstimate(
        probability=probability,
        window=reported,
        start_ms=start,
        end_ms=end,
        grid_ms=profile_grid(space).astype(float),
        edge_samples_ms=edges,
        profile_quantiles_mv=Later(lambda: _band_mv(profiles())),
        split_probability=float((windows.sizes <= last - first).mean()) if len(edges) else None,
        hypothesis_samples=None if hypotheses is None else hypotheses.kinds[windows.found],
        hypothesis_names=() if hypotheses is None else hypotheses.names,
        expected_f1=f1 * (1.0 - probability if reported is None else probability),
        best_isi=Later(lambda: _best_isi(profiles(), space)),
        magnitude=Later(lambda: _magnitude(profiles())),
        largest_excluded=Later(
            lambda: Enhancement(float(np.quantile(profiles().excess_mv, EXCLUDED_AT)), shift_pct_rmt())
        ),
    )


_BAND: Final = (0.05, 0.5, 0.95)


def _band_mv(profiles: SampledProfiles) -> FloatArray:
    # As `np.quantile` interpolates, which takes three times as long for so few samples.
    place = (len(profiles.mep_mv) - 1) * np.array(_BAND)
    low, high = np.floor(place).astype(int), np.ceil(place).astype(int)
    ordered = np.sort(profiles.mep_mv, axis=0)
    band_mv: FloatArray = ordered[low] + (place - low)[:, np.newaxis] * (ordered[high] - ordered[low]).astype(float)
    return band_mv


def _magnitude(profiles: SampledProfiles) -> Magnitude | None:
    enhanced, base_mv = profiles.enhanced, profiles.baseline_mv
    if not enhanced.any():
        return None
    excess_mv = profiles.excess_mv[enhanced]
    sizes = (excess_mv, 1.0 + excess_mv / base_mv[enhanced])
    medians = (np.quantile(each, _BAND)[[1, 0, 2]].astype(float).tolist() for each in sizes)
    return Magnitude(*map(tuple, medians))


def _best_isi(profiles: SampledProfiles, space: DesignSpace) -> BestISI | None:
    enhanced = profiles.enhanced
    if not enhanced.any():
        return None
    low, median, high = np.quantile(profile_grid(space)[profiles.mep_mv[enhanced].argmax(-1)], _BAND).tolist()
    return BestISI(median, low, high)
