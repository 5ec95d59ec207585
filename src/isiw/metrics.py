"""Measures of an estimate: F1, edge errors, coverage, correlation, and the trial from which a criterion is met."""

from __future__ import annotations

import math
from types import NoneType
from typing import Final, NamedTuple

import numpy as np

from isiw.design import DesignSpace, require_space
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.types import ArrayLike, BoolArray, FloatArray
from isiw.window import Interval, Window

LEAST_ISIS: Final = 3
"""Profiles with fewer ISIs in common have no correlation."""


class ProfileCorrelation(NamedTuple):
    """Correlation of two profiles.

    Args:
        r: Pearson's r; NaN if one of them is the same everywhere.
        isis: at how many ISIs.
    """

    r: float
    isis: int


def f1_of_masks(estimated: ArrayLike, true: ArrayLike) -> FloatArray:
    """F1 of an estimated against a true set of grid points; 1 if both are empty, 0 if one is."""
    a, b = np.asarray(estimated, dtype=bool), np.asarray(true, dtype=bool)
    size = a.sum(axis=-1) + b.sum(axis=-1)
    return np.where(size == 0, 1.0, 2.0 * (a & b).sum(axis=-1) / np.maximum(size, 1))


def f1(estimate: WindowEstimate | Window | None, truth: Window | None, space: DesignSpace) -> float:
    """F1 of an estimated window against the truth on the space's grid."""
    _require(estimate, "the estimate", WindowEstimate, Window, NoneType)
    _require(truth, "the true window", Window, NoneType)
    require_space(space)
    if isinstance(estimate, WindowEstimate) and not estimate.has_answer:
        return 0.0
    window = estimate.window if isinstance(estimate, WindowEstimate) else estimate
    return float(f1_of_masks(_on_grid(window, space), _on_grid(truth, space)))


def _require(given: object, what: str, *kinds: type) -> None:
    """Raise if something else is given, such as an estimate in the place of the truth."""
    if not isinstance(given, kinds):
        raise InvalidValueError(
            f"{what} is of another kind",
            got=type(given).__name__,
            expected=" or ".join("None" if kind is NoneType else kind.__name__ for kind in kinds),
            remedy="The estimate comes first, then the true window, then the space.",
        )


def _on_grid(window: Window | None, space: DesignSpace) -> BoolArray:
    """Which ISIs of the space are a window's; at least one if it lies in the space."""
    grid_ms = space.grid_ms
    if window is None:
        return np.zeros(len(grid_ms), dtype=bool)
    mask = window.mask(grid_ms)
    if not mask.any() and space.low_ms <= window.start_ms <= window.end_ms <= space.high_ms:
        middles_ms = [0.5 * (start_ms + end_ms) for start_ms, end_ms in window.segments]
        mask[[np.abs(grid_ms - middle_ms).argmin() for middle_ms in middles_ms]] = True
    return mask


def true_edges_ms(truth: Window, space: DesignSpace) -> Interval:
    """Start and end of a true window [ms], ±inf if it runs out of the range."""
    _require(truth, "the true window", Window)
    require_space(space)
    start = -math.inf if truth.start_ms <= space.low_ms else truth.start_ms
    end = math.inf if truth.end_ms >= space.high_ms else truth.end_ms
    return start, end


def covers(
    estimate: WindowEstimate, truth: Window | None, space: DesignSpace, level: float = 0.9
) -> tuple[bool, bool] | None:
    """True if the credible intervals of start and end hold the true edges; None if there are none of either."""
    _require(estimate, "the estimate", WindowEstimate)
    intervals = estimate.interval(level)
    if intervals is None or truth is None:
        return None
    slack = 0.5 * space.step_ms
    start, end = (
        low - slack <= edge <= high + slack
        for (low, high), edge in zip(intervals, true_edges_ms(truth, space), strict=True)
    )
    return start, end


