from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout, pairs_of
from isiw.existing.reading import read_people

ISIS = [10.0, 20.5, 30.0, 40.0, 55.25]
MEPS = [0.123456789012, 0.2, 1.5, 0.75, 0.0]
IMPACT = Layout(reference="impact")


def trials_of(people: list[Delivered]) -> list[tuple[float | None, float | None]]:
    (person,) = people
    return [(trial.isi_ms, trial.mep_mv) for trial in person.trials]


def frame(isi: str = "isi_ms", mep: str = "mep_mv", factor: float = 1.0, **more: Any) -> pd.DataFrame:
    return pd.DataFrame({isi: ISIS, mep: [factor * mep_mv for mep_mv in MEPS], **more})


def written(table: pd.DataFrame, path: Path) -> Path:
    """The table in a file of the kind that its name says, as pandas writes it."""
    if path.suffix == ".xlsx":
        table.to_excel(path, index=False)
    elif path.suffix == ".parquet":
        table.to_parquet(path, index=False)
    else:
        table.to_csv(path, index=False, sep="\t" if path.suffix == ".tsv" else ",")
    return path


@pytest.mark.parametrize("suffix", [".csv", ".tsv", ".txt", ".xlsx", ".parquet"])
def test_a_table_of_another_program_is_read_to_the_last_digit(suffix: str, tmp_path: Path) -> None:
    path = written(frame(), tmp_path / f"P01{suffix}")
    (person,) = read_people(path, IMPACT)
    assert trials_of([person]) == list(zip(ISIS, MEPS, strict=True))
    assert person.subject == "P01"


def test_microvolts_become_the_nearest_millivolts() -> None:
    table = pd.DataFrame({"isi_ms": ISIS, "mep_uv": [10.4, 20.9, 35.7, 120.3, 1.1]})
    assert [mep_mv for _, mep_mv in trials_of(read_people(table, IMPACT))] == [0.0104, 0.0209, 0.0357, 0.1203, 0.0011]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_a_decimal_comma_and_any_encoding_are_read(encoding: str, tmp_path: Path) -> None:
    frame("ISI (ms)", "MEP [µV]", 1000.0).to_csv(
        tmp_path / "a.csv", sep=";", decimal=",", index=False, encoding=encoding
    )
    found = trials_of(read_people(tmp_path / "a.csv", IMPACT))
    assert np.allclose(np.array(found, dtype=float), np.array([ISIS, MEPS]).T, rtol=1e-12)


@pytest.mark.parametrize(
    ("isi", "mep", "factor", "units"),
    [
        ("ISI", "Amplitude", 1.0, ("ms", "mV")),
        ("Interstimulus interval (ms)", "MEP amplitude [uV]", 1000.0, ()),
        ("isi.ms", "MEP p2p (mV)", 1.0, ()),
        ("delay_ms", "ptp_V", 1e-3, ()),
        ("ISI", "peak-to-peak µV", 1000.0, ("ms",)),
    ],
)
def test_columns_are_found_by_their_names_and_units(isi: str, mep: str, factor: float, units: tuple[str, ...]) -> None:
    found = trials_of(read_people(frame(isi, mep, factor), Layout(reference="impact", units=units)))
    assert np.allclose(np.array(found, dtype=float), np.array([ISIS, MEPS]).T, rtol=1e-12)


def test_columns_are_those_that_are_named() -> None:
    table = pd.DataFrame({"a": ISIS, "b": MEPS, "isi_ms": 0.0, "mep_mv": 0.0})
    layout = Layout(reference="impact", columns=pairs_of("--column", ["isi=a", "mep=b"]), units=("ms", "mV"))
    assert trials_of(read_people(table, layout)) == list(zip(ISIS, MEPS, strict=True))


def test_each_person_and_day_of_a_file_is_somebody() -> None:
    table = frame(subject=["A", "B", "A", "B", "A"], day=[1, 1, 1, 1, 2])
    table = pd.concat([table, table.assign(isi_ms=table["isi_ms"] + 1)], ignore_index=True)
    people = read_people(table, IMPACT)
    assert [(one.subject, one.visit.day, len(one.trials)) for one in people] == [("A", 1, 4), ("B", 1, 4), ("A", 2, 2)]


