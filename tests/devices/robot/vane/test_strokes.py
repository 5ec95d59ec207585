from __future__ import annotations

import numpy as np
import pytest

from isiw.devices.robot.vane.rotation import Vane
from isiw.devices.robot.vane.tapper import UNITS, draw_strokes, record_strokes

MODULE = "isiw.devices.robot.vane.tapper"


@pytest.mark.slow
def test_without_variation_all_strokes_are_one_and_without_noise_they_are_recorded_as_they_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, value in {"FRICTION_CV": 0, "RESERVOIR_CV": 0, "NOISE_SD": dict.fromkeys(UNITS, 0)}.items():
        monkeypatch.setattr(f"{MODULE}.{name}", value)
    strokes = draw_strokes(Vane(), 2, np.random.default_rng(0))
    waves = record_strokes(strokes, np.random.default_rng(0), rest_ms=100)
    assert set(waves) == set(UNITS)
    assert (waves["angle"][0] == waves["angle"][1]).all()
    assert (waves["angle"][:, :100] == 0).all()
    assert waves["angle"][:, 100:] == pytest.approx(np.degrees(strokes.angle_rad))
    assert waves["vane_pressure"].max() == pytest.approx(300, rel=0.05)  # 4 bar on one side, 1 bar on the other


@pytest.mark.slow
def test_more_friction_starts_later(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{MODULE}.FRICTION_CV", 0.3)
    monkeypatch.setattr(f"{MODULE}.RESERVOIR_CV", 0)
    strokes = draw_strokes(Vane(), 20, np.random.default_rng(1))
    friction = 1 + 0.3 * np.random.default_rng(1).standard_normal((2, 20))[0]
    assert (np.argsort(strokes.delay_ms, kind="stable") == np.argsort(friction)).sum() > 10
    assert strokes.delay_ms.std() > 0.5
