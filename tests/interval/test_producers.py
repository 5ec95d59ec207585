from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.dissertation.interval.producers import Producer, produce
from isiw.errors import InvalidValueError
from isiw.log.headers import Block

STEADY = Producer(
    timing_cv=0.0, motor_ms=0.0, offset_ms=0.0, offset_sd_ms=0.0, start_sd_ms=0.0, search_ms=0.0, learning=0.5
)
TABLE_62 = {
    300.0: {1: (294, 68), 2: (311, 64), 3: (300, 36), 4: (282, 50)},
    500.0: {1: (499, 93), 2: (500, 93), 3: (496, 58), 4: (474, 59)},
}


@pytest.mark.parametrize("mode", [1, 2, 3, 4])
def test_who_has_no_noise_and_no_error_produces_the_target(mode: int) -> None:
    np.testing.assert_allclose(
        produce(Block(mode, 300.0, trials=9), 3, seed=0, producer=STEADY), np.full((3, 9), 300.0)
    )


def test_the_noise_of_the_timing_grows_with_the_target_and_that_of_the_presses_does_not() -> None:
    scalar = Producer(timing_cv=0.1, motor_ms=0.0, offset_ms=0.0, offset_sd_ms=0.0)
    constant = Producer(timing_cv=0.0, motor_ms=20.0, offset_ms=0.0, offset_sd_ms=0.0)
    for law, ratio in ((scalar, 2.0), (constant, 1.0)):
        spread = [np.diff(np.percentile(produce(Block(4, each), 500, 1, law), [25, 75]))[0] for each in (250.0, 500.0)]
        assert spread[1] / spread[0] == pytest.approx(ratio, rel=0.03)


def test_the_produced_time_removes_an_offset_and_the_absolute_error_does_not() -> None:
    off = Producer(timing_cv=0.0, motor_ms=0.0, offset_ms=40.0, offset_sd_ms=0.0, learning=0.5)
    told = produce(Block(3, 300.0, trials=4), 1, 0, off)[0]
    np.testing.assert_allclose(told, [340.0, 320.0, 310.0, 305.0])
    np.testing.assert_allclose(produce(Block(4, 300.0, trials=4), 1, 0, off)[0], 340.0)


@pytest.mark.parametrize("mode", [1, 2])
def test_rewards_bring_people_nearer_to_a_hidden_target(mode: int) -> None:
    times_ms = produce(Block(mode, 300.0), 800, seed=1)
    early, late = (np.mean(np.abs(part - 300) <= 20) for part in (times_ms[:, :20], times_ms[:, -20:]))
    assert late > early + 0.1


def test_half_the_score_makes_people_less_sure() -> None:
    full, half = (produce(Block(2, 300.0, scale_pct), 800, seed=1) for scale_pct in (100.0, 50.0))
    assert half.std() > full.std() + 5


def test_the_same_seed_gives_the_same_people() -> None:
    block = Block(2, 300.0, trials=20)
    np.testing.assert_array_equal(produce(block, 5, seed=4), produce(block, 5, seed=4))
    assert not np.array_equal(produce(block, 5, seed=4), produce(block, 5, seed=5))


@pytest.mark.parametrize(
    "bad", [{"timing_cv": -0.1}, {"motor_ms": float("nan")}, {"learning": 1.5}, {"restlessness": -0.1}]
)
def test_a_law_that_makes_no_sense_is_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=f"Producer.{next(iter(bad))}"):
        Producer(**bad)


@pytest.mark.parametrize(("people", "seed"), [(0, 0), (2.5, 0), (3, -1)])
def test_people_and_seed_are_checked(people: Any, seed: int) -> None:
    with pytest.raises(InvalidValueError, match="whole number"):
        produce(Block(1, 300.0), people, seed)
