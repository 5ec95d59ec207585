"""The cohorts on which strategies are compared. Person i of seed s is the same on every machine."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

import numpy as np

from isiw.checks import choice, whole
from isiw.subjects.changes import Change, TapResponse
from isiw.subjects.measured import LABS, MEASURED_KIM, WIDTHS_KIM_MS, lab, supra_threshold
from isiw.subjects.responses import (
    EmgFloor,
    GainResponse,
    PeakProfile,
    Profile,
    RecruitmentResponse,
    ResponseCurve,
    TwoPeakProfile,
    log_normal,
)
from isiw.subjects.subject import Drift, SimulatedSubject

P_STAYS: Final = 0.7
"""How often the window is the one of the day before, moved as a whole."""

SHIFT_SD_MS: Final = 12.0
AMPLITUDE_LOG_SD: Final = 0.4
X50_SD_PCT: Final = 3.0


def another_day(person: SimulatedSubject, stranger: SimulatedSubject, rng: np.random.Generator) -> SimulatedSubject:
    """The same person another day, with a stranger's window if it was drawn again (dissertation, appendix B)."""
    if not (isinstance(person.profile, PeakProfile) and isinstance(person.response, RecruitmentResponse)):
        raise TypeError(person)
    stays = rng.random() < P_STAYS
    shift, amplitude, x50 = rng.standard_normal(3)
    moved = replace(person.profile, start_ms=float(person.profile.start_ms + SHIFT_SD_MS * shift))
    response = replace(
        person.response,
        amplitude_mv=float(person.response.amplitude_mv * np.exp(AMPLITUDE_LOG_SD * amplitude)),
        x50_pct_rmt=float(person.response.x50_pct_rmt + X50_SD_PCT * x50),
    )
    return replace(person, profile=moved if stays else stranger.profile, response=response)


_Changed: TypeAlias = Callable[[np.random.Generator, SimulatedSubject], SimulatedSubject]

