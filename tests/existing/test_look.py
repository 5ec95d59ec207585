"""What a look into a file says: what is there, the command that would read it, and what is still to be said."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import edfio
import numpy as np
import pandas as pd
import pytest

from existing.writers import RATE_HZ, as_edf, as_fif, recording, without_records
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.existing.analysis import analyse
from isiw.existing.layout import Layout
from isiw.existing.looking import look


def test_markers_without_a_known_name_are_proposed_by_which_follows_which(tmp_path: Path) -> None:
    found = look(as_fif(tmp_path), Layout(channels={"emg": "FCR"}))
    said = str(found)
    assert "channel 'FCR': V, 4000 Hz, emg, 14.0 s" in said
    assert re.search(r"event 'S  1': 5 times, 2 s apart", said)
    assert shlex.split(found.command)[3:] == [
        "--reference", "impact", "--marker", "tap=S  1", "--marker", "pulse=S  2", "--channel", "emg=FCR",
        "-o", "P01_raw.mcap",
    ]  # fmt: skip
    assert "--unmarked alone" in found.missing
    assert found.figure is None


def test_what_would_be_measured_is_drawn_once_nothing_but_the_reference_is_missing(tmp_path: Path) -> None:
    path = without_records(as_edf(tmp_path), 2, 4)
    found = look(path, Layout(channels={"emg": "FCR"}, unmarked="alone"))
    assert "in 3 parts, the second from 3.0 s on" in str(found)
    assert found.missing == "Do ISIs count from the impact (or electrical pulse), or the valve?"
    assert found.figure is not None
    titles = [axes.get_title(loc="left") for axes in found.figure.axes]
    expected = [f"trial {number}: ISI {isi_ms} ms" for number, isi_ms in enumerate((30, 60, 90))]
    assert [title.split(",")[0] for title in titles] == expected
    assert look(path, Layout("impact", channels={"emg": "FCR"}, unmarked="alone")).missing == ""


def test_triggers_are_found_in_channels_if_there_are_no_events(tmp_path: Path) -> None:
    emg_mv, stimuli = recording()
    triggers = {name: np.zeros_like(emg_mv) for name in ("S  1", "S  2")}
    for at_s, name in stimuli:
        triggers[name][round(at_s * RATE_HZ) :][:20] = 4.0
    signals = [
        edfio.EdfSignal(values, RATE_HZ, label=label, physical_dimension="mV", physical_range=(-4, 4))
        for label, values in (("EMG", emg_mv), ("in 2", triggers["S  1"]), ("in 3", triggers["S  2"]))
    ]
    edfio.Edf(signals).write(tmp_path / "P01.edf")
    found = look(tmp_path / "P01.edf", Layout("impact", unmarked="alone"))
    assert "channel 'in 3': mV, 4000 Hz, 14.0 s; a trigger? 6 times" in str(found)
    assert "--channel 'tap=in 2' --channel 'pulse=in 3'" in found.command
    assert found.missing == ""
    assert look(tmp_path / "P01.edf", Layout("impact", unmarked="alone", markers={"tap": "x"})).command == found.command


def test_the_columns_of_a_table_are_listed_with_what_they_are_taken_for(tmp_path: Path) -> None:
    pd.DataFrame({"isi_ms": [10, 20, 40, 80, 90], "mep": 0.1, "note": "x"}).to_csv(tmp_path / "P01.csv", index=False)
    found = look(tmp_path / "P01.csv")
    assert "column 'isi_ms', the isi: 10, 20, 40, 80 … (5 different)" in str(found)
    assert "column 'note': x" in str(found)
    assert "--unit with mV, uV or V" in found.missing
    assert not found.missing.startswith("Do ISIs")


def test_a_log_says_itself_what_it_holds_and_is_in_the_list_of_what_can_be_read(tmp_path: Path) -> None:
    space = DesignSpace(0, 100, reference="impact")
    log = analyse([10, 20, 30, 40], [0.1, 0.2, 0.1, 0.3], space=space, strategy="even").to_log(tmp_path / "P01.mcap")
    with pytest.raises(InvalidValueError, match=r"says itself what it holds.*isiw show"):
        look(log)
    with pytest.raises(InvalidValueError, match=r"or a log \(\.mcap\)"):
        look(tmp_path / "P01.doc")
