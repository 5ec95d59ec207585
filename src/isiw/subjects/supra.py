"""People under TMS above the motor threshold: a tap may depress the MEP as well as enhance it [Kim2020, 8.1.3]."""

from __future__ import annotations

from typing import Final

import numpy as np

from isiw.subjects.profiles import OpposedProfile, PeakProfile
from isiw.subjects.responses import EmgFloor, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject

INTENSITY_PCT_RMT: Final = 120.0
"""Intensity of the pulse [% RMT] [Kim2020, 8.1.3]."""

RANGE_MS: Final = 120.0
"""Both segments lie between the impact and this ISI [ms]."""

WIDTH_LIMITS_MS: Final = (10.0, 60.0)
"""A segment's width is clipped to these [ms], so that two of them always fit into the range."""


def supra_threshold(rng: np.random.Generator) -> SimulatedSubject:
    """A person of the cohort `supra-threshold`."""
    boost_pct, dip_pct = float(rng.uniform(6, 18)), float(rng.uniform(5, 12))
    first, second = _segments(rng)
    if rng.random() < 0.5:
        first, second = second, first
    response = RecruitmentResponse(
        EmgFloor(_log_normal(rng, 0.010, 0.25), float(rng.uniform(0.12, 0.25))),
        amplitude_mv=_log_normal(rng, 1.0, 0.4),
        slope_per_pct=0.23,
        x50_pct_rmt=float(rng.uniform(112, 122)),
        boost_pct_rmt=boost_pct,
        sigma_x_pct_rmt=float(rng.uniform(5, 9)),
        sigma_y=float(rng.uniform(0.3, 0.5)),
        intensity_pct_rmt=INTENSITY_PCT_RMT,
    )
    return SimulatedSubject(
        OpposedProfile(first, second, dip_pct / boost_pct),
        response,
        hit_delay_ms=float(rng.uniform(170, 190)),
        hit_delay_sd_ms=float(rng.uniform(1, 4)),
        input_correlation=float(rng.uniform(0, 0.2)),
    )


def _segments(rng: np.random.Generator) -> tuple[PeakProfile, PeakProfile]:
    """Two segments one behind the other; what they leave of the range is cut at random."""
    widths_ms = [float(np.clip(_log_normal(rng, 30.0, 0.3), *WIDTH_LIMITS_MS)) for _ in range(2)]
    before_ms, until_ms = np.sort(rng.uniform(0.0, RANGE_MS - sum(widths_ms), 2)).tolist()
    return PeakProfile(before_ms, widths_ms[0]), PeakProfile(until_ms + widths_ms[0], widths_ms[1])


def _log_normal(rng: np.random.Generator, median: float, log_sd: float) -> float:
    return float(median * np.exp(log_sd * rng.standard_normal()))