def test_a_row_without_an_mep_is_lost_and_one_that_says_tms_is_tms_alone() -> None:
    table = pd.DataFrame({"isi_ms": ["10", "TMS alone", "20", "30"], "mep_mv": ["0.1", "0.2", "n/a", ""]})
    (person,) = read_people(table, IMPACT)
    assert [trial.is_control for trial in person.trials] == [False, True, False, False]
    assert [str(trial.reason) for trial in person.trials if trial.reason] == ["outcome unknown"] * 2


@pytest.mark.parametrize(("mark", "cell"), [("-1", -1.0), ("", None), ("none given", "none given")])
def test_the_mark_of_tms_alone_is_what_somebody_says(mark: str, cell: Any) -> None:
    table = pd.DataFrame({"isi_ms": pd.Series([10.0, cell, 20.0], dtype=object), "mep_mv": [0.1, 0.2, 0.3]})
    (person,) = read_people(table, Layout(reference="impact", alone=mark))
    assert [trial.is_control for trial in person.trials] == [False, True, False]


@pytest.mark.parametrize(
    "judged",
    [
        {"status": ["accepted", "mistrial", "ok", "bad", "1"]},
        {"exclude": [0, 1, 0, 1, ""]},
        {"Rejected": [None, "x", None, "yes", None]},
        {"valid": [True, False, True, False, True]},
    ],
)
def test_rows_that_the_file_excludes_are_lost(judged: dict[str, list[Any]]) -> None:
    (person,) = read_people(frame().assign(**judged), IMPACT)
    assert [trial.told for trial in person.trials] == [True, False, True, False, True]


def test_without_a_status_a_row_is_judged_as_in_a_session() -> None:
    table = pd.DataFrame({"isi_ms": [-3.0, 10, 20, 30], "mep_mv": [0.1, 55.0, 0.2, 0.3]})
    (person,) = read_people(table, IMPACT)
    assert [str(trial.reason or "") for trial in person.trials] == [
        "TMS before impact", "implausible amplitude", "", "",
    ]  # fmt: skip
    nominal = frame(commanded_isi_ms=[10.0, 60.0, 30.0, 40.0, 55.0])
    (person,) = read_people(nominal, IMPACT)
    assert [trial.told for trial in person.trials] == [True, False, True, True, True]


def test_blocks_and_dates_are_kept() -> None:
    (person,) = read_people(frame(block=[1, 1, 2, 2, 3], date=["2024-05-01 10:00"] * 5), IMPACT)
    assert person.blocks == {2: "2", 4: "3"}
    assert person.created.startswith("2024-05-01T10:00")


def test_cells_with_units_and_words_for_tms_alone_are_read_and_so_are_latencies_with_commas(tmp_path: Path) -> None:
    rows = "".join(
        f"{isi}ms;0,{isi} mV;21,{isi % 20}\nTS alone;0,{isi + 1} mV;21,{isi % 20}\n" for isi in range(10, 90)
    )
    (tmp_path / "P01.csv").write_text(f"ISI;MEP;latency\n{rows}")
    (person,) = read_people(tmp_path / "P01.csv", IMPACT)
    assert [trial.isi_ms for trial in person.trials][:3] == [10.0, None, 11.0]
    assert [trial.mep_mv for trial in person.trials][:3] == [0.1, 0.11, 0.11]


def test_times_with_decimal_commas_are_an_order(tmp_path: Path) -> None:
    rows = "".join(f"{6 * n},5;{10 + n};0,{30 + n}\n" for n in range(20))
    (tmp_path / "P01.csv").write_text(f"Zeit;ISI (ms);MEP (mV)\n{rows}")
    (person,) = read_people(tmp_path / "P01.csv", IMPACT)
    assert len(person.trials) == 20