COARSE_STEPS_MV: Final = (0.005, 0.010, 0.020)
"""Steps of converters and displays [mV]."""


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _step(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    """A coil re-seated, a gain, an electrode: by a factor of LN(4, .4), up or down."""
    trial, log_factor = int(rng.integers(4, 31)), float(np.log(4.0) + 0.4 * rng.standard_normal())
    return replace(subject, change=Change(trial, trial, log_gain=_sign(rng) * log_factor))


def _retuned(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    trial, change_pct = int(rng.integers(5, 31)), float(rng.uniform(6, 14))
    return replace(subject, change=Change(trial, trial, intensity_pct_rmt=_sign(rng) * change_pct))


def _moving(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    first, last = int(rng.integers(5, 16)), int(rng.integers(20, 36))
    return replace(subject, change=Change(first, last, shift_ms=25.0 * float(rng.standard_normal())))


def _tap_response(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    start_ms, duration_ms = float(rng.uniform(18, 60)), float(rng.uniform(10, 40))
    median_mv = float(0.1 * np.exp(0.7 * rng.standard_normal()))
    return replace(subject, tap_response=TapResponse(start_ms, duration_ms, median_mv, float(rng.uniform(0.2, 0.9))))


CHANGED: Final[Mapping[str, _Changed]] = MappingProxyType(
    {
        "step": _step,
        "ramp": lambda rng, one: replace(
            one, change=Change(1, 60, log_gain=_sign(rng) * float(np.log(rng.uniform(2, 5))))
        ),
        "retuned": _retuned,
        "fading": lambda rng, one: replace(one, change=Change(half_life=float(rng.uniform(15, 60)))),
        "moving": _moving,
        "tap-response": _tap_response,
        "coarse": lambda rng, one: replace(one, amplitude_step_mv=float(rng.choice(COARSE_STEPS_MV))),
    }
)
"""The change that makes a usual person one of a cohort in whose sessions something else than the ISI moves an MEP, or
is not as most methods assume; half of its people have a window, unless the cohort says otherwise."""

_Pair: TypeAlias = tuple[float, float]
_Shape: TypeAlias = Callable[[np.random.Generator, float, float], Profile]


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


def _span(rng: np.random.Generator, width_ms: tuple[float, float] | None = None) -> tuple[float, float]:
    start_ms, usual_ms = float(rng.uniform(5, 110)), float(np.clip(log_normal(rng, 100, 0.42), 40, 230))
    return start_ms, usual_ms if width_ms is None else float(rng.uniform(*width_ms))


def _gain(rng: np.random.Generator) -> GainResponse:
    floor = EmgFloor(log_normal(rng, 0.008, 0.3), 0.35)
    return GainResponse(floor, log_normal(rng, 0.06, 0.5), float(rng.uniform(0.4, 0.9)))


@dataclass(frozen=True)
class _CohortLaw:
    """People with recruitment curves: ends of uniform laws, or medians and log SDs. The usual law is `recruitment`."""

    start_ms: _Pair = (5, 110)
    width_ms: _Pair = (100, 0.42)
    width_law: Literal["log-normal", "uniform"] = "log-normal"
    width_limits_ms: _Pair = (40, 230)
    hit_delay_ms: _Pair = (170, 190)
    amplitude_mv: _Pair = (0.16, 0.35)
    slope_per_pct: float = 0.30
    x50_pct_rmt: _Pair = (103, 107)
    boost_pct_rmt: _Pair = (6, 18)
    sigma_x_pct_rmt: _Pair = (5, 9)
    intensity_sd_pct_rmt: float = 0.0
    intensities_pct_rmt: tuple[float, ...] = (90.0,)
    intensity_range_pct_rmt: _Pair | None = None

    def response(self, rng: np.random.Generator) -> RecruitmentResponse:
        floor = EmgFloor(log_normal(rng, 0.010, 0.25), float(rng.uniform(0.12, 0.25)))
        return RecruitmentResponse(
            floor,
            amplitude_mv=log_normal(rng, *self.amplitude_mv),
            slope_per_pct=self.slope_per_pct,
            x50_pct_rmt=float(rng.uniform(*self.x50_pct_rmt)),
            boost_pct_rmt=float(rng.uniform(*self.boost_pct_rmt)),
            sigma_x_pct_rmt=float(rng.uniform(*self.sigma_x_pct_rmt)),
            sigma_y=float(rng.uniform(0.3, 0.5)),
        )

    def subject(self, rng: np.random.Generator) -> SimulatedSubject:
        start_ms = float(rng.uniform(*self.start_ms))
        if self.width_law == "uniform":
            width_ms = float(rng.uniform(*self.width_ms))
        else:
            width_ms = float(np.clip(log_normal(rng, *self.width_ms), *self.width_limits_ms))
        response = self.response(rng)
        subject = replace(
            _subject(rng, PeakProfile(start_ms, width_ms), response, self.hit_delay_ms),
            input_correlation=float(rng.uniform(0, 0.2)),
        )
        if self.intensity_range_pct_rmt is None:
            stated = float(rng.choice(self.intensities_pct_rmt))
            intensity = stated + self.intensity_sd_pct_rmt * rng.standard_normal()
        else:
            intensity = float(rng.uniform(*self.intensity_range_pct_rmt))
            stated = float(round(intensity))
        response = replace(response, intensity_pct_rmt=intensity)
        return replace(subject, response=response, stated_intensity_pct_rmt=stated)


_USUAL: Final = _CohortLaw()

_OFF_THE_MAP: Final[Mapping[str, _CohortLaw]] = MappingProxyType(
    {
        "other-rig": _CohortLaw(hit_delay_ms=(20, 300)),
        "late": _CohortLaw(start_ms=(80, 200)),
        "very-wide": _CohortLaw(start_ms=(0, 60), width_ms=(200, 0.25), width_limits_ms=(120, 320)),
        "steep": _CohortLaw(sigma_x_pct_rmt=(2, 4), slope_per_pct=0.6),
        "flat": _CohortLaw(sigma_x_pct_rmt=(9, 14), slope_per_pct=0.2),
        "weak": _CohortLaw(boost_pct_rmt=(4, 8)),
        "rmt-off": _CohortLaw(intensity_sd_pct_rmt=6.0),
        "hand": _CohortLaw(
            amplitude_mv=(1.0, 0.6),
            slope_per_pct=0.23,
            x50_pct_rmt=(112, 122),
            boost_pct_rmt=(8, 24),
            intensities_pct_rmt=(90.0, 100.0, 110.0),
        ),
    }
)
"""People whom the usual law does not cover."""

_REALITIES: Final[Mapping[str, _CohortLaw]] = MappingProxyType(
    {
        **dict.fromkeys(CHANGED, _USUAL),
        "narrow-unstated": _CohortLaw(start_ms=(5, 90), width_ms=(15, 40), width_law="uniform"),
        "wide-early": _CohortLaw(start_ms=(-40, 20), width_ms=(200, 320), width_law="uniform"),
        "above-threshold": _CohortLaw(intensity_range_pct_rmt=(100, 110)),
        "hand-flat": replace(_OFF_THE_MAP["hand"], boost_pct_rmt=(0, 0)),
    }
)
"""People in whose sessions something else moves an MEP, or is not as assumed."""

_ALL_WITH_A_WINDOW: Final = frozenset({"narrow-unstated", "wide-early"})

_NARROW: Final = _CohortLaw(start_ms=(5, 50), width_ms=(20, 0.3), width_limits_ms=(10, 40))
"""Windows after an electrical pulse: 15–20 ms wide with TMS below the threshold (dissertation, 3.3.4)."""

_KINDS_OF_ODD: Final = ("other-rig", "late", "very-wide", ("steep", "flat"), "weak", "rmt-off", "hand")


def _off_the_map(rng: np.random.Generator, name: str) -> SimulatedSubject:
    subject = _OFF_THE_MAP[name].subject(rng)
    return replace(subject, stated_hit_delay_ms=(subject.hit_delay_ms, 6.0)) if name == "other-rig" else subject


def _odd(rng: np.random.Generator) -> SimulatedSubject:
    kind = _KINDS_OF_ODD[int(rng.integers(len(_KINDS_OF_ODD)))]
    return _off_the_map(rng, kind if isinstance(kind, str) else str(rng.choice(kind)))


def _subject(
    rng: np.random.Generator, profile: Profile, response: ResponseCurve, hit_delay_ms: _Pair = (170, 190)
) -> SimulatedSubject:
    return SimulatedSubject(profile, response, float(rng.uniform(*hit_delay_ms)), float(rng.uniform(1, 4)))


def _gain_subject(
    rng: np.random.Generator, width_ms: tuple[float, float] | None = None, shape: _Shape = _gaussian
) -> SimulatedSubject:
    start_ms, width = _span(rng, width_ms)
    return _subject(rng, shape(rng, start_ms, width), _gain(rng))


def _low_response_subject(rng: np.random.Generator) -> SimulatedSubject:
    profile = PeakProfile(*_span(rng))
    return _subject(rng, profile, replace(_gain(rng), max_response_probability=float(rng.uniform(0.4, 0.7))))


def _jitter_subject(rng: np.random.Generator, *, told: bool) -> SimulatedSubject:
    return replace(_gain_subject(rng), isi_jitter_ms=float(rng.uniform(1, 5)), jitter_reported=told)


def _nonresponder(rng: np.random.Generator, *, kind: bool) -> SimulatedSubject:
    profile = PeakProfile(*_span(rng))
    if kind:
        return _subject(rng, profile, replace(_gain(rng), gain_mv=0.0))
    subject = _subject(rng, profile, replace(_USUAL.response(rng), boost_pct_rmt=0.0))
    return replace(subject, input_correlation=float(rng.uniform(0, 0.2)))


def _reality(rng: np.random.Generator, name: str, *, window: bool) -> SimulatedSubject:
    law = _REALITIES[name]
    has_window = window or name in _ALL_WITH_A_WINDOW
    subject = (law if has_window else replace(law, boost_pct_rmt=(0, 0))).subject(rng)
    return CHANGED[name](rng, subject) if name in CHANGED else subject


def _kim_subject(index: int) -> SimulatedSubject:
    rng = np.random.default_rng([zlib.crc32(b"kim11"), 4, index])
    profile = PeakProfile(float(rng.uniform(20, 100)), WIDTHS_KIM_MS[index])
    subject = _subject(rng, profile, replace(_USUAL, boost_pct_rmt=(6, 14)).response(rng))
    return replace(subject, input_correlation=float(rng.uniform(0, 0.2)))


def _measured_kim_subject(index: int) -> SimulatedSubject:
    rng = np.random.default_rng([zlib.crc32(b"kim11-measured"), 4, index])
    start_ms, hit_delay_ms, hit_delay_sd_ms = rng.uniform((50, 170, 1), (100, 190, 4)).tolist()
    return MEASURED_KIM[index].subject(start_ms, hit_delay_ms, hit_delay_sd_ms)


_ELEVEN: Final[Mapping[str, Callable[[int], SimulatedSubject]]] = MappingProxyType(
    {"kim11": _kim_subject, "kim11-measured": _measured_kim_subject}
)
"""Cohorts of the dissertation's eleven subjects, drawn once."""


def _on_either_day(seed: int, number: int) -> SimulatedSubject:
    """Even numbers are people on the first day, and the next one is the same person on the second."""
    rng = np.random.default_rng([zlib.crc32(b"another-day"), seed, number // 2])
    person, stranger = _USUAL.subject(rng), _USUAL.subject(rng)
    return another_day(person, stranger, rng) if number % 2 else person


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
    "recruitment": _USUAL.subject,
    **{name: partial(_off_the_map, name=name) for name in _OFF_THE_MAP},
    "odd": _odd,
    "electrical": lambda rng: replace(_NARROW.subject(rng), conditioning="electrical"),
    "supra-threshold": supra_threshold,
}

COHORTS: Final = (*_DRAW, "nonresponder", *_ELEVEN, *LABS, "another-day", *_REALITIES)
"""The names that `cohort` knows."""


def cohort(name: str, n: int, seed: int) -> list[SimulatedSubject]:
    """The first n people of a cohort.

    Args:
        name: one of `COHORTS`.
        n: how many people. `kim11` and `kim11-measured` have eleven, and cycle with other trial noise. Of
            `another-day` every two, from the first on, are one person on two days.
        seed: seed of people, or of a cohort's lab; 0–999 are for development, reported figures use 10,000 and above.

    Raises:
        InvalidValueError: an unknown name, or a negative number.
    """
    choice("the cohort", name, COHORTS)  # also of nobody
    n, seed = whole("n", n, least=0), whole("seed", seed, least=0)
    return [person_of(name, number, seed) for number in range(n)]


def person_of(name: str, number: int, seed: int) -> SimulatedSubject:
    """One person of a cohort, without the others."""
    choice("the cohort", name, COHORTS)
    number, seed = whole("number", number, least=0), whole("seed", seed, least=0)
    if name in _ELEVEN:
        return _ELEVEN[name](number % len(WIDTHS_KIM_MS))
    if name == "another-day":
        return _on_either_day(seed, number)
    rng = np.random.default_rng([zlib.crc32(name.encode()), seed, number])
    if name == "nonresponder":
        return _nonresponder(rng, kind=number % 2 == 0)
    if name in _REALITIES:
        return _reality(rng, name, window=number % 2 == 0)
    draw = lab(name, seed).subject if name in LABS else _DRAW[name]
    return draw(rng)
