"""Simulated people for whom the intensity and the place of the coil are varied, before any window is sought.

A cohort's recruitment curve is moved so that half of the MEPs exceed 50 µV at the motor threshold [Rossini2015].
"""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Final, cast

import numpy as np

from isiw.checks import Checked, Number, Positive, choice, number, whole
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.subjects.cohorts import cohort
from isiw.subjects.responses import RecruitmentResponse, TrialNoise
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import RESPONSE_MV
from isiw.types import FloatArray

RMT_PCT_MSO: Final = (30.0, 80.0)
"""Between these the thresholds of simulated people are uniform [% MSO]."""

SMALLEST_AMPLITUDE_MV: Final = 0.08
"""Of the largest MEP [mV]: of somebody with less, hardly half of the MEPs exceed 50 µV at any intensity."""

SPOT_RANGE_MM: Final = 20.0
SPREAD_MM: Final = (20.0, 35.0)

THRESHOLD_COHORTS: Final = ("recruitment", "hand", "steep", "flat")
"""Whose recruitment curves these people may have: forearm, hand, and less and more noise than was measured."""

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(15)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()


@dataclass(frozen=True)
class HotSpot(Checked):
    """The place at which the coil acts most [mm]; its effect falls off as a Gaussian of the distance."""

    x_mm: Number = 0.0  # from the middle of the searched area
    y_mm: Number = 0.0
    spread_mm: Positive = 28.0  # at this distance the intensity acts like 61 % of it

    def effect(self, x_mm: float, y_mm: float) -> float:
        """The share of the intensity that acts with the coil at a place.

        Args:
            x_mm: the coil's place [mm].
            y_mm: the same, across [mm].
        """
        return math.exp(-0.5 * ((x_mm - self.x_mm) ** 2 + (y_mm - self.y_mm) ** 2) / self.spread_mm**2)


@dataclass(frozen=True)
class StimulatedPerson(Checked):
    """One simulated person, by intensity; `x50_pct_rmt` is put at what 100 % of RMT asks for."""

    rmt_pct_mso: Positive  # at the hot spot
    response: RecruitmentResponse  # by intensity in % RMT
    input_correlation: Annotated[float, partial(number, least=0, below=1)] = 0.0
    hot_spot: HotSpot = HotSpot()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.response.amplitude_mv < SMALLEST_AMPLITUDE_MV:
            raise InvalidValueError(
                "a person with such small MEPs has no threshold",
                got=self.response.amplitude_mv,
                expected=f"an amplitude_mv of at least {SMALLEST_AMPLITUDE_MV:g}",
            )
        needed, sigma_x = _criterion_drive(self.response), self.response.sigma_x_pct_rmt
        drive = scipy.optimize.brentq(lambda above: _exceeding(above, needed, sigma_x) - 0.5, -200.0, 200.0)
        object.__setattr__(self, "response", replace(self.response, x50_pct_rmt=100.0 - float(drive)))

    def response_probability(self, intensity_pct_mso: float) -> float:
        """Probability of an MEP above 50 µV at the hot spot, by intensity [% MSO]."""
        drive = 100 * intensity_pct_mso / self.rmt_pct_mso - self.response.x50_pct_rmt
        return _exceeding(drive, _criterion_drive(self.response), self.response.sigma_x_pct_rmt)

    def begin(self, seed: int) -> StimulatedResponder:
        """A session with this person, its trial noise from this seed."""
        return StimulatedResponder(self, seed)


def _criterion_drive(response: RecruitmentResponse) -> FloatArray:
    """Input above x50 that an MEP of 50 µV takes [% RMT], by nodes of output noise and of the floor."""
    output = np.exp(response.sigma_y * _NODES)[:, None]
    floor_mv = response.floor.median_mv * np.exp(response.floor.log_sd * _NODES)
    share = (RESPONSE_MV - floor_mv) / (response.amplitude_mv * output)
    return np.asarray(scipy.special.logit(np.clip(share, 0.0, 1.0)) / response.slope_per_pct)


def _exceeding(drive: float, needed: FloatArray, sigma_x: float) -> float:
    with np.errstate(divide="ignore"):
        probability = scipy.special.ndtr(np.divide(drive - needed, sigma_x))
    return float(_WEIGHTS @ probability @ _WEIGHTS)


class StimulatedResponder:
    """A simulated person who answers stimuli; it holds what has a memory."""

    def __init__(self, person: StimulatedPerson, seed: int) -> None:
        self.person = person
        self._rng = np.random.default_rng([zlib.crc32(b"threshold"), whole("seed", seed, least=0)])
        self._input_z = float(self._rng.standard_normal())

    def respond(self, intensity_pct_mso: float, x_mm: float | None = None, y_mm: float | None = None) -> float:
        """Peak-to-peak amplitude of the MEP of one pulse [mV].

        Args:
            intensity_pct_mso: of the pulse [% MSO].
            x_mm: the coil's place [mm]; None is the hot spot.
            y_mm: the same, across [mm].

        Raises:
            InvalidValueError: an intensity that is not positive.
        """
        intensity = number("intensity_pct_mso", intensity_pct_mso, above=0)
        person, rng = self.person, self._rng
        spot, floor = person.hot_spot, person.response.floor
        acting = spot.effect(spot.x_mm if x_mm is None else x_mm, spot.y_mm if y_mm is None else y_mm)
        at = replace(person.response, intensity_pct_rmt=100 * intensity * acting / person.rmt_pct_mso)
        keeps = person.input_correlation
        self._input_z = keeps * self._input_z + math.sqrt(1 - keeps**2) * rng.standard_normal()
        floor_mv = floor.median_mv * math.exp(floor.log_sd * rng.standard_normal())
        return at.sample_evoked_mv(0.0, TrialNoise(self._input_z), rng) + floor_mv


def threshold_cohort(name: str, n: int, seed: int) -> list[StimulatedPerson]:
    """The first n people with thresholds of 30–80 % MSO and the recruitment curves of a cohort.

    The curves are those of the cohorts, with a largest MEP of at least 80 µV.

    Args:
        name: one of `THRESHOLD_COHORTS`.
        n: how many.
        seed: of the people; 0–999 are for development, reported figures use 10,000 and above.

    Raises:
        InvalidValueError: an unknown name, or a negative number.
    """
    choice("the cohort", name, THRESHOLD_COHORTS)
    subjects = cohort(name, whole("n", n, least=0), seed)
    return [_person(name, seed, index, subject) for index, subject in enumerate(subjects)]


def _person(name: str, seed: int, index: int, subject: SimulatedSubject) -> StimulatedPerson:
    rng = np.random.default_rng([zlib.crc32(f"threshold-{name}".encode()), seed, index])
    rmt = float(rng.uniform(*RMT_PCT_MSO))
    x_mm, y_mm = rng.uniform(-SPOT_RANGE_MM, SPOT_RANGE_MM, 2).tolist()
    spot = HotSpot(x_mm, y_mm, float(rng.uniform(*SPREAD_MM)))
    response = cast("RecruitmentResponse", subject.response)  # as all people of these cohorts have
    usable = replace(response, amplitude_mv=max(response.amplitude_mv, SMALLEST_AMPLITUDE_MV))
    return StimulatedPerson(rmt, usable, subject.input_correlation, spot)
