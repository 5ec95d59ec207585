from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from isiw.devices.robot.mechanism import (
    SEPARATION_RAD,
    SUPPLY_KPA,
    EventTime,
    Faults,
    Geometry,
    draw_taps,
    drive,
    pressure_kpa,
    rebound,
    restitution,
)
from isiw.devices.robot.tapper import PRESETS, preset
from isiw.errors import InvalidValueError


@pytest.mark.parametrize("name", PRESETS)
def test_taps_vary_as_the_geometry_says(name: str) -> None:
    geometry = replace(preset(name), faults=Faults())
    taps = draw_taps(geometry, 4000, np.random.default_rng(0))
    assert taps.hit_ms.mean() == pytest.approx(geometry.hit.mean_ms, abs=0.3)
    assert taps.hit_ms.std() == pytest.approx(geometry.hit.sd_ms, rel=0.06)
    assert taps.descent_ms.mean() == pytest.approx(geometry.descent.mean_ms, abs=0.3)
    assert taps.descent_ms.std() == pytest.approx(geometry.descent.sd_ms, rel=0.06)


def test_a_late_descent_makes_a_late_hit_but_not_by_as_much() -> None:
    geometry = preset("subject1")
    taps = draw_taps(geometry, 4000, np.random.default_rng(1))
    slope = np.cov(taps.descent_ms, taps.hit_ms)[0, 1] / taps.descent_ms.var()
    assert slope == pytest.approx(geometry.friction_share, abs=0.07)
    assert 0.1 < slope < 0.9


def test_the_hammer_is_driven_from_the_descent_to_the_travel_of_its_geometry() -> None:
    geometry = preset("subject2")
    time_ms = np.arange(geometry.descent.mean_ms, geometry.hit.mean_ms, 0.001)
    speed = np.cumsum(drive(time_ms, geometry.kinetic_share)) * 1e-6
    assert speed[-1] == pytest.approx(geometry.hit_speed_m_s, rel=1e-3)
    assert speed.sum() * 1e-3 == pytest.approx(geometry.travel_mm, rel=1e-3)


def test_the_pressure_rises_from_the_line_delay_to_the_supply() -> None:
    assert pressure_kpa([0.0, 22.0]).tolist() == [0.0, 0.0]
    assert (np.diff(pressure_kpa(np.arange(23.0, 500.0))) > 0).all()
    assert pressure_kpa(1500.0) == pytest.approx(SUPPLY_KPA, rel=1e-4)


def test_the_rebound_pushes_only_and_leaves_with_the_speed_of_restitution() -> None:
    phase = np.linspace(0, SEPARATION_RAD, 200_001)
    force = rebound(phase)
    assert (force <= 1e-9).all()
    assert rebound([-0.1, SEPARATION_RAD + 0.1]).tolist() == [0.0, 0.0]
    assert 1.0 + np.trapezoid(force, phase) == pytest.approx(-restitution(), abs=1e-4)


def test_the_contact_lasts_as_long_as_the_geometry_says() -> None:
    geometry = preset("subject3")
    pull = float(drive(geometry.hit.mean_ms, geometry.kinetic_share))
    time_ms = np.arange(0, 40, 0.001)
    push = -1000 * geometry.hit_speed_m_s * geometry.stiffness_rad_ms * rebound(geometry.stiffness_rad_ms * time_ms)
    assert (push > pull).sum() * 0.001 == pytest.approx(geometry.contact.mean_ms, abs=0.05)


def test_faults_come_as_often_as_their_probability() -> None:
    faulty = replace(preset("cushion"), faults=Faults(0.1, 0.2, (13.0, 22.0)))
    taps = draw_taps(faulty, 5000, np.random.default_rng(2))
    assert np.isnan(taps.hit_ms).mean() == pytest.approx(0.1, abs=0.02)
    late = taps.late_ms[taps.late_ms > 0]
    assert len(late) / 5000 == pytest.approx(0.2, abs=0.02)
    assert 13.0 <= late.min() <= late.max() <= 22.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"descent": (20.0, 5.0)},
        {"hit": (120.0, 4.0)},
        {"contact": (0.0, 1.0)},
        {"hit": (183.0, -1.0)},
        {"hit": (183.0, 0.1)},
    ],
)
def test_an_impossible_geometry_is_an_error(wrong: dict[str, tuple[float, float]]) -> None:
    times = {"descent": (131.0, 5.0), "hit": (183.0, 4.0), "contact": (15.0, 1.0)} | wrong
    with pytest.raises(InvalidValueError):
        Geometry(EventTime(*times["descent"]), EventTime(*times["hit"]), EventTime(*times["contact"]))


@pytest.mark.parametrize("wrong", [{"stuck_probability": 1.5}, {"late_probability": 0.1, "late_ms": (20.0, 10.0)}])
def test_impossible_faults_are_an_error(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Faults(**wrong)


def test_an_unknown_preset_names_the_known_ones() -> None:
    with pytest.raises(InvalidValueError, match="subject4"):
        preset("subject12")