def profile_correlation(
    isi_ms: ArrayLike, mep_mv: ArrayLike, other_isi_ms: ArrayLike, other_mep_mv: ArrayLike
) -> ProfileCorrelation:
    """Correlation of two profiles (Pearson's r), such as an estimated and a measured one [Kim2020, Fig. 4.23].

    It is taken at those ISIs of the second profile that the first one spans, at which the first is interpolated.

    Args:
        isi_ms: ISIs of the first profile, ascending [ms], shape (t,).
        mep_mv: its MEP at each [mV], shape (t,).
        other_isi_ms: ISIs of the second, such as those of a sweep [ms], shape (n,).
        other_mep_mv: its MEP at each [mV], shape (n,).

    Raises:
        InvalidValueError: shapes that do not fit, values that are not finite, ISIs that do not ascend, or fewer than
            three common ISIs.
    """
    (own_ms, own_mv), (at_ms, other_mv) = (_profile(*each) for each in ((isi_ms, mep_mv), (other_isi_ms, other_mep_mv)))
    both = (at_ms >= own_ms[0]) & (at_ms <= own_ms[-1])
    if both.sum() < LEAST_ISIS:
        raise InvalidValueError(
            "the profiles have too few ISIs in common", got=int(both.sum()), expected=f"at least {LEAST_ISIS}"
        )
    first, second = np.interp(at_ms[both], own_ms, own_mv), other_mv[both]
    flat = min(np.ptp(first), np.ptp(second)) == 0.0
    return ProfileCorrelation(math.nan if flat else float(np.corrcoef(first, second)[0, 1]), int(both.sum()))


def _profile(isi_ms: ArrayLike, mep_mv: ArrayLike) -> tuple[FloatArray, FloatArray]:
    at_ms, sizes_mv = np.asarray(isi_ms, dtype=float), np.asarray(mep_mv, dtype=float)
    if at_ms.ndim != 1 or at_ms.shape != sizes_mv.shape or not len(at_ms):
        raise InvalidValueError("each ISI of a profile has one MEP", got=(at_ms.shape, sizes_mv.shape))
    if not (np.isfinite(at_ms).all() and np.isfinite(sizes_mv).all() and (np.diff(at_ms) > 0).all()):
        raise InvalidValueError("a profile has finite MEPs at ISIs that ascend", got=at_ms.tolist())
    return at_ms, sizes_mv


def edge_ranks(
    estimate: WindowEstimate, truth: Window, space: DesignSpace, rng: np.random.Generator
) -> tuple[float, float]:
    """Where the true start and end rank among the samples of the posterior, in 0–1.

    Over people of the model's own prior the ranks of an honest posterior are uniform (simulation-based calibration
    [Talts2018]). Samples equal to the truth, as on a grid, are ranked at random.
    """
    _require(estimate, "the estimate", WindowEstimate)
    samples = np.empty((0, 2)) if estimate.edge_samples_ms is None else estimate.edge_samples_ms
    edges = np.array(true_edges_ms(truth, space))
    below, equal = (samples < edges).sum(axis=0), (samples == edges).sum(axis=0)
    start, end = (below + rng.random(2) * (equal + 1)) / (len(samples) + 1)
    return float(start), float(end)


def edge_error_ms(estimate: WindowEstimate | Window | None, truth: Window | None) -> tuple[float, float] | None:
    """Estimated minus true start and end [ms]; None if either has no window."""
    _require(estimate, "the estimate", WindowEstimate, Window, NoneType)
    _require(truth, "the true window", Window, NoneType)
    window = estimate.window if isinstance(estimate, WindowEstimate) else estimate
    if window is None or truth is None:
        return None
    return window.start_ms - truth.start_ms, window.end_ms - truth.end_ms


def trials_to_criterion(mean_f1: ArrayLike, criterion: float) -> int | None:
    """The first trial from which a cohort's mean F1 stays at or above a criterion; None if it never does."""
    reached = np.asarray(mean_f1, dtype=float) >= criterion  # a NaN has not
    missed = np.flatnonzero(~reached)
    first = 1 if len(missed) == 0 else int(missed[-1]) + 2
    return first if first <= len(reached) else None
