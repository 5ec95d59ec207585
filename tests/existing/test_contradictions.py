"""Files that say something twice, half, or in a way that can be read in two ways: read rightly, or asked about."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.io

import isiw
from existing.test_tables import IMPACT, trials_of
from existing.test_waves import COLUMNS, EMG_MV, TRIGGERS, lines, read, trigger
from existing.writers import KNOWN, NAMES, epochs, raw
from isiw.errors import InvalidValueError
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people


def of_text(text: str, folder: Path, **said: Any) -> list[Delivered]:
    (folder / "P01.csv").write_text(text, encoding="utf-8")
    return read_people(folder / "P01.csv", Layout(**{"reference": "impact", **said}))


@pytest.mark.parametrize(
    "text",
    [
        "Nr;ISI (ms);MEP (mV);Latency\n1;10;0,15;22,4;\n2;20;0,3;21,4;\n3;40;0,5;20,1;\n",
        "trial,isi_ms,mep_mv\n1,10,0.15,\n2,20,0.3,\n3,40,0.5,\n",
        "P01 session\nisi_ms,mep_mv,comment\n10,0.15\n20,.3,ok\n40,.5\n",
        "isi_ms,mep_mv\n# pause\n10,0.15\n20,.3\n# pause\n40,.5\n",
        "id,isi_ms,mep_mv\n1,10,0.15\n2,20,.3\n3,40,.5\n",
        "isi_ms,mep_mv\n10,0.15\n20,.3\n40,.5\n\nRMT: 48 % MSO, coil: D70\n",
    ],
    ids=["a sign at each end", "R's numbers", "cells left out", "remarks", "an id of trials", "a foot"],
)
def test_rows_and_names_fit_each_other(text: str, tmp_path: Path) -> None:
    assert trials_of(of_text(text, tmp_path)) == [(10, 0.15), (20, 0.3), (40, 0.5)]


@pytest.mark.parametrize("filler", ["0", "-1", "-1.0", ""])
def test_a_condition_says_what_is_tms_alone_whatever_stands_for_its_isi(filler: str, tmp_path: Path) -> None:
    text = f"condition,isi_ms,mep_mv\nsingle,{filler},0.1\npaired,20,0.3\nsingle,{filler},.12\npaired,40,0.5\n"
    assert trials_of(of_text(text, tmp_path)) == [(None, 0.1), (20, 0.3), (None, 0.12), (40, 0.5)]


def test_a_condition_that_contradicts_an_isi_is_asked_about(tmp_path: Path) -> None:
    text = "condition,isi_ms,mep_mv\nsingle,90,0.1\npaired,20,0.3\npaired,40,0.5\n"
    with pytest.raises(InvalidValueError, match=r"row 1 .* says TMS alone, and the ISI there is 90"):
        of_text(text, tmp_path)
    assert trials_of(of_text(text, tmp_path, alone="90")) == [(None, 0.1), (20, 0.3), (40, 0.5)]


def test_a_condition_says_what_is_a_tap_alone_and_others_are_named(tmp_path: Path) -> None:
    (person,) = of_text("condition,isi_ms,mep_mv\ntap only,50,.01\npaired,20,0.3\npaired,40,0.5\n", tmp_path)
    assert [trial.tap_alone for trial in person.trials] == [True, False, False]
    assert person.unused == ()
    (person,) = of_text("condition,isi_ms,mep_mv\nrest,50,.01\nrest,20,0.3\nactive,40,0.5\n", tmp_path)
    assert person.unused == ("condition",)


@pytest.mark.parametrize(("mark", "cell"), [("-1", "-1.0"), ("0", "0.0"), ("-1.0", "-1"), ("-1", "-1,0")])
def test_a_mark_is_a_number_however_it_is_written(mark: str, cell: str, tmp_path: Path) -> None:
    text = f"isi_ms;mep_mv\n{cell};0.1\n20;0.3\n40;0.5\n"
    assert trials_of(of_text(text, tmp_path, alone=mark)) == [(None, 0.1), (20, 0.3), (40, 0.5)]


def test_structures_of_matlab_with_the_same_names_are_asked_about(tmp_path: Path) -> None:
    path, isis_ms, meps_mv = tmp_path / "P01.mat", [10.0, 20.0, 40.0], [0.15, 0.3, 0.5]
    one = {"isi_ms": isis_ms, "mep_mv": meps_mv}
    scipy.io.savemat(path, {"day1": one, "day2": {"isi_ms": [1.0, 2.0, 3.0], "mep_mv": [0.1, 0.1, 0.1]}})
    with pytest.raises(InvalidValueError, match=r"day1\.isi_ms, day1\.mep_mv, day2\.isi_ms"):
        read_people(path, IMPACT)
    named = Layout(reference="impact", columns={"isi": "day1.isi_ms", "mep": "day1.mep_mv"})
    assert trials_of(read_people(path, named)) == list(zip(isis_ms, meps_mv, strict=True))
    scipy.io.savemat(path, {"trials": [dict(zip(one, pair, strict=True)) for pair in zip(*one.values(), strict=True)]})
    assert trials_of(read_people(path, IMPACT)) == list(zip(isis_ms, meps_mv, strict=True))
    scipy.io.savemat(path, {**one, "t": np.arange(1000.0)})
    assert trials_of(read_people(path, IMPACT)) == list(zip(isis_ms, meps_mv, strict=True))


@pytest.mark.slow
def test_a_sampling_rate_is_compared_with_the_times_in_the_file(tmp_path: Path) -> None:
    taps, pulses = trigger("tap"), trigger("pulse")
    text = lines(EMG_MV, taps, pulses)
    with pytest.raises(InvalidValueError, match=r"the column 'time' of P01\.txt says.* 4000 Hz"):
        read(tmp_path, text, f"rate_hz = 5000\n{COLUMNS}[channels]\n{TRIGGERS}")
    assert len(read(tmp_path, text, f"rate_hz = 4000\n{COLUMNS}[channels]\n{TRIGGERS}").trials) == 6
    with pytest.raises(InvalidValueError, match="several columns"):
        read(tmp_path, text, f"rate_hz = 4000\n{COLUMNS.replace('time', 'EMG')}[channels]\n{TRIGGERS}")
    with pytest.raises(InvalidValueError, match="If they are in mV, say --unit mV"):
        read(tmp_path, text, f"rate_hz = 4000\n{COLUMNS.replace('mV', 'uV')}[channels]\n{TRIGGERS}")


def test_a_cell_of_vectors_is_no_column(tmp_path: Path) -> None:
    cell = np.empty(3, dtype=object)
    cell[:] = [np.array([0.1, 0.2]), np.array([0.3, 0.4, 0.5]), np.array([0.2])]
    scipy.io.savemat(tmp_path / "P01.mat", {"isi_ms": [20.0, 40.0, 60.0], "mep_mv": cell})
    with pytest.raises(InvalidValueError, match=r"no column of P01\.mat is known to hold the amplitudes"):
        read_people(tmp_path / "P01.mat", Layout(reference="impact"))


def test_a_matrix_of_matlab_is_found_or_asked_about(tmp_path: Path) -> None:
    path, sweeps = tmp_path / "P01.mat", np.zeros((3, 100))
    layout = Layout("impact", units=("mV",), alone="", rate_hz=4000.0, pulse_at_ms=10.0, channels={"emg": "sweeps"})
    times = {"sweeps": sweeps, "t": np.arange(100) / 4000 - 0.005}
    for arrays, asked in (
        ({"sweep": sweeps}, "no such array"),
        ({"sweeps": sweeps[:, :, None] + np.zeros(2)}, "3 × 100 × 2 samples"),
        ({"sweeps": sweeps, "fs": 2000.0}, "'fs' of P01.mat says"),
        (times, "where 't' of P01.mat is 0; got '10 ms'; expected '?5 ms"),
    ):
        scipy.io.savemat(path, {"isi_ms": [10.0, 20.0, 30.0], **arrays})
        with pytest.raises(InvalidValueError, match=asked):
            read_people(path, layout)


def test_sweeps_that_are_marked_as_bad_do_not_count() -> None:
    recording = raw()
    third_s = [one["onset"] for one in recording.annotations if one["description"] == NAMES["pulse"]][2]
    recording.annotations.append(third_s - 0.1, 0.3, "BAD_cough")
    (person,) = read_people(recording, KNOWN)
    assert [trial.told for trial in person.trials] == [True, True, False, True, True, True]


def silent(**said: Any) -> Any:
    """Epochs whose annotations say nothing."""
    return epochs(**said).set_annotations(None)


@pytest.mark.slow
def test_the_metadata_of_epochs_are_read_as_the_columns_of_a_table() -> None:
    (person,) = read_people(epochs(exclude=[0, 1, 0, 0, 0, 0], note="x"), KNOWN)
    assert [trial.told for trial in person.trials] == [True, False, True, True, True, True]
    assert person.unused == ("note",)
    for said, asked in (({"subject": [*"AABBBB"]}, "several people"), ({"n_averaged": 8}, "rows of .* are means of")):
        with pytest.raises(InvalidValueError, match=asked):
            read_people(epochs(**said), KNOWN)
    (person,) = read_people(silent(condition=["paired"] * 4 + ["single"] * 2, isi_ms=[30.0, 60, 90, 120, 0, 0]), KNOWN)
    assert [trial.isi_ms is None for trial in person.trials] == [False] * 4 + [True] * 2
    (person,) = read_people(silent(isi_ms=[30.0, 60, 90, 120, -45, -45]), KNOWN)
    assert [str(trial.reason or "") for trial in person.trials][-2:] == ["TMS before impact"] * 2


def dated(*dates: str, **more: list[Any]) -> list[Delivered]:
    return read_people(pd.DataFrame({"isi_ms": [10.0, 20, 30, 40], "mep_mv": 0.1, "date": dates, **more}), IMPACT)


@pytest.mark.parametrize(
    ("dates", "trials_of_days"),
    [
        (["2026-12-01 23:50", "2026-12-01 23:59", "2026-12-02 00:05", "2026-12-02 01:10"], [4]),
        (["2026-12-01T12:50+13:00", "2026-12-01T12:59+13:00", "2026-12-01T13:05+13:00", "2026-12-01T13:10+13:00"], [4]),
        (["2026-10-25T02:40+02:00", "2026-10-25T02:59+02:00", "2026-10-25T02:05+01:00", "2026-10-25T02:20+01:00"], [4]),
        (["2026-12-01 23:50", "2026-12-02 00:05", "2026-12-02 09:00", "2026-12-02 09:05"], [2, 2]),
        (["2026-12-01 09:00", "2026-12-01 18:00", "2026-12-02 00:05", "2026-12-02 00:10"], [2, 2]),
        (["2026-12-01", "2026-12-01", "2026-12-02", "2026-12-02"], [2, 2]),
    ],
)
def test_a_session_that_goes_on_after_midnight_is_of_one_day(dates: list[str], trials_of_days: list[int]) -> None:
    assert [len(one.trials) for one in dated(*dates)] == trials_of_days


def test_days_come_first_with_points_and_slashes_are_asked_about() -> None:
    people = dated("31.01.2024", "31.01.2024", "01.02.2024", "01.02.2024")
    assert [(one.visit.day, one.created[:10]) for one in people] == [(1, "2024-01-31"), (2, "2024-02-01")]
    (person,) = dated(*["10.01.2024 9:05"] * 4)
    assert person.created.startswith("2024-01-10T09:05")
    (person,) = dated(*["01/13/2024"] * 4)
    assert person.created.startswith("2024-01-13")
    assert dated(*["2024-01-10_10h22.31.554"] * 4)[0].created.startswith("2024-01-10T10:22:31.554")  # of PsychoPy
    with pytest.raises(InvalidValueError, match="Write dates as 2026-01-31"):
        dated(*["10/01/2024"] * 4)
    (person,) = dated("2024-01-31", "", "", "")
    assert person.visit.day is None
    with pytest.raises(InvalidValueError, match="Write the day into each row"):
        dated("2024-01-31", "", "2024-02-20", "")
    with pytest.raises(InvalidValueError, match="Write the day into each row"):
        dated(*["2024-01-31"] * 4, day=[1, "", 2, ""])
    (person,) = dated(*[""] * 4, time=["31.01.2024 10:00", "31.01.2024 10:01", "01.02.2024 10:00", "01.02.2024 10:01"])
    assert len(person.trials) == 4


def test_what_is_masked_or_comes_before_the_impact_does_not_count() -> None:
    space = isiw.DesignSpace(0, 100, reference="impact")
    isis_ms = np.ma.array([10.0, 20.0, 50.0, -10.0], mask=[False, False, True, False])
    meps_mv = np.ma.array([0.1, 0.2, 9.9, 0.1], mask=[False, False, True, False])
    trials = isiw.analyse(isis_ms, meps_mv, space=space, particles=20).record.table
    assert [str(trial.reason or "") for trial in trials] == ["", "", "outcome unknown", "TMS before impact"]
    with pytest.raises(InvalidValueError, match="the ISIs are not numbers"):
        isiw.analyse(["10", "x"], [0.1, 0.2], space=space)


def test_what_pandas_holds_for_missing_is_empty() -> None:
    table = pd.DataFrame({"isi_ms": [10, 20, None, 30], "mep_mv": [0.1, 0.2, None, 0.4]}).convert_dtypes()
    assert trials_of(read_people(table, IMPACT)) == [(10, 0.1), (20, 0.2), (30, 0.4)]


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("#isi_ms,mep_mv\n10,0.15\n#15,0.2\n20,.3\n40,.5\n", [10, 20, 40]),
        ("#isi_ms,mep_mv\n10,0.15\n# pause\n20,.3\n#isi_ms,mep_mv\n40,.5\n", [10, 20, 40]),
        ("#isi_ms,mep_mv\n10,0.15\n20,.3\n40,.5\n#time,force,x\n75,1.1,4\n", [10, 20, 40]),
        ("isi_ms,mep_mv,note\n10,0.15\n20,.3,ok\nisi_ms,mep_mv,note\n40,.5,ok\n50,.6,ok\n", None),
        ("#isi_ms,mep_mv\n10,0.15\n20,.3\n#time,force\n75,1.1\n", None),
    ],
    ids=["a trial left out", "names again after #", "another part", "names again", "another part of as many columns"],
)
def test_no_trial_is_lost_where_a_line_stands_between_them(text: str, kept: list[int] | None, tmp_path: Path) -> None:
    if kept is not None:
        assert [isi_ms for isi_ms, _ in trials_of(of_text(text, tmp_path))] == kept
        return
    with pytest.raises(InvalidValueError, match=r"is no number|may say that the trial"):
        of_text(text, tmp_path)


@pytest.mark.parametrize("name", ["label", "subject", "trial"])
def test_a_title_between_trials_is_asked_about_and_a_footer_is_not(name: str, tmp_path: Path) -> None:
    rows = [f"{n if name == 'trial' else ''},{10 * n},{0.1 * n:.1f}" for n in range(1, 6)]
    text = f"{name},isi_ms,mep_mv\n" + "\n".join([*rows[:2], "FDI,,", *rows[2:]]) + "\n"
    with pytest.raises(InvalidValueError, match=rf"row 3 of the column '{name}' .* has a word and no trial"):
        of_text(text, tmp_path)
    (person,) = of_text(text.replace("FDI,,\n", "") + "Exported by LabApp,,\n", tmp_path)
    assert len(person.trials) == 5


@pytest.mark.parametrize(("bad", "good"), [("excluded", ""), ("bad", "ok"), ("rejected", "accepted"), ("yes", "no")])
@pytest.mark.parametrize("name", ["exclude", "artifacts", "status"])
def test_what_a_cell_calls_a_trial_holds_whatever_its_column_asks(
    name: str, bad: str, good: str, tmp_path: Path
) -> None:
    if name == "status" and bad == "yes":
        bad, good = good, bad
    rows = "".join(f"{isi},{isi / 100},{bad if isi == 20 else good}\n" for isi in (10, 20, 40, 50))
    (person,) = of_text(f"isi_ms,mep_mv,{name}\n{rows}", tmp_path)
    assert [trial.told for trial in person.trials] == [True, False, True, True]


def test_a_column_that_is_called_tms_alone_says_it_or_contradicts_an_isi(tmp_path: Path) -> None:
    text = "isi_ms,mep_mv,single_pulse\n,0.1,yes\n20,.3,no\n0,.12,yes\n40,.5,no\n"
    assert trials_of(of_text(text, tmp_path)) == [(None, 0.1), (20, 0.3), (None, 0.12), (40, 0.5)]
    with pytest.raises(InvalidValueError, match=r"row 1 of the column 'single_pulse' .* and the ISI there is 30"):
        of_text(text.replace("\n,", "\n30,"), tmp_path)
    (person,) = of_text("isi_ms,mep_mv,single_pulse\n10,.1,.2\n20,.3,.2\n40,.5,.2\n", tmp_path)
    assert person.unused == ("single_pulse",)


@pytest.mark.parametrize(("name", "others"), [("reason", ""), ("condition", "paired"), ("type", ""), ("note", "")])
@pytest.mark.parametrize("word", ["artefact", "#bad", "exclude: hum"])
def test_a_word_that_excludes_a_trial_is_asked_about_in_any_column(
    name: str, others: str, word: str, tmp_path: Path
) -> None:
    rows = "".join(f"{isi},{isi / 100},{word if isi == 20 else others}\n" for isi in (10, 20, 40, 50))
    with pytest.raises(InvalidValueError, match=r"row 2 .* may say that the trial does not count"):
        of_text(f"isi_ms,mep_mv,{name}\n{rows}", tmp_path)
