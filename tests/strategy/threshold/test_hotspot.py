from __future__ import annotations

import math
from dataclasses import replace

import pytest

from isiw.errors import InvalidValueError
from isiw.strategy.threshold.hotspot import BayesHotSpot, CoilPulse, WalkedHotSpot
from isiw.subjects.thresholds import StimulatedPerson, threshold_cohort


def distance_mm(method: BayesHotSpot | WalkedHotSpot, person: StimulatedPerson, pulses: int) -> float:
    responder, told = person.begin(1), list[CoilPulse]()
    for _ in range(pulses):
        x_mm, y_mm = method.ask(told)
        told.append(CoilPulse(x_mm, y_mm, responder.respond(1.2 * person.rmt_pct_mso, x_mm, y_mm)))
    found = method.estimate(told)
    return math.hypot(found.x_mm - person.hot_spot.x_mm, found.y_mm - person.hot_spot.y_mm)


def test_without_noise_ten_pulses_find_the_hot_spot_to_a_step_of_the_grid() -> None:
    (person,) = threshold_cohort("hand", 1, 6)
    quiet = replace(person, response=replace(person.response, sigma_x_pct_rmt=0.0, sigma_y=0.0))
    assert distance_mm(BayesHotSpot(), quiet, 10) < 5


@pytest.mark.slow
def test_twelve_pulses_find_the_hot_spot_nearer_than_a_walk_of_25() -> None:
    somebody = threshold_cohort("hand", 4, 6)
    assert all(distance_mm(BayesHotSpot(), person, 12) < 8 for person in somebody)
    walked = [distance_mm(WalkedHotSpot(repeats=1), person, 25) for person in somebody]
    assert sum(walked) > sum(distance_mm(BayesHotSpot(), person, 12) for person in somebody)


def test_a_walk_visits_every_place_and_takes_the_largest_mean() -> None:
    walk, told = WalkedHotSpot(half_width_mm=10, step_mm=10, repeats=2), list[CoilPulse]()
    assert walk.pulses == 18
    for number in range(walk.pulses):
        x_mm, y_mm = walk.ask(told)
        best = (x_mm, y_mm) == (10.0, 0.0)
        told.append(CoilPulse(x_mm, y_mm, 0.5 if best else 0.9 * (number == 0)))
    assert len({(pulse.x_mm, pulse.y_mm) for pulse in told}) == 9
    assert walk.estimate(told)[:2] == (10.0, 0.0)


@pytest.mark.parametrize("method", [BayesHotSpot(), WalkedHotSpot()])
def test_without_an_answer_there_is_no_place(method: BayesHotSpot | WalkedHotSpot) -> None:
    with pytest.raises(InvalidValueError, match="in another area"):
        method.estimate([CoilPulse(0, 0, 0.01), CoilPulse(10, 0, 0.02)])


def test_values_that_cannot_be_are_refused() -> None:
    for wrong in (lambda: CoilPulse(math.nan, 0, 0.1), lambda: CoilPulse(0, 0, -1), lambda: WalkedHotSpot(repeats=0)):
        with pytest.raises(InvalidValueError):
            wrong()
