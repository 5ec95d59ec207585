"""The least-excess rule, which defines the window of an expected MEP over ISIs."""

from __future__ import annotations

import math

import numpy as np

from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, FloatArray
from isiw.window import Window

EDGE_LEVEL = 0.135
"""The share of the largest excess that a window's edge has: two SDs down a Gaussian [Kim2020, 4.3]."""

MIN_EXCESS_MV = 0.002
MIN_EXCESS_OF_BASELINE = 0.10

LEAST_DEPRESSED_MV = 0.05
"""Where the expected MEP without a tap is smaller there is none to depress: what counts as an MEP [Rossini2015]."""


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
