from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.dissertation.interval.producers import LightSearch, search_light
from isiw.errors import InvalidValueError
from isiw.log.headers import Block


@pytest.mark.slow
def test_it_begins_with_evenly_spaced_intervals_and_finds_the_target() -> None:
    exact = LightSearch(timing_sd_ms=0.0, initial=6)
    times_ms = search_light(Block(2, 287.0, trials=40), seed=2, search=exact)
    np.testing.assert_allclose(times_ms[:6], np.linspace(200, 400, 6))
    assert np.median(np.abs(times_ms[-15:] - 287)) <= 7


def test_the_same_seed_gives_the_same_run() -> None:
    block = Block(2, 300.0, 50.0, trials=9)
    np.testing.assert_array_equal(search_light(block, 5), search_light(block, 5))
    assert not np.array_equal(search_light(block, 5), search_light(block, 6))


def test_delivered_intervals_miss_the_chosen_ones_by_the_timing_error() -> None:
    block = Block(2, 300.0, trials=7)
    missed = np.concatenate([search_light(block, seed) - np.linspace(200, 400, 7) for seed in range(60)])
    assert missed.std() == pytest.approx(5.0, rel=0.15)


def test_it_needs_a_light() -> None:
    with pytest.raises(InvalidValueError, match="answers to the light"):
        search_light(Block(1, 300.0), 0)


@pytest.mark.parametrize(
    "bad", [{"low_ms": 400.0}, {"initial": 1}, {"beta": -1.0}, {"length_scale_ms": 0.0}, {"high_ms": float("inf")}]
)
def test_a_search_that_makes_no_sense_is_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"LightSearch|the longest interval must exceed"):
        LightSearch(**bad)
