"""Amplitudes and ISIs that are not what their unit says: relative, halves, or multiplied; and flags beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.io

from existing.test_languages import IMPACT
from existing.test_tables import trials_of
from isiw.errors import IsiwError
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

RNG = np.random.default_rng(7)
ISIS = np.where(np.arange(48) % 4 == 3, np.nan, RNG.uniform(5, 195, 48).round(1))
MEPS = (0.6 * np.exp(0.4 * RNG.standard_normal(48))).round(3)
ALONE = np.isnan(ISIS)
STATED = Layout("impact", units=("ms", "mV"), alone="")
IN_UV = STATED.saying(units=("uV",))


def table(meps: Any = MEPS, isi: Any = "ISI (ms)", mep: Any = "MEP (mV)", **more: Any) -> pd.DataFrame:
    return pd.DataFrame({isi: ISIS, mep: meps, **more})


def few(bad: Any, good: Any) -> list[Any]:
    return [bad if n % 9 == 4 else good for n in range(48)]


@pytest.mark.parametrize(
    ("meps", "says", "layout"),
    [
        (MEPS / MEPS[ALONE].mean(), "mean of TMS alone is 1", STATED),
        ((MEPS / MEPS[ALONE].mean()).round(2), "mean of TMS alone is 1", STATED),
        ((100 * MEPS / MEPS[ALONE].mean()).round(1), "mean of TMS alone is 100", IN_UV),
        (np.where(ALONE, 100, (170 * MEPS).round()), "mean of TMS alone is 100", IN_UV),
        (MEPS / np.median(MEPS[ALONE]), "median of TMS alone is 1", STATED),
        (MEPS / MEPS.mean(), "its mean is 1", STATED),
        ((MEPS / MEPS.max()).round(3), "its largest is 1", STATED),
        (np.log10(1e3 * MEPS), "scatters as little as logarithms do; got", STATED),
        (20 * np.log10(1e3 * MEPS), "scatters as little as logarithms do; got", IN_UV),
    ],
)
def test_amplitudes_that_are_relative_by_their_numbers_are_asked_about(meps: Any, says: str, layout: Layout) -> None:
    with pytest.raises(IsiwError, match=rf"'MEP' of the table .*{says}.*--where \"MEP=\*\""):
        read_people(table(meps, mep="MEP"), layout)
    kept = trials_of(read_people(table(meps, mep="MEP"), layout.saying(where={"MEP": "*"})))
    assert len(kept) == 48
    assert len(trials_of(read_people(table(1.01 * MEPS, mep="MEP"), layout.saying(units=("mV",))))) == 48


@pytest.mark.parametrize(
    ("name", "beside", "is_half"),
    [
        ("peak_mv", {"trough_mv": -0.5 * MEPS}, True),
        ("peak (mV)", {"max_mv": MEPS}, True),
        ("MEP (mV)", {"min (mV)": -0.9 * MEPS}, True),
        ("MEP (mV)", {"low (mV)": -0.9 * MEPS}, True),
        ("MEP p-p (mV)", {"min (mV)": -1.1 * MEPS}, True),
        ("MEP (mV)", {"min (mV)": -0.55 * MEPS, "max (mV)": 0.45 * MEPS}, False),
        ("MEP p-p (mV)", {"max (mV)": 0.9 * MEPS}, False),
        ("MEP (mV)", {"AUC (mV*ms)": 5 * MEPS, "min": np.arange(48) // 4}, False),
    ],
)
def test_halves_of_amplitudes_are_known_by_what_stands_beside_them(
    name: str,
    beside: dict[str, Any],
    is_half: bool,  # noqa: FBT001 - a parameter of the test
) -> None:
    layout = Layout("impact", alone="", columns={"mep": name})
    if is_half:
        with pytest.raises(IsiwError, match=r"one half of each MEP.*expected amplitudes from peak to peak"):
            read_people(table(mep=name, **beside), layout)
        layout = layout.saying(where={name: "*"})
    assert [mep for _, mep in trials_of(read_people(table(mep=name, **beside), layout))] == MEPS.tolist()


def test_the_column_of_the_meps_themselves_is_not_left_beside() -> None:
    with pytest.raises(IsiwError, match=r"'p2p \(mV\)' of the table has larger amplitudes.*--column \"mep=p2p"):
        read_people(table(**{"p2p (mV)": 1.9 * MEPS}), Layout("impact", alone=""))
    (person,) = read_people(table(**{"MEP (% of control)": 100 * MEPS}), Layout("impact", alone=""))
    assert person.unused == ("MEP (% of control)",)
    more = {"amplitude": np.arange(48) % 11 + 48, "response (uV)": 1e3 * MEPS}
    with pytest.raises(IsiwError, match=r"'response \(uV\)' .* says a unit .* 'amplitude' says none"):
        read_people(table(**more).drop(columns="MEP (mV)"), IN_UV)
    said = IN_UV.saying(columns={"mep": "response (uV)"})
    assert trials_of(read_people(table(**more).drop(columns="MEP (mV)"), said))[0][1] == pytest.approx(MEPS[0])


@pytest.mark.parametrize(
    "name",
    ["ISI (x10 ms)", "ISI [1/10 ms]", "ISI x0.1 ms", "ISI (10^-1 ms)", "ISI (0,1 ms)", "ISI (ms*10)", "ISI 100us",
     "ISI (10⁻¹ ms)", "ISI (ms, ×10)", "MEP (10^-1 mV)", "MEP (x10 mV)", "MEP [1/10 mV]", "MEP (e-3 V)",
     "MEP*1000 (mV)", "MEP (100 µV)", "MEP (counts)", "MEP (mV²)", "MEP (mVs)", "ISI (cs)", "ISI [ticks]"],
)  # fmt: skip
def test_a_factor_or_a_strange_unit_in_a_name_is_asked_about_whatever_unit_is_stated(name: str) -> None:
    key = name[:3].casefold()
    with pytest.raises(IsiwError, match=r"are (multiplied|numbers of something|of another measure); got"):
        read_people(table(**{key: name}), STATED.saying(columns={key: name}))


@pytest.mark.parametrize("name", ["ISI_1_ms", "isi2_ms", "ISI 1 ms", "ISI (ms), block 2", "ISI/ms"])
def test_other_numbers_in_a_name_are_no_factors(name: str) -> None:
    assert len(trials_of(read_people(table(isi=name), STATED.saying(columns={"isi": name})))) == 48


def test_a_factor_in_a_label_or_a_unit_beside_is_asked_about() -> None:
    with pytest.raises(IsiwError, match=r"'ISI \(0\.1 ms\)' are multiplied"):
        read_people(table(isi="ISI", isi_unit=["0.1 ms"] * 48), STATED)
    with pytest.raises(IsiwError, match=r"'nominal ISI \(x10 ms\)' are multiplied"):
        read_people(table(**{"nominal ISI (x10 ms)": ISIS}), STATED)


def test_a_unit_that_is_stated_against_a_name_is_asked_about_until_the_name_is_said_to_be_wrong() -> None:
    made = table(mep="MEP (µV)")
    with pytest.raises(IsiwError, match=r"'MEP \(µV\)' .* says another unit .* got 'mV'; expected uV.*MEP \(µV\)=\*"):
        read_people(made, STATED)
    kept = trials_of(read_people(made, STATED.saying(where={"MEP (µV)": "*"})))
    assert [mep for _, mep in kept] == MEPS.tolist()
    with pytest.raises(IsiwError, match="got 'ms'; expected s"):
        read_people(table(isi="ISI (s)"), STATED)


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        (few(0, 1), r"says yes or no of each pair.*--column \"exclude=x\".*--where \"x=\*\""),
        (few("x", ""), "says yes or no"),
        (few("FALSE", "TRUE"), "says yes or no"),
        (few("double tap", ""), "may say that the trial does not count"),
        (few("amplifier saturated", ""), "may say that the trial does not count"),
        (few("no tap", ""), "says TMS alone, and nothing is read of it"),
    ],
)
def test_flags_and_remarks_of_any_name_are_asked_about(cells: list[Any], says: str, tmp_path: Path) -> None:
    made = table(x=cells)[~ALONE]
    made.to_csv(tmp_path / "P01.csv", index=False)
    with pytest.raises(IsiwError, match=says):
        read_people(tmp_path / "P01.csv", IMPACT)
    of_range = table(x=((ISIS > 60) & (ISIS < 120)).astype(int))[~ALONE]  # which the ISIs say themselves
    assert read_people(of_range, IMPACT)[0].unused == ("x",)


def test_one_isi_that_comes_again_and_again_among_others_that_do_not_is_asked_about() -> None:
    with pytest.raises(IsiwError, match=r"12 rows .* have the ISI 250 ms, which may stand for TMS alone"):
        read_people(table(**{"ISI (ms)": np.where(ALONE, 250.0, ISIS)}), IMPACT)


def test_an_empty_field_of_a_structure_for_each_trial_is_an_empty_cell(tmp_path: Path) -> None:
    trials = [{"isi_ms": [] if np.isnan(isi) else isi, "mep_mv": mep} for isi, mep in zip(ISIS, MEPS, strict=True)]
    scipy.io.savemat(tmp_path / "P01.mat", {"trials": trials})
    found = trials_of(read_people(tmp_path / "P01.mat", Layout("impact", alone="")))
    assert [isi is None for isi, _ in found] == ALONE.tolist()


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_a_title_says_units_and_what_is_relative(suffix: str, tmp_path: Path) -> None:
    rows = [[isi / 1e3, mep] for isi, mep in zip(ISIS[~ALONE], MEPS[~ALONE], strict=True)]

    def titled(title: str, mep: str = "MEP") -> Path:
        made, path = pd.DataFrame([[title, None], ["ISI", mep], *rows]), tmp_path / f"P01{suffix}"
        made.to_csv(path, index=False, header=False) if suffix == ".csv" else made.to_excel(
            path, index=False, header=False
        )
        return path

    found = trials_of(read_people(titled("P01 at 110 % of RMT: ISI in s and MEP in mV"), IMPACT))
    assert [isi for isi, _ in found] == pytest.approx([1e3 * isi for isi, _ in rows])
    assert [mep for _, mep in found] == [mep for _, mep in rows]
    for title, says in (("MEP in % of control", "relative by what the title says"), ("ISI in samples", "got 'samples'"),
                        ("ISI in s and MEP in µV", "another unit than the one that is stated")):  # fmt: skip
        with pytest.raises(IsiwError, match=says):
            read_people(titled(title), IMPACT.saying(units=("s", "mV")))


@pytest.mark.parametrize("name", ["Intervall ab Magnetventil (ms)", "délai vanne (ms)", "ISI re solenoid (ms)"])
def test_valves_have_names_in_several_languages(name: str) -> None:
    with pytest.raises(IsiwError, match=r"the column .* of the table counts from another event.*--column isi=NAME"):
        read_people(table(isi=name), STATED.saying(columns={"isi": name}))


def test_portuguese_and_other_words_are_found() -> None:
    for exclude, yes, alone in (("excluído", "sim", "pulso único"), ("afgekeurd", "ja", "enkele puls"),
                                ("à exclure", "oui", "choc test"), ("da scartare", "sì", "solo TMS"),
                                ("exclu", "oui", "TMS seule"), ("escluso", "sì", "TMS sola"),
                                ("uitgesloten", "ja", "alleen TMS")):  # fmt: skip
        isis = [alone if np.isnan(isi) else isi for isi in ISIS]
        cells = {"ensaio": range(48), "intervalo (ms)": isis, "amplitude (mV)": MEPS, exclude: few(yes, "")}
        (person,) = read_people(pd.DataFrame(cells), Layout("impact"))
        assert [trial.told for trial in person.trials] == few(False, True)
        assert [trial.isi_ms is None for trial in person.trials] == ALONE.tolist()
