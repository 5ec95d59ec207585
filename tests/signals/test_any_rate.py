"""Sweeps of any rate, length and offset are judged or are mistrials; nothing raises, whatever the ISI."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import CallbackDevice
from isiw.session.loop import Session
from isiw.signals import judge
from isiw.strategy.catalogue import make_strategy
from isiw.sweeps import Channel, Sweep
from isiw.trials import Status, Stimulus, Trial
from known import known

SPACE = DesignSpace(0, 320, reference="impact")


def emg_of(rate_hz: float, before_ms: float, after_ms: float, seed: int = 0, mep_mv: float = 0.1) -> Channel:
    """EMG at rest with an MEP at 20 to 30 ms after the pulse, which is at 0 ms."""
    since_ms = np.arange(max(2, round((before_ms + after_ms) * rate_hz / 1000))) * 1000 / rate_hz - before_ms
    evoked_mv = mep_mv / 2 * np.where((since_ms > 20) & (since_ms < 30), np.sin((since_ms - 20) * np.pi / 5), 0)
    noise_mv = 0.003 * np.random.default_rng(seed).standard_normal(since_ms.size)
    return Channel(evoked_mv + noise_mv, rate_hz, "mV", t0_ms=-before_ms)


def judged(sweep: Sweep, isi_ms: float | None) -> Trial:
    return judge(sweep, Stimulus(0, isi_ms), SPACE)


@pytest.mark.parametrize("rate_hz", [512.0, 1024.0, 1925.926, 2048.0, 3003.003, 4370.0, 4800.0, 5000.0])
@pytest.mark.parametrize("isi_ms", [79.9, 80.0, 80.1, 100.0, 0.0])
def test_at_the_isi_that_leaves_just_enough_rest_a_trial_is_judged(rate_hz: float, isi_ms: float) -> None:
    sweep = Sweep({"emg": emg_of(rate_hz, 100.0, 100.0)}, t_tms_ms=0.0, t_hit_ms=-isi_ms)
    trial = judged(sweep, isi_ms)
    assert trial.status is Status.ACCEPTED
    assert trial.mep_mv == pytest.approx(0.1, abs=0.03) or isi_ms == 0.0


@pytest.mark.slow
@given(
    rate_hz=st.floats(500.0, 50_000.0),
    before_ms=st.floats(-40.0, 300.0),
    after_ms=st.floats(0.0, 120.0),
    isi_ms=st.none() | st.floats(0.0, 320.0),
    late_ms=st.floats(-30.0, 400.0),
    hit=st.booleans(),
    seed=st.integers(0, 9),
)
@settings(max_examples=200, deadline=None)
def test_no_sweep_raises(
    *, rate_hz: float, before_ms: float, after_ms: float, isi_ms: float | None, late_ms: float, hit: bool, seed: int
) -> None:
    emg = emg_of(rate_hz, before_ms, after_ms, seed)
    times = {} if isi_ms is None else {"t_hit_ms": -isi_ms} if hit else {"t_valve_ms": -isi_ms - late_ms}
    acceleration = {} if hit else {"acceleration": Channel(0.3 * emg.values[::-1], rate_hz, "m/s^2", t0_ms=-before_ms)}
    trial = judged(Sweep({"emg": emg, **acceleration}, t_tms_ms=0.0, **times), isi_ms)
    assert (trial.status is Status.ACCEPTED) == (trial.mep_mv is not None and trial.reason is None)


def test_a_window_that_begins_a_part_of_a_sample_before_the_sweep_is_no_error() -> None:
    assert judged(Sweep({"emg": emg_of(600.0, -15.1, 100.0)}, t_tms_ms=0.0), None).status is Status.MISTRIAL


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [1024.0, 3003.003, 4370.0])
def test_a_session_with_just_enough_rest_at_some_isi_runs_to_its_end(rate_hz: float, tmp_path: Path) -> None:
    def fired(stimulus: Stimulus, _: float) -> Sweep:
        size = math.exp(0.6 * np.random.default_rng(stimulus.trial).standard_normal())
        emg = emg_of(rate_hz, 100.0, 100.0, stimulus.trial, mep_mv=0.1 * size)
        return Sweep({"emg": emg}, t_tms_ms=0.0, t_hit_ms=-known(stimulus.isi_ms))

    rig = CallbackDevice(fired, DeviceInfo("own", "impact", channels={"emg": "mV"}, simulated=True))
    strategy = make_strategy("even", space=DesignSpace(20, 90, step_ms=10, reference="impact"), max_trials=8)
    result = Session(rig, strategy, log=tmp_path / "s.mcap").run(progress=False)
    assert result.decision.stop
    assert [trial.status for trial in result.trials] == [Status.ACCEPTED] * 8
