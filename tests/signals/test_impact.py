from __future__ import annotations

import numpy as np
import pytest

from isiw.devices.robot.mechanism import Faults, drive
from isiw.errors import InvalidValueError
from isiw.signals import impact_time, impact_times
from isiw.types import FloatArray
from signals.made import render

PEOPLE = ("bench", "subject1", "subject2", "subject3", "subject4", "cushion")


@pytest.mark.slow
@pytest.mark.parametrize("name", PEOPLE)
def test_the_impact_is_found_within_one_sample_in_99_of_100_sweeps(name: str) -> None:
    tapped = render(name, n=100, seed=10)
    error_ms = np.abs(impact_times(tapped.waves["acceleration"], 5000.0) - tapped.true_hit_ms)
    assert np.mean(error_ms <= 0.2) >= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("name", PEOPLE)
def test_noise_doubled_with_hum_drift_and_a_weaker_hit_leaves_95_of_100_within_1_ms(name: str) -> None:
    tapped = render(name, n=100, seed=11, harsh=True)
    error_ms = np.abs(impact_times(tapped.waves["acceleration"], 5000.0) - tapped.true_hit_ms)
    assert np.mean(error_ms <= 1.0) >= 0.95


@pytest.mark.parametrize("harsh", [False, True])
def test_a_hammer_that_sticks_is_never_given_an_impact(*, harsh: bool) -> None:
    still = render("subject1", n=50, seed=12, harsh=harsh, faults=Faults(stuck_probability=1.0))
    assert np.isnan(impact_times(still.waves["acceleration"], 5000.0)).all()


def test_a_hammer_that_is_braked_softly_is_never_given_an_impact() -> None:
    rng, geometry_kinetic = np.random.default_rng(13), 0.62
    since_valve_ms = np.arange(5000) / 5 - 500
    moving = (since_valve_ms >= 130) & (since_valve_ms < 182)
    driven = np.where(moving, drive(since_valve_ms, geometry_kinetic), 0.0)
    braking = (since_valve_ms >= 182) & (since_valve_ms < 262)
    speed_m_s = driven.sum() / 5000
    braked = np.where(braking, -np.sin(np.pi * (since_valve_ms - 182) / 80), 0.0)
    soft = driven + braked * speed_m_s / (-braked.sum() / 5000)
    falling = (since_valve_ms >= 182) & (since_valve_ms < 190)
    soft[falling] += driven[moving][-1] * (1 - (since_valve_ms[falling] - 182) / 8)
    waves = soft + 0.3 * rng.standard_normal((100, 5000))
    assert np.isnan(impact_times(waves, 5000.0)).all()


def test_an_artefact_before_the_hammer_moves_is_no_impact() -> None:
    waves = 0.1 * np.random.default_rng(14).standard_normal((50, 5000))
    waves[:, 2700:2710] -= 30.0
    assert np.isnan(impact_times(waves, 5000.0)).all()


def test_a_single_sweep_without_impact_gives_none() -> None:
    assert impact_time(np.random.default_rng(0).standard_normal(5000), 5000.0) is None


def test_batch_and_single_sweep_agree() -> None:
    waves = render("subject2", n=20).waves["acceleration"]
    assert impact_times(waves, 5000.0).tolist() == [impact_time(wave, 5000.0) for wave in waves]


@pytest.mark.parametrize("unit", [0.001, 1 / 9.81, 1000.0])
def test_the_unit_and_offset_of_the_acceleration_do_not_matter(unit: float) -> None:
    waves = render("subject3", n=20).waves["acceleration"]
    np.testing.assert_allclose(impact_times(unit * waves + 5.0 * unit, 5000.0), impact_times(waves, 5000.0), atol=1e-6)


@pytest.mark.parametrize("rate_hz", [2000.0, 10000.0])
def test_other_sampling_rates_find_the_same_impact(rate_hz: float) -> None:
    tapped = render("subject1", n=30)
    grid = np.arange(0, 999, 1000 / rate_hz)
    waves = np.array([np.interp(grid, np.arange(5000) / 5, wave) for wave in tapped.waves["acceleration"]])
    np.testing.assert_allclose(impact_times(waves, rate_hz), tapped.true_hit_ms, atol=0.8)


@pytest.mark.parametrize(
    ("waves", "rate_hz", "what"),
    [
        (np.empty(0), 5000.0, "empty"),
        (np.full(5000, 1.0), 5000.0, "constant"),
        (np.where(np.arange(5000) == 7, np.nan, 1.0), 5000.0, "not finite"),
        (np.arange(5000.0), 5.0, "rate"),
        (np.arange(5000.0), np.nan, "rate"),
        (np.ones((2, 2, 5000)), 5000.0, "vector"),
    ],
)
def test_what_is_not_a_recording_is_an_error_and_never_a_number(waves: FloatArray, rate_hz: float, what: str) -> None:
    with pytest.raises(InvalidValueError, match=what):
        impact_time(waves, rate_hz)


def test_a_sweep_without_rest_is_an_error() -> None:
    with pytest.raises(InvalidValueError, match="at rest"):
        impact_time(np.random.default_rng(0).standard_normal(500), 5000.0, after_ms=10.0)
