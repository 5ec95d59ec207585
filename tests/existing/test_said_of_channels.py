"""What a recording says of its channels, events and epochs besides their numbers: it is used, or asked about."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import edfio
import numpy as np
import pandas as pd
import pytest
import scipy.io

from existing.test_doubts import with_events
from existing.test_waves import EMG_MV
from existing.writers import (
    ISIS_MS,
    KNOWN,
    MEPS_MV,
    NAMES,
    RATE_HZ,
    as_edf,
    as_eeglab_epochs,
    as_nwb,
    pulsed,
    raw,
    recording,
    require_as_written,
    with_stim,
)
from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

EVERY = {"event": "*"}


def lost(person: Delivered) -> list[int]:
    return [trial.index for trial in person.trials if not trial.told]


@pytest.mark.parametrize(
    "name",
    ["FCR ADU", "FCR (counts)", "iEMG FCR", "FCR detrended", "FCR smoothed", "FCR normalised", "FCR %MVC", "FCR log",
     "FCR abs", "FCR_RMS50", "FCR TKEO", "EMG z-score", "FCR x1000", "FCR (0.1 mV)", "EMG RMS", "mean EMG",
     "EMG gain 500"],
)  # fmt: skip
def test_a_channel_that_is_not_emg_as_it_was_recorded_has_many_names(name: str) -> None:
    made = raw()
    made.rename_channels({"FCR": name})
    with pytest.raises(IsiwError, match=rf"is not EMG as it was recorded.*--where \"{name[:3]}"):
        read_people(made, KNOWN.saying(channels={"emg": name}))
    require_as_written(read_people(made, KNOWN.saying(channels={"emg": name}, where={name: "*"}))[0])


@pytest.mark.parametrize("name", ["FCR diff", "X10", "EMG 1/2", "Bipolar 10", "Rect. fem.", "EMG1-EMG2"])
def test_a_channel_may_have_numbers_and_a_difference_in_its_name(name: str) -> None:
    made = raw()
    made.rename_channels({"FCR": name})
    require_as_written(read_people(made, KNOWN.saying(channels={"emg": name}))[0])


def test_a_channel_that_is_marked_as_bad_or_filtered_is_asked_about(tmp_path: Path) -> None:
    made = raw()
    made.info["bads"] = ["FCR"]
    path = as_edf(tmp_path).rename(tmp_path / "sub-01_emg.edf")
    pd.DataFrame({"name": ["FCR"], "units": ["uV"], "status": ["bad"]}).to_csv(
        tmp_path / "sub-01_channels.tsv", sep="\t", index=False
    )
    signal = edfio.EdfSignal(1e3 * EMG_MV, RATE_HZ, label="FCR", physical_dimension="uV", prefiltering="RECT RMS:20ms")
    edfio.Edf([signal], annotations=[edfio.EdfAnnotation(at, None, name) for at, name in recording()[1]]).write(
        tmp_path / "P02.edf"
    )
    for source, got in ((made, "'bad'"), (path, "'bad'"), (tmp_path / "P02.edf", "'rms'|'rect'")):
        with pytest.raises(IsiwError, match=rf"not EMG as it was recorded; got ({got})"):
            read_people(source, KNOWN)
        require_as_written(read_people(source, KNOWN.saying(where={"FCR": "*"}))[0])


@pytest.mark.parametrize(
    ("unit", "is_asked"),
    [*((unit, True) for unit in ("counts", "N", "g", "uV RMS", "mV", "10uV")), ("", False), ("n/a", False)],
)
def test_a_unit_of_no_voltage_is_not_overruled_in_silence(unit: str, is_asked: bool, tmp_path: Path) -> None:  # noqa: FBT001
    path, layout = as_edf(tmp_path, unit), KNOWN.saying(units=("uV",))
    if is_asked:
        with pytest.raises(IsiwError, match=rf"says another unit than the one that is stated.*expected {unit}"):
            read_people(path, layout)
        layout = layout.saying(where={"FCR": "*"})
    require_as_written(read_people(path, layout)[0])


@pytest.mark.parametrize(
    "remark",
    [
        "LostSamples: 234",
        "Buffer Overflow",
        "no tap",
        "muscle active",
        "-> out",
        "Comment/n. v.",
        "coughs",
        "artefact",
        "reject last trial",
        "bad",
    ],
)
def test_remarks_beside_trials_are_asked_about_whatever_their_words(remark: str) -> None:
    usual = [(0.1, "subject seated"), (5.6, "relaxed"), (7.4, "pause"), (8.0, "S 99"), (8.1, "Block 2")]
    usual += [(5.5, "BAD boundary")]
    require_as_written(read_people(with_events(lambda rows: sorted([*rows, *usual])), KNOWN)[0])
    noted = with_events(lambda rows: sorted([*rows, *usual, (5.4, remark)]))
    said = re.escape(remark.removeprefix("Comment/"))
    with pytest.raises(IsiwError, match=rf"may say that a trial does not count; got .*{said}.*--where \"event=\*\""):
        read_people(noted, KNOWN)
    require_as_written(read_people(noted, KNOWN.saying(where=EVERY))[0])


@pytest.mark.parametrize("later_s", [0.0005, 0.0019])
def test_a_trigger_that_is_found_twice_is_one(later_s: float) -> None:
    twice = with_events(lambda rows: sorted([*rows, *((at + later_s, name) for at, name in rows)]))
    require_as_written(read_people(twice, KNOWN)[0])


def named(said: list[float], before_s: float) -> Any:
    """The recording with the ISI of each trial in an event of its own, so long before its pulse."""
    pulses = [at for at, name in recording()[1] if name == NAMES["pulse"]]
    notes = [(at - before_s, f"ISI {isi:g} ms") for at, isi in zip(pulses, said, strict=False)]
    return with_events(lambda rows: sorted([*rows, *notes]))


@pytest.mark.parametrize("before_s", [0.3, 0.0])
def test_isis_that_events_name_are_those_between_tap_and_pulse(before_s: float) -> None:
    require_as_written(read_people(named([*ISIS_MS], before_s), KNOWN)[0])
    require_as_written(read_people(named([isi - 6 for isi in ISIS_MS], before_s), KNOWN)[0])  # a hammer is late
    require_as_written(read_people(named([1, 2, 3, 4, 5], before_s), KNOWN)[0])  # of conditions
    for wrong in ([30.0, 60, 115, 120, 45], [*ISIS_MS[1:], ISIS_MS[0]]):
        with pytest.raises(IsiwError, match=r"names another ISI than .*--where \"event=\*\""):
            read_people(named(wrong, before_s), KNOWN)
        require_as_written(read_people(named(wrong, before_s), KNOWN.saying(where=EVERY))[0])


def test_pulses_of_several_names_are_one_marker_with_a_star() -> None:
    isis = iter([*ISIS_MS, "alone"])
    several = with_events(
        lambda rows: [(at, f"TMS {next(isis)}" if name == NAMES["pulse"] else name) for at, name in rows]
    )
    with pytest.raises(IsiwError, match=r"--marker pulse=NAME, where NAME may end with \*"):
        read_people(several, Layout("impact", markers={"tap": NAMES["tap"]}, channels={"emg": "FCR"}))
    require_as_written(read_people(several, KNOWN.saying(markers={"pulse": "TMS*"}))[0])


def test_events_epochs_and_intervals_that_a_file_marks_do_not_count(tmp_path: Path) -> None:
    path = as_edf(tmp_path).rename(tmp_path / "sub-01_emg.edf")
    events = pd.DataFrame([(at, 0.0, name) for at, name in sorted(recording()[1])]).set_axis(
        ["onset", "duration", "trial_type"], axis=1
    )
    for column, cells in (("artifact", [int(n == 5) for n in range(len(events))]),
                          ("quality", ["poor" if n == 5 else "good" for n in range(len(events))]),
                          ("status", ["bad" if n == 5 else "ok" for n in range(len(events))])):  # fmt: skip
        events.assign(**{column: cells}).to_csv(tmp_path / "sub-01_events.tsv", sep="\t", index=False)
        assert lost(read_people(path, KNOWN)[0]) == [2]
    eeg = scipy.io.loadmat(as_eeglab_epochs(tmp_path), simplify_cells=True)["EEG"]
    scipy.io.savemat(tmp_path / "P01.set", {"EEG": {**eeg, "reject": {"rejmanual": [0, 0, 1, 0, 0, 0]}}})
    assert lost(read_people(tmp_path / "P01.set", KNOWN)[0]) == [2]
    pynwb, layout = pytest.importorskip("pynwb"), Layout("impact", channels={"emg": "EMG FCR"}, unmarked="alone")
    with pynwb.NWBHDF5IO(as_nwb(tmp_path), "a") as target:
        file = target.read()
        file.add_invalid_time_interval(start_time=9.9, stop_time=10.3)
        target.write(file)
    assert lost(read_people(tmp_path / "P01.nwb", layout)[0]) == [2]


@pytest.mark.parametrize(("wave", "last"), [(np.sin(np.linspace(0, np.pi, 24)), 1.0), (np.hanning(80), 5.0)])
def test_a_wave_of_a_hammer_is_no_trigger(wave: np.ndarray, last: float) -> None:
    force = np.convolve(pulsed(1, NAMES["tap"], 4.0), wave)[: len(EMG_MV)] * np.linspace(1, last, len(EMG_MV))
    with pytest.raises(IsiwError, match="'STI' has more than two levels, as a wave of force or acceleration"):
        read_people(with_stim(force, "emg"), Layout(reference="impact", channels={"emg": "FCR", "tap": "STI"}))


def test_what_matlab_has_beside_sweeps_and_where_these_begin_is_asked_about(tmp_path: Path) -> None:
    pulses_s, isis_ms = [at for at, name in recording()[1] if name == NAMES["pulse"]][:5], [2.0, 4.0, 6.0, 8.0, 10.0]
    layout = Layout("impact", rate_hz=RATE_HZ, pulse_at_ms=400.0, units=("mV",), channels={"emg": "emg"})

    def sweeps(late_ms: Any = 0.0, **more: Any) -> Path:
        firsts = np.round((np.array(pulses_s) - 0.4 - np.asarray(late_ms) / 1e3) * RATE_HZ).astype(int)
        cut = np.array([EMG_MV[first : first + 3200] for first in firsts])
        scipy.io.savemat(tmp_path / "P01.mat", {"emg": cut, "isi_ms": isis_ms, **more})
        return tmp_path / "P01.mat"

    (person,) = read_people(sweeps(), layout)
    assert [trial.mep_mv for trial in person.trials] == pytest.approx(MEPS_MV, rel=0.01)
    with pytest.raises(IsiwError, match=r"come later by as much as their ISIs are longer.*about the pulse"):
        read_people(sweeps(isis_ms), layout)
    for more, says in (({"gain": 1000.0}, r"'gain' of P01\.mat says a factor"), ({"badsweeps": 3}, "not as long"),
                       ({"note": "EMG rectified"}, "not EMG as it was recorded"),
                       ({"remark": np.array(["", "noise", "", "", ""], dtype="O")}, "row 2 .* may say")):  # fmt: skip
        with pytest.raises(IsiwError, match=says):
            read_people(sweeps(**more), layout)
    with pytest.raises(IsiwError, match=r"got 'V in one place|cannot be in|says another unit"):
        read_people(sweeps(emg_unit="V"), layout)
