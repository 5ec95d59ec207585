"""Mains hum and a drift are found, said and subtracted; EMG without them is left as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.findings import Kind, Severity
from isiw.signals import SignalLimits, judge
from isiw.signals.mep import at_rest, disturbance
from isiw.signals.rig import Evidence
from isiw.signals.watch import findings, shown_by
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus, Trial
from known import known

SPACE, LIMITS = DesignSpace(0, 300, reference="impact"), SignalLimits()


def sweep(
    trial: int, isi_ms: float, *, hum_uv: float = 0.0, hz: float = 50.0, mep_uv: float = 100.0, drift_uv_s: float = 0.0
) -> Sweep:
    """EMG at 5 kHz with an MEP of two lobes 21 to 33 ms after the pulse, a hum of any phase, and a drift."""
    rng = np.random.default_rng(trial)
    since_ms = np.arange(-500.0, 100.0, 0.2)
    lobes = np.where((since_ms > 21) & (since_ms < 33), np.sin(np.pi * (since_ms - 21) / 6), 0.0)
    wave = np.sin(2e-3 * np.pi * hz * since_ms + rng.uniform(0, 2 * np.pi))
    emg_uv = 1.5 * rng.standard_normal(since_ms.size) + 0.5 * mep_uv * lobes + 0.5 * hum_uv * wave
    emg_uv += 1e-3 * drift_uv_s * since_ms
    return Sweep({"emg": Channel(emg_uv, 5000.0, "uV", t0_ms=-500.0)}, t_tms_ms=0.0, t_hit_ms=-isi_ms)


def judged(trial: int, isi_ms: float, **changed: float) -> tuple[Sweep, Trial]:
    one = sweep(trial, isi_ms, **changed)
    return one, judge(one, Stimulus(trial, isi_ms), SPACE, LIMITS)


@pytest.mark.parametrize("hz", [50.0, 60.0, 50.05])
@pytest.mark.parametrize("isi_ms", [60.0, 250.0])
def test_hum_leaves_the_amplitude_of_an_mep_as_it_is(hz: float, isi_ms: float) -> None:
    clean = [known(judged(trial, isi_ms, hum_uv=0.0)[1].mep_mv) for trial in range(8)]
    hummed = [known(judged(trial, isi_ms, hum_uv=25.0, hz=hz)[1].mep_mv) for trial in range(8)]
    assert hummed == pytest.approx(clean, abs=0.003)


def test_hum_is_not_an_mep() -> None:
    silent = [known(judged(trial, 90.0, hum_uv=25.0, mep_uv=0.0)[1].mep_mv) for trial in range(8)]
    assert max(silent) < 0.015  # as EMG at rest of 1.5 µV; with the hum it was 25 µV and more


@pytest.mark.parametrize(("hum_uv", "noise_uv", "says"), [(60.0, 0.0, "mains hum of 60 Hz"), (0.0, 20.0, "is tense")])
def test_a_trial_that_hum_alone_loses_is_not_laid_to_the_muscle(hum_uv: float, noise_uv: float, says: str) -> None:
    one = sweep(1, 150.0, hum_uv=hum_uv, hz=60.0)
    emg = one.channels["emg"]
    noisy = emg.values + noise_uv * np.random.default_rng(0).standard_normal(emg.values.size)
    one = replace(one, channels={"emg": replace(emg, values=noisy)})
    trial = judge(one, Stimulus(1, 150.0), SPACE, LIMITS)
    assert trial.reason is Kind.BACKGROUND_ACTIVITY
    assert says in next(findings(Evidence(trial, one, LIMITS))).text


def test_hum_is_said_after_four_trials_with_its_frequency_and_size() -> None:
    trials = [judged(trial, isi_ms, hum_uv=25.0, hz=60.0) for trial, isi_ms in enumerate((60.0, 90.0, 150.0, 250.0))]
    told = [shown_by(one, trial, LIMITS) for one, trial in trials]
    found = next(findings(Evidence(limits=LIMITS, told=told)))
    assert (found.kind, found.severity) == (Kind.HUM, Severity.DOUBT)
    assert "60 Hz" in found.text
    assert "25 µV" in found.text
    assert next(findings(Evidence(limits=LIMITS, told=told[:3])), None) is None


@pytest.mark.parametrize("hum_uv", [0.0, 5.0])
def test_emg_without_hum_to_speak_of_is_left_as_it_is(hum_uv: float) -> None:
    for trial in range(20):
        one, found = judged(trial, 90.0, hum_uv=hum_uv)
        assert shown_by(one, found, LIMITS).disturbance is None


def test_too_little_rest_for_three_periods_says_nothing() -> None:
    one, trial = judged(0, 290.0, hum_uv=25.0)
    emg = one.channels["emg"]
    short = np.zeros(emg.values.size, dtype=bool)
    short[:290] = True  # 58 ms
    assert disturbance(1e-3 * emg.values, emg.rate_hz, short) is None
    assert at_rest(emg, trial).sum() > 1000


@pytest.mark.parametrize("drift_uv_s", [200.0, -2000.0])
@pytest.mark.parametrize("hum_uv", [0.0, 25.0])
def test_an_electrode_that_drifts_moves_no_amplitude_and_is_not_taken_for_a_tense_muscle(
    drift_uv_s: float, hum_uv: float
) -> None:
    for isi_ms in (60.0, 250.0):
        clean = [judged(trial, isi_ms)[1] for trial in range(8)]
        drifting = [judged(trial, isi_ms, drift_uv_s=drift_uv_s, hum_uv=hum_uv)[1] for trial in range(8)]
        assert [known(one.mep_mv) for one in drifting] == pytest.approx([known(one.mep_mv) for one in clean], abs=0.003)
        assert {one.reason for one in drifting} == {None}


@pytest.mark.parametrize("mep_uv", [0.0, 100.0])
def test_a_drift_is_said_after_four_trials_and_nothing_else_is_blamed_for_it(mep_uv: float) -> None:
    trials = [
        judged(n, isi_ms, drift_uv_s=1000.0, mep_uv=mep_uv) for n, isi_ms in enumerate((60.0, 90.0, 150.0, 250.0))
    ]
    told = [shown_by(one, trial, LIMITS) for one, trial in trials]
    found = list(findings(Evidence(limits=LIMITS, told=told)))
    assert [(one.kind, one.severity) for one in found] == [(Kind.DRIFT, Severity.DOUBT)]
    assert "100 µV in 100 ms" in found[0].text
    assert not list(findings(Evidence(limits=LIMITS, told=told[:3])))
