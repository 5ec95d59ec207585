from __future__ import annotations

import math
from dataclasses import replace

import pytest
from benchmarks.threshold import SPACE, WalkedHotSpot

from isiw.errors import InvalidValueError
from isiw.strategy.threshold.hotspot import BayesHotSpot
from isiw.strategy.threshold.pulses import Pulse
from isiw.subjects.thresholds import StimulatedPerson, threshold_cohort


def at(place_mm: tuple[float, float], mep_mv: float) -> Pulse:
    return Pulse(60, mep_mv, place_mm=place_mm)


def distance_mm(method: BayesHotSpot | WalkedHotSpot, person: StimulatedPerson, pulses: int) -> float:
    responder, told = person.begin(1), list[Pulse]()
    for _ in range(pulses):
        place_mm = method.place_mm(told)
        told.append(at(place_mm, responder.respond(1.2 * person.rmt_pct_mso, *place_mm)))
    found_mm = method.estimate(told, SPACE).hot_spot_mm
    assert found_mm is not None
    return math.hypot(found_mm[0] - person.hot_spot.x_mm, found_mm[1] - person.hot_spot.y_mm)


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
    walk, told = WalkedHotSpot(repeats=2, step_mm=25), list[Pulse]()
    assert walk.pulses == 18
    for number in range(walk.pulses):
        place_mm = walk.place_mm(told)
        told.append(at(place_mm, 0.5 if place_mm == (25.0, 0.0) else 0.9 * (number == 0)))
    assert len({pulse.place_mm for pulse in told}) == 9
    assert walk.estimate(told, SPACE).hot_spot_mm == (25.0, 0.0)


def test_without_an_answer_there_is_no_place_and_at_the_end_another_area_is_advised() -> None:
    method, nothing = BayesHotSpot(max_pulses=2), [at((0, 0), 0.01), at((10, 0), 0.02)]
    estimate, decision = method.estimate(nothing, SPACE), method.decision(nothing, SPACE)
    assert estimate.hot_spot_mm is None
    assert estimate.reason
    assert decision.stop
    assert "another area" in decision.reason


def test_a_search_of_no_extent_is_refused() -> None:
    with pytest.raises(InvalidValueError):
        BayesHotSpot(half_width_mm=0)
    with pytest.raises(InvalidValueError):
        BayesHotSpot(step_mm=math.nan)
