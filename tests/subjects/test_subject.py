"""A simulated person who cannot be is refused, and so is a seed that means nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from isiw.errors import InvalidValueError
from isiw.subjects.cohorts import COHORTS, cohort
from isiw.subjects.subject import Drift, SimulatedSubject


@pytest.fixture
def person() -> SimulatedSubject:
    return cohort("gaussian", 1, 3)[0]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("hit_delay_ms", "x"),
        ("hit_delay_ms", math.nan),
        ("hit_delay_sd_ms", -5),
        ("isi_jitter_ms", -3),
        ("input_correlation", 2),
        ("outlier_probability", 5),
        ("scale", -1),
        ("scale", 0),
        ("jitter_reported", "no"),
        ("conditioning", "laser"),
        ("stated_hit_delay_ms", 180.0),
        ("stated_hit_delay_ms", (180.0, -6.0)),
        ("stated_hit_delay_ms", (0.18, 0.006)),
    ],
)
def test_a_person_who_cannot_be_is_refused_by_the_name_of_what_is_wrong(
    person: SimulatedSubject, field: str, value: Any
) -> None:
    with pytest.raises(InvalidValueError, match=rf"SimulatedSubject\.{field} .*got"):
        replace(person, **{field: value})


@pytest.mark.parametrize(
    "wrong", [{"persistence": 2}, {"persistence": math.nan}, {"innovation_sd": -1}, {"startup": (0.1, "x")}]
)
def test_a_drift_that_cannot_be_is_refused(wrong: dict[str, Any]) -> None:
    (field,) = wrong
    with pytest.raises(InvalidValueError, match=rf"Drift\.{field}"):
        Drift(**wrong)


@pytest.mark.parametrize("seed", [-1, 1.5, True])
def test_a_session_begins_with_a_whole_seed(person: SimulatedSubject, seed: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"the seed"):
        person.begin(seed)


@pytest.mark.parametrize("name", COHORTS)
def test_everybody_of_every_cohort_can_be(name: str) -> None:
    for person in cohort(name, 40, 10_000):
        assert replace(person) == person
