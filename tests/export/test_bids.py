"""EMG-BIDS: valid by the official validator, and the same numbers when it is read back."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import edfio
import numpy as np
import pandas as pd
import pytest

from export.recorded import SAMPLES, alone, emg_mv, sweep, write_sweeps
from isiw.devices.info import DeviceInfo
from isiw.errors import ConfigError, InvalidValueError
from isiw.export import export_logs
from isiw.export.bids import TASK
from isiw.export.emg import Layout, Run
from isiw.findings import Kind
from isiw.log.record import read_session
from isiw.signals.limits import SignalLimits
from isiw.sweeps import Channel
from isiw.text.stimuli import STIMULI
from isiw.trials import Status, Stimulus, Trial
from isiw.visit import Visit

OLD_LOGS = Path(__file__).parents[1] / "data" / "logs"
NAME = "sub-P07_ses-01_task-pairedstimulation"


def errors_of(folder: Path) -> list[str]:
    """What the official validator has against a data set."""
    found = shutil.which("bids-validator-deno", path=sysconfig.get_path("scripts")) or shutil.which(
        "bids-validator-deno"
    )
    if found is None:
        pytest.skip("bids-validator-deno is not installed")
    done = subprocess.run(  # noqa: S603 - found beside this Python
        [found, str(folder), "--format", "json"], capture_output=True, text=True, check=False, timeout=60
    )
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert issues, "the validator always has a recommendation"
    return [f"{issue['code']} {issue.get('location')}" for issue in issues if issue["severity"] == "error"]


def table(folder: Path, name: str) -> pd.DataFrame:
    (path,) = folder.rglob(name)
    return pd.read_csv(path, sep="\t", na_values="n/a", keep_default_na=False)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_sweeps(tmp_path / "logs" / "s.mcap", {trial: sweep(trial) for trial in range(4)})


@pytest.fixture
def data_set(log: Path, tmp_path: Path) -> Path:
    export_logs(log, tmp_path / "out", "bids")
    return tmp_path / "out"


@pytest.mark.slow
def test_the_official_validator_finds_no_error(data_set: Path) -> None:
    assert errors_of(data_set) == []


@pytest.mark.slow
def test_logs_of_all_earlier_versions_make_one_valid_data_set(tmp_path: Path) -> None:
    export_logs(OLD_LOGS, tmp_path / "out", "bids")
    assert errors_of(tmp_path / "out") == []


@pytest.mark.slow
def test_a_pseudonymised_data_set_is_valid_and_has_no_logs(log: Path, tmp_path: Path) -> None:
    export_logs(log, tmp_path / "out", "bids", pseudonymise=True)
    assert errors_of(tmp_path / "out") == []
    assert list((tmp_path / "out").rglob("*.mcap")) == []


@pytest.mark.slow
def test_the_validator_would_find_an_error(data_set: Path) -> None:
    (sidecar,) = data_set.rglob("*_emg.json")
    sidecar.write_text("{}")
    assert any(error.startswith("SIDECAR_KEY_REQUIRED") for error in errors_of(data_set))


@pytest.mark.parametrize(("rate_hz", "samples"), [(3000.0, SAMPLES), (5000.0, 800), (4096.0, 333), (1000.0 / 3, 70)])
def test_the_sweeps_are_read_back_to_the_same_numbers(tmp_path: Path, rate_hz: float, samples: int) -> None:
    sweeps = {trial: sweep(trial, rate_hz, samples) for trial in range(4)}
    export_logs(write_sweeps(tmp_path / "s.mcap", sweeps), tmp_path / "out", "bids")
    (file,) = (tmp_path / "out").rglob("*.bdf")
    emg = edfio.read_bdf(file).get_signal("emg")
    logged = np.concatenate([emg_mv(trial, samples) for trial in sweeps])
    step_mv = np.ptp(logged) / 2**24
    assert emg.sampling_frequency == pytest.approx(rate_hz, rel=1e-12)
    assert emg.data[: len(logged)] == pytest.approx(logged, abs=2 * step_mv, rel=0)
    assert len(emg.data) - len(logged) < 64
    assert np.ptp(emg.data[len(logged) - 1 :]) == 0


def test_a_sweep_that_fits_is_a_record_of_the_file(tmp_path: Path) -> None:
    sweeps = {trial: sweep(trial, 5000.0, 800) for trial in range(3)}
    export_logs(write_sweeps(tmp_path / "s.mcap", sweeps), tmp_path / "out", "bids")
    (file,) = (tmp_path / "out").rglob("*.bdf")
    assert (edfio.read_bdf(file).num_data_records, edfio.read_bdf(file).data_record_duration) == (3, 0.16)


def test_the_events_are_where_they_are_in_the_file(data_set: Path) -> None:
    events = table(data_set, f"{NAME}_run-01_events.tsv")
    (file,) = data_set.rglob("*.bdf")
    emg = edfio.read_bdf(file).get_signal("emg")
    sweeps = events[events.trial_type == "sweep"]
    assert sweeps.trial.tolist() == [0, 1, 2, 3]
    for row in sweeps.itertuples():
        first = round(float(str(row.onset)) * emg.sampling_frequency)
        assert emg.data[first : first + SAMPLES] == pytest.approx(emg_mv(int(str(row.trial))), abs=1e-6)
    tms = events[events.trial_type == "tms"]
    assert (tms.onset.to_numpy() - sweeps.onset.to_numpy()).tolist() == pytest.approx([0.07] * 4)
    assert events[events.trial_type == "tap"].trial.tolist() == [0, 2, 3]


def test_the_events_say_what_was_given_and_what_came_of_it(data_set: Path, log: Path) -> None:
    events = table(data_set, f"{NAME}_run-01_events.tsv")
    sweeps, trials = events[events.trial_type == "sweep"], read_session(log).trials
    assert sweeps.condition.tolist() == ["paired"] * 4
    assert sweeps.status.tolist() == ["accepted", "mistrial", "accepted", "accepted"]
    assert sweeps.reason.tolist()[1] == "no impact"
    assert sweeps.session_s.tolist() == trials.onset_s.tolist() == [0.0, 6.5, 13.0, 19.5]
    assert sweeps.mep_mv.tolist() == pytest.approx(trials.mep_mv.tolist(), nan_ok=True)


STIMULATOR = DeviceInfo("stimulator", "impact", channels={"emg": "mV"}, conditioning="electrical")


def write_pulsed(path: Path) -> Path:
    """A session with electrical pulses in the place of taps; the last one is alone."""
    return write_sweeps(path, {trial: sweep(trial) for trial in (0, 2, 3)}, *alone(4), device=STIMULATOR)


@pytest.mark.slow
def test_a_data_set_of_electrical_pulses_speaks_of_no_tap(tmp_path: Path) -> None:
    export_logs(write_pulsed(tmp_path / "s.mcap"), tmp_path / "out", "bids")
    texts = [
        path for path in (tmp_path / "out").rglob("*") if path.suffix in {".tsv", ".json"} or path.name == "README"
    ]
    found = {
        path.name: re.findall(r"\b(?:belly-tendon|taps?|tendon|hammer|impact)\b", path.read_text("utf-8"))
        for path in texts
    }
    assert len(found) > 8
    found = {name: [word for word in words if word != "belly-tendon"] for name, words in found.items()}
    assert {name: words for name, words in found.items() if words} == {"sub-P07_sessions.tsv": ["impact"]}  # reference
    assert errors_of(tmp_path / "out") == []


def test_the_electrical_pulse_is_an_event_where_it_was_given(tmp_path: Path) -> None:
    export_logs(write_pulsed(tmp_path / "s.mcap"), tmp_path / "out", "bids")
    events = table(tmp_path / "out", f"{NAME}_run-01_events.tsv")
    assert events[events.trial_type == "electrical pulse"].trial.tolist() == [0, 2, 3]
    assert set(events.trial_type) == {"sweep", "electrical pulse", "tms"}
    meanings = json.loads(next((tmp_path / "out").rglob("*_events.json")).read_text("utf-8"))
    assert meanings["trial_type"]["Description"] == (
        "sweep: a trial's waveforms; and in it electrical pulse: the electrical pulse, tms: the magnetic pulse"
    )
    assert "TMS alone or electrical pulse alone" in meanings["condition"]["Description"]
    for sidecar in (tmp_path / "out").rglob("*.json"):
        task = json.loads(sidecar.read_text("utf-8")).get("TaskDescription")
        assert task is None or task.startswith("An electrical pulse to the nerve, and after an inter-stimulus interval")
    assert table(tmp_path / "out", "sub-P07_sessions.tsv").conditioning.tolist() == ["electrical"]


def test_a_data_set_of_taps_says_so_and_needs_no_column_for_it(data_set: Path) -> None:
    assert "conditioning" not in table(data_set, "sub-P07_sessions.tsv")
    meanings = json.loads(next(data_set.rglob("*_events.json")).read_text("utf-8"))
    assert meanings["trial_type"]["Description"] == (
        "sweep: a trial's waveforms; and in it valve: the valve command, tap: the impact, tms: the pulse"
    )
    assert "at which a tap on the tendon enhances" in (data_set / "README").read_text("utf-8")


def test_the_task_says_whether_the_muscle_is_contracted(log: Path, tmp_path: Path) -> None:
    contracted = SignalLimits(contracted=True)
    write_sweeps(log.parent / "c.mcap", {0: sweep(0)}, signals=contracted, created="2026-12-24T10:00:00+00:00")
    export_logs(log.parent, tmp_path / "out", "bids")
    found = {
        path.name: json.loads(path.read_text("utf-8"))["TaskDescription"].rpartition("The muscle is ")[2]
        for path in (tmp_path / "out").rglob(f"*task-{TASK}*.json")
        if not path.name.endswith("events.json")
    }
    assert found[f"task-{TASK}_beh.json"] == "contracted or at rest."
    assert {said for name, said in found.items() if "ses-01" in name} == {"at rest."}
    assert {said for name, said in found.items() if "ses-02" in name} == {"contracted."}
    assert len(found) == 5


@pytest.mark.slow
def test_in_a_data_set_with_both_each_session_says_which_stimulus_came_first(log: Path, tmp_path: Path) -> None:
    write_pulsed(log.parent / "electrical.mcap").rename(log.parent / "second.mcap")
    exported = export_logs(log.parent, tmp_path / "out", "bids")
    assert exported.sessions == 2
    found = {}
    for session in ("ses-01", "ses-02"):
        (sidecar,) = (tmp_path / "out" / "sub-P07" / session).rglob("*_beh.json")
        events = table(tmp_path / "out" / "sub-P07" / session, "*_events.tsv")
        task = json.loads(sidecar.read_text("utf-8"))["TaskDescription"].partition(", and after")[0]
        found[task] = set(events.trial_type) - {"sweep", "tms"}
    assert found == {"A tap on the tendon": {"tap"}, "An electrical pulse to the nerve": {"electrical pulse"}}
    task = json.loads((tmp_path / "out" / "task-pairedstimulation_beh.json").read_text("utf-8"))["TaskDescription"]
    assert task.startswith("A tap on the tendon or an electrical pulse to the nerve, and after")
    assert set(table(tmp_path / "out", "sub-P07_sessions.tsv").conditioning) == {"tap", "electrical"}
    assert errors_of(tmp_path / "out") == []


def test_all_trials_are_in_a_table_with_what_was_believed(data_set: Path, log: Path) -> None:
    back, trials = table(data_set, f"{NAME}_beh.tsv"), read_session(log).trials
    for name in ("onset_s", "isi_ms", "mep_mv", "p_window", "window_start_ms", "end_high_ms"):
        assert back[name].tolist() == pytest.approx(trials[name].tolist(), nan_ok=True), name


def test_what_is_known_of_the_recording_is_said_and_what_is_not_known_is_not_made_up(data_set: Path) -> None:
    sidecar = json.loads(next(data_set.rglob("*_emg.json")).read_text("utf-8"))
    assert (sidecar["RecordingType"], sidecar["SamplingFrequency"]) == ("epoched", 3000.0)
    assert sidecar["EMGPlacementSchemeDescription"] == "Muscle: FCR. Electrodes: belly-tendon."
    assert sidecar["PowerLineFrequency"] == sidecar["SoftwareFilters"] == sidecar["EMGReference"] == "n/a"
    channels = table(data_set, f"{NAME}_run-01_channels.tsv")
    assert channels[["name", "type", "units"]].to_numpy().tolist() == [
        ["emg", "EMG", "mV"], ["acceleration", "MISC", "m/s^2"],
    ]  # fmt: skip


@pytest.mark.slow
def test_sweeps_of_another_length_are_another_run(tmp_path: Path) -> None:
    sweeps = {0: sweep(0), 1: sweep(1), 2: sweep(2, samples=300), 3: {"emg": sweep(3)["emg"]}}
    export_logs(write_sweeps(tmp_path / "s.mcap", sweeps), tmp_path / "out", "bids")
    runs = [table(tmp_path / "out", f"{NAME}_run-{run:02d}_events.tsv").trial.unique().tolist() for run in (1, 2, 3)]
    assert runs == [[0, 1], [2], [3]]
    assert errors_of(tmp_path / "out") == []


@pytest.mark.parametrize(
    "other",
    [
        Channel(np.ones(2), 3000.0, "V", -50.0),
        Channel(np.ones(SAMPLES), 1500.0, "V", -50.0),
        Channel(np.ones(SAMPLES), 3000.0, "V", 0.0),
        Channel(np.full(SAMPLES, np.nan), 3000.0, "V", -50.0),
        Channel(np.full(SAMPLES, -1e9), 3000.0, "V", -50.0),
    ],
    ids=["length", "rate", "begin", "not finite", "too large"],
)
def test_a_channel_that_does_not_go_with_the_emg_is_left_out_and_said_to_be(tmp_path: Path, other: Channel) -> None:
    log = write_sweeps(tmp_path / "s.mcap", {0: {**sweep(0), "force": other}})
    exported = export_logs(log, tmp_path / "out", "bids")
    assert "The channel force is not in the EMG file in 1 trials" in exported.lacking[0]
    assert "The channel force" in (tmp_path / "out" / "README").read_text("utf-8")


def test_channels_of_a_trial_without_emg_are_said_to_have_none_beside_them(tmp_path: Path) -> None:
    log = write_sweeps(tmp_path / "s.mcap", {0: sweep(0), 1: {"force": sweep(1)["acceleration"]}})
    (said, *_) = export_logs(log, tmp_path / "out", "bids").lacking
    assert said.endswith("The channel force is not in the EMG file in 1 trials (first 1): there is no EMG.")


def test_a_channel_that_never_changes_and_one_with_a_long_name_are_written(tmp_path: Path) -> None:
    name = "the force beneath the hammer"
    flat = Channel(np.full(SAMPLES, 5.0), 3000.0, "N", -50.0)
    export_logs(write_sweeps(tmp_path / "s.mcap", {0: {**sweep(0), name: flat}}), tmp_path / "out", "bids")
    channels = table(tmp_path / "out", f"{NAME}_run-01_channels.tsv").set_index("description")
    (file,) = (tmp_path / "out").rglob("*.bdf")
    signal = edfio.read_bdf(file).get_signal(str(channels.name[name]))
    assert signal.data[:SAMPLES] == pytest.approx(np.full(SAMPLES, 5.0), abs=1e-6)


@pytest.mark.slow
def test_a_damaged_log_makes_a_valid_data_set_that_says_what_it_lacks(log: Path, tmp_path: Path) -> None:
    whole = log.read_bytes()
    log.write_bytes(whole[: len(whole) // 2])
    exported = export_logs(log, tmp_path / "out", "bids")
    assert exported.lacking
    assert exported.lacking[0].removeprefix("P07, session 01: ") in (tmp_path / "out" / "README").read_text("utf-8")
    assert errors_of(tmp_path / "out") == []


def test_a_sweep_whose_trial_is_lost_is_there_with_an_unknown_outcome(tmp_path: Path) -> None:
    log = write_sweeps(tmp_path / "s.mcap", {trial: sweep(trial) for trial in range(3)}, lost=1)
    exported = export_logs(log, tmp_path / "out", "bids")
    assert "not known: trials 1." in exported.lacking[0]
    events = table(tmp_path / "out", f"{NAME}_run-01_events.tsv")
    (row,) = events[events.trial == 1].to_dict("records")
    assert (row["trial_type"], row["status"], row["reason"]) == ("sweep", "mistrial", "outcome unknown")
    assert (row["condition"], row["commanded_isi_ms"]) == ("paired", 30.0)


@pytest.mark.parametrize(
    ("trial", "condition"),
    [
        (Trial(0, Status.ACCEPTED, 30.0, isi_ms=30.0, mep_mv=0.1), "paired"),
        (Trial(0, Status.ACCEPTED, None, mep_mv=0.1), "TMS alone"),
        (Trial(0, Status.ACCEPTED, None, tap_alone=True), "tap alone"),
        (Trial(0, Status.MISTRIAL, None, Kind.NO_PULSE), "TMS alone"),
        (Trial.unknown(Stimulus(0, None)), "unknown"),
        (Trial.unknown(Stimulus(0, 30.0)), "paired"),
    ],
)
def test_each_condition_is_named(trial: Trial, condition: str) -> None:
    layout = Layout(1000.0, 4, (("emg", "mV"),))
    (row,) = Run(layout, (trial,), (0.0,), (np.zeros(4),)).events({})
    assert row["condition"] == condition
    (row,) = Run(layout, (trial,), (0.0,), (np.zeros(4),), STIMULI["electrical"]).events({})
    assert row["condition"] == condition.replace("tap", "electrical pulse")


def test_moments_outside_the_sweep_are_left_out_as_they_would_lie_in_another_trials() -> None:
    trial = Trial(0, Status.ACCEPTED, 30.0, isi_ms=30.0, mep_mv=0.1, t_valve_ms=-1.0, t_hit_ms=0.0, t_tms_ms=4.0)
    layout = Layout(1000.0, 4, (("emg", "mV"),))
    rows = Run(layout, (trial,), (0.0,), (np.zeros(4),)).events({})
    assert [row["trial_type"] for row in rows] == ["sweep", "tap"]


def test_two_people_whose_codes_become_one_label_are_refused(tmp_path: Path) -> None:
    for number, subject in enumerate(("P.07", "p07")):
        write_sweeps(tmp_path / "logs" / f"{number}.mcap", {0: {}}, subject=subject)
    with pytest.raises(InvalidValueError, match="--pseudonymise"):
        export_logs(tmp_path / "logs", tmp_path / "out", "bids")
    assert export_logs(tmp_path / "logs", tmp_path / "out", "bids", pseudonymise=True).sessions == 2
    assert export_logs(tmp_path / "logs", tmp_path / "tables").sessions == 2


@pytest.mark.slow
def test_a_session_without_sweeps_needs_no_edfio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "edfio", None)
    export_logs(write_sweeps(tmp_path / "s.mcap", {0: {}, 1: {}}), tmp_path / "out", "bids")
    assert errors_of(tmp_path / "out") == []
    with pytest.raises(ConfigError, match=r"isiw\[bids\]"):
        export_logs(write_sweeps(tmp_path / "t.mcap", {0: sweep(0)}), tmp_path / "again", "bids")


def test_texts_with_tabs_and_newlines_break_no_table(tmp_path: Path) -> None:
    write_sweeps(tmp_path / "s.mcap", {0: sweep(0)}, visit=Visit(electrodes="one\ttwo\nthree"))
    export_logs(tmp_path / "s.mcap", tmp_path / "out", "bids")
    assert table(tmp_path / "out", "*_sessions.tsv").electrodes.tolist() == ["one two three"]


def test_a_unit_that_a_file_cannot_hold_is_written_as_far_as_it_can(tmp_path: Path) -> None:
    channels = {"emg": sweep(0)["emg"], "force": Channel(emg_mv(0), 3000.0, "N\tm\x07", -50.0)}
    export_logs(write_sweeps(tmp_path / "s.mcap", {0: channels}), tmp_path / "out", "bids")
    assert table(tmp_path / "out", f"{NAME}_run-01_channels.tsv").units.tolist() == ["mV", "N?m?"]
