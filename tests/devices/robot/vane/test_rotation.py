from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benchmarks.vane import filled_bar
from scipy.integrate import cumulative_trapezoid

from isiw.devices.robot.vane.rotation import Load, Rotations, Rotor, Supply, Vane, orifice_flow, rotate
from isiw.errors import InvalidValueError

VANE = Vane(Rotor(15, 150))
HELD = replace(VANE, rotor=replace(VANE.rotor, friction_nm=1000.0, leak_l_min=0.0))
FINE_MS = 0.1


@pytest.fixture(scope="module")
def fine() -> Rotations:
    """A small, a middle and a large actuator without leaks, every step kept."""
    rotors = (Rotor(10, 62.5, leak_l_min=0), Rotor(15, 150, leak_l_min=0), Rotor(37.5, 150, leak_l_min=0))
    return rotate([Vane(rotor) for rotor in rotors], duration_s=0.55, step_ms=FINE_MS, sample_ms=FINE_MS)


def test_nothing_flows_between_equal_pressures() -> None:
    assert orifice_flow(1.0, 0.3, 2e5, 2e5) == 0


def test_a_choked_flow_is_the_conductance_times_the_upstream_pressure() -> None:
    litres_of_free_air = orifice_flow(1.1, 0.28, 4e5, [1e5, 0.28 * 4e5]) / 100  # 1 l at 1 bar is 100 J
    assert litres_of_free_air == pytest.approx(4.4)


def test_a_flow_that_is_not_choked_falls_to_nothing_along_an_ellipse() -> None:
    ratio = np.array([0.28, 0.64, 1.0])
    assert orifice_flow(1.0, 0.28, 1e5, 1e5 * ratio) == pytest.approx(100 * np.array([1, math.sqrt(0.75), 0]))


def test_a_flow_changes_its_sign_with_its_direction() -> None:
    assert orifice_flow(1.0, 0.3, 1e5, 3e5) == -orifice_flow(1.0, 0.3, 3e5, 1e5)


def test_a_fixed_volume_fills_within_half_a_percent_of_the_closed_form() -> None:
    # 79 ml behind the valve, and next to nothing more
    at_once = Supply(line_m=0.01, bore_mm=100, fitting_l_s_bar=1e-9, critical_ratio=0.35)
    done = rotate([replace(HELD, supply=at_once)], duration_s=0.2, half_wave_s=1.0)
    expected = filled_bar(done.t_ms, at_once.line_m3, at_once)
    assert expected[5] < 0.35 * 4 < expected[-1]  # choked first, then not
    assert done.line_bar[0, 0] == pytest.approx(expected, rel=0.005)


@pytest.mark.slow
def test_it_is_within_half_a_percent_of_itself_at_half_the_step() -> None:
    vanes = [Vane(Rotor(h, d)) for h, d in ((10, 62.5), (15, 150), (37.5, 150))]
    one, half = (rotate(vanes, duration_s=0.6, step_ms=step_ms, sample_ms=5) for step_ms in (0.1, 0.05))
    assert one.delay_ms == pytest.approx(half.delay_ms, rel=0.005)
    assert np.abs(one.angle_rad - half.angle_rad).max() < 0.005 * math.pi
    # Pressures that jump when the vane meets its stop are compared over time, not at the moment of the jump.
    assert one.chamber_bar.mean(axis=-1) == pytest.approx(half.chamber_bar.mean(axis=-1), rel=0.005)


def test_nothing_arrives_before_the_sound(fine: Rotations) -> None:
    early = fine.t_ms <= VANE.supply.delay_ms
    assert (fine.line_bar[..., early] == 1.0).all()
    assert (fine.delay_ms > VANE.supply.delay_ms).all()


