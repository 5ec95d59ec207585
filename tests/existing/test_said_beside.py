"""What a file, or one beside it, says besides its numbers: it is used, or asked about where it contradicts them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mne
import numpy as np
import openpyxl
import pandas as pd
import pytest
import scipy.io

from existing import writers
from existing.test_doubts import eeglab, table
from existing.test_tables import IMPACT
from existing.test_waves import EMG_MV, lines, trigger
from existing.writers import ISIS_MS, KNOWN, NAMES, RATE_HZ, as_edf, epochs, raw, recording, require_as_written
from isiw.errors import IsiwError
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people


def shown(path: Path, change: Callable[[Any], None]) -> Path:
    """A workbook whose sheet was changed in Excel."""
    with pd.ExcelWriter(path, engine="openpyxl") as book:
        table().to_excel(book, index=False, sheet_name="Data")
        change(book.sheets["Data"])
    return path


def crossed_out(sheet: Any) -> None:
    for cell in sheet[7]:
        cell.font = openpyxl.styles.Font(strike=True)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda sheet: sheet.row_dimensions.group(5, 6, hidden=True),
         "2 rows of the sheet 'Data' are hidden; got 'row 5, 6'.*called exclude"),
        (crossed_out, "1 row of the sheet 'Data' is crossed out; got 'row 7'"),
        (lambda sheet: setattr(sheet["A8"], "comment", openpyxl.comments.Comment("EK:\ncoil moved", "EK")),
         "1 row of the sheet 'Data' is with a note, .*; got 'row 8'"),
        (lambda sheet: sheet.merge_cells("B4:B6"), "an amplitude of the sheet 'Data' is merged over several rows"),
        (lambda sheet: sheet.__setitem__("B4", "=1/2"), "1 row .* without the result of a formula; got 'row 4'"),
    ],
)  # fmt: skip
def test_rows_that_excel_shows_otherwise_than_they_are_read_are_asked_about(
    change: Callable[[Any], None], says: str, tmp_path: Path
) -> None:
    with pytest.raises(IsiwError, match=says):
        read_people(shown(tmp_path / "P01.xlsx", change), IMPACT)
    hidden_head = shown(tmp_path / "P02.xlsx", lambda sheet: setattr(sheet.row_dimensions[1], "hidden", True))
    merged = shown(tmp_path / "P03.xlsx", lambda sheet: sheet.merge_cells("A4:A6"))
    usual, of_one = (read_people(source, IMPACT)[0].trials for source in (hidden_head, merged))
    assert (len(usual), len({of_one[row].isi_ms for row in (2, 3, 4)})) == (36, 1)


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        ({"E1": "Gain", "F1": 1000}, "says a gain"),
        ({"E2": "Filter", "F2": "10-500 Hz", "E3": "Verstärkung", "E4": 300}, "says a gain"),
        ({"F5": "trials 4 and 17 excluded"}, "may say that the trial does not count"),
        ({"E1": "MEP in µV"}, "says two units"),
        ({"C1": "gain", "D1": "1000"}, "says a gain"),
        ({"E1": "Coil", "F1": "D70", "E2": "Amplifier", "F2": "D360", "E3": "gain", "F3": 1}, None),
    ],
)
def test_cells_beside_a_table_are_a_title(cells: dict[str, Any], says: str | None, tmp_path: Path) -> None:
    def change(sheet: Any) -> None:
        for at, cell in cells.items():
            sheet[at] = cell

    path = shown(tmp_path / "P01.xlsx", change)
    if says is None:
        assert (len(read_people(path, IMPACT)[0].trials), read_people(path, IMPACT)[0].unused) == (36, ())
        return
    with pytest.raises(IsiwError, match=says):
        read_people(path, IMPACT)


def test_a_few_rows_of_a_colour_of_their_own_are_flags_unless_another_column_says_why(tmp_path: Path) -> None:
    def coloured(number: int, rows: list[int], more: dict[str, Any], *, text: bool = False) -> Path:
        red = openpyxl.styles.PatternFill("solid", fgColor=openpyxl.styles.colors.Color(theme=5))
        with pd.ExcelWriter(tmp_path / f"P{number}.xlsx", engine="openpyxl") as book:
            table().assign(**more).to_excel(book, index=False, sheet_name="Data")
            for cell in (cell for row in rows for cell in book.sheets["Data"][row + 2]):
                if text:
                    cell.font = openpyxl.styles.Font(color="FFFF0000")
                else:
                    cell.fill = red
        return tmp_path / f"P{number}.xlsx"

    for number, text in enumerate((True, False)):
        path = coloured(number, [3, 8], {}, text=text)
        with pytest.raises(IsiwError, match=r"row 4 of the column 'flag by colour'.*exclude=flag by colour.*colour=\*"):
            read_people(path, IMPACT)
        (person,) = read_people(path, IMPACT.saying(columns={"exclude": "flag by colour"}))
        assert [trial.index for trial in person.trials if not trial.told] == [3, 8]
    of_isi = np.flatnonzero(table()["isi_ms"] == 100.0).tolist()
    excluded = [int(row in (3, 8)) for row in range(36)]
    kinds: list[tuple[list[int], dict[str, Any]]] = [
        (of_isi, {}),
        ([3, 8], {"exclude": excluded}),
        ([*range(0, 36, 2)], {}),
    ]
    for number, (rows, more) in enumerate(kinds, 2):
        (person,) = read_people(coloured(number, rows, more), IMPACT)
        assert len(person.trials.told) == 36 - sum(more.get("exclude", []))


def test_a_unit_beside_numbers_is_theirs_in_a_table_and_in_a_structure_of_matlab(tmp_path: Path) -> None:
    numbers: dict[str, Any] = {"isi": [0.03, 0.06, 0.09], "isi_unit": "s", "mep": [400.0, 900.0, 160.0]}
    scipy.io.savemat(tmp_path / "P01.mat", {"trials": {**numbers, "mep_units": "uV"}})
    scipy.io.savemat(tmp_path / "P02.mat", {"P02": {**numbers, "isi_unit": "sec", "unit": "uV"}})
    for source in (tmp_path / "P01.mat", tmp_path / "P02.mat", pd.DataFrame({**numbers, "mep_unit": "uV"})):
        (person,) = read_people(source, IMPACT)
        assert [trial.isi_ms for trial in person.trials] == pytest.approx([30, 60, 90])
        assert [trial.mep_mv for trial in person.trials] == pytest.approx([0.4, 0.9, 0.16])
        assert person.unused == ()


def test_epochs_that_contradict_their_events_are_asked_about() -> None:
    for isis_ms in ([30.0, 60, 90, 120, 85, np.nan], [30.0, 60, 90, 120, np.nan, np.nan]):
        with pytest.raises(IsiwError, match=r"ISI of row 5 of .*; expected 45\.0 ms, by the events"):
            read_people(epochs(isi_ms=isis_ms), KNOWN)
    with pytest.raises(IsiwError, match=r"ISI of row 6 of .* got '20 ms'; expected no tap, by the events"):
        read_people(epochs(isi_ms=[*ISIS_MS, 20.0]), KNOWN)
    found, _ = mne.events_from_annotations(raw(), {NAMES["tap"]: 1})
    held = pd.DataFrame({"isi_ms": ISIS_MS})
    about = mne.Epochs(raw(), found, {"stim": 1}, -0.3, 0.3, baseline=None, preload=True, metadata=held)
    with pytest.raises(
        IsiwError, match=r"what comes at time 0 of the sweeps of the epochs; got 'stim'.*--marker pulse"
    ):
        read_people(about.set_annotations(None), Layout("impact", channels={"emg": "FCR"}))


@pytest.mark.parametrize(
    "head",
    [
        "Interval=\t0.00025 s\n",
        pytest.param("0.25 msec/sample\n", marks=pytest.mark.slow),
        pytest.param("Sampling rate: 4 kHz\n", marks=pytest.mark.slow),
    ],
)
def test_a_rate_above_the_samples_or_beside_sweeps_is_compared_with_the_one_that_is_stated(
    head: str, tmp_path: Path
) -> None:
    rows = lines(EMG_MV, trigger("tap"), trigger("pulse")).splitlines(keepends=True)
    (tmp_path / "P01.txt").write_text(head + "".join(row.partition("\t")[2] for row in rows))
    channels = {"emg": "EMG", "tap": "Hammer", "pulse": "TMS"}
    layout = Layout("impact", rate_hz=2000.0, channels=channels, unmarked="alone", units=("mV",), skip_lines=1,
                    names=tuple(channels.values()), separator="\t")  # fmt: skip
    with pytest.raises(IsiwError, match=r"the head of P01\.txt says; got '2000 Hz'; expected 4000 Hz"):
        read_people(tmp_path / "P01.txt", layout)
    require_as_written(read_people(tmp_path / "P01.txt", layout.saying(rate_hz=4000.0))[0])
    scipy.io.savemat(tmp_path / "P01.mat", {"emg": np.zeros((3, 99)), "isi_ms": [1, 2, 3], "interval": 0.25})
    sweeps = Layout("impact", rate_hz=2000.0, pulse_at_ms=9.0, units=("mV",), channels={"emg": "emg"})
    with pytest.raises(IsiwError, match=r"'interval' of P01\.mat says"):
        read_people(tmp_path / "P01.mat", sweeps)
    waves = {name: {"values": trigger(name), "interval": 0.00025} for name in ("tap", "pulse")}
    scipy.io.savemat(tmp_path / "P02.mat", {"emg": EMG_MV, **waves})
    with pytest.raises(IsiwError, match=r"'tap\.interval' of P02\.mat says"):
        read_people(tmp_path / "P02.mat", sweeps)


def test_files_of_bids_beside_a_recording_that_contradict_it_are_asked_about(tmp_path: Path) -> None:
    path = as_edf(tmp_path).rename(tmp_path / "sub-01_emg.edf")
    pd.DataFrame({"name": ["FCR"], "units": ["mV"]}).to_csv(tmp_path / "sub-01_channels.tsv", sep="\t", index=False)
    with pytest.raises(IsiwError, match="got 'uV in one place, and mV in another'"):
        read_people(path, KNOWN)
    require_as_written(read_people(path, KNOWN.saying(units=("uV",)))[0])
    events = pd.DataFrame([(at_s, round(at_s * RATE_HZ), name) for at_s, name in sorted(recording()[1])])
    events = events.set_axis(["onset", "sample", "value"], axis=1).assign(duration=0.0, trial_type="n/a")
    events.to_csv(tmp_path / "sub-01_events.tsv", sep="\t", index=False)
    require_as_written(read_people(path, KNOWN.saying(units=("uV",)))[0])
    events.assign(onset=1e3 * events["onset"]).to_csv(tmp_path / "sub-01_events.tsv", sep="\t", index=False)
    with pytest.raises(IsiwError, match=r"onsets of events beside sub-01_emg\.edf are not those of their samples"):
        read_people(path, KNOWN)


def test_times_of_an_eeglab_file_are_compared_with_its_rate(tmp_path: Path) -> None:
    path = eeglab(tmp_path, 1e3)
    held = {**scipy.io.loadmat(path, simplify_cells=True)["EEG"], "times": np.arange(len(EMG_MV)) / 4.0}
    held["data"].astype("<f4").tofile(tmp_path / "P01.fdt")
    scipy.io.savemat(path, {"EEG": {**held, "data": "P01.fdt"}})
    require_as_written(read_people(path, KNOWN)[0])
    scipy.io.savemat(path, {"EEG": {**held, "srate": 2000.0}})
    with pytest.raises(IsiwError, match=r"EEG\.times of P01\.set says; got '2000 Hz'; expected 4000 Hz"):
        read_people(path, KNOWN)


def test_units_and_isis_that_a_channel_or_a_table_in_a_recording_says_are_compared(tmp_path: Path) -> None:
    made = raw()
    made.rename_channels({"FCR": "FCR (mV)"})
    with pytest.raises(IsiwError, match="got 'V in one place, and mV in another'"):
        read_people(made, KNOWN.saying(channels={"emg": "FCR (mV)"}))
    pynwb, layout = pytest.importorskip("pynwb"), Layout("impact", channels={"emg": "EMG FCR"}, unmarked="alone")
    with pynwb.NWBHDF5IO(writers.as_nwb(tmp_path), "a") as target:
        file = target.read()
        file.add_trial_column("isi_ms", "the ISI")
        pulses_s = [5.0 + at_s for at_s, name in writers.named_events() if name == "TMS"]
        for at_s, isi_ms in zip(pulses_s, (*ISIS_MS[:4], 85.0, np.nan), strict=True):
            file.add_trial(start_time=at_s - 0.5, stop_time=at_s + 0.3, isi_ms=isi_ms)
        target.write(file)
    with pytest.raises(IsiwError, match=r"the ISI of the trial at .* got '85 ms'; expected 45\.0 ms, by the events"):
        read_people(tmp_path / "P01.nwb", layout)
