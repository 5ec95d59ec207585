"""Against the reference toolbox (MEPFeatX) on recorded sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

import numpy as np
import pandas as pd
import pytest

from isiw.signals import MEP_WINDOWS_MS, background_rms, is_saturated, mep_amplitudes, mep_onsets, mep_present
from isiw.types import FloatArray

PULSE_MS, RATE_HZ = 50.0, 3000.0

Recorded: TypeAlias = tuple[FloatArray, pd.DataFrame, tuple[float, float]]
"""Sweeps of EMG [mV], what the toolbox found in them, and the window of their MEPs [ms]."""


@pytest.fixture(params=[("ID10_1_ECR", "ID10_1", "forearm"), ("ID01_FDI", "ID01", "hand")], ids=["ECR", "FDI"])
def recorded(request: pytest.FixtureRequest, recordings_folder: Path) -> Recorded:
    file, dataset, muscles = request.param
    sweeps = pd.read_csv(recordings_folder / f"uef_{file}_epochs_uV_3kHz.csv.gz", index_col="trial")
    trials = pd.read_csv(recordings_folder / "uef_trials.csv")
    reference = trials[trials["dataset"] == dataset].set_index("trial").loc[sweeps.index]
    return sweeps.to_numpy() / 1000, reference, MEP_WINDOWS_MS[muscles]


def test_amplitudes_agree_within_2_percent_in_95_of_100_sweeps_with_an_mep(recorded: Recorded) -> None:
    emg_mv, reference, window_ms = recorded
    theirs = reference["feature_amp_uV"].to_numpy()
    held = theirs > 50
    ours = 1000 * mep_amplitudes(emg_mv, RATE_HZ, PULSE_MS, window_ms)
    assert held.sum() >= 50
    assert np.mean(np.abs(ours[held] / theirs[held] - 1) <= 0.02) >= 0.95


def test_the_default_window_agrees_too(recorded: Recorded) -> None:
    emg_mv, reference, _ = recorded
    theirs = reference["feature_amp_uV"].to_numpy()
    held = theirs > 50
    ours = 1000 * mep_amplitudes(emg_mv, RATE_HZ, PULSE_MS)
    assert np.mean(np.abs(ours[held] / theirs[held] - 1) <= 0.02) >= 0.95


def test_onsets_agree_within_1_and_a_half_ms_in_90_of_100(recorded: Recorded) -> None:
    emg_mv, reference, window_ms = recorded
    theirs = reference["feature_latency_ms"].to_numpy()
    held = (reference["feature_amp_uV"].to_numpy() > 50) & (theirs > 0)
    ours = mep_onsets(emg_mv, RATE_HZ, PULSE_MS, window_ms)
    assert np.mean(np.abs(ours[held] - theirs[held]) <= 1.5) >= 0.90


def test_an_mep_is_present_exactly_where_the_reference_found_one(recorded: Recorded) -> None:
    emg_mv, reference, window_ms = recorded
    present = mep_present(emg_mv, RATE_HZ, PULSE_MS, window_ms)
    assert np.mean(present == (reference["feature_amp_uV"].to_numpy() > 50)) >= 0.97


def test_the_background_follows_the_reference(recorded: Recorded) -> None:
    emg_mv, reference, _ = recorded
    ours = 1000 * background_rms(emg_mv, RATE_HZ, PULSE_MS)
    assert np.median(ours / reference["prestim_rms_uV"].to_numpy()) == pytest.approx(1.0, abs=0.1)


def test_no_recorded_sweep_is_called_saturated(recorded: Recorded) -> None:
    assert not any(is_saturated(emg, RATE_HZ) for emg in recorded[0])
    first_ms, last_ms = (PULSE_MS + edge_ms for edge_ms in recorded[2])
    assert not any(is_saturated(emg, RATE_HZ, span_ms=(first_ms, last_ms)) for emg in recorded[0])
