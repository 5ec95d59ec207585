"""Labs: people of one rig and one protocol, who are more alike than people at large."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from isiw.checks import choice, whole
from isiw.subjects.profiles import PeakProfile
from isiw.subjects.responses import EmgFloor, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject

_Pair: TypeAlias = tuple[float, float]


class _Centre(NamedTuple):
    """Between which values a lab's mean start and mean hit delay lie [ms]."""

    start_ms: _Pair
    hit_delay_ms: _Pair


LABS: Final = MappingProxyType(
    {
        "lab": _Centre((35, 80), (174, 186)),
        "lab-late": _Centre((115, 165), (174, 186)),
        "lab-rig": _Centre((35, 80), (20, 300)),
    }
)
"""Cohorts of one lab each, drawn from the seed: about the people of `recruitment`, about those of `late`, and those of
`recruitment` with a rig of any hit delay."""


@dataclass(frozen=True)
class Lab:
    """The law of a lab's people: mean and SD over people, or the median and the SD of the natural logarithm.

    Args:
        start_ms: mean and SD of the window's start from the impact [ms].
        width_ms: median and log SD of its width [ms], clipped to 40–230.
        hit_delay_ms: mean and SD of a person's mean hit delay [ms].
        amplitude_mv: median and log SD of the largest MEP [mV].
        boost_pct_rmt: median and log SD of the shift of the input at the best ISI [% RMT].
        sigma_x_pct_rmt: median and log SD of the noise on the input [% RMT].
        sigma_y: median and log SD of the noise on the output, natural log.
        floor_mv: median and log SD of the EMG floor [mV].
        floor_log_sd: median and log SD of the floor's log SD over trials.
    """

    start_ms: _Pair
    width_ms: _Pair
    hit_delay_ms: _Pair
    amplitude_mv: _Pair
    boost_pct_rmt: _Pair
    sigma_x_pct_rmt: _Pair
    sigma_y: _Pair
    floor_mv: _Pair
    floor_log_sd: _Pair

    def subject(self, rng: np.random.Generator) -> SimulatedSubject:
        """One of its people."""
        floor = EmgFloor(_log_normal(rng, self.floor_mv), _log_normal(rng, self.floor_log_sd))
        response = RecruitmentResponse(
            floor,
            amplitude_mv=_log_normal(rng, self.amplitude_mv),
            slope_per_pct=0.30,
            x50_pct_rmt=float(rng.uniform(103, 107)),
            boost_pct_rmt=_log_normal(rng, self.boost_pct_rmt),
            sigma_x_pct_rmt=_log_normal(rng, self.sigma_x_pct_rmt),
            sigma_y=_log_normal(rng, self.sigma_y),
        )
        width_ms = float(np.clip(_log_normal(rng, self.width_ms), 40, 230))
        profile = PeakProfile(_normal(rng, self.start_ms), width_ms)
        subject = SimulatedSubject(profile, response, _normal(rng, self.hit_delay_ms), float(rng.uniform(1, 4)))
        correlation = float(rng.uniform(0, 0.2))
        return replace(subject, input_correlation=correlation, stated_hit_delay_ms=self.hit_delay_ms)


def lab(name: str, seed: int) -> Lab:
    """The law of the lab that a seed stands for.

    Args:
        name: one of `LABS`.
        seed: seed of the lab; 0–999 are for work.

    Raises:
        InvalidValueError: an unknown name, or a negative seed.
    """
    centre = LABS[choice("the lab", name, LABS)]
    rng = np.random.default_rng([zlib.crc32(b"law of a lab"), zlib.crc32(name.encode()), whole("seed", seed, least=0)])

    def about(median: float, log_sd: float, spread: _Pair) -> _Pair:
        return _log_normal(rng, (median, log_sd)), float(rng.uniform(*spread))

    return Lab(
        start_ms=(float(rng.uniform(*centre.start_ms)), float(rng.uniform(10, 25))),
        width_ms=about(100.0, 0.2, (0.15, 0.35)),
        hit_delay_ms=(float(rng.uniform(*centre.hit_delay_ms)), 6.0),
        amplitude_mv=about(0.16, 0.3, (0.2, 0.4)),
        boost_pct_rmt=about(11.0, 0.2, (0.15, 0.35)),
        sigma_x_pct_rmt=about(7.0, 0.15, (0.1, 0.2)),
        sigma_y=about(0.39, 0.1, (0.05, 0.15)),
        floor_mv=about(0.010, 0.2, (0.15, 0.3)),
        floor_log_sd=about(0.18, 0.1, (0.1, 0.2)),
    )


def _normal(rng: np.random.Generator, law: _Pair) -> float:
    return float(law[0] + law[1] * rng.standard_normal())


def _log_normal(rng: np.random.Generator, law: _Pair) -> float:
    return float(law[0] * np.exp(law[1] * rng.standard_normal()))
