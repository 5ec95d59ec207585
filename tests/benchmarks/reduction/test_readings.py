"""Readings: what each means for a method, and what cannot be read."""

from __future__ import annotations

from typing import Any

import pytest
from benchmarks.reduction.dissertation import METHODS
from benchmarks.reduction.pf_readings import SETTINGS
from benchmarks.reduction.readings import BASE, READINGS, TRUTHS, Reading

import isiw
from isiw.errors import InvalidValueError


def test_every_method_is_made_as_each_reading_has_it() -> None:
    for reading, _ in READINGS.values():
        for method in (*METHODS, "nr2"):
            settings = reading.settings(method)
            assert isiw.make_strategy(method, **settings).recipe.settings.items() >= settings.items()


def test_every_reading_is_tried_once() -> None:
    assert len(set(READINGS.values())) == len(READINGS)


def test_the_base_has_the_texts_stopping_rule() -> None:
    assert BASE.settings("gpr") == {"stop_edges": "both", "stop_last": 5, "acquisition": "variance"}


def test_every_reading_of_the_particle_filter_makes_one() -> None:
    for settings in SETTINGS.values():
        isiw.make_strategy("pf", **dict(settings))
    assert len(set(SETTINGS.values())) == len(SETTINGS)


def test_a_reading_is_judged_by_its_own_measured_window() -> None:
    assert BASE.truth == "measured, 100 % RMT"
    assert {reading.truth for reading, _ in READINGS.values()} <= set(TRUTHS)


def test_the_particle_filter_is_touched_by_the_floor_alone() -> None:
    assert Reading(edges="either", last=6, floor="zeroed").settings("pf") == {"floor": "zeroed"}


def test_the_default_is_never_touched() -> None:
    assert Reading(edges="either", floor="raw").settings("default") == {}


@pytest.mark.parametrize(
    "wrong", [{"observation": "median"}, {"outside": "noise"}, {"range_end": "never"}, {"baseline": "110 % RMT"}]
)
def test_unknown_words_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="is unknown"):
        Reading(**wrong)


def test_live_trials_have_no_recorded_outside() -> None:
    with pytest.raises(InvalidValueError, match="has an outside"):
        Reading(observation="live", outside="zero")
