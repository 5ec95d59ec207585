from __future__ import annotations

import math

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.signals import Impact, ImpactDetector, impact_times
from isiw.types import FloatArray
from signals.made import render

RATE_HZ = 5000.0
VALVE = 2500


def streamed(wave: FloatArray, piece: int = 5) -> Impact | None:
    """The impact in a sweep of 1 s whose valve command is in its middle, given in pieces."""
    detector = ImpactDetector(RATE_HZ)
    assert detector.add(wave[:VALVE], first=0) is None
    detector.valve()
    found = (detector.add(wave[first : first + piece], first=first) for first in range(VALVE, len(wave), piece))
    return next((impact for impact in found if impact is not None), None)


@pytest.mark.parametrize("harsh", [False, True])
@pytest.mark.parametrize("name", ["bench", "subject1", "subject4", "cushion"])
def test_it_finds_what_is_found_in_the_whole_sweep_within_5_ms_of_it(name: str, *, harsh: bool) -> None:
    waves = render(name, n=12, seed=21, harsh=harsh).waves["acceleration"]
    found = [streamed(wave) for wave in waves]
    hits_ms = [math.nan if impact is None else impact.hit_ms + 500.0 for impact in found]
    np.testing.assert_allclose(hits_ms, impact_times(waves, RATE_HZ), atol=1e-9)
    delays_ms = [impact.known_ms - impact.hit_ms for impact in found if impact is not None]
    assert min(delays_ms) > 0
    assert max(delays_ms) <= 5.0


@pytest.mark.parametrize("piece", [1, 7, 64, 2500])
def test_the_length_of_the_pieces_changes_nothing(piece: int) -> None:
    wave = render("subject2", n=1, seed=3).waves["acceleration"][0]
    assert streamed(wave, piece) == streamed(wave)


def test_there_is_one_impact_after_each_valve_command_and_none_without() -> None:
    wave = render("subject1", n=1, seed=4).waves["acceleration"][0]
    detector = ImpactDetector(RATE_HZ)
    assert detector.add(wave) is None
    for _ in range(2):
        assert detector.add(wave[:VALVE]) is None
        detector.valve()
        assert detector.add(wave[VALVE:]) is not None
        assert detector.add(wave) is None


def test_a_hammer_that_sticks_gives_none() -> None:
    still = 0.3 * np.random.default_rng(5).standard_normal((20, 5000))
    assert not any(streamed(wave) for wave in still)


@pytest.mark.parametrize("bad", [np.array([math.nan]), np.array([0.0, math.inf]), np.zeros((2, 2))])
def test_after_bad_samples_nothing_is_found_until_the_next_valve_command(bad: FloatArray) -> None:
    wave = render("subject1", n=1, seed=6).waves["acceleration"][0]
    detector = ImpactDetector(RATE_HZ)
    detector.add(wave[:VALVE])
    detector.valve()
    with pytest.raises(InvalidValueError, match=r"finite numbers.*until valve"):
        detector.add(bad)
    assert detector.add(wave[VALVE:]) is None
    detector.valve()
    assert detector.add(wave[VALVE:]) is not None


def test_missing_samples_are_told_and_never_fire() -> None:
    wave = render("subject1", n=1, seed=7).waves["acceleration"][0]
    detector = ImpactDetector(RATE_HZ)
    detector.add(wave[:VALVE], first=0)
    detector.valve()
    with pytest.raises(InvalidValueError, match="10 are missing"):
        detector.add(wave[VALVE + 10 :], first=VALVE + 10)
    assert detector.add(wave, first=5000) is None
    with pytest.raises(InvalidValueError, match="-5000 are missing"):
        detector.add(wave, first=5000)


def test_a_valve_command_without_rest_before_it_is_refused_and_finds_nothing() -> None:
    detector = ImpactDetector(RATE_HZ)
    detector.add(np.random.default_rng(8).standard_normal(50))
    with pytest.raises(InvalidValueError, match="too little"):
        detector.valve()
    assert detector.add(render("subject1", n=1, seed=9).waves["acceleration"][0]) is None


@pytest.mark.parametrize("rate_hz", [0.0, 5.0, math.nan])
def test_a_rate_at_which_no_impact_is_resolved_is_refused(rate_hz: float) -> None:
    with pytest.raises(InvalidValueError, match="rate_hz"):
        ImpactDetector(rate_hz)
