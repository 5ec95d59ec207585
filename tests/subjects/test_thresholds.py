"""Simulated people by intensity: half of their pulses are answered at their threshold, and only so at it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.subjects.thresholds import THRESHOLD_COHORTS, HotSpot, StimulatedPerson, threshold_cohort
from isiw.trials import RESPONSE_MV

PULSES = 800
FOUR_SE = 4 * 0.5 / math.sqrt(PULSES)


@pytest.mark.parametrize("name", THRESHOLD_COHORTS)
def test_half_of_the_pulses_at_the_threshold_are_answered(name: str) -> None:
    (person,) = threshold_cohort(name, 1, 3)
    person = replace(person, input_correlation=0.0)
    responder = person.begin(0)
    for share in (0.95, 1.0, 1.05):
        intensity = share * person.rmt_pct_mso
        answered = np.mean([responder.respond(intensity) > RESPONSE_MV for _ in range(PULSES)])
        assert answered == pytest.approx(person.response_probability(intensity), abs=FOUR_SE)
    assert person.response_probability(person.rmt_pct_mso) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(("name", "measured_pct"), [("recruitment", 4.0), ("hand", 17.0)])
def test_the_curves_lie_where_they_were_measured(name: str, measured_pct: float) -> None:
    above = np.mean([person.response.x50_pct_rmt - 100 for person in threshold_cohort(name, 60, 5)])
    assert above == pytest.approx(measured_pct, abs=4.0)


def test_thresholds_are_from_30_to_80_pct_mso() -> None:
    thresholds = [person.rmt_pct_mso for person in threshold_cohort("hand", 200, 1)]
    assert 30 <= min(thresholds) < 33
    assert 77 < max(thresholds) <= 80


def test_a_person_and_its_noise_are_those_of_the_seed() -> None:
    first, again = threshold_cohort("recruitment", 3, 8)[-1], threshold_cohort("recruitment", 5, 8)[2]
    assert first == again
    assert [first.begin(4).respond(60.0)] == [again.begin(4).respond(60.0)]
    assert first.begin(4).respond(60.0) != first.begin(5).respond(60.0)


def test_the_effect_of_the_coil_falls_off_with_its_distance() -> None:
    spot = HotSpot(3.0, -4.0, 20.0)
    assert spot.effect(3.0, -4.0) == 1.0
    assert spot.effect(23.0, -4.0) == pytest.approx(math.exp(-0.5))
    person = replace(threshold_cohort("hand", 1, 1)[0], hot_spot=spot)
    near, far = person.begin(1), person.begin(1)
    intensity = 1.2 * person.rmt_pct_mso
    assert near.respond(intensity, 3.0, -4.0) == person.begin(1).respond(intensity)
    assert np.mean([near.respond(intensity, 3.0, -4.0) for _ in range(30)]) > 5 * np.mean(
        [far.respond(intensity, 33.0, -4.0) for _ in range(30)]
    )


def test_somebody_whose_meps_hardly_exceed_the_criterion_has_no_threshold() -> None:
    (person,) = threshold_cohort("recruitment", 1, 1)
    with pytest.raises(InvalidValueError, match="has no threshold"):
        StimulatedPerson(50.0, replace(person.response, amplitude_mv=0.04))


@pytest.mark.parametrize("intensity", [0.0, -5.0, math.nan, math.inf])
def test_an_intensity_that_cannot_be_is_refused(intensity: float) -> None:
    with pytest.raises(InvalidValueError, match="intensity_pct_mso"):
        threshold_cohort("recruitment", 1, 1)[0].begin(0).respond(intensity)


@pytest.mark.parametrize(("name", "n"), [("gaussian", 1), ("recruitment", -1)])
def test_unknown_people_are_refused(name: str, n: int) -> None:
    with pytest.raises(InvalidValueError):
        threshold_cohort(name, n, 1)