def test_no_air_is_lost_or_made(fine: Rotations) -> None:
    line_ml, dead_ml = 1e6 * VANE.supply.line_m3, VANE.rotor.dead_ml
    levers_ml = 1e6 * np.array([Rotor(10, 62.5).lever_m3, Rotor(15, 150).lever_m3, Rotor(37.5, 150).lever_m3])
    turned = np.stack([fine.angle_rad, math.pi - fine.angle_rad], axis=1)
    air = fine.line_bar * line_ml + fine.chamber_bar * (dead_ml + levers_ml[:, None, None] * turned)  # [bar ml]
    late = round(VANE.supply.delay_ms / FINE_MS)
    let_in = FINE_MS * np.cumsum(fine.valve_l_s, axis=-1)  # 1 l/s of free air is 1 bar ml in a ms
    assert (air[..., late + 1 :] - air[..., :1]) == pytest.approx(let_in[..., : -late - 1], abs=1e-6)
    assert let_in.max() > 500


def test_the_airs_work_is_what_friction_damping_weight_and_motion_take(fine: Rotations) -> None:
    load, rotor = VANE.load, VANE.rotor
    moving = fine.t_ms < 480  # before the command turns round
    angle = fine.angle_rad[1, moving]
    free = slice(0, int(np.argmax(angle >= math.pi)) - 1)  # before the stop
    angle, speed = angle[free], np.gradient(angle, FINE_MS / 1000)[free]
    moment = 1e5 * rotor.lever_m3 * (fine.chamber_bar[1, 0] - fine.chamber_bar[1, 1])[moving][free]
    work = cumulative_trapezoid(moment, angle)
    damped = cumulative_trapezoid(rotor.damping_nm_s * speed, angle)
    lifted = -load.moment_nm * np.diff(np.cos(angle - math.pi / 2)[[0, -1]])
    kept = load.inertia_kg_m2 * speed[-1] ** 2 / 2
    taken = rotor.friction_nm * np.ptp(angle) + damped[-1] + lifted[0] + kept
    assert angle[-1] > 3
    assert work[-1] == pytest.approx(taken, rel=0.01)


def test_an_actuator_whose_friction_the_reservoir_cannot_overcome_rests() -> None:
    done = rotate([Vane(Rotor(7.5, 12.5))], duration_s=0.4, step_ms=0.5)
    assert np.isnan(done.delay_ms).all()
    assert np.ptp(done.angle_rad) == 0


@pytest.mark.slow
def test_a_held_actuator_comes_to_the_pressures_of_reservoir_and_room_and_stays_there() -> None:
    done = rotate([HELD], duration_s=1.5, half_wave_s=2.0, step_ms=0.2)
    assert done.chamber_bar[0, :, -200:] == pytest.approx(np.array([[4.0], [1.0]]) * np.ones(200), rel=0.02)


def test_the_vane_stays_within_its_stops(fine: Rotations) -> None:
    assert fine.angle_rad.min() >= 0
    assert fine.angle_rad.max() == math.pi


def test_each_actuator_does_what_it_does_alone(fine: Rotations) -> None:
    alone = rotate([Vane(Rotor(15, 150, leak_l_min=0))], duration_s=0.12, step_ms=FINE_MS, sample_ms=FINE_MS)
    assert (alone.angle_rad[0] == fine.angle_rad[1, : len(alone.t_ms)]).all()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"vanes": []}, "at least one Vane"),
        ({"duration_s": 0}, "duration_s"),
        ({"duration_s": 1e6}, "duration_s"),
        ({"half_wave_s": -1}, "half_wave_s"),
        ({"start_rad": 4}, "start_rad"),
        ({"step_ms": 5}, "step_ms"),
        ({"sample_ms": 0.01}, "sample_ms"),
    ],
)
def test_what_cannot_be_solved_is_refused(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        rotate(**{"vanes": [VANE], **changed})


def test_a_load_that_outweighs_the_friction_falls_to_the_middle() -> None:
    heavy = Vane(Rotor(15, 150, friction_nm=0.1), Load(payload_n=60))
    done = rotate([heavy], start_rad=0.3, duration_s=0.02)  # before any air arrives
    assert done.angle_rad[0, -1] > 0.3
