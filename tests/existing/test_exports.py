"""What exports of labs' programs say in names, titles, remarks and cells: it is read, or asked about in a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pandas as pd
import pytest
import scipy.io

from existing.test_doubtful_numbers import ALONE, ISIS, MEPS, STATED, few, table
from existing.test_tables import IMPACT, trials_of
from isiw.errors import IsiwError
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

EMPTY_IS_ALONE = Layout("impact", alone="")
KEPT = few(bad=False, good=True)
WAY_OUT = r'--where "MEP \(mV\)=\*"'


@pytest.mark.parametrize(
    "name",
    ["nMEP", "MEP_n", "MEP/TS", "MEP (re TS)", "MEP (x test)", "cond/test", "MEP (times TS)", "MEPcond_MEPtest",
     "MEP index", "MEP_detrended", "adjusted MEP", "standardised MEP", "MEP centered", "iEMG (mV)", "Rect. EMG (mV)",
     "ARV (mV)", "MEP power (mV)", "MEP counts", "MEP pourcentage", "MEP porcentaje", "MEPcond/MEPtest", "Aire MEP",
     "Amplitude Basis-Spitze", "Amplitude base-crête", "negative peak (mV)"],
)  # fmt: skip
def test_other_measures_and_what_is_relative_are_known_by_more_names(name: str) -> None:
    with pytest.raises(IsiwError, match=r"are (relative to others|of another measure)"):
        read_people(table(mep=name), STATED.saying(columns={"mep": name}))


LINES = {
    "to be relative":
        "MEPs expressed as % Mmax | Amplitudes relative to TMS alone | z-scored MEPs | "
        "log-transformed MEP amplitudes | All MEPs divided by their mean in TS | "
        "Amplitude: conditioned / test | Amplituden bezogen auf TMS allein",
    "to be means of several trials":
        "amplitudes averaged over 4 pulses | averages of 3 sweeps each | Sweeps averaged: 4",
    "which trials do not count":
        "omit #4 #9 | excluded trials: 4, 17 | artefacts in trials 3 and 8 | Ausgeschlossen: Nr. 7 und 12",
    "to be multiplied": "MEP amplitudes (x10) | MEP in 10 µV",
    "to be of another measure": "rectified MEP areas | Baseline-to-peak amplitudes",
    "counts ISIs from another event": "ISIs are counted from the solenoid trigger",
    "says a gain": "Amplifier gain: 1000 | EMG verstärkt, Verstärkung 500",
}  # fmt: skip


@pytest.mark.parametrize(
    ("line", "says"), [(line, says) for says, lines in LINES.items() for line in lines.split(" | ")]
)
def test_a_line_above_or_below_the_trials_says_what_they_are(line: str, says: str, tmp_path: Path) -> None:
    rows, path = table().to_csv(index_label="trial", sep=";"), tmp_path / "P01.csv"
    for text in (f"{line}\n{rows}", f"{rows}\n{line}\n", f"# {line}\n{rows}"):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(IsiwError, match=rf"{says}.*{WAY_OUT}"):
            read_people(path, EMPTY_IS_ALONE)
        assert len(trials_of(read_people(path, EMPTY_IS_ALONE.saying(where={"MEP (mV)": "*"})))) == 48


@pytest.mark.parametrize(
    "line",
    ["TMS at 120 % of rMT; ISI 10-190 ms, 4 trials of each, ITI 5 s x 50", "valve-driven tapper, ISIs from impact",
     "Experiment 3 (bad weather)", "Mean RMT 45 %", "p2p amplitudes, no trials excluded", "each ISI repeated 4 times",
     "Artefact rejection 100 µV; excluded: 3 trials", "Filter 20-2000 Hz, gain 1000, amplitudes at the electrodes",
     "MEPs at delays relative to the impact", "Afferent inhibition and MEP amplitudes, day 2", "gain 1",
     "exported on 31 January by Signal 7"],
)  # fmt: skip
def test_other_lines_are_not_asked_about(line: str, tmp_path: Path) -> None:
    (tmp_path / "P01.csv").write_text(f"{line}\n{table().to_csv(index=False, sep=';')}", encoding="utf-8")
    assert len(trials_of(read_people(tmp_path / "P01.csv", EMPTY_IS_ALONE))) == 48


@pytest.mark.parametrize(
    ("name", "says"),
    [("Delay from trigger (ms)", "counts from a trigger"), ("trigger-TMS delay (ms)", "counts from a trigger"),
     ("ISI (TMS to tap) (ms)", "the pulse came before the tap"), ("tap after TMS (ms)", "the pulse came before")],
)  # fmt: skip
def test_isis_of_a_trigger_or_up_to_the_tap_are_asked_about(name: str, says: str) -> None:
    layout = STATED.saying(columns={"isi": name})
    with pytest.raises(IsiwError, match=says):
        read_people(table(isi=name), layout)
    assert len(trials_of(read_people(table(isi=name), layout.saying(where={name: "*"})))) == 48
    for usual in ("tap-TMS interval (ms)", "TMS after tap (ms)", "CS-TS (ms)"):
        assert len(trials_of(read_people(table(isi=usual), STATED.saying(columns={"isi": usual})))) == 48


@pytest.mark.parametrize(
    "remark",
    ["repeat", "nicht auswertbar", "EMG not relaxed", "coil slipped, do not use", "eliminare", "not valid", "excl.",
     "noise", "-> out", "n.v.", "kein Schlag", "!", "EMG not silent", "lousy", "hat gelacht", "coil moved"],
)  # fmt: skip
def test_a_remark_in_few_rows_is_asked_about_whatever_its_words(remark: str) -> None:
    with pytest.raises(IsiwError, match=r"row 5 of .* may say that the trial does not count.*--where \"note=\*\""):
        read_people(table(note=few(remark, "")), EMPTY_IS_ALONE)
    read_people(table(note=few(remark, "")), EMPTY_IS_ALONE.saying(where={"note": "*"}))


@pytest.mark.parametrize(
    "cells",
    [*(few(usual, "") for usual in ("not repeated", "not bad", "ok, no artefact", "pause", "entspannt", "Block 2")),
     ["muscle active"] * 48, ["cough", *[""] * 47], [f"P01_{n}.cfs" for n in range(48)]],
)  # fmt: skip
def test_a_remark_that_is_harmless_or_of_all_trials_is_not_asked_about(cells: list[str]) -> None:
    assert len(trials_of(read_people(table(note=cells), EMPTY_IS_ALONE))) == 48


def test_a_gain_beside_the_amplitudes_is_asked_about() -> None:
    with pytest.raises(IsiwError, match=r"'amp_gain' of .* has a gain.*--where \"amp_gain=\*\""):
        read_people(table(amp_gain=1000), EMPTY_IS_ALONE)
    assert len(trials_of(read_people(table(amp_gain=1), EMPTY_IS_ALONE))) == 48


@pytest.mark.parametrize("states", [("1", "2"), ("rest", "active"), ("0", "3")])
def test_a_state_that_is_seldom_is_asked_about_and_a_measure_of_few_values_is_not(states: tuple[str, str]) -> None:
    with pytest.raises(IsiwError, match=r"'state' .* several values at each ISI.*write that in place of its ISIs"):
        read_people(table(state=few(*states)), EMPTY_IS_ALONE)
    with pytest.raises(IsiwError, match=r"'state' .* several values at each ISI"):
        read_people(table(state=[states[n == 5] for n in range(48)]), EMPTY_IS_ALONE)
    for name, cells in (("latency_ms", 17 + np.arange(48) % 5), ("distance", 0.2 * (np.arange(48) % 5))):
        assert len(trials_of(read_people(table(**{name: cells}), EMPTY_IS_ALONE))) == 48


FIGURES: dict[str, Any] = {"max": max, "min": min, "mean": np.mean, "sd": lambda meps: np.std(meps, ddof=1), "sum": sum,
                           "geometric": lambda meps: np.exp(np.log(meps).mean()), "range": np.ptp}  # fmt: skip


@pytest.mark.parametrize(
    "names", ["max min mean sd", "mean sd", "mean", "sum mean sd", "min max", "sum mean", "geometric", "range"]
)
def test_figures_below_the_trials_are_no_tms_alone_whatever_is_said_of_empty_cells(names: str) -> None:
    below = pd.DataFrame({"MEP (mV)": [round(float(FIGURES[name](MEPS)), 3) for name in names.split()]})
    with pytest.raises(IsiwError, match=r"row 49 .* seems to be a mean of rows above, or an SD"):
        read_people(pd.concat([table(), below], ignore_index=True), EMPTY_IS_ALONE)
    lone = pd.DataFrame({"MEP (mV)": [0.377]})  # whatever it is, if all others have an ISI
    with pytest.raises(IsiwError, match=r"row 37 .* has no ISI, and all above have one, as a mean or a sum has"):
        read_people(pd.concat([table()[~ALONE], lone]).reset_index(drop=True), EMPTY_IS_ALONE)
    last = pd.DataFrame({"MEP (mV)": [0.377, 0.281, 0.593]})
    assert len(trials_of(read_people(pd.concat([table(), last], ignore_index=True), EMPTY_IS_ALONE))) == 51
    numbered = pd.concat([table(trial=np.arange(1.0, 49.0)), last], ignore_index=True)
    with pytest.raises(IsiwError, match=r"row 49 .* has no ISI, and no number in the column 'trial'"):
        read_people(numbered, EMPTY_IS_ALONE)


def test_a_code_for_too_large_an_amplitude_is_asked_about() -> None:
    with pytest.raises(IsiwError, match=r"row 6 .* may stand for no amplitude"):
        read_people(table(np.where(np.arange(48) == 5, 9999, 1e3 * MEPS), mep="MEP (µV)"), EMPTY_IS_ALONE)
    with pytest.raises(IsiwError, match=rf"got '\d times 9\.999'.*{WAY_OUT}"):
        read_people(table(np.where(few(bad=True, good=False), 9.999, MEPS)), EMPTY_IS_ALONE)


@pytest.mark.parametrize("column", ["ISI (ms)", "MEP (mV)", "accepted"])
@pytest.mark.parametrize("error", ["#DIV/0!", "#N/A", "#WERT!", "#NV"])
def test_an_error_of_excel_is_no_empty_cell(error: str, column: str, tmp_path: Path) -> None:
    table(accepted=1, ratio=1.0).to_excel(tmp_path / "P01.xlsx", index=False)
    book = openpyxl.load_workbook(tmp_path / "P01.xlsx")
    cells = {str(cell.value): cell.column for cell in book.active[1]}
    for name in ("ratio", column):
        book.active.cell(7, cells[name], error).data_type = "e" if error in {"#DIV/0!", "#N/A"} else "s"
        book.save(tmp_path / f"{name[:3]}.xlsx")
    assert len(trials_of(read_people(tmp_path / "rat.xlsx", EMPTY_IS_ALONE))) == 48  # nothing is read of it
    with pytest.raises(IsiwError, match=r"row 6 of .* is an error of Excel"):
        read_people(tmp_path / f"{column[:3]}.xlsx", EMPTY_IS_ALONE)


@pytest.mark.parametrize(("note", "says"), [("Trials 5 and 8 excluded", "do not count"), ("Gain 1000", "says a gain")])
def test_another_sheet_may_say_a_gain_or_which_trials_do_not_count(note: str, says: str, tmp_path: Path) -> None:
    for text in ("Summary of means, % of control", note):
        with pd.ExcelWriter(tmp_path / f"{text[:5]}.xlsx", engine="openpyxl") as book:
            table().to_excel(book, index=False, sheet_name="Data")
            book.book.create_sheet("Notes").append([text])
    assert len(trials_of(read_people(tmp_path / "Summa.xlsx", EMPTY_IS_ALONE))) == 48
    with pytest.raises(IsiwError, match=rf"{says}.*{WAY_OUT}"):
        read_people(tmp_path / f"{note[:5]}.xlsx", EMPTY_IS_ALONE)


@pytest.mark.parametrize(
    ("name", "bad", "good", "key"),
    [("QC", "fail", "pass", "exclude"), ("check", "NOK", "OK", "exclude"), ("quality", "poor", "good", "exclude"),
     ("blink", "*", "", "exclude"), ("Auswahl", "", "x", "status"), ("valid (0 = ok)", 1, 0, "exclude"),
     ("artifact (1 = clean)", 0, 1, "status")],
)  # fmt: skip
def test_flags_of_any_kind_are_asked_about_and_can_be_said(name: str, bad: Any, good: Any, key: str) -> None:
    made = table(**{name: few(bad, good)})
    with pytest.raises(IsiwError, match=rf"--column \"{key}={name.replace('(', '.').replace(')', '.')}\""):
        read_people(made, EMPTY_IS_ALONE)
    (person,) = read_people(made, EMPTY_IS_ALONE.saying(columns={key: name}))
    assert [trial.told for trial in person.trials] == KEPT


def test_a_column_without_a_name_is_read_for_remarks() -> None:
    with pytest.raises(IsiwError, match=r"row 5 of the column 'column 3' .* does not count"):
        read_people(table(**{"": few("artefact", "")}), EMPTY_IS_ALONE)
    assert read_people(table(**{"": [""] * 48}), EMPTY_IS_ALONE)[0].unused == ()


@pytest.mark.parametrize("cell", ["<0.2", "no MEP", "none", "n.d.", "-", "—", " -- ", "."])
def test_words_and_dashes_for_no_mep_are_asked_about_unless_the_trial_is_lost(cell: str) -> None:
    made = table([cell if bad else mep for bad, mep in zip(few(bad=True, good=False), MEPS, strict=True)])
    with pytest.raises(IsiwError, match=r"row 5 of .* 0 is no MEP, or one below the detection limit"):
        read_people(made, EMPTY_IS_ALONE)
    if cell not in {"<0.2", "no MEP"}:
        for own, layout in ((made, {"where": {"MEP (mV)": "*"}}), (made.assign(bad=few(bad=1, good=0)), {})):
            assert sum(trial.told for trial in read_people(own, EMPTY_IS_ALONE.saying(**layout))[0].trials) == sum(KEPT)


@pytest.mark.parametrize(("meps", "says"), [(np.minimum(MEPS, 0.8), "saturated"), (np.maximum(MEPS, 0.45), "limit")])
def test_amplitudes_that_are_cut_off_are_asked_about(meps: Any, says: str) -> None:
    with pytest.raises(IsiwError, match=rf"seem to be .*{says}.*{WAY_OUT}"):
        read_people(table(meps), EMPTY_IS_ALONE)
    assert len(trials_of(read_people(table(meps), EMPTY_IS_ALONE.saying(where={"MEP (mV)": "*"})))) == 48
    assert len(trials_of(read_people(table(MEPS.round(1)), EMPTY_IS_ALONE))) == 48


@pytest.mark.parametrize("label", ["Mean block {}", "MW B{}", ""])
def test_means_between_blocks_are_no_tms_alone(label: str) -> None:
    made, parts = table(label=""), list[pd.DataFrame]()
    for n, first in enumerate((0, 24)):
        mean = pd.DataFrame(
            {"MEP (mV)": [round(float(MEPS[first : first + 24].mean()), 5)], "label": label.format(n + 1)}
        )
        parts += [made.iloc[first : first + 24], mean]
    with pytest.raises(IsiwError, match=r"row 25 .*(is none of a trial|seems to be a mean)"):
        read_people(pd.concat(parts, ignore_index=True), EMPTY_IS_ALONE)


def test_a_tap_alone_may_be_a_word_among_the_isis_and_a_long_isi_before_the_tap_is_asked_about() -> None:
    cells = ["tap alone" if alone and n < 12 else "TMS" if alone else isi
             for n, (alone, isi) in enumerate(zip(ALONE, ISIS, strict=True))]  # fmt: skip
    (person,) = read_people(table(**{"ISI (ms)": cells}), IMPACT)
    assert [trial.tap_alone for trial in person.trials] == [cell == "tap alone" for cell in cells]
    with pytest.raises(IsiwError, match="have the ISI -100 ms, which may stand for TMS alone"):
        read_people(table(**{"ISI (ms)": [-100.0 if n in {3, 7, 11} else 10.0 + n for n in range(48)]}), IMPACT)


def test_units_are_read_below_words_and_in_their_peak_to_peak_spelling(tmp_path: Path) -> None:
    rows = "".join(f"{isi:g};{mep}\n" for isi, mep in zip(ISIS[~ALONE], MEPS[~ALONE], strict=True))
    for head in (
        "ISI, ms;MEP, mV\n",
        "ISI;MEP\n(ms);amplitude (mV)\n",
        "ISI (ms);MEP (mVpp)\n",
        "ISI (ms);MEP (mV p-p)\n",
    ):
        (tmp_path / "P01.csv").write_text(head + rows)
        assert [mep for _, mep in trials_of(read_people(tmp_path / "P01.csv", IMPACT))] == MEPS[~ALONE].tolist()


@pytest.mark.parametrize(
    ("names", "factor", "unit", "says"),
    [({"isi": "ISI (s)"}, 1.0, "ms", r"say --unit ms and --where \"ISI \(s\)=\*\""),
     ({"mep": "MEP (mV)"}, 1e3, "uV", r"by --unit, and --where \"MEP \(mV\)=\*\"")],
)  # fmt: skip
def test_the_first_question_about_a_wrong_unit_in_a_name_has_the_whole_way_out(
    names: dict[str, str], factor: float, unit: str, says: str
) -> None:
    made = table(factor * MEPS, **names)
    with pytest.raises(IsiwError, match=says):
        read_people(made, EMPTY_IS_ALONE)
    said = EMPTY_IS_ALONE.saying(units=(unit,), where={next(iter(names.values())): "*"})
    assert len(trials_of(read_people(made, said))) == 48


@pytest.mark.parametrize(
    ("more", "says"),
    [({"badTrials": 7}, "'badTrials' is not as long"), ({"badsweeps": [3, 9]}, r"'badsweeps' is not .* got '?\[3, 9\]"),
     ({"gain": 1000.0}, "'gain' of .* says a factor"), ({"info": "MEP in % of control"}, "relative by what the title")],
)  # fmt: skip
def test_what_stands_beside_vectors_of_matlab_is_asked_about(more: dict[str, Any], says: str, tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "P01.mat", {"isi_ms": ISIS, "mep_mv": MEPS, **more})
    with pytest.raises(IsiwError, match=says):
        read_people(tmp_path / "P01.mat", EMPTY_IS_ALONE)
    scipy.io.savemat(tmp_path / "P01.mat", {"isi_ms": ISIS, "mep_mv": MEPS, "badTrials": [], "n_bad": 3, "gain": 1.0})
    assert len(trials_of(read_people(tmp_path / "P01.mat", EMPTY_IS_ALONE))) == 48
