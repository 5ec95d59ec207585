"""People of some labs, and people whose *measured* windows are those of the dissertation's subjects [Kim2020, 4].

The text measures a window as the ISIs at which the mean of ten MEPs is above the MEP of TMS alone at 100 % of the
resting motor threshold (RMT); TMS alone at the 90 % of the pairs is silent. On the recruitment curve a tap that shifts
the input by 10 % RMT gives just that MEP. So the measured window of such a person is where the shift is at least
10 % RMT, whatever the noise, and the profile's width follows from the shift at the best ISI. The true window, by 0.135
of the largest excess, is wider.

What the text leaves open, and what was chosen:

- RMT is where half of the MEPs of TMS alone are above the person's own threshold of a response. The usual 0.05 mV
  (4.2.1) cannot be meant: subject 4's means plus SD stay below 0.08 mV, and a window of 70 ms above 0.05 mV leaves no
  hill.
- Peaks can be read from the ends of axes alone, and only three: subject 3 in Fig. 4.29, subject 4 in Fig. 4.22, and the
  tallest of all in Fig. 4.18, which is taken to be subject 7, the widest. For the others: 2.5 thresholds.
- The EMG floor is 0.4 thresholds. Noise on the input is less than usual (2 % RMT), for TMS alone to be silent.

People under TMS above the motor threshold have laws of their own: a tap may depress the MEP as well as enhance it
[Kim2020, 8.1.3].
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final, TypeAlias

import numpy as np

from isiw.checks import Checked, Number, Positive, choice, whole
from isiw.lazy import scipy
from isiw.subjects.responses import EmgFloor, OpposedProfile, PeakProfile, RecruitmentResponse, log_normal
from isiw.subjects.subject import SimulatedSubject

PAIRED_PCT_RMT: Final = 90.0
BASELINE_PCT_RMT: Final = 100.0
"""TMS alone whose MEP a window is above (4.2.1) [% RMT]."""

STEP_MS: Final = 5.0
"""Between two ISIs of the sweep; a run of ISIs inside a window is shorter than the window by one step, on average."""

AMPLITUDE_MV: Final = 0.25
SLOPE_PER_PCT: Final = 0.30
SIGMA_X_PCT_RMT: Final = 2.0
SIGMA_Y: Final = 0.35
FLOOR_OF_THRESHOLD: Final = 0.4
FLOOR_LOG_SD: Final = 0.15
MAX_BOOST_PCT_RMT: Final = 60.0


@dataclass(frozen=True)
class MeasuredPerson(Checked):
    """Figures of the text about one of its subjects."""

    width_ms: Positive  # of the measured window (Table 4.1)
    threshold_mv: Positive  # from which an MEP counts as a response (4.1.1)
    peak_mv: Number  # mean MEP at the best ISI, EMG floor included
    peak_error_mv: Positive | None = None  # by how much it may be misread; None if no figure shows it

    def response(self) -> RecruitmentResponse:
        """Their recruitment curve: half of the MEPs at RMT are responses, and the best ISI has their peak."""
        floor = EmgFloor(FLOOR_OF_THRESHOLD * self.threshold_mv, FLOOR_LOG_SD)
        at_rmt_mv = self.threshold_mv - floor.median_mv
        curve = RecruitmentResponse(
            floor,
            amplitude_mv=AMPLITUDE_MV,
            slope_per_pct=SLOPE_PER_PCT,
            x50_pct_rmt=BASELINE_PCT_RMT + float(np.log(AMPLITUDE_MV / at_rmt_mv - 1.0)) / SLOPE_PER_PCT,
            boost_pct_rmt=0.0,
            sigma_x_pct_rmt=SIGMA_X_PCT_RMT,
            sigma_y=SIGMA_Y,
            intensity_pct_rmt=PAIRED_PCT_RMT,
        )

        def too_much_mv(boost_pct_rmt: float) -> float:
            evoked_mv = replace(curve, boost_pct_rmt=boost_pct_rmt).expected_evoked_mv(1.0)
            return float(evoked_mv) + floor.mean_mv - self.peak_mv

        return replace(curve, boost_pct_rmt=float(scipy.optimize.brentq(too_much_mv, 0.0, MAX_BOOST_PCT_RMT)))

    def subject(self, start_ms: float, hit_delay_ms: float, hit_delay_sd_ms: float) -> SimulatedSubject:
        """A simulated person with this measured window, from its start after the impact."""
        response = self.response()
        profile = self.profile(start_ms, response.boost_pct_rmt)
        return SimulatedSubject(profile, response, hit_delay_ms, hit_delay_sd_ms)

    def profile(self, start_ms: float, boost_pct_rmt: float) -> PeakProfile:
        """The profile whose shift is at least 10 % RMT inside the window, given that at the best ISI."""
        level = (BASELINE_PCT_RMT - PAIRED_PCT_RMT) / boost_pct_rmt  # facilitation at the window's ends
        span_ms = (self.width_ms + STEP_MS) / float(np.sqrt(-0.5 * np.log(level)))
        return PeakProfile(start_ms + 0.5 * (self.width_ms - span_ms), span_ms)


MEASURED_KIM: Final = (
    MeasuredPerson(75, 0.026, 0.065),
    MeasuredPerson(65, 0.020, 0.050),
    MeasuredPerson(80, 0.030, 0.095, 0.005),
    MeasuredPerson(70, 0.033, 0.050, 0.010),
    MeasuredPerson(110, 0.015, 0.0375),
    MeasuredPerson(120, 0.020, 0.050),
    MeasuredPerson(220, 0.030, 0.175, 0.025),
    MeasuredPerson(145, 0.020, 0.050),
    MeasuredPerson(135, 0.030, 0.075),
    MeasuredPerson(110, 0.025, 0.0625),
    MeasuredPerson(60, 0.030, 0.075),
)
"""The dissertation's eleven subjects, in order."""

