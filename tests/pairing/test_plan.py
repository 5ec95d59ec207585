"""Plans of interventions, and how their arm is drawn and sealed."""

from __future__ import annotations

from typing import Any

import pytest

from isiw import schedule
from isiw.errors import InvalidValueError
from isiw.intervention import Arm, Intervention, drawn_arm, opened, sealed
from isiw.schedule import Part
from pairing.paired import planned


def test_every_stimulus_has_its_place_by_its_number() -> None:
    plan = planned(intensities_pct_rmt=(100.0, 120.0))
    parts = [slot.part for slot in schedule.slots(plan)]
    assert parts == [Part.BEFORE] * 6 + [Part.PAIRS] * 50 + [Part.AFTER] * 12
    slots = schedule.slots(plan)
    assert [slot.number for slot in slots] == list(range(68))
    assert [slot.number for slot in slots if slot.first] == [0, 6, 26, 46, 56, 62]
    assert [slot.number for slot in slots if slot.last] == [5, 25, 45, 55, 61, 67]
    assert slots[plan.last_pair].last
    assert slots[plan.last_pair].part is Part.PAIRS
    assert [slot.intensity_pct_rmt for slot in slots[:6]] == [100.0] * 3 + [120.0] * 3
    assert [slot.name for slot in slots[-4:]] == ["after 2 min"] * 4


def test_one_pair_in_each_stretch_is_a_probe() -> None:
    plan = planned(pairs=100)
    places = [slot.place for slot in schedule.slots(plan) if schedule.is_probe(plan, slot, 7)]
    assert [place // 10 for place in places] == list(range(10))
    assert len({place % 10 for place in places}) > 1
    assert not any(schedule.is_probe(planned(probes=0.0), slot, 7) for slot in schedule.slots(plan))


def test_a_seed_draws_the_same_arm_for_a_person_and_all_arms_for_many() -> None:
    arms = tuple(Arm)
    drawn = [drawn_arm(arms, f"P{number}", 3) for number in range(400)]
    assert drawn == [drawn_arm(arms, f"P{number}", 3) for number in range(400)]
    assert all(70 < drawn.count(arm) < 130 for arm in arms)
    assert {Intervention.drawn(planned(arms=arms), "P1").arm for _ in range(60)} == set(arms)


def test_a_sealed_arm_looks_different_each_time_and_is_none_of_the_words() -> None:
    digests = {sealed(Arm.WINDOW) for _ in range(10)}
    assert len(digests) == 10
    assert all(opened(digest, tuple(Arm)) is Arm.WINDOW for digest in digests)
    assert not any(arm in digest for digest in digests for arm in Arm)


def test_a_seed_draws_no_arm_for_a_person_without_a_code() -> None:
    several = planned(arms=(Arm.WINDOW, Arm.OUTSIDE))
    with pytest.raises(InvalidValueError, match="by their code"):
        Intervention.drawn(several, "", seed=3)
    assert Intervention.drawn(several, "P07", seed=3).arm is Intervention.drawn(several, "P07", seed=3).arm
    assert Intervention.drawn(planned(arms=(Arm.WINDOW,)), "", seed=3).arm is Arm.WINDOW


def test_a_digest_of_no_arm_of_the_plan_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="none of the plan's"):
        Intervention(planned(arms=(Arm.WINDOW, Arm.OUTSIDE)), sealed(Arm.TAP_ALONE))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"pairs": 49}, "pairs"),
        ({"pairs": 301}, "pairs"),
        ({"iti_s": (0.5, 5.0)}, "repetitive TMS above 1 Hz"),
        ({"rest_s": 5.0}, "no longer than the interval"),
        ({"arms": ("window", "window")}, "different arms"),
        ({"arms": ("nothing",)}, "unknown"),
        ({"after_min": (15.0, 0.0)}, "ascend"),
        ({"range_ms": (90.0, 20.0)}, "ascend"),
        ({"protocol_code": " "}, "protocol"),
        ({"intensities_pct_rmt": (1.0, 1.2)}, "in another unit"),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidValueError, match=says):
        planned(**changes)
