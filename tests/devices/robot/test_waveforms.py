from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from isiw.devices.robot.mechanism import Taps, draw_taps
from isiw.devices.robot.tapper import preset
from isiw.devices.robot.waveforms import (
    acceleration_m_s2,
    emg_noise_uv,
    force_n,
    mep_shape,
    record_robot,
    sample_times_ms,
    tap_artefact_mv,
    tms_artefact_mv,
)

TIMES_MS = sample_times_ms(5000.0, 1000.0, valve_ms=500.0)


@pytest.fixture
def bench() -> Taps:
    return draw_taps(preset("bench"), 20, np.random.default_rng(0))


def test_the_bench_records_a_force_and_people_do_not(bench: Taps) -> None:
    rng = np.random.default_rng(1)
    assert sorted(record_robot(TIMES_MS, bench, rng)) == ["acceleration", "force", "pressure", "valve"]
    assert "force" not in record_robot(TIMES_MS, draw_taps(preset("subject1"), 1, rng), rng)


def test_the_load_cell_shows_an_impact_and_then_the_resting_hammer(bench: Taps) -> None:
    force = force_n(np.broadcast_to(TIMES_MS, (20, 5000)), bench)
    before = bench.hit_ms[:, None] > TIMES_MS
    assert not force[before].any()
    np.testing.assert_allclose(force.max(axis=1), 89.0, rtol=0.35)  # about 20 lbf
    np.testing.assert_allclose(force[:, -1], 2.401 * 4.448, rtol=0.01)


def test_the_acceleration_jumps_below_zero_at_the_contact() -> None:
    taps = draw_taps(preset("subject2"), 50, np.random.default_rng(2))
    just_before, just_after = ((taps.hit_ms + shift)[:, None] for shift in (-0.01, 0.01))
    assert (acceleration_m_s2(just_before, taps) > 5).all()
    assert (acceleration_m_s2(just_after, taps) < -10).all()


def test_the_hammer_rests_at_the_end_of_the_trial() -> None:
    for name in ("bench", "subject1", "subject3"):
        taps = draw_taps(preset(name), 50, np.random.default_rng(3))
        assert (acceleration_m_s2(np.full((50, 1), 499.0), taps) == 0).all()


@pytest.mark.parametrize("rate_hz", [2000.0, 5000.0, 10000.0])
def test_the_emg_at_rest_has_the_rms_that_the_preset_states(rate_hz: float) -> None:
    noise = emg_noise_uv(40, 5000, rate_hz, 1.5, np.random.default_rng(4))
    assert noise.std() == pytest.approx(1.5, rel=0.03)


def test_the_artefacts_are_as_short_as_in_a_good_rig() -> None:
    time_ms = np.linspace(-5, 30, 3501)
    tap = tap_artefact_mv(time_ms, 0.1)
    assert (tap[time_ms <= 0] == 0).all()
    assert np.abs(tap[time_ms > 8]).max() < 0.001
    pulse = tms_artefact_mv(time_ms[None, :], np.array([0.5]))[0]
    assert np.ptp(pulse) == pytest.approx(0.5, rel=0.01)
    assert np.abs(pulse[time_ms > 1.6]).max() < 0.006


def test_the_mep_has_unit_height_and_the_turns_of_a_forearm_mep() -> None:
    time_ms = np.linspace(0, 80, 8001)
    shape = mep_shape(time_ms)
    assert np.ptp(shape) == pytest.approx(1.0, abs=1e-3)
    assert time_ms[shape.argmin()] == pytest.approx(21.3, abs=0.3)
    assert time_ms[shape.argmax()] == pytest.approx(29.9, abs=0.3)


def test_the_mep_resembles_the_recorded_mean_mep(recordings_folder: Path) -> None:
    recorded = pd.read_csv(recordings_folder / "uef_ECR_template_norm.csv").query("t_ms >= 5 and t_ms <= 60")
    ours = mep_shape(recorded["t_ms"].to_numpy())
    assert np.corrcoef(ours, recorded["mean_norm"])[0, 1] >= 0.95
