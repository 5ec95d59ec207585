from __future__ import annotations

from typing import Any

import pytest

from isiw.devices.robot.vane.rotation import Load, Rotor, Supply
from isiw.errors import InvalidValueError


def test_the_texts_friction_is_that_of_a_break_away_pressure_of_400_mbar_with_h_over_2_in_equation_7_8() -> None:
    assert Rotor(20, 150).break_away_bar == pytest.approx(0.4)


def test_inertia_and_weight_are_those_of_the_table() -> None:
    load = Load(payload_n=9.81, arm_n=5, shaft_n=2)
    assert load.inertia_kg_m2 == pytest.approx(3.3e-4 + 7.2e-4 + 1.0 * 0.06**2)
    assert load.moment_nm == pytest.approx((5 + 9.81) * 0.06 + 2 * 0.025)


def test_the_line_delays_by_its_length_over_the_speed_of_sound() -> None:
    assert Supply().delay_ms == pytest.approx(21.9, abs=0.05)
    assert Supply(bore_mm=4).line_m3 == pytest.approx(94.2e-6, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "values", "said"),
    [
        (Rotor, {"height_mm": 0, "depth_mm": 150}, "height_mm"),
        (Rotor, {"height_mm": 15, "depth_mm": 150, "friction_nm": -1}, "friction_nm"),
        (Rotor, {"height_mm": 15, "depth_mm": 150, "dead_ml": 0}, "dead_ml"),
        (Load, {"payload_n": float("nan")}, "payload_n"),
        (Load, {"arm_kg_m2": 0}, "arm_kg_m2"),
        (Supply, {"critical_ratio": 1}, "critical_ratio"),
        (Supply, {"valve_l_s_bar": 0}, "valve_l_s_bar"),
        (Supply, {"reservoir_bar": 1}, "add 1 bar"),
    ],
)
def test_what_no_actuator_can_be_made_of_is_refused(kind: type, values: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        kind(**values)
