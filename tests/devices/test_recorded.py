from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.devices.simulated import RecordedPerson, Recordings, SimulatedDevice, load_recordings
from isiw.errors import DeviceError
from isiw.signals.judgement import judge
from isiw.subjects.subject import Response
from isiw.sweeps import Sweep
from isiw.trials import Status, Stimulus
from isiw.types import FloatArray, Reference
from known import instance, known


@pytest.fixture(scope="module")
def recordings(recordings_folder: Path) -> Recordings:
    return load_recordings(recordings_folder)


def sweep_of(device: SimulatedDevice, trial: int) -> Sweep:
    return instance(Sweep, device.deliver(Stimulus(trial, 100.0), 1.0))


def staged(recordings: Recordings, mep_mv: float, seed: int = 0, reference: Reference = "valve") -> SimulatedDevice:
    device = SimulatedDevice(RecordedPerson(lambda isi_ms: Response(isi_ms, mep_mv), reference, recordings, seed))
    device.stage()
    return device


@pytest.mark.parametrize("mep_mv", [0.03, 0.1, 0.7, 3.0])
@pytest.mark.parametrize("trial", range(8))
def test_a_sweep_has_the_amplitude_that_the_person_answered_with(
    recordings: Recordings, space: DesignSpace, mep_mv: float, trial: int
) -> None:
    sweep = sweep_of(staged(recordings, mep_mv), trial)
    judged = judge(sweep, Stimulus(trial, 100.0), space)
    assert judged.status is Status.ACCEPTED
    assert judged.mep_mv == pytest.approx(mep_mv, rel=1e-6)
    assert judged.isi_ms == pytest.approx(100.0)


@pytest.mark.parametrize("trial", range(8))
def test_without_a_mep_the_recorded_floor_remains(recordings: Recordings, space: DesignSpace, trial: int) -> None:
    sweep = sweep_of(staged(recordings, 0.0), trial)
    floor_mv = known(judge(sweep, Stimulus(trial, 100.0), space).mep_mv)
    assert 0.001 < floor_mv < 0.02


def test_the_emg_before_the_pulse_is_the_quiet_recording_untouched(recordings: Recordings) -> None:
    emg = sweep_of(staged(recordings, 3.0), 0).channels["emg"]
    before = recordings.time_ms < 10
    assert any(np.array_equal(emg.values[before], quiet[before]) for quiet in recordings.quiet_mv)


def test_the_choice_of_sweeps_depends_on_seed_and_trial_alone(recordings: Recordings) -> None:
    def emg(seed: int, trials: list[int], last: int) -> FloatArray:
        device = staged(recordings, 0.1, seed)
        for trial in trials:
            device.deliver(Stimulus(trial, 50.0), 1.0)
        return sweep_of(device, last).channels["emg"].values

    assert np.array_equal(emg(1, [], 5), emg(1, [0, 1, 2], 5))
    assert not np.array_equal(emg(1, [], 5), emg(1, [], 6))
    assert not np.array_equal(emg(1, [], 5), emg(2, [], 5))


def test_the_isi_counts_from_the_reference(recordings: Recordings) -> None:
    valve = staged(recordings, 0.1).deliver(Stimulus(0, 100.0), 1.0)
    impact = staged(recordings, 0.1, reference="impact").deliver(Stimulus(0, 100.0), 1.0)
    assert (valve.t_valve_ms, valve.t_hit_ms) == (-100.0, None)
    assert (impact.t_valve_ms, impact.t_hit_ms) == (None, -100.0)


def test_the_recordings_sort_into_quiet_sweeps_and_clear_meps(recordings: Recordings) -> None:
    assert len(recordings.quiet_mv) >= 10
    assert len(recordings.mep_mv) >= 40
    assert recordings.rate_hz == pytest.approx(3000.0)


def test_a_folder_without_recordings_is_refused_with_the_way_out(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"not found.*--data"):
        load_recordings(tmp_path)


@pytest.mark.parametrize(
    "content", [b"", b"trial,0.0\n0,1.0\n", gzip.compress(b"trial,0.0\n0,none\n", mtime=0), gzip.compress(b"", mtime=0)]
)
def test_a_damaged_recording_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "uef_1_ECR_epochs_uV_3kHz.csv.gz").write_bytes(content)
    with pytest.raises(DeviceError, match="cannot be read"):
        load_recordings(tmp_path)
