"""Taps alone whose amplitudes were taken, without waveforms: what they say of the tap's own part of amplitudes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from isiw.signals.spans import HIT_DELAY_MS, MEP_WINDOW_MS, TAP_MS
from isiw.window import Window

LEAST_SHOWN: Final = 3
"""So many taps, or sweeps, say what the tap does; with fewer nobody knows how much it varies."""

LEAST_WEIGHT: Final = 0.1
"""The least sum of weights that a mean is made of, or of squared sizes, whose mean is 1, that a course is made of."""

ALONE_NEAR_MS: Final = 10.0
"""Taps alone speak for the ISIs around theirs, with weights of this SD [ms]."""

ALONE_SHARE, ALONE_COUNTS = 0.7, 2.0
"""SD of the tap's response from trial to trial as a share of its mean: that is expected, and counts as so many taps."""


class TapsAlone(NamedTuple):
    """The tap's own part of amplitudes near an ISI, as taps alone say whose amplitude was taken there [mV]."""

    mean_mv: float
    sd_mv: float  # from trial to trial
    taps: float  # so many say so, by their nearness

    @property
    def most_mv(self) -> float:
        """More is hardly the tap's: its mean, which few taps tell badly, and three SDs."""
        return self.mean_mv + 3.0 * self.sd_mv * math.sqrt(1.0 + 1.0 / self.taps)

    @property
    def log_sd(self) -> float:
        """SD of the mean as so few taps tell it, natural log."""
        return math.sqrt(math.log1p((self.sd_mv / self.mean_mv) ** 2 / self.taps)) if self.mean_mv > 0 else 0.0


def taps_near(taps: Sequence[tuple[float, float]], isi_ms: float, least_mv: float) -> TapsAlone | None:
    """The evidence of taps alone, ISIs [ms] and amplitudes [mV], near an ISI, above the least; None for too few."""
    isis_ms, sizes_mv = np.array(taps).T
    weights = np.exp(-0.5 * ((isis_ms - isi_ms) / ALONE_NEAR_MS) ** 2)
    count = float(weights.sum())
    if count < LEAST_WEIGHT:
        return None
    excess = sizes_mv - least_mv
    mean = float(weights @ excess) / count
    variance = float(weights @ (excess - mean) ** 2)
    sd_mv = math.sqrt((variance + ALONE_COUNTS * (ALONE_SHARE * mean) ** 2) / (count + ALONE_COUNTS))
    return TapsAlone(mean, sd_mv, count)


def meets_response(isi_ms: float, reference: str, mep_window_ms: tuple[float, float] = MEP_WINDOW_MS) -> bool:
    """Whether the MEP window at an ISI meets the time after the hit in which a tap may move the EMG."""
    from_hit_ms = isi_ms - (HIT_DELAY_MS if reference == "valve" else 0.0)
    return -mep_window_ms[1] <= from_hit_ms <= TAP_MS - mep_window_ms[0]


def taps_anywhere(sizes_mv: Sequence[float], least_mv: float) -> TapsAlone | None:
    """The same of taps alone whose amplitudes [mV] are the largest at any time; None for too few."""
    if len(sizes_mv) < LEAST_SHOWN:
        return None
    excess = np.asarray(sizes_mv) - least_mv
    return TapsAlone(float(excess.mean()), float(excess.std()), len(sizes_mv))


def is_inside(window: Window, isi_ms: float) -> bool:
    """Whether an ISI [ms] is within a segment of a window."""
    return any(start <= isi_ms <= end for start, end in window.segments)
