"""The cohorts on which strategies are compared. Person i of seed s is the same on every machine."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from isiw.checks import choice, whole
from isiw.subjects.profiles import PeakProfile, Profile, TwoPeakProfile
from isiw.subjects.responses import EmgFloor, GainResponse, RecruitmentResponse, ResponseCurve
from isiw.subjects.subject import Drift, SimulatedSubject

__all__ = ["COHORTS", "WIDTHS_KIM_MS", "cohort"]

WIDTHS_KIM_MS: Final = (75, 65, 80, 70, 110, 120, 220, 145, 135, 110, 60)
"""Window widths of the dissertation's eleven subjects [ms] (Table 4.1)."""


_Shape = Callable[[np.random.Generator, float, float], Profile]


def _gaussian(_rng: np.random.Generator, start_ms: float, width_ms: float) -> Profile:
    return PeakProfile(start_ms, width_ms)


def _skewed(rng: np.random.Generator, start_ms: float, width_ms: float) -> Profile:
    early = float(rng.uniform(0.22, 0.40))
    return PeakProfile(start_ms, width_ms, peak_at=early if rng.random() < 0.5 else 1.0 - early)


def _plateau(rng: np.random.Generator, start_ms: float, width_ms: float) -> Profile:
    return PeakProfile(start_ms, width_ms, exponent=float(rng.uniform(4, 8)))


def _two_peak(rng: np.random.Generator, start_ms: float, width_ms: float) -> Profile:
    lower = float(rng.uniform(0.4, 1.0))
    heights = (1.0, lower) if rng.random() < 0.5 else (lower, 1.0)
    return TwoPeakProfile(start_ms, width_ms, *heights)


def _log_normal(rng: np.random.Generator, median: float, log_sd: float) -> float:
    return float(median * np.exp(log_sd * rng.standard_normal()))


def _span(rng: np.random.Generator, width_ms: tuple[float, float] | None = None) -> tuple[float, float]:
    start_ms, usual_ms = float(rng.uniform(5, 110)), float(np.clip(_log_normal(rng, 100, 0.42), 40, 230))
    return start_ms, usual_ms if width_ms is None else float(rng.uniform(*width_ms))


def _gain(rng: np.random.Generator) -> GainResponse:
    floor = EmgFloor(_log_normal(rng, 0.008, 0.3), 0.35)
    return GainResponse(floor, _log_normal(rng, 0.06, 0.5), float(rng.uniform(0.4, 0.9)))


def _recruitment(rng: np.random.Generator, boost_pct_rmt: tuple[float, float] = (6, 18)) -> RecruitmentResponse:
    floor = EmgFloor(_log_normal(rng, 0.010, 0.25), float(rng.uniform(0.12, 0.25)))
    return RecruitmentResponse(
        floor,
        amplitude_mv=_log_normal(rng, 0.16, 0.35),
        slope_per_pct=0.30,
        x50_pct_rmt=float(rng.uniform(103, 107)),
        boost_pct_rmt=float(rng.uniform(*boost_pct_rmt)),
        sigma_x_pct_rmt=float(rng.uniform(5, 9)),
        sigma_y=float(rng.uniform(0.3, 0.5)),
    )


def _subject(rng: np.random.Generator, profile: Profile, response: ResponseCurve) -> SimulatedSubject:
    return SimulatedSubject(profile, response, float(rng.uniform(170, 190)), float(rng.uniform(1, 4)))


def _gain_subject(
    rng: np.random.Generator, width_ms: tuple[float, float] | None = None, shape: _Shape = _gaussian
) -> SimulatedSubject:
    start_ms, width = _span(rng, width_ms)
    return _subject(rng, shape(rng, start_ms, width), _gain(rng))


def _low_response_subject(rng: np.random.Generator) -> SimulatedSubject:
    profile = PeakProfile(*_span(rng))
    return _subject(rng, profile, replace(_gain(rng), max_response_probability=float(rng.uniform(0.4, 0.7))))


def _jitter_subject(rng: np.random.Generator, *, told: bool) -> SimulatedSubject:
    return replace(_gain_subject(rng), isi_jitter_ms=float(rng.uniform(1, 5)), jitter_told=told)


def _recruitment_subject(rng: np.random.Generator) -> SimulatedSubject:
    subject = _subject(rng, PeakProfile(*_span(rng)), _recruitment(rng))
    return replace(subject, input_correlation=float(rng.uniform(0, 0.2)))


def _nonresponder(rng: np.random.Generator, *, kind: bool) -> SimulatedSubject:
    profile = PeakProfile(*_span(rng))
    if kind:
        return _subject(rng, profile, replace(_gain(rng), gain_mv=0.0))
    subject = _subject(rng, profile, replace(_recruitment(rng), boost_pct_rmt=0.0))
    return replace(subject, input_correlation=float(rng.uniform(0, 0.2)))


def _kim_subject(index: int) -> SimulatedSubject:
    rng = np.random.default_rng([zlib.crc32(b"kim11"), 4, index])
    profile = PeakProfile(float(rng.uniform(20, 100)), WIDTHS_KIM_MS[index])
    subject = _subject(rng, profile, _recruitment(rng, boost_pct_rmt=(6, 14)))
    return replace(subject, input_correlation=float(rng.uniform(0, 0.2)))


_DRAW: Final[dict[str, Callable[[np.random.Generator], SimulatedSubject]]] = {
    "gaussian": _gain_subject,
    "skewed": partial(_gain_subject, shape=_skewed),
    "plateau": partial(_gain_subject, shape=_plateau),
    "two-peak": partial(_gain_subject, shape=_two_peak),
    "narrow": partial(_gain_subject, width_ms=(35, 50)),
    "wide": partial(_gain_subject, width_ms=(180, 230)),
    "low-response": _low_response_subject,
    "outliers": lambda rng: replace(_gain_subject(rng), outlier_probability=0.06),
    "drift": lambda rng: replace(_gain_subject(rng), drift=Drift()),
    "jitter": partial(_jitter_subject, told=True),
    "jitter-untold": partial(_jitter_subject, told=False),
    "recruitment": _recruitment_subject,
}

COHORTS: Final = (*_DRAW, "nonresponder", "kim11")
"""The names that `cohort` knows."""


def cohort(name: str, n: int, seed: int) -> list[SimulatedSubject]:
    """The first n people of a cohort.

    Args:
        name: one of `COHORTS`.
        n: how many people. `kim11` has eleven, and cycles: its sessions differ in trial noise only.
        seed: seed of the people; 0–999 are for work, reported figures use 10,000 and above.

    Raises:
        InvalidValueError: an unknown name, or a negative number.
    """
    choice("the cohort", name, COHORTS)
    n, seed = whole("n", n, least=0), whole("seed", seed, least=0)
    if name == "kim11":
        return [_kim_subject(i % len(WIDTHS_KIM_MS)) for i in range(n)]
    generators = [np.random.default_rng([zlib.crc32(name.encode()), seed, i]) for i in range(n)]
    if name == "nonresponder":
        return [_nonresponder(rng, kind=i % 2 == 0) for i, rng in enumerate(generators)]
    return [_DRAW[name](rng) for rng in generators]