WIDTHS_KIM_MS: Final = tuple(int(person.width_ms) for person in MEASURED_KIM)
"""Window widths of the dissertation's eleven subjects [ms] (Table 4.1)."""


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
        EmgFloor(log_normal(rng, 0.010, 0.25), float(rng.uniform(0.12, 0.25))),
        amplitude_mv=log_normal(rng, 1.0, 0.4),
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
    widths_ms = [float(np.clip(log_normal(rng, 30.0, 0.3), *WIDTH_LIMITS_MS)) for _ in range(2)]
    before_ms, until_ms = np.sort(rng.uniform(0.0, RANGE_MS - sum(widths_ms), 2)).tolist()
    return PeakProfile(before_ms, widths_ms[0]), PeakProfile(until_ms + widths_ms[0], widths_ms[1])


_Pair: TypeAlias = tuple[float, float]


LABS: Final[Mapping[str, tuple[_Pair, _Pair]]] = MappingProxyType(
    {"lab": ((35, 80), (174, 186)), "lab-late": ((115, 165), (174, 186)), "lab-rig": ((35, 80), (20, 300))}
)
"""Cohorts of one lab each, drawn from the seed: about the people of `recruitment`, about those of `late`, and those of
`recruitment` with a rig of any hit delay; between which values mean start and mean hit delay lie [ms]."""


@dataclass(frozen=True)
class Lab:
    """The law of a lab's people: mean and SD over people, or the median and the SD of the natural logarithm."""

    start_ms: _Pair  # from the impact: mean and SD
    width_ms: _Pair  # clipped to 40–230
    hit_delay_ms: _Pair  # mean and SD
    amplitude_mv: _Pair  # of the largest MEP
    boost_pct_rmt: _Pair  # of the input at the best ISI
    sigma_x_pct_rmt: _Pair  # noise on the input
    sigma_y: _Pair  # noise on the output, natural log
    floor_mv: _Pair
    floor_log_sd: _Pair  # over trials

    def subject(self, rng: np.random.Generator) -> SimulatedSubject:
        """One of its people."""
        floor = EmgFloor(log_normal(rng, *self.floor_mv), log_normal(rng, *self.floor_log_sd))
        response = RecruitmentResponse(
            floor,
            amplitude_mv=log_normal(rng, *self.amplitude_mv),
            slope_per_pct=0.30,
            x50_pct_rmt=float(rng.uniform(103, 107)),
            boost_pct_rmt=log_normal(rng, *self.boost_pct_rmt),
            sigma_x_pct_rmt=log_normal(rng, *self.sigma_x_pct_rmt),
            sigma_y=log_normal(rng, *self.sigma_y),
        )
        width_ms = float(np.clip(log_normal(rng, *self.width_ms), 40, 230))
        profile = PeakProfile(_normal(rng, self.start_ms), width_ms)
        subject = SimulatedSubject(profile, response, _normal(rng, self.hit_delay_ms), float(rng.uniform(1, 4)))
        correlation = float(rng.uniform(0, 0.2))
        return replace(subject, input_correlation=correlation, stated_hit_delay_ms=self.hit_delay_ms)


def lab(name: str, seed: int) -> Lab:
    """The law of the lab, one of `LABS`, that a seed stands for; 0–999 are for work."""
    start_ms, hit_delay_ms = LABS[choice("the lab", name, LABS)]
    rng = np.random.default_rng([zlib.crc32(b"law of a lab"), zlib.crc32(name.encode()), whole("seed", seed, least=0)])

    def about(median: float, log_sd: float, spread: _Pair) -> _Pair:
        return log_normal(rng, median, log_sd), float(rng.uniform(*spread))

    return Lab(
        start_ms=(float(rng.uniform(*start_ms)), float(rng.uniform(10, 25))),
        width_ms=about(100.0, 0.2, (0.15, 0.35)),
        hit_delay_ms=(float(rng.uniform(*hit_delay_ms)), 6.0),
        amplitude_mv=about(0.16, 0.3, (0.2, 0.4)),
        boost_pct_rmt=about(11.0, 0.2, (0.15, 0.35)),
        sigma_x_pct_rmt=about(7.0, 0.15, (0.1, 0.2)),
        sigma_y=about(0.39, 0.1, (0.05, 0.15)),
        floor_mv=about(0.010, 0.2, (0.15, 0.3)),
        floor_log_sd=about(0.18, 0.1, (0.1, 0.2)),
    )


def _normal(rng: np.random.Generator, law: _Pair) -> float:
    return float(law[0] + law[1] * rng.standard_normal())
