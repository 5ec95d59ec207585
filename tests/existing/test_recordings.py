"""Recordings that other programs' libraries write are read back to what was put into them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import edfio
import mne
import numpy as np
import pandas as pd
import pybv
import pytest
import scipy.io

import isiw
from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

RATE_HZ = 4000.0
ISIS_MS = (30.0, 60.0, 90.0, 120.0, 45.0)
MEPS_MV = (0.4, 0.9, 1.6, 0.25, 0.7)
NAMES = {"tap": "S  1", "pulse": "S  2"}
KNOWN = Layout(reference="impact", markers=NAMES, channels={"emg": "FCR"}, unmarked="alone")

mne.set_log_level("ERROR")


def recording(scale: float = 1.0) -> tuple[np.ndarray, list[tuple[float, str]]]:
    """EMG [mV] with an MEP of known amplitude after each pulse, and the times of taps and pulses [s]."""
    rng, seconds = np.random.default_rng(1), 2.0 * (len(ISIS_MS) + 2)
    emg_mv = 1e-3 * rng.standard_normal(round(seconds * RATE_HZ))
    events = []
    for number, (isi_ms, mep_mv) in enumerate(zip((*ISIS_MS, None), (*MEPS_MV, 0.3), strict=True)):
        tap_s = 1.0 + 2.0 * number
        pulse_s = tap_s if isi_ms is None else tap_s + isi_ms / 1e3
        events += [] if isi_ms is None else [(tap_s, NAMES["tap"])]
        events.append((pulse_s, NAMES["pulse"]))
        first = round((pulse_s + 0.018) * RATE_HZ)
        wave = np.sin(np.linspace(0.0, 2.0 * np.pi, round(0.012 * RATE_HZ)))
        emg_mv[first : first + len(wave)] += 0.5 * mep_mv * wave / np.abs(wave).max()
    return scale * emg_mv, events


def raw(scale: float = 1.0, kind: str = "emg") -> Any:
    emg_mv, events = recording(scale)
    info = mne.create_info(["FCR", "EEG 1"], RATE_HZ, [kind, "eeg"])
    made = mne.io.RawArray(np.stack([1e-3 * emg_mv, np.zeros_like(emg_mv)]), info)
    onsets, names = zip(*events, strict=True)
    return made.set_annotations(mne.Annotations(onsets, 0.0, names))


def as_brainvision(path: Path) -> Path:
    emg_mv, events = recording()
    samples = [
        {"onset": round(at_s * RATE_HZ), "duration": 1, "description": int(name[-1]), "type": "Stimulus"}
        for at_s, name in events
    ]
    pybv.write_brainvision(
        data=1e-3 * np.stack([emg_mv, 0 * emg_mv]), sfreq=RATE_HZ, ch_names=["FCR", "EEG 1"], fname_base="P01",
        folder_out=path, events=samples, resolution=1e-3, unit="µV",
    )  # fmt: skip
    return path / "P01.vhdr"


def as_edf(
    path: Path, dimension: str = "uV", scale: float = 1e3, *, bdf: bool = False, record_s: float | None = None
) -> Path:
    emg_mv, events = recording()
    signal: Any = edfio.BdfSignal if bdf else edfio.EdfSignal
    signals = [
        signal(
            scale * values, RATE_HZ, label=label, physical_dimension=dimension, physical_range=(-4 * scale, 4 * scale)
        )
        for label, values in (("FCR", emg_mv), ("EEG 1", 0 * emg_mv))
    ]
    notes = [edfio.EdfAnnotation(at_s, None, name) for at_s, name in events]
    kind: Any = edfio.Bdf if bdf else edfio.Edf
    made = kind(signals, annotations=notes, data_record_duration=record_s)
    target = path / f"P01.{'bdf' if bdf else 'edf'}"
    made.write(target)
    return target


def as_fif(path: Path) -> Path:
    raw().save(path / "P01_raw.fif")
    return path / "P01_raw.fif"


def as_eeglab(path: Path) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mne.export.export_raw(path / "P01.set", raw(kind="eeg"))
    return path / "P01.set"


def as_epochs(path: Path) -> Path:
    made = epochs()
    made.save(path / "P01-epo.fif")
    return path / "P01-epo.fif"


def epochs() -> Any:
    whole = raw()
    events, _ = mne.events_from_annotations(whole, {NAMES["pulse"]: 2})
    metadata = pd.DataFrame({"isi_ms": [*ISIS_MS, np.nan]})
    return mne.Epochs(whole, events, tmin=-0.3, tmax=0.1, baseline=None, preload=True, metadata=metadata)


WRITERS = {
    "brainvision": as_brainvision,
    "edf in µV": as_edf,
    "edf in mV": lambda path: as_edf(path, "mV", 1.0),
    "bdf": lambda path: as_edf(path, bdf=True),
    "fif": as_fif,
    "eeglab": as_eeglab,
    "epochs in a file": as_epochs,
}


def require_as_written(person: Delivered) -> None:
    pairs = [trial for trial in person.trials if trial.isi_ms is not None]
    assert [trial.isi_ms for trial in pairs] == pytest.approx(ISIS_MS, abs=1000 / RATE_HZ)
    assert [trial.mep_mv for trial in pairs] == pytest.approx(MEPS_MV, rel=0.01)
    assert [trial.is_control for trial in person.trials] == [False] * 5 + [True]
    assert all(trial.told for trial in person.trials)


@pytest.mark.parametrize("kind", WRITERS)
def test_a_recording_is_read_back_to_the_numbers_that_were_written(kind: str, tmp_path: Path) -> None:
    (person,) = read_people(WRITERS[kind](tmp_path), KNOWN)
    require_as_written(person)


def test_a_comma_that_is_not_coded_in_a_comment_of_brainvision_is_said_with_its_line(tmp_path: Path) -> None:
    path = as_brainvision(tmp_path)
    markers = path.with_suffix(".vmrk")
    whole = markers.read_text()
    for text in ("coil moved, pair repeated", "again, 5", "one, two, three"):
        markers.write_text(f"{whole}Mk99=Comment,{text},500,1,0\n")
        with pytest.raises(IsiwError, match=rf"comma .* of a marker in P01\.vmrk.*Mk99=Comment,{text}.*\\1"):
            read_people(path, KNOWN)
    markers.write_text(
        f"{whole}Mk99=Comment,coil moved\\1 again,500,1,0\nMk100=New Segment,,1,1,0,20131113161403794232\n"
    )
    (person,) = read_people(path, KNOWN)
    require_as_written(person)


def test_recordings_in_memory_are_read_too() -> None:
    for made in (raw(), epochs()):
        (person,) = read_people(made, KNOWN, subject="P01")
        require_as_written(person)


@pytest.mark.parametrize("date", [None, 1_700_000_000])
def test_a_recording_that_was_cropped_is_read_as_the_whole_one(date: int | None, tmp_path: Path) -> None:
    made = raw()
    made.set_meas_date(date)
    made.crop(0.5, None).save(tmp_path / "P01_raw.fif.gz")
    for source in (made, tmp_path / "P01_raw.fif.gz"):
        (person,) = read_people(source, KNOWN)
        require_as_written(person)


def test_a_trigger_channel_has_events_too() -> None:
    emg_mv, events = recording()
    trigger = np.zeros_like(emg_mv)
    for at_s, name in events:
        trigger[round(at_s * RATE_HZ) :][:8] = int(name[-1])
    info = mne.create_info(["FCR", "STI 014"], RATE_HZ, ["emg", "stim"])
    made = mne.io.RawArray(np.stack([1e-3 * emg_mv, trigger]), info)
    (person,) = read_people(made, Layout(reference="impact", markers={"tap": "1", "pulse": "2"}, unmarked="alone"))
    require_as_written(person)


def test_the_metadata_of_epochs_say_units_and_tms_alone() -> None:
    for cells in ({"ISI (s)": [isi / 1e3 for isi in (*ISIS_MS, np.nan)]}, {"isi_ms": [*map(str, ISIS_MS), "TMS"]}):
        made = epochs()
        made.metadata = pd.DataFrame(cells)
        (person,) = read_people(made, KNOWN)
        require_as_written(person)
    made.metadata = None
    (person,) = read_people(made, KNOWN)  # the annotations within them say when the stimuli came
    require_as_written(person)
    made.set_annotations(None)
    with pytest.raises(IsiwError, match="isi_ms in their metadata"):
        read_people(made, KNOWN)


def test_what_was_recorded_is_in_the_log_and_in_what_is_exported_and_read_again(tmp_path: Path) -> None:
    (person,) = read_people(as_edf(tmp_path), KNOWN)
    space = isiw.DesignSpace(20, 130, reference="impact")
    log = isiw.existing.analysed(person, isiw.make_strategy(space=space, particles=50)).to_log(tmp_path / "P01.mcap")
    assert len(isiw.read_session(log).waveforms) == 6
    isiw.export.export_logs(log, tmp_path / "bids", "bids")
    (file,) = (tmp_path / "bids").rglob("*_emg.bdf")
    (again,) = read_people(file, Layout(reference="impact"))
    require_as_written(again)


def test_vectors_of_matlab_are_a_table(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "P01.mat", {"isi_ms": ISIS_MS, "mep_mv": MEPS_MV, "rate": 4000.0})
    (person,) = read_people(tmp_path / "P01.mat", Layout(reference="impact"))
    assert [(trial.isi_ms, trial.mep_mv) for trial in person.trials] == list(zip(ISIS_MS, MEPS_MV, strict=True))


BROKEN: dict[str, tuple[dict[str, Any], str]] = {
    "no reference": ({"reference": None}, "--reference"),
    "no marker": ({"markers": {}}, "--marker pulse=NAME --marker tap=NAME"),
    "no marker of the pulse": ({"markers": {"tap": "S  1"}}, "--marker pulse=NAME"),
    "no marker of the tap": ({"markers": {"pulse": "S  2"}}, "--marker tap=NAME"),
    "a marker that is not there": ({"markers": {"pulse": "S 99"}}, "no event of this name"),
    "one marker for both": ({"markers": {"tap": "S 2", "pulse": "S2"}}, "cannot mark both"),
    "markers swapped": ({"markers": {"tap": "S 2", "pulse": "S 1"}}, "which marker is of the tap"),
    "a channel that is not there": ({"channels": {"emg": "FDI"}}, "no such channel"),
    "no valve": ({"reference": "valve"}, "--marker valve=NAME"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_a_recording_does_not_tell_is_asked_for_by_name(kind: str) -> None:
    said, expected = BROKEN[kind]
    layout = Layout(**{"reference": "impact", "markers": NAMES, "channels": {"emg": "FCR"}, **said})
    with pytest.raises(IsiwError, match=expected) as refused:
        read_people(raw(), layout)
    assert "\n" not in str(refused.value)


def test_several_channels_of_one_kind_are_asked_about() -> None:
    made = raw(kind="eeg")
    made.rename_channels({"FCR": "one"})
    with pytest.raises(IsiwError, match='--channel "emg='):
        read_people(made, Layout(reference="impact", markers=NAMES))


@pytest.mark.parametrize(("scale", "kind"), [(1000.0, "implausible"), (1e-4, "implausible")])
def test_a_recording_of_another_unit_does_not_count(scale: float, kind: str) -> None:
    with pytest.raises(IsiwError, match=f"counts|{kind}|cannot be in"):
        read_people(raw(scale), KNOWN)


def test_a_clipped_recording_does_not_count() -> None:
    made = raw()
    made.apply_function(lambda values: np.clip(values, -1e-4, 1e-4), picks="all")
    with pytest.raises(IsiwError, match="saturation"):
        read_people(made, KNOWN)


def test_a_unit_that_the_file_does_not_say_is_asked_for(tmp_path: Path) -> None:
    path = as_edf(tmp_path, "", 1e3)
    with pytest.raises(IsiwError, match="--unit"):
        read_people(path, KNOWN)
    (person,) = read_people(path, KNOWN.saying(units=("uV",)))
    require_as_written(person)


@pytest.mark.parametrize("name", ["P01.vhdr", "P01.edf", "P01.bdf", "P01_raw.fif", "P01.set", "P01.mat"])
def test_a_file_that_is_no_recording_is_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"no recording at all")
    with pytest.raises(IsiwError, match=r"cannot be read|can be read"):
        read_people(tmp_path / name, KNOWN)