@pytest.mark.parametrize(
    ("dates", "given_by"),
    [
        (["2024-05-01 10:00Z", "2024-05-01 10:01Z"], "2024-05-01T10:01:00+00:00"),
        (["2024-05-01 10:00+02:00", "2024-05-01 10:01+02:00"], "2024-05-01T08:01:00+00:00"),
        (["2024-05-01 10:00", "2024-05-01 10:01"], "2024-05-01T22:01:00+00:00"),
        (["2024-05-01 10:00Z", "2024-05-01 10:00Z"], "2024-05-02T10:00:00+00:00"),
        (["2024-05-01", "2024-05-01"], "2024-05-02T12:00:00+00:00"),
        (["2024-05-01 10:00Z", ""], ""),
        (["", ""], ""),
    ],
    ids=["times", "zone", "any zone", "one time", "a day", "not all", "none"],
)
def test_trials_were_given_at_the_latest_when_their_dates_allow(dates: list[str], given_by: str) -> None:
    table = pd.DataFrame({"isi_ms": [10.0, 20.0], "mep_mv": [0.1, 0.2], "date": dates})
    (person,) = read_people(table, IMPACT)
    assert person.given_by == given_by


WRITTEN: dict[str, tuple[str, str, dict[str, Any]]] = {
    "grouped thousands and a decimal comma": (
        "ISI (ms);MEP (µV)\n", "10,0;123,456789012\n20,5;200\n30;1.500,0\n40;750\n55,25;0,0\n", {},
    ),
    "grouped thousands and a decimal point": (
        "ISI (ms),MEP (uV)\n", '10.0,123.456789012\n20.5,200\n30,"1,500"\n40,750\n55.25,0\n', {},
    ),
    "points among words, and commas among numbers alone": (
        "ISI (ms);MEP (µV)\n", "10.0;123,456789012\n20.5;200,0\n30.0;1500,0\n40.0;750,0\n55.25;0,0\n", {},
    ),
    "thousands grouped by blanks": (
        "ISI (ms);MEP (uV)\n", "10,0;123,456789012\n20,5;200\n30;1 500,0\n40;750\n55,25;0\n", {},
    ),
    "units below the names": ("ISI\tMEP\nms\tmV\n", "\t", {}),
    "units in the cells": (
        "ISI,MEP\n", "10 ms,0.123456789012 mV\n20.5 ms,0.2 mV\n30 ms,1.5 mV\n40 ms,0.75 mV\n55.25 ms,0 mV\n", {},
    ),
    "units below the names, and others that are none of these": ("ISI,MEP,HR\nms,mV,bpm\n", ",", {}),
    "units as words": ("ISI milliseconds,MEP_in_millivolts\n", ",", {}),
    "a title and comments above": ("Paired pulses: ISI, MEP\n# of 2024\n\nisi_ms,mep_mv\n", ",", {}),
    "what Excel writes about the separator": ("sep=;\nisi_ms;mep_mv\n", ";", {}),
    "bars": ("isi_ms|mep_mv\n", "|", {}),
    "blanks": ("  isi_ms   mep_mv\n", "   ", {}),
    "rows that R numbers": (
        '"isi_ms","mep_mv"\n', '"1",10,0.123456789012\n"2",20.5,0.2\n"3",30,1.5\n"4",40,0.75\n"5",55.25,0\n', {},
    ),
    "other names": ("IPI (ms),Peak-to-peak amplitude (mV)\n", ",", {}),
    "a decimal sign that is stated": (
        "ISI (ms);MEP (mV)\n", "10;0,123456789012\n20,5;0,2\n30;1,500\n40;0,75\n55,25;0\n", {"decimal": ","},
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", WRITTEN)
def test_tables_as_other_programs_write_them_are_read(kind: str, tmp_path: Path) -> None:
    head, body, said = WRITTEN[kind]
    if "\n" not in body:
        body = "".join(f"{isi_ms}{body}{mep_mv}\n" for isi_ms, mep_mv in zip(ISIS, MEPS, strict=True))
    (tmp_path / "P01.csv").write_text(head + body, encoding="utf-8")
    found = trials_of(read_people(tmp_path / "P01.csv", Layout(**{"reference": "impact", **said})))
    assert np.allclose(np.array(found, dtype=float), np.array([ISIS, MEPS]).T, rtol=1e-12)


def test_of_a_workbook_the_sheet_with_trials_is_read_and_several_are_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "P01.xlsx"
    with pd.ExcelWriter(path) as book:
        pd.DataFrame({"note": ["FCR"]}).to_excel(book, sheet_name="About", index=False)
        frame().to_excel(book, sheet_name="Trials", index=False, startrow=2)
        book.sheets["Trials"]["A1"] = "Participant 7"
    assert trials_of(read_people(path, IMPACT)) == list(zip(ISIS, MEPS, strict=True))
    with pd.ExcelWriter(path) as book:
        for name in ("one", "two"):
            frame().to_excel(book, sheet_name=name, index=False)
    with pytest.raises(IsiwError, match="--sheet NAME"):
        read_people(path, IMPACT)
    assert len(read_people(path, Layout(reference="impact", sheet="two"))) == 1
    with pytest.raises(IsiwError, match="one of one, two"):
        read_people(path, Layout(reference="impact", sheet="three"))


def test_an_index_with_a_name_is_a_column(tmp_path: Path) -> None:
    table = frame(subject=list("AABBB")).set_index("subject")
    table.to_parquet(tmp_path / "all.parquet")
    for source in (table, tmp_path / "all.parquet"):
        assert [one.subject for one in read_people(source, IMPACT)] == ["A", "B"]
    nested = pd.DataFrame(frame().to_numpy(), columns=pd.MultiIndex.from_tuples([("isi", "ms"), ("mep", "mV")]))
    assert trials_of(read_people(nested, IMPACT)) == list(zip(ISIS, MEPS, strict=True))


@pytest.mark.parametrize(
    ("days", "numbers"),
    [
        (["ses-01", "ses-02"], [1, 2]),
        (["pre", "post"], [1, 2]),
        (["2", "3"], [2, 3]),
        (["2024-05-01", "2024-06-01"], [1, 2]),
    ],
)
def test_days_are_numbers_in_their_names_or_are_counted(days: list[str], numbers: list[int]) -> None:
    people = read_people(frame(session_id=[days[0], days[0], days[1], days[1], days[1]]), IMPACT)
    assert [(one.visit.day, len(one.trials)) for one in people] == list(zip(numbers, [2, 3], strict=True))


def test_each_column_has_a_unit_of_its_own() -> None:
    table = frame().assign(**{"nominal ISI (s)": [isi / 1e3 for isi in ISIS], "background (mV)": [0.002] * 5})
    (person,) = read_people(table, IMPACT)
    assert [trial.commanded_isi_ms for trial in person.trials] == pytest.approx(ISIS)
    assert [trial.background_rms_uv for trial in person.trials] == [2.0] * 5


HEAD = "isi_ms,mep_mv\n"
BROKEN: dict[str, tuple[str, dict[str, Any], str]] = {
    "no reference": (HEAD + "10,0.1\n20,0.2\n", {"reference": None}, "--reference"),
    "no unit of the ISI": ("ISI,mep_mv\n10,0.1\n20,0.2\n", {}, "--unit with ms or s"),
    "no unit of the MEP": ("isi_ms,MEP\n10,0.1\n20,0.2\n", {}, "--unit with mV, uV or V"),
    "microvolt as millivolt": (HEAD + "10,120\n20,250\n30,90\n", {}, "--unit uV"),
    "volt as millivolt": (HEAD + "10,0.0001\n20,0.0003\n30,0.0002\n", {}, "--unit V"),
    "seconds as milliseconds": (HEAD + "0.01,0.1\n0.02,0.3\n0.03,0.2\n", {}, "--unit s"),
    "microseconds as milliseconds": (HEAD + "10000,0.1\n20000,0.3\n30000,0.2\n", {}, "--unit us"),
    "swapped": (HEAD + "0.11,10\n0.52,20\n0.33,10\n0.24,20\n0.75,10\n0.4,20\n", {}, "swapped"),
    "text in the MEPs": (HEAD + "10,0.1\n20,artefact\n30,0.2\n", {}, "row 2 of the column 'mep_mv'"),
    "text in the ISIs": (HEAD + "10,0.1\nlong,0.3\n30,0.2\n", {}, "row 2 of the column 'isi_ms'"),
    "infinite": (HEAD + "10,inf\n20,0.3\n", {}, "is no number"),
    "negative": (HEAD + "10,-0.1\n20,0.3\n", {}, "is no amplitude"),
    "more than an amplifier gives": (HEAD + "10,5000\n20,0.3\n", {}, "is no amplitude"),
    "no ISI column": ("when,mep_mv\n10,0.1\n", {}, '--column "isi=NAME"'),
    "no MEP column": ("isi_ms,emg\n10,0.1\n", {}, '--column "mep=NAME"'),
    "two MEP columns": ("isi_ms,MEP (mV),mep_mv\n10,0.1,0.2\n", {}, '--column "mep=MEP \\(mV\\)"'),
    "a column that is not there": (HEAD + "10,0.1\n", {"columns": {"isi": "ISI ms"}}, "no such column"),
    "rows without an ISI": (HEAD + "10,0.1\n,0.3\n20,0.2\n", {}, "--alone"),
    "no pair": (HEAD + "tms,0.1\ntms,0.3\n", {}, "no pair of stimuli"),
    "no rows": (HEAD, {}, "no rows"),
    "nothing": ("", {}, "no table that can be read"),
    "empty lines": (HEAD + ",\n,\n", {}, "has no trials"),
    "a comma that may be of thousands": ("isi_ms;mep_mv\n10;1,250\n20;2,300\n", {}, "--decimal ,"),
    "a comma among points": ("isi_ms;mep_mv\n10;0.5\n20;1.250,5\n", {}, "decimal commas and decimal points"),
    "an unknown status": ("isi_ms,mep_mv,status\n10,0.1,perhaps\n", {}, "neither yes nor no"),
    "no date": ("isi_ms,mep_mv,date\n10,0.1,yesterday\n20,0.3,yesterday\n", {}, "is no date"),
    "more cells than names": (HEAD + "10,0.1\n20,0.3,4,5\n", {}, "no table that can be read"),
    "a decimal comma that also separates": (HEAD + "10,5,0,1\n20,5,0,2\n", {}, "another separator"),
    "a point that may be of thousands": ("isi_ms;mep_uv\n10;1.250\n20;980\n", {}, "--decimal"),
    "a trial in two rows": ("trial,isi_ms,mep_mv\n1,10,0.1\n1,10,0.3\n2,20,0.2\n", {}, "'1'.*Leave one row"),
    "a person in some rows only": ("subject,isi_ms,mep_mv\nA,10,0.1\n,20,0.3\n", {}, "into each row"),
    "two files in one": (HEAD + "10,0.1\n20,0.3\n" + HEAD + "10,0.2\n", {}, "row 3 of the column 'isi_ms'"),
    "milliseconds in a column of seconds": ("isi_s,mep_mv\n10,0.1\n20,0.3\n30,0.2\n", {}, "--unit ms"),
    "millivolts in µV that are small": ("isi_ms,mep_uv\n10,0.1\n20,3\n30,1.2\n", {}, "--unit mV"),
    "millivolts in a column of microvolts": ("isi_ms,mep_uv\n10,0.1\n20,0.3\n30,0.2\n", {}, "--unit mV"),
    "bytes": ("\0\1\0\1\2\1\2", {}, "is no text"),
    "an ISI that is empty": (HEAD + "single,.1\n,.9\n20,.2\n30,.3\n", {"alone": "single"}, "1 row has an amplitude"),
    "names that pandas numbered": (HEAD[:-1] + ",mep_mv.1\n10,.1,.3\n20,.3,.4\n", {}, "mep; got 'mep_mv or mep_mv.1'"),
    "a time between trials": ("Interval (s),Delay (ms),mep_mv\n4.9,10,.1\n4.8,20,.1\n", {}, "Interval .s. or Delay"),
    "an intensity": ("isi_ms,Amplitude (V),p2p (mV)\n10,4.5,.1\n20,4.5,.1\n", {}, "Amplitude .V. or p2p"),
    "two conditions": ("condition,isi_ms,mep_mv\ncontrol,10,0.1\ntest,20,0.3\ncontrol,40,0.5\n", {},
                       "says TMS alone, and the ISI there is 10; got 'control'"),
    "one column": ("isi_ms mep_mv;\n10 0.1;\n", {}, "--column"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_table_ends_in_a_sentence_that_says_what_to_do(kind: str, tmp_path: Path) -> None:
    content, said, expected = BROKEN[kind]
    (tmp_path / "P01.csv").write_text(content)
    with pytest.raises(IsiwError, match=expected) as refused:
        read_people(tmp_path / "P01.csv", Layout(**{"reference": "impact", **said}))
    assert len(str(refused.value)) < 500
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_or_is_an_older_workbook_is_refused(tmp_path: Path) -> None:
    with pytest.raises(IsiwError, match="no such file"):
        read_people(tmp_path / "b.csv", IMPACT)
    (tmp_path / "a.xlsx").write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")
    with pytest.raises(IsiwError, match="without a password"):
        read_people(tmp_path / "a.xlsx", IMPACT)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"isi_ms": [-5.0, -10.0], "mep_mv": [0.1, 0.2]}, "TMS before impact"),
        ({"isi_ms": [5.0, 10.0], "mep_mv": [None, None]}, "outcome unknown"),
        ({"isi_ms": [5.0, 10.0], "mep_mv": [0.1, 0.2], "bad": [1, 1]}, "rejected"),
        ({"isi_ms": [30.0] * 4, "mep_mv": [0.1, 0.2, 0.3, 0.4]}, "all the same"),
    ],
)
def test_why_no_trial_counts_is_said(table: dict[str, Any], says: str) -> None:
    (person,) = read_people(pd.DataFrame(table), IMPACT)
    with pytest.raises(IsiwError, match=says):
        person.space()


