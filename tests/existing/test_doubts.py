"""Files that are not what they look like, in forms that labs have: each is read right, or asked about in a sentence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mne
import numpy as np
import pandas as pd
import pytest
import scipy.io

from existing.test_waves import EMG_MV, lines, trigger
from existing.writers import (
    ISIS_MS,
    KNOWN,
    NAMES,
    RATE_HZ,
    as_edf,
    epochs,
    pulsed,
    raw,
    recording,
    require_as_written,
    with_stim,
)
from isiw.errors import IsiwError
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

IMPACT = Layout(reference="impact")
ISIS = np.repeat(np.arange(20.0, 181.0, 20.0), 4)
TIMES = [f"2026-03-04 10:{n:02d}:00" for n in range(36)]


def table(**more: Any) -> pd.DataFrame:
    """36 pairs, in an order of their own."""
    rng = np.random.default_rng(4)
    order = rng.permutation(len(ISIS))
    cells = {key: np.asarray(value)[order] if len(value) == len(ISIS) else value for key, value in more.items()}
    return pd.DataFrame({"isi_ms": ISIS[order], "mep_mv": rng.uniform(0.1, 1.0, len(ISIS)).round(4), **cells})


def of(kinds: list[Any]) -> list[Any]:
    return (kinds * len(ISIS))[: len(ISIS)]


def long(column: str, kinds: list[str], *, blocks: bool = False) -> pd.DataFrame:
    """The rows of each of several kinds, one below the other or beside each other."""
    parts = pd.concat([table().assign(**{column: kind}) for kind in kinds])
    return (parts if blocks else parts.sort_index(kind="stable")).reset_index(drop=True)


def renamed(**names: str) -> pd.DataFrame:
    return table().rename(columns=names)


def means(name: str, **beside: Any) -> pd.DataFrame:
    return pd.DataFrame({"isi_ms": np.unique(ISIS), name: np.linspace(0.1, 0.9, 9), **beside})


MEAN_MV, SD_MV = table()["mep_mv"].mean(), table()["mep_mv"].std()
MEANS_MV = table().groupby("isi_ms")["mep_mv"].mean().reset_index().to_numpy().round(4).tolist()


def with_below(*rows: list[Any]) -> pd.DataFrame:
    return pd.concat([table(), pd.DataFrame(rows, columns=["isi_ms", "mep_mv"])], ignore_index=True)


ASKED: dict[str, tuple[pd.DataFrame, dict[str, Any], str]] = {
    "two muscles side by side": (long("muscle", ["FCR", "FDI"]), {}, "'muscle'.*--where \"muscle=FCR\""),
    "two muscles one after the other": (long("channel", ["APB", "ADM"], blocks=True), {}, "'channel'.*APB, ADM"),
    "people under another name": (long("Kürzel", ["AB", "CD", "EF"]), {}, '--column "subject=Kürzel"'),
    "people by numbers": (long("Vpn-Code", ["1", "2", "3", "4"]), {}, "'Vpn-Code'.*1, 2, 3 and 1 other"),
    "sides": (table(hand=of(["left", "right"])), {}, "'hand'"),
    "coils in blocks": (long("coil", ["D70", "B65"], blocks=True), {}, "'coil'"),
    "conditions at each ISI": (table(condition=of(["rest", "active"])), {}, "'condition'.*(rest, active|active, rest)"),
    "means with their SDs": (means("mep_mv", SD=0.1, N=8), {}, "means of several trials.*beside 'SD'"),
    "means with standard errors alone": (means("MEP (mV)", **{"s.e.m.": 0.1, "SEM": 0.1}), {}, "means of several"),
    "means by their name": (renamed(mep_mv="avg_mep_mv"), {"columns": {"mep": "avg_mep_mv"}}, "means of several"),
    "per cent with a unit": (renamed(mep_mv="MEP %"), {"columns": {"mep": "MEP %"}, "units": ("mV",)},
                             "relative to others"),
    "per cent below the name": (pd.concat([pd.DataFrame({"isi_ms": ["ms"], "MEP": ["%"]}), renamed(mep_mv="MEP")]),
                                {"units": ("mV",)}, "relative"),
    "normalised": (renamed(mep_mv="norm mep"), {"columns": {"mep": "norm mep"}, "units": ("mV",)}, "relative"),
    "logarithms": (renamed(mep_mv="log10 MEP"), {"columns": {"mep": "log10 MEP"}, "units": ("mV",)}, "got 'log10'"),
    "numbers of samples": (table().assign(isi_ms=np.linspace(810, 1900, 36)), {}, "longer than those of paired"),
    "a code NA among numbers": (long("subject", ["P01", "NA", "P02"]), {}, "may be a code, or stand for none"),
    "means of each person with SDs": (pd.concat([means("mep_mv", sd=0.1).assign(subject=one) for one in "ABCDE"]), {},
                                      "means of several trials.*beside 'sd'"),
    "means beside how many they are of": (means("mep_mv", n_averaged=10), {}, "beside 'n_averaged'"),
    "means with limits of their confidence": (means("mep_mv", ci_lower=0.1, ci_upper=2.0), {}, "beside 'ci_lower'"),
    "means between limits": (means("mep_mv", a=np.linspace(0, 0.8, 9), b=np.linspace(0.2, 1, 9)), {}, "'a'.*the SD of"),
    "means by how many they are of": (renamed(mep_mv="MEP, n=10"), {"columns": {"mep": "MEP, n=10"}, "units": ("mV",)},
                                      "means of several"),
    "means with a Greek letter": (means("mep_mv", σ=np.linspace(0.04, 0.2, 9)), {}, "'σ'.*the SD of.*--where \"σ="),
    "means in one word": (renamed(mep_mv="mepmean"), {"columns": {"mep": "mepmean"}, "units": ("mV",)}, "means of"),
    **{name: (renamed(mep_mv=name), {"columns": {"mep": name}, "units": ("uV",)}, "relative")
       for name in ("MEPnorm", "zMEP", "MEP (a.u.)", "MEP/control", "mep_x_baseline", "MEP fold change", "MEP_Mmax",
                    "MEP比", "MEP residual", "predicted_mep", "dMEP", "MEP dB", "MEP - control", "MEP rank", "MEP^.5")},
    "two units": (table().rename(columns={"mep_mv": "mep_mv (µV)"}), {}, "says two units; got 'uV and mV'"),
    "an ISI of 0 in many rows": (table().assign(isi_ms=np.where(ISIS > 60, ISIS, 0.0)), {}, "--alone 0 if they are"),
    "an ISI of 0 more often than another": (table().assign(isi_ms=np.repeat([0.0, 40, 80, 120, 160], [11, 7, 6, 6, 6])),
                                                {}, "11 rows .* have the ISI 0 ms"),
    "an ISI of -1": (table().assign(isi_ms=np.where(ISIS > 20, ISIS, -1.0)), {}, "--alone -1 if they are TMS alone"),
    "an ISI of 999": (table().assign(isi_ms=np.where(ISIS > 20, ISIS, 999.0)), {}, "4 rows .* have the ISI 999 ms"),
    "muscles as blocks": (long("block", ["FCR", "FDI"]), {}, 'comes back after another block.*--where "block=FCR"'),
    "a row a muscle, which nothing says": (long("x", ["", ""]).drop(columns="x"), {}, "come 2 times each, as if"),
    "muscles below each other": (pd.concat([table().assign(isi_ms=ISIS + np.linspace(0, 1, 36))] * 2), {}, "2 times"),
    "a few rows of another coil": (table(coil=of(["sham", *["real"] * 7])), {}, "'coil'"),
    "a few rows a person": (table(code=of([f"VP{n}" for n in range(9)])), {}, "'code'.*and 6 others"),
    "a mean below the trials": (pd.concat([table().assign(Nr=range(36)), means("mep_mv", Nr="Mittelwert")[:1]]), {},
                                "row 37 of the column 'Nr' .* is none of a trial"),
    "each row twice": (pd.concat([table()] * 2), {}, "or each row twice"),
    "areas": (renamed(mep_mv="MEP area (mV*ms)"), {"columns": {"mep": "MEP area (mV*ms)"}, "units": ("mV",)},
              "of another measure"),
    "half of the amplitude": (renamed(mep_mv="base-to-peak (mV)"), {"columns": {"mep": "base-to-peak (mV)"}},
                              "got 'base-to-peak'; expected amplitudes from peak to peak"),
    "codes of ISIs": (renamed(isi_ms="ISI code"), {"columns": {"isi": "ISI code"}, "units": ("ms",)}, "are numbers of"),
    "ISIs in two units": (table().assign(isi_ms=np.where(np.arange(36) < 20, ISIS, ISIS / 1e3)), {},
                          "'isi_ms' .* in two units; got '16 up to 0.18 and 20 from 20 on'"),
    "amplitudes in two units": (table().assign(mep_mv=np.where(np.arange(36) < 20, 0.5, 500.0)), {}, "in two units"),
    "a gain": (renamed(mep_mv="MEP (mV, gain 1000)"), {"columns": {"mep": "MEP (mV, gain 1000)"}, "units": ("mV",)},
               "are multiplied"),
    "ISIs from another event": (renamed(isi_ms="ISI from valve (ms)"), {"columns": {"isi": "ISI from valve (ms)"}},
                                "counts from another event than is stated; got 'impact'"),
    "remarks that leave out": (table(Bemerkung=np.where(np.arange(36) == 5, "Verworfen!", "")), {},
                               "'Bemerkung' .* may say that the trial does not count"),
    "remarks of several words": (table(note=np.where(np.arange(36) == 5, "coil moved - discard", "no artefact")), {},
                                 "may say that the trial does not count; got .*discard"),
    "a code for no amplitude": (table(mep_uv=np.where(np.arange(36) % 9, 412.5, 999)).drop(columns="mep_mv"), {},
                                "may stand for no amplitude; got .*999"),
    "rows sorted by their ISIs": (table(stim_nr=range(36)).sort_values("isi_ms"), {}, "order of its column 'stim_nr'"),
    "the newest row first": (table().assign(timestamp=TIMES)[::-1], {}, "'timestamp'"),
    "the newest row first, by dates": (table().assign(date=TIMES)[::-1], {}, "'date'"),
    "the last rows twice": (pd.concat([table(), table()[-6:]]), {}, "or each row twice"),
    "a measured ISI beside": (table(measured_isi_ms=ISIS + 8), {}, "isi_ms or measured_isi_ms"),
    "before and after in a column called time": (table(time=of(["pre", "post"])), {}, "'time'.*(pre, post|post, pre)"),
    "a word for ISIs of 0": (table(code=np.where(ISIS > 20, 2, 1), stim=np.where(ISIS > 20, "cond", "uncond"))
                             .replace(20.0, 0.0), {}, "--alone 0 if"),
    "numbers of rows": (table().assign(isi_ms=np.arange(1.0, 37.0)), {}, "'isi_ms' .* seems to have codes"),
    "two columns of ISIs": (table(realised_isi_ms=ISIS + 40), {}, "isi_ms or realised_isi_ms"),
    "a unit beside that is another": (table(isi_unit=of(["s"])), {}, "'isi_ms .s.' says two units"),
    "a unit beside that changes": (renamed(isi_ms="ISI").assign(isi_unit=of(["s", "ms"])), {}, "says two units"),
    "latencies": (renamed(mep_mv="onset (ms)"), {"columns": {"mep": "onset (ms)"}, "units": ("mV",)}, "no amplitudes"),
    "ISIs in samples": (renamed(isi_ms="ISI (samples)"), {"units": ("ms",)}, "a unit of no ISIs; got 'samples'"),
    "a mean that no word says": (with_below([ISIS.mean(), MEAN_MV]), {}, "seems to be a mean of rows above, or an SD"),
    "a mean and an SD after an empty row": (with_below([None, None], [99, MEAN_MV], [51, SD_MV]).round(4), {},
                                            "row 38 .* seems to be a mean"),
    "means of each ISI after an empty row": (with_below([None, None], *MEANS_MV), {}, "row 38 .* seems to be a mean"),
    "an ISI in the first row of its group": (table().assign(isi_ms=np.where(np.arange(36) % 4, np.nan, ISIS)),
                                             {"alone": ""}, "row 2 .* is empty, as if the ISI above held for it"),
    "means below each of several parts": (pd.concat([pd.concat([part, with_below([None, part["mep_mv"].mean()])[-1:]])
                                          for part in (table()[:12], table()[12:24], table()[24:])]).round(4),
                                          {"alone": ""}, "row 13 .* seems to be a mean"),
    "a mean in a column of words": (with_below([99, 0.4]).assign(label=[*of(["t"]), "Mean MEP (n=36)"]), {},
                                    "row 37 of the column 'label' .* is none of a trial"),
    "outliers that nothing is read of": (table(outlier_3sd=of([0, 0, 0, 1])), {}, '--column "exclude=outlier_3sd"; if'),
    "trials that were used": (table(used=of(["x", "x", "x", ""])), {}, '--column "status=used"; if'),
    "a status that is left empty": (table(valid=of(["yes", "yes", ""])), {}, "is empty, and others say yes"),
    "ISIs below 0": (table().assign(isi_ms=np.where(ISIS > 20, -ISIS, 20)), {}, "most ISIs below 0.*got '32 of 36'"),
    "numbers of rows out of order": (table().sort_values("isi_ms").reset_index(names=""), {}, "column 'index'"),
    "blocks with the newest row first": (table(trial=range(36), block=of([1])).iloc[::-1], {}, "its column 'trial'"),
    "a recruitment curve beside pairs": (table(mso=of([55])).assign(isi_ms=np.where(ISIS > 40, ISIS, np.nan),
                                         mso=np.where(ISIS > 40, 55, ISIS.astype(int))), {"alone": ""},
                                         "'mso'.*other intensities of TMS alone.*got '20, 40'.*--where \"mso=55"),
    "a recruitment curve in % RMT": (table(**{"% RMT": of([90])}).assign(**{"isi_ms": np.where(ISIS > 40, ISIS, np.nan),
                                     "% RMT": np.where(ISIS > 40, 90, 90 + ISIS.astype(int))}), {"alone": ""},
                                     "'% RMT'.*other intensities of TMS alone.*--column intensity=NAME"),
    "a column for each ISI": (pd.DataFrame({f"{isi} ms": [0.1, 0.2] for isi in (20, 40)}), {}, "write a row for each"),
    "two spellings of a code": (table(subject=of(["P07", "p-07"])), {}, "P07 differs .* only in case.*'p-07'"),
    "two columns of what is lost": (table(rejected=of([""]), artefact=of(["", "x"])), {}, "rejected or artefact"),
    "an ISI a row, and columns of trials": (means("MEP1", MEP2=0.2, MEP3=0.3), {"columns": {"mep": "MEP1"},
                                            "units": ("mV",)}, "'MEP2' .* is like isi_ms or MEP1"),
    "two trials a row": (table(isi2_ms=ISIS[::-1], mep2_mv=ISIS / 99), {}, "'isi2_ms' .* is like isi_ms"),
    "ISIs that were measured, by their numbers": (table(real=ISIS + 6), {}, "'real' .* is like isi_ms"),
    "baselines of two names": (table().assign(isi_ms=np.where(np.arange(36) % 6, ISIS, 0.0),
                               phase=of(["pre", *["go"] * 5, "post", *["go"] * 5])), {}, "6 rows .* have the ISI 0 ms"),
    "a number for ISIs of 0": (table().assign(isi_ms=np.where(np.arange(36) % 9, ISIS, 0.0),
                               conditioned=np.where(np.arange(36) % 9, 1, 0)), {}, "4 rows .* have the ISI 0 ms"),
    "a long ISI in many rows": (table().assign(isi_ms=np.where(np.arange(36) % 3, ISIS, 450.0)), {}, "the ISI 450 ms"),
    "a condition that stands in the first row alone": (table().assign(isi_ms=np.where(np.arange(36) < 8, 0.0, ISIS),
                                                       condition=["TMS alone", *[""] * 7, "pairs", *[""] * 27]), {},
                                                       "is empty, and the ISI there is that of TMS alone"),
    "codes of ISIs by their numbers": (table().assign(isi_ms=ISIS / 20), {}, "'isi_ms' .* have codes; got '1, 2, 3"),
    "responses that are yes or no": (table().assign(mep_mv=of([0, 1, 1])), {}, "have codes; got '0, 1'"),
    "responses that are rated": (table().assign(mep_mv=of([0, 1, 2, 3])), {}, "'mep_mv' .* seems to have codes"),
    "one amplitude": (table().assign(mep_mv=5.0), {}, "have codes; got '5'"),
    "milliamperes": (renamed(mep_mv="Amplitude (mA)"), {"units": ("mV",)}, "a unit of no amplitudes; got 'mA'"),
    "peaks": (renamed(mep_mv="MEP max (mV)"), {"columns": {"mep": "MEP max (mV)"}}, "of another measure"),
    **{f"sorted, beside {name}": (table().assign(**{name: cells}).sort_values("isi_ms"), {}, f"'{name}' .* number")
       for name, cells in (("試行", range(36)), ("t", 5.3 * np.arange(36)), ("clock", [time[11:] for time in TIMES]),
                           ("file", [f"S3_{n:03}.cfs" for n in range(36)]))},
    "copies that are numbered on": (pd.concat([table()] * 2).assign(trial=range(72)), {}, "or each row twice"),
    "blocks of words": (long("run", ["left", "right"], blocks=True), {}, "'run' .* several values at each ISI"),
    "the last block first": (long("block", ["2", "1"], blocks=True), {}, "'block' .* does not ascend"),
    "one ISI that is far longer": (table().assign(isi_ms=np.where(np.arange(36) == 7, 600, ISIS)), {}, "row 8 .* far"),
    "kinds of rows below": (with_below(["Trials 1-20 FCR, 21-36 ECR", None]), {}, "to be of several kinds"),
    "a value that is not there": (long("muscle", ["FCR", "FDI"]), {"where": {"muscle": "APB"}}, "one of FCR, FDI"),
}  # fmt: skip


@pytest.mark.parametrize("kind", ASKED)
@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_a_table_that_is_not_of_single_trials_is_asked_about(kind: str, suffix: str, tmp_path: Path) -> None:
    frame, said, expected = ASKED[kind]
    path = tmp_path / f"P01{suffix}"
    if suffix == ".csv":
        frame.to_csv(path, index=False, sep=";")
    else:
        frame.to_excel(path, index=False)
    with pytest.raises(IsiwError, match=expected) as refused:
        read_people(path, Layout(**{"reference": "impact", **said}))
    assert len(str(refused.value)) < 500


def test_means_are_known_by_the_name_of_a_file_or_a_sheet_and_by_a_title(tmp_path: Path) -> None:
    text = means("mep_mv").to_csv(index=False)
    (tmp_path / "P01_means.csv").write_text(text)
    (tmp_path / "P02.csv").write_text(f"Mean MEP at each ISI\n{text}")
    means("mep_mv").to_excel(tmp_path / "P03.xlsx", sheet_name="Mittelwerte", index=False)
    for path in tmp_path.iterdir():
        with pytest.raises(IsiwError, match=r"are means of several trials.*beside '(means?|mittelwerte)'"):
            read_people(path, IMPACT)


def test_what_was_asked_about_can_be_said() -> None:
    for odd, mark, alone in ((999.0, "999", 4), (999.0, "never", 0)):
        (person,) = read_people(table().assign(isi_ms=np.where(ISIS > 20, ISIS, odd)), IMPACT.saying(alone=mark))
        assert sum(trial.isi_ms is None for trial in person.trials) == alone
    both = long("muscle", ["FCR", "FDI"])
    (person,) = read_people(both, IMPACT.saying(where={"muscle": "FDI"}))
    assert len(person.trials) == 36
    (person,) = read_people(both, IMPACT.saying(where={"muscle": "*"}))
    assert len(person.trials) == 72
    people = read_people(long("Kürzel", ["AB", "CD"]), IMPACT.saying(columns={"subject": "Kürzel"}))
    assert [one.subject for one in people] == ["AB", "CD"]
    (person,) = read_people(table().assign(isi_ms=np.linspace(810, 1900, 36)), Layout("impact", longest_isi_ms=2000.0))
    assert person.space().high_ms == 1900
    flags, below = table(outlier=of([0, 0, 0, 1])), table().assign(isi_ms=np.where(ISIS > 60, -ISIS, ISIS))
    for said, counted in (({"columns": {"exclude": "outlier"}}, 27), ({"where": {"outlier": "*"}}, 36)):
        assert sum(trial.told for trial in read_people(flags, IMPACT.saying(**said))[0].trials) == counted
    (person,) = read_people(below, IMPACT.saying(where={"isi_ms": "*"}))
    assert sum(str(trial.reason) == "TMS before impact" for trial in person.trials) == 24


PLAIN: dict[str, pd.DataFrame] = {
    "empty rows between blocks": pd.concat([table()[:12], pd.DataFrame([{"isi_ms": None}]), table()[12:]]).assign(
        mep_uv=lambda rows: (1e3 * rows["mep_mv"]).round()).drop(columns="mep_mv"),
    "numbers of rows that begin again": pd.concat([table()[:18], table()[18:].reset_index(drop=True)]),
    "numbers of trials in each block": table().assign(trial=[*range(18)] * 2, block=[1] * 18 + [2] * 18),
    "a last trial that is like the mean": with_below([20, round(MEAN_MV, 4)]),
    "yes and no of something else": table(response=np.where(ISIS > 60, 1, 0)),
    "one intensity": table(mso=of([55]), rmt=of([46])),
    "rows that are left out before": table()[3:],
    "numbers of repetitions": table().assign(rep=lambda rows: rows.groupby("isi_ms").cumcount() + 1),
    "times of pulses": table(t_tms_ms=ISIS + 100, mep2_mv=ISIS / 99),
    "another muscle beside measured ISIs": table(mep2_mv=ISIS / 99).assign(isi_ms=np.linspace(9.1, 200.3, 36)),
    "all below the limit": table().assign(mep_mv=0.0),
    "measures of few values": table(onset_ms=of([20, 21, 22]), iti_s=of([5, 6]), **{"baseline µV": of([3, 4, 5])}),
    "responses": table(response=np.where((ISIS > 60) & (ISIS < 140), "yes", "no")),
    "one word in all rows": table(experimenter=of(["EK"])),
}  # fmt: skip


@pytest.mark.parametrize("kind", PLAIN)
def test_a_plain_table_is_read_whatever_it_resembles(kind: str, tmp_path: Path) -> None:
    PLAIN[kind].to_csv(tmp_path / "P01.csv", index=not kind.startswith("empty"))
    expected = PLAIN[kind].dropna(subset="isi_ms")
    for source in (tmp_path / "P01.csv", PLAIN[kind]):
        (person,) = read_people(source, IMPACT)
        assert [trial.isi_ms for trial in person.trials.told] == expected["isi_ms"].tolist()


@pytest.mark.parametrize("name", ["MEP (max - min) [mV]", "MEP max to min (mV)", "Peak-peak of max response (mV)"])
def test_the_maximum_minus_the_minimum_is_an_amplitude_from_peak_to_peak(name: str) -> None:
    (person,) = read_people(renamed(mep_mv=name), IMPACT.saying(columns={"mep": name}, units=("mV",)))
    assert len(person.trials.told) == 36


def test_a_person_may_be_called_na() -> None:
    people = read_people(long("subject", ["AB", "NA", "KL"]), IMPACT)
    assert [one.subject for one in people] == ["AB", "NA", "KL"]
    (person,) = read_people(long("subject", ["NA"]), IMPACT)
    assert person.subject == "NA"


def test_a_german_workbook_is_read_at_once(tmp_path: Path) -> None:
    made = pd.DataFrame(
        {
            "Proband": "AB", "Nr.": range(1, 5), "Intervall (ms)": [10, "nur TMS", 40, 80],
            "MEP-Amplitude (mV)": ["0,1", "0,12", "0,5", "0,7"], "verworfen": ["nein", "nein", "ja", "nein"],
        }
    )  # fmt: skip
    with pd.ExcelWriter(tmp_path / "Daten.xlsx") as book:
        pd.DataFrame({"Studie": ["Klopfen"], "Leitung": ["EK"]}).to_excel(book, sheet_name="Angaben", index=False)
        made.to_excel(book, sheet_name="Messung", index=False, startrow=1)
    (person,) = read_people(tmp_path / "Daten.xlsx", IMPACT)
    assert (person.subject, [trial.isi_ms for trial in person.trials.told]) == ("AB", [10, None, 80])
    with pd.ExcelWriter(tmp_path / "Daten.xlsx") as book:
        for name in ("A", "B"):
            made.rename(columns={"Intervall (ms)": "dt"}).to_excel(book, sheet_name=name, index=False)
    with pytest.raises(IsiwError, match=r"no sheet .*A \(Proband, Nr\., dt.*--sheet NAME"):
        read_people(tmp_path / "Daten.xlsx", IMPACT)
    pd.DataFrame([["", ""], [1, 2]]).to_excel(tmp_path / "leer.xlsx", index=False, header=False)
    with pytest.raises(IsiwError, match="got 'no names'"):
        read_people(tmp_path / "leer.xlsx", IMPACT)


def with_events(change: Callable[[list[tuple[float, str]]], list[tuple[float, str]]]) -> Any:
    made = raw()
    rows = change(sorted(recording()[1]))
    return made.set_annotations(mne.Annotations([at for at, _ in rows], 0.0, [name for _, name in rows]))


def test_pulses_without_a_tap_among_pairs_are_asked_about_and_are_what_is_said() -> None:
    asking = Layout(reference="impact", markers=NAMES, channels={"emg": "FCR"})
    with pytest.raises(IsiwError, match=r"1 pulse of 6 .*--unmarked alone .*--unmarked lost"):
        read_people(raw(), asking)
    missing = with_events(lambda rows: rows[:2] + rows[3:])  # the second tap's marker
    with pytest.raises(IsiwError, match="2 pulses of 6"):
        read_people(missing, asking)
    (person,) = read_people(missing, asking.saying(unmarked="lost"))
    assert [str(trial.reason or "") for trial in person.trials] == ["", "no impact", "", "", "", "no impact"]
    require_as_written(read_people(raw(), asking.saying(unmarked="alone"))[0])
    said = with_events(lambda rows: [*rows[:-1], (rows[-1][0], "TMS alone")])
    require_as_written(read_people(said, asking)[0])
    with pytest.raises(IsiwError, match="says TMS alone, and a tap came 30 ms before"):
        read_people(with_events(lambda rows: [*rows, (rows[1][0], "TMS alone")]), asking)


def test_a_pulse_just_before_the_tap_is_a_mistrial_in_a_recording_as_in_a_table() -> None:
    early = with_events(lambda rows: [(rows[1][0] + 0.002, rows[0][1]), *rows[1:]])
    (person,) = read_people(early, KNOWN)
    (other,) = read_people(pd.DataFrame({"isi_ms": [-2.0, 60, 90], "mep_mv": [0.4, 0.9, 1.6]}), IMPACT)
    for one in (person, other):
        assert str(one.trials[0].reason) == "TMS before impact"
        assert one.trials[0].isi_ms == pytest.approx(-2.0)


def test_an_annotation_of_bad_data_leaves_the_events_of_a_stim_channel(tmp_path: Path) -> None:
    made = with_stim(pulsed(1))
    made.set_annotations(mne.Annotations([12.5], [0.5], ["BAD_movement"]))
    made.save(tmp_path / "P01_raw.fif")
    layout = Layout(reference="impact", markers={"tap": "1", "pulse": "2"}, unmarked="alone")
    require_as_written(read_people(tmp_path / "P01_raw.fif", layout)[0])


def eeglab(path: Path, scale: float, *more: dict[str, Any], cut: slice = slice(0)) -> Path:
    emg = scale * EMG_MV
    stimuli: list[dict[str, Any]] = [{"type": name, "latency": 1 + round(at * RATE_HZ)} for at, name in recording()[1]]
    kept = np.ones(len(emg), dtype=bool)
    kept[cut] = False
    for one in stimuli:
        one["latency"] = float(one["latency"] - (~kept[: int(one["latency"])]).sum())
    eeg = {"data": emg[None, kept], "srate": RATE_HZ, "nbchan": 1.0, "pnts": float(kept.sum()), "trials": 1.0}
    events = [{"duration": 0.0, **one} for one in (*stimuli, *more)]
    scipy.io.savemat(path / "P01.set", {"EEG": {**eeg, "event": events, "chanlocs": [{"labels": "FCR"}] * 1}})
    return path / "P01.set"


def test_a_stated_unit_is_that_of_the_numbers_of_an_eeglab_file(tmp_path: Path) -> None:
    path = eeglab(tmp_path, 1.0)
    with pytest.raises(IsiwError, match="--unit mV"):
        read_people(path, KNOWN)
    require_as_written(read_people(path, KNOWN.saying(units=("mV",)))[0])
    (person,) = read_people(eeglab(tmp_path, 1e3), KNOWN)
    require_as_written(person)
    assert "µV are usual" in person.notes[0]


def test_what_was_cut_out_of_an_eeglab_file_is_a_gap(tmp_path: Path) -> None:
    gap = slice(8400, 10000)  # 0.1 s after a tap of another kind, up to 2.5 s
    boundary = {"type": "boundary", "latency": 8400.5, "duration": 1600.0}
    require_as_written(read_people(eeglab(tmp_path, 1e3, boundary, cut=gap), KNOWN)[0])


def test_a_stated_unit_is_used_or_refused() -> None:
    with pytest.raises(IsiwError, match=r"cannot be in mV.*say --unit V"):
        read_people(raw(), KNOWN.saying(units=("mV",)))
    (person,) = read_people(raw(1e3), KNOWN.saying(units=("mV",)))
    require_as_written(person)


def test_epochs_about_the_tap_are_cut_at_the_pulse() -> None:
    whole = raw()
    found, ids = mne.events_from_annotations(whole, regexp=NAMES["tap"])
    held = pd.DataFrame({"isi_ms": ISIS_MS})
    made = mne.Epochs(whole, found, ids, -0.3, 0.3, baseline=None, preload=True, metadata=held)
    (person,) = read_people(made, KNOWN)
    (other,) = read_people(epochs(), KNOWN)
    assert [trial.mep_mv for trial in person.trials] == pytest.approx(
        [trial.mep_mv for trial in other.trials][:5], rel=0.01
    )


@pytest.mark.parametrize("later_s", [0.01, -0.01, 0.025, 0.045])
def test_sweeps_whose_time_0_is_not_at_the_pulse_are_asked_about(later_s: float) -> None:
    silent = epochs().set_annotations(None)
    with pytest.raises(IsiwError, match=r"most responses .* are not within 15–35 ms after the pulse.*mep_window_ms = "):
        read_people(silent.shift_time(later_s), KNOWN)
    if later_s == 0.01:
        require_as_written(read_people(silent, KNOWN.saying(mep_window_ms=(20.0, 50.0)))[0])


def test_emg_that_is_not_rectified_is_not_said_to_be(tmp_path: Path) -> None:
    made, artefact = raw(), np.convolve(pulsed(1, NAMES["pulse"], 0.02), np.exp(-np.arange(40) / 4))
    made.apply_function(lambda values: values + artefact[: len(values)], picks="all")  # nor is what a pulse does itself
    made.apply_function(lambda values: values + 2e-3, picks="all")  # an offset is none
    assert read_people(made, KNOWN)[0].notes == ()
    assert read_people(as_edf(tmp_path), KNOWN)[0].notes == ()


@pytest.mark.parametrize(
    ("shown", "name", "says"),
    [
        ("0.0%", "MEP", r"'MEP \(%\)' .* relative"),
        ('0.0" µV"', "mep_mv", "two units; got 'uV and mV'"),
        ("0.000,", "mep_mv", r"'mep_mv \(÷1000\)' are multiplied"),
    ],
)
def test_what_excel_shows_behind_numbers_is_their_unit(shown: str, name: str, says: str, tmp_path: Path) -> None:
    with pd.ExcelWriter(tmp_path / "P01.xlsx", engine="openpyxl") as book:
        renamed(mep_mv=name).to_excel(book, index=False)
        for cells in book.book.active.iter_rows(min_row=2, min_col=2):
            cells[0].number_format = shown
    with pytest.raises(IsiwError, match=says):
        read_people(tmp_path / "P01.xlsx", IMPACT.saying(units=("mV",)))


def test_events_of_two_names_that_may_mark_the_pulse_are_asked_about() -> None:
    words = {NAMES["tap"]: "tap", NAMES["pulse"]: "TMS"}
    two = with_events(
        lambda rows: [(at, words[name] if at < 6 or name == NAMES["tap"] else "Pulse") for at, name in rows]
    )
    with pytest.raises(IsiwError, match="events of 2 names in the recording may mark the pulse"):
        read_people(two, Layout(reference="impact", channels={"emg": "FCR"}, unmarked="alone"))


def test_events_of_which_nothing_is_read_are_said() -> None:
    last_s = recording()[1][-2][0]
    alone = with_events(lambda rows: [*[row for row in rows if row[0] <= last_s + 1], (0.5, "S  3"), (0.6, "S  3")])
    (person,) = read_people(alone, KNOWN)
    assert person.notes == ("Nothing is read of the events 'S  3' (2). Do some mark stimuli?",)


@pytest.mark.parametrize(("marks", "later_s", "says"), [("tap", 0.008, "2 taps"), ("pulse", 0.15, "have one tap")])
def test_a_second_tap_or_pulse_is_asked_about(marks: str, later_s: float, says: str) -> None:
    twice = with_events(lambda rows: [*rows, *((at + later_s, name) for at, name in rows if name == NAMES[marks])])
    with pytest.raises(IsiwError, match=says):
        read_people(twice, KNOWN)


@pytest.mark.slow
def test_codes_of_triggers_that_overlap_are_told_apart_in_fif_and_in_bdf(tmp_path: Path) -> None:
    codes = pulsed(200)  # for 50 ms, and ISIs are from 30 ms on
    made = with_stim(codes)
    layout = Layout(reference="impact", markers={"tap": "1", "pulse": "2"}, channels={"emg": "FCR"}, unmarked="alone")
    require_as_written(read_people(made, layout)[0])
    longer = as_status(tmp_path, np.tile([1e3 * EMG_MV, codes], 20))  # than one piece
    (person,) = read_people(longer, layout)
    assert [trial.isi_ms for trial in person.trials] == pytest.approx([*ISIS_MS, None] * 20, abs=0.3)


def as_status(path: Path, values: np.ndarray) -> Path:
    """A BDF file as BioSemi writes it: EMG [µV], and codes in the lower bits of a channel called Status."""
    count, scales = values.shape[1] // int(RATE_HZ), [[-8000, -8388608], [8000, 8388607], [-8388608] * 2, [8388607] * 2]
    said: list[Any] = [["FCR", "Status"], [""] * 2, ["uV", "Boolean"], *scales, [""] * 2, [int(RATE_HZ)] * 2, [""] * 2]
    sizes = [16, 80, 8, 8, 8, 8, 8, 80, 8, 32]
    top = [("BIOSEMI", 7), ("", 80), ("", 80), ("01.01.26", 8), ("10.00.00", 8), (768, 8), ("24BIT", 44), (count, 8)]
    top += [(1, 8), (2, 4), *((one, size) for each, size in zip(said, sizes, strict=True) for one in each)]
    digital = np.stack([np.round((values[0] + 8000) * (16777215 / 16000) - 8388608), values[1] + 65536]).astype("<i4")
    records = digital[:, : count * int(RATE_HZ)].reshape(2, count, -1).swapaxes(0, 1)
    packed = np.ascontiguousarray(records).view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    (path / "P01.bdf").write_bytes(b"\xff" + "".join(str(one).ljust(size) for one, size in top).encode() + packed)
    return path / "P01.bdf"


def test_a_trigger_whose_level_turns_at_each_stimulus_is_asked_about() -> None:
    turns = 5.0 * (np.cumsum(pulsed(1, NAMES["pulse"], 1.0)) % 2)
    with pytest.raises(IsiwError, match="which of its edges are stimuli"):
        read_people(with_stim(turns, "emg"), Layout(reference="impact", channels={"emg": "FCR", "pulse": "STI"}))


@pytest.mark.parametrize("change", [np.abs, lambda emg: np.abs(emg) - 0.02, lambda emg: -np.abs(emg)])
def test_rectified_emg_is_noticed_at_any_level_and_upside_down(change: Callable[[np.ndarray], np.ndarray]) -> None:
    made = raw()
    made.apply_function(lambda values: 1e-3 * change(1e3 * values), picks="all")
    assert "as if it was rectified" in read_people(made, KNOWN)[0].notes[0]


@pytest.mark.slow
def test_a_pause_in_a_column_of_times_is_a_gap(tmp_path: Path) -> None:
    rows = lines(EMG_MV, trigger("tap"), trigger("pulse")).splitlines(keepends=True)
    (tmp_path / "P01.txt").write_text("".join([*rows[:12040], *rows[12120:]]))  # 20 ms after the second tap
    said: dict[str, Any] = {"names": ("time", "EMG", "Hammer", "TMS"), "separator": "\t", "units": ("mV",)}
    channels = {"emg": "EMG", "tap": "Hammer", "pulse": "TMS"}
    layout = Layout(reference="impact", rate_hz=RATE_HZ, channels=channels, unmarked="alone", **said)
    (person,) = read_people(tmp_path / "P01.txt", layout)
    assert [trial.isi_ms for trial in person.trials] == pytest.approx([*ISIS_MS, None], abs=1000 / RATE_HZ)
    with pytest.raises(IsiwError, match=r"'time' of P01\.txt says; got '2000 Hz'; expected 4000 Hz"):
        read_people(tmp_path / "P01.txt", layout.saying(rate_hz=2000.0))
