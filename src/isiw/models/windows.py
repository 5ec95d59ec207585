"""From sampled windows to an estimate: the reported window is the one of largest expected F1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from isiw.design import DesignSpace
from isiw.estimate import Enhancement, Magnitude, WindowEstimate
from isiw.excess import least_excess_mv
from isiw.figures import BestISI
from isiw.lazy import Later
from isiw.native.engine import best_window
from isiw.types import Array, BoolArray, FloatArray, IntArray, Singles
from isiw.window import Window

PROFILE_POINTS = 101
"""ISIs at which the expected MEP and its band are reported, at least."""

PROFILE_STEP_MS = 4.0
"""They are no further apart than this, if the space has ISIs between them: narrow peaks are 20 ms wide."""


EXCLUDED_AT = 0.9
"""With which probability `WindowEstimate.largest_excluded` is larger than the largest enhancement."""


CUTS: Final = np.linspace(0.1, 0.9, 17)
"""Level sets of the membership that may be reported, as shares of the largest, (cuts,)."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Sampled windows as runs of ISIs next to each other."""

    pairs: NDArray[np.int32]  # of each index of its first ISI, and behind its last; 0 where there is none, (s, k, 2)
    points: int  # how many ISIs
    told: tuple[BoolArray, float] | None = None  # what `best` is, if that was worked out

    @classmethod
    def of_masks(cls, masks: Array) -> Runs:
        """The runs of windows given as 0 or 1, shape (s, t)."""
        samples, points = masks.shape
        inside = np.zeros((samples, points + 2), dtype=np.int8)
        inside[:, 1:-1] = masks > 0
        steps = np.diff(inside, axis=-1)
        (sample, first), behind = np.nonzero(steps > 0), np.nonzero(steps < 0)[1]
        number = np.arange(len(sample)) - np.searchsorted(sample, sample)
        pairs = np.zeros((samples, 1 + number.max(initial=0), 2), dtype=np.int32)
        pairs[sample, number] = np.stack((first, behind), axis=-1)
        return cls(pairs, points)

    @cached_property
    def found(self) -> IntArray:
        """The samples that have a window, shape (w,)."""
        return np.flatnonzero(self.pairs[:, 0, 1])

    @cached_property
    def _own(self) -> NDArray[np.int32]:
        """The runs of those, shape (w, k, 2)."""
        return self.pairs.take(self.found, axis=0)

    @cached_property
    def hulls(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Index of the first and of the last ISI of each window, each of shape (w,)."""
        return self._own[:, 0, 0], self._own[:, :, 1].max(-1) - 1

    @property
    def sizes(self) -> IntArray:
        """Number of ISIs of each window, shape (w,)."""
        sizes: IntArray = (self._own[..., 1] - self._own[..., 0]).sum(-1)
        return sizes

    @property
    def best(self) -> tuple[BoolArray, float]:
        """The set of ISIs of largest expected F1 among the level sets of the membership, (t,), and that F1."""
        return best_window(self.pairs, self.points, CUTS) if self.told is None else self.told


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
    probability = min(len(windows.found) / len(windows.pairs), most_probable)
    first, last = windows.hulls
    edges = edge_samples(windows, space)
    middle = (len(edges) - 1) // 2
    start, end = np.sort(edges, axis=0)[middle].tolist() if len(edges) else (None, None)
    inside, f1 = windows.best if probability >= 0.5 else (None, 1.0)
    reported = None if inside is None else Window.from_mask(space.grid_ms, inside)
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
