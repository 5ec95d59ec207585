"""Onset, duration, area and silent period: those of made-up sweeps, and against the reference toolbox."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from isiw.design import DesignSpace
from isiw.findings import Kind
from isiw.log.frames import measures_of
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.rig import Safeguards
from isiw.signals import MEP_WINDOWS_MS, SignalLimits, judge
from isiw.signals.measures import Measures, measures
from isiw.strategy.catalogue import make_strategy
from isiw.subjects.changes import TapResponse
from isiw.sweeps import Channel, Sweep
from isiw.trials import Status, Stimulus, Trial
from tapped import IMPACT, TapRig
from wrong_rigs import rig

SPACE, RATE_HZ = DesignSpace(0, 320, reference="impact"), 5000.0
CONTRACTED = SignalLimits(contracted=True)


def sweep(
    *, mep_mv: float = 0.4, contraction_mv: float = 0.0, silent_until_ms: float = 0.0, after: float = 1.0, seed: int = 0
) -> Sweep:
    """An MEP of two lobes from 21 to 33 ms, in a muscle that is at rest, or contracted and silent for a while.

    The contraction is so many times as strong after the silence as before.
    """
    rng, since_ms = np.random.default_rng(seed), np.arange(-400.0, 300.0, 1000 / RATE_HZ)
    lobes = np.where((since_ms > 21) & (since_ms < 33), np.sin(np.pi * (since_ms - 21) / 6), 0.0)
    active = contraction_mv * rng.standard_normal(since_ms.size) * ((since_ms < 21) | (since_ms > silent_until_ms))
    active[since_ms > silent_until_ms] *= after
    emg = 0.002 * rng.standard_normal(since_ms.size) + 0.5 * mep_mv * lobes + active
    return Sweep({"emg": Channel(emg, RATE_HZ, "mV", t0_ms=-400.0)}, t_tms_ms=0.0, t_hit_ms=-100.0)


def measured(one: Sweep, limits: SignalLimits | None = None) -> Measures:
    limits = limits or SignalLimits()
    return measures(one.channels["emg"], judge(one, Stimulus(0, 100.0), SPACE, limits), limits)


def test_onset_duration_and_area_are_those_of_the_mep() -> None:
    found = measured(sweep())
    assert found.mep_onset_ms == pytest.approx(21.0, abs=0.5)
    assert found.mep_duration_ms == pytest.approx(12.0, abs=1.0)
    assert found.mep_area_mv_ms == pytest.approx(0.2 * 12 * 2 / math.pi, rel=0.05)
    assert math.isnan(found.silent_period_ms)


def test_without_an_mep_there_is_nothing_to_measure() -> None:
    assert all(map(math.isnan, measured(sweep(mep_mv=0.0))))


@pytest.mark.parametrize("until_ms", [90.0, 150.0])
@pytest.mark.parametrize("after", [1.0, 1.5, 3.0])
def test_the_silent_period_of_a_contracted_muscle_is_counted_from_the_pulse(after: float, until_ms: float) -> None:
    made = partial(sweep, mep_mv=4.0, contraction_mv=0.1, silent_until_ms=until_ms, after=after)
    found = [measured(made(seed=seed), CONTRACTED) for seed in range(9)]
    assert np.median([one.silent_period_ms for one in found]) == pytest.approx(until_ms, abs=3.0)


def test_a_contracted_muscle_is_a_mistrial_unless_it_is_stated() -> None:
    tense = sweep(mep_mv=4.0, contraction_mv=0.1)
    assert judge(tense, Stimulus(0, 100.0), SPACE).reason is Kind.BACKGROUND_ACTIVITY
    assert judge(tense, Stimulus(0, 100.0), SPACE, CONTRACTED).reason is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "dataset", "muscles", "share"),
    [("ID10_1_ECR", "ID10_1", "forearm", 0.8), ("ID01_FDI", "ID01", "hand", 0.6)],
)
def test_durations_agree_with_the_reference_toolbox(
    recordings_folder: Path, file: str, dataset: str, muscles: str, share: float
) -> None:
    sweeps = pd.read_csv(recordings_folder / f"uef_{file}_epochs_uV_3kHz.csv.gz", index_col="trial")
    trials = pd.read_csv(recordings_folder / "uef_trials.csv")
    reference = trials[trials["dataset"] == dataset].set_index("trial").loc[sweeps.index]
    limits = SignalLimits(mep_window_ms=MEP_WINDOWS_MS[muscles])
    trial = Trial(0, Status.ACCEPTED, 100.0, isi_ms=100.0, mep_mv=0.1, t_tms_ms=50.0)
    ours = [measures(Channel(emg / 1000, 3000.0, "mV"), trial, limits).mep_duration_ms for emg in sweeps.to_numpy()]
    held = (reference["feature_amp_uV"] > 50) & (reference["feature_latency_ms"] > 0)
    apart_ms = np.abs(np.array(ours) - reference["feature_duration_ms"])[held]
    assert (apart_ms <= 5.0).mean() >= share


def test_the_table_of_trials_has_them_for_the_trials_with_sweeps(tmp_path: Path) -> None:
    strategy = make_strategy("even", space=IMPACT, max_trials=3, particles=100)
    Session(TapRig(), strategy, log=tmp_path / "s.mcap").run(progress=False)
    trials = read_session(tmp_path / "s.mcap").trials
    assert trials.mep_onset_ms[:3].between(20.0, 23.0).all()
    assert trials.silent_period_ms.isna().all()


def test_a_log_of_a_robots_sweeps_is_measured_too(tmp_path: Path) -> None:
    Session(rig(), make_strategy("even", space=SPACE, max_trials=3, particles=100), log=tmp_path / "s.mcap").run(
        progress=False
    )
    record = read_session(tmp_path / "s.mcap")
    assert set(measures_of(record)) == {trial.index for trial in record.table.told}


@pytest.mark.slow
def test_measures_are_without_the_taps_own_response_as_the_amplitude_is(tmp_path: Path) -> None:
    rig, strategy = (
        TapRig(TapResponse(30.0, 100.0, 0.3, 0.0)),
        make_strategy("even", space=IMPACT, max_trials=14, particles=100),
    )
    Session(rig, strategy, log=tmp_path / "s.mcap", safeguards=Safeguards(on_pause=lambda _: True)).run(progress=False)
    trials = read_session(tmp_path / "s.mcap").trials
    pairs = trials[trials.commanded_isi_ms.notna()]
    assert (pairs.tap_mv > 0).sum() >= 4
    assert pairs.mep_onset_ms.between(20.0, 23.0).all()
    assert pairs.mep_duration_ms.to_numpy() == pytest.approx(8.0, abs=1.5)
    assert pairs.mep_area_mv_ms.to_numpy() == pytest.approx(0.15 * 8 / math.pi, rel=0.1)