def test_tms_alone_has_its_intensity_where_it_is_not_that_of_all_pairs(tmp_path: Path) -> None:
    isis_ms, pct_rmt = ["10", "TMS alone", "20", "TMS alone", "30"], [95, 95, 95, 120, 95]
    table = pd.DataFrame({"isi_ms": isis_ms, "mep_mv": [0.1, 0.2, 0.3, 0.9, 0.2], "intensity_pct_rmt": pct_rmt})
    table.to_csv(tmp_path / "a.csv", index=False)
    (person,) = read_people(tmp_path / "a.csv", IMPACT)
    assert [trial.intensity_pct_rmt for trial in person.trials] == [None, None, None, 120.0, None]
    assert person.visit.intensity_pct_rmt == 95.0
    wrong = table.assign(intensity_pct_rmt=table["intensity_pct_rmt"] / 100)
    with pytest.raises(IsiwError, match=r"row 1 .*% of the resting motor threshold"):
        read_people(wrong, IMPACT)


def test_pairs_of_several_intensities_are_asked_about() -> None:
    table = pd.DataFrame({"isi_ms": [10, 20, 30, 40], "mep_mv": 0.2, "intensity_pct_rmt": [110, 110, 130, 130]})
    with pytest.raises(IsiwError, match=r"several intensities; got '110, 130 % RMT'.*--where \"intensity_pct_rmt=110"):
        read_people(table, IMPACT)
    exported = table.assign(intensity_pct_rmt=[math.nan, math.nan, 130, 130])  # as in isiw.s tables
    with pytest.raises(IsiwError, match=r"several intensities; got '130 % RMT, and some say none'"):
        read_people(exported, IMPACT)
    for wanted, count in (("130", 2), ("*", 4)):
        (person,) = read_people(table, IMPACT.saying(where={"intensity_pct_rmt": wanted}))
        assert len(person.trials) == count
