"""The comparison of strategies: what its rows come to, what is said of them, and that it continues where it stopped."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from benchmarks.compare import write
from benchmarks.comparison import running
from benchmarks.comparison.measures import lasting, ratio, table_of
from benchmarks.comparison.rows import EVEN, GUESS, Part, chosen, matrix, parts
from benchmarks.comparison.running import (
    RECORDED,
    Plan,
    as_study,
    keep,
    recorded_units,
    require_same,
    rows_of,
    run_part,
    timed,
)
from benchmarks.comparison.words import choosing, compared_rows, ratio_of, readme_table, saving, sentences, trusting
from benchmarks.quick import expanded

import isiw
from isiw.strategy.catalogue import measured_of
from isiw.studies import StudyStrategy, Unit

FAMILY = Path(__file__).parents[2] / "benchmarks" / "results" / "gp_family.json"
MARKS = (0, 10, 20, 40)
FAST = Part("few", (StudyStrategy("random", {"particles": 20}), StudyStrategy("even", {"particles": 20})), batch=1)


def test_a_lasting_f1_is_read_between_the_marks() -> None:
    assert lasting([0.5, 0.6, 0.8, 0.9], MARKS, 0.7) == pytest.approx(15.0)
    assert lasting([0.5, 0.8, 0.6, 0.8], MARKS, 0.7) == pytest.approx(30.0)  # what is lost again does not last
    assert lasting([0.7, 0.7, 0.7, 0.7], MARKS, 0.7) == 0.0
    assert lasting([0.9, 0.9, 0.9, 0.6], MARKS, 0.7) == math.inf
    assert lasting([[0.5, 0.6, 0.8, 0.9], [0.0, 0.0, 0.0, 0.7]], MARKS, 0.7) == pytest.approx([15.0, 40.0])


def people(*means: float, n: int = 40, spread: float = 0.0) -> np.ndarray:
    offsets = np.linspace(-spread, spread, n)[:, None]
    return np.array(means) + offsets


def test_half_the_stimuli_of_even_isis_are_a_ratio_of_a_half() -> None:
    found = ratio(people(0.5, 0.7, 0.8, 0.9, spread=0.05), people(0.5, 0.6, 0.7, 0.9, spread=0.05), MARKS, 0.7)
    assert (found["stimuli"], found["even"], found["bound"]) == (pytest.approx(10.0), pytest.approx(20.0), "")
    assert found["ratio"] == pytest.approx(0.5)
    assert found["low"] < 0.5 < found["high"] < 1.0


def test_a_ratio_is_a_bound_where_one_of_both_does_not_reach_it() -> None:
    good, bad = people(0.5, 0.7, 0.8, 0.9), people(0.5, 0.5, 0.5, 0.5)
    for own, even, bound, value in ((good, bad, "below", 0.25), (bad, good, "above", 4.0)):
        found = ratio(own, even, MARKS, 0.7)
        assert (found["bound"], found["ratio"]) == (bound, pytest.approx(value))
    assert ratio(bad, bad, MARKS, 0.7)["bound"] == "unknown"


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [(0.3, 0.7, ".50 (.30 to .70)"), (0.3, math.inf, ".50 (≥ .30)"), (math.nan, math.nan, ".50 (no interval)")],
)
def test_an_interval_says_which_of_its_ends_nobody_knows(low: float, high: float, said: str) -> None:
    line = {"strategy": "default", "bound_0.7": "", "ratio_0.7": 0.5, "low_0.7": low, "high_0.7": high}
    assert ratio_of(line, 0.7) == said


def rows_with(means: Mapping[str, tuple[float, ...]], cohort: str = "recruitment") -> pd.DataFrame:
    """Rows of twenty people, who expect .8 from 20 stimuli on, and whose F1 is spread by .019 around the mean."""
    rng = np.random.default_rng(3)
    found = [
        {"strategy": name, "cohort": cohort, "person": person, "seed": 1, "trial": mark, "delivered": mark}
        | {"f1": f1 + offset, "expected_f1": 0.8 if mark >= 20 else math.nan, "true_window": True}
        | {"start_covered": 1.0, "end_covered": float(person % 2), "reported_window": True, "answered": True}
        | dict.fromkeys(("stop_trial", "stop_f1", "converged", "ask_ms", "tell_ms"), math.nan)
        for name, f1s in means.items()
        for mark, f1 in zip(MARKS, f1s, strict=True)
        for person, offset in enumerate(rng.permutation(np.linspace(-0.019, 0.019, 20)))
    ]
    return pd.DataFrame(found)


FOUND = {
    "default": (0.5, 0.7, 0.8, 0.9),
    EVEN: (0.5, 0.6, 0.7, 0.75),
    "nr": (0.0, 0.44, 0.44, 0.44),
    GUESS: (0.6, 0.6, 0.6, 0.6),
}


def test_the_table_has_what_a_column_says() -> None:
    table = table_of(rows_with(FOUND), {"nr": 3.0}).set_index("strategy")
    default, nr = table.loc["default"], table.loc["nr"]
    assert default["f1_20"] == pytest.approx(0.8)
    assert nr["excess_20"] == pytest.approx(0.8 - 0.44)
    assert default["coverage_20"] == pytest.approx(0.75)
    assert (default["wrong_20"], nr["wrong_20"]) == (0.0, 0.75)  # fifteen of twenty are not above .45
    assert (nr["processor_ms"], nr["people"], nr["trials"], nr["bound_0.7"]) == (3.0, 20, 40, "above")


def said(means: Mapping[str, tuple[float, ...]]) -> list[str]:
    rows = rows_with(means)
    return sentences(table_of(rows, {}), rows)


def test_without_even_isis_no_ratio_to_them_is_given() -> None:
    rows = rows_with({"nr": (0.5, 0.7, 0.8, 0.9)})
    (line,) = table_of(rows, {}).to_dict("records")
    assert {line[f"bound_{criterion}"] for criterion in (0.7, 0.8, 0.9)} == {"unknown"}


def test_the_sentences_have_the_figures() -> None:
    first, second, third = said(FOUND)
    assert "on 20 simulated people with noise as near the motor threshold (`recruitment`)" in first.lower()
    assert "from 10 stimuli on, evenly spaced ISIs from 20: 50 % fewer (ratio .50" in first
    assert "of 2 other ways" in second
    assert "2 have a lower mean F1" in second
    assert "`even` (−.10" in second
    assert "0 % of the default's answers" in third
    assert "`nr` (75 %)" in third
    assert "not above it are `nr`" in third


def test_without_the_main_people_the_tables_are_written_and_nothing_else(tmp_path: Path) -> None:
    write(rows_with(FOUND).assign(cohort="gaussian"), {}, {}, tmp_path / "c")
    assert {path.name for path in tmp_path.iterdir()} == {"c.json", "c.md"}
    assert "What follows" not in (tmp_path / "c.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_other_figures_are_another_sentence() -> None:
    worse = FOUND | {"default": FOUND[EVEN], EVEN: FOUND["default"], "nr": (0.0, 0.9, 0.9, 0.9)}
    first, second, third = said(worse)
    assert "more (ratio 2" in first
    assert "2 a higher one (`even`, `nr`)" in second
    assert "of no other row's" in third
    assert "each of 3 rows is above it" in third
    assert "does not keep" in said(FOUND | {"default": FOUND["nr"]})[0]
    assert "evenly spaced ISIs not within 40" in said(FOUND | {EVEN: FOUND["nr"]})[0]


def test_a_saving_that_may_be_chance_is_called_so() -> None:
    line = {"people": 9, "cohort": "gaussian", "trials": 40}
    found = {"stimuli": 9.0, "even": 10.0, "ratio": 0.9, "low": 0.4, "high": 1.3, "bound": ""}
    line |= {f"{name}_0.7": value for name, value in found.items()} | {"bound_0.8": "unknown", "bound_0.9": "below"}
    assert "may be chance" in saving(line)
    assert "too early to compare" in saving(line | {"ratio_0.7": math.nan})


def test_readmes_table_has_the_methods_that_met_all_people_of_the_default() -> None:
    rows = rows_with(FOUND)
    fewer = rows[(rows["strategy"] != "nr") | (rows["person"] < 5)]
    shown = compared_rows(fewer, "recruitment")
    assert set(shown["strategy"]) == {"default", EVEN, GUESS}
    shown = compared_rows(rows[(rows["strategy"] != "default") | (rows["person"] < 5)], "recruitment")
    assert set(shown["person"]) == set(range(5))
    text = readme_table({"recruitment": table_of(shown, {})})
    assert "| 5: noise as near threshold" in text
    assert text.index("no stimulus") < text.index("evenly") < text.index("nonlinear") < text.index("default")


def plan_in(folder: Path) -> Plan:
    return Plan(folder, people=3, trials=5, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("cohort", ["gaussian", RECORDED])
def test_what_was_interrupted_continues_with_the_same_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cohort: str
) -> None:
    monkeypatch.setattr(running, "recordings", lambda: tmp_path)
    monkeypatch.setattr(running.RecordedSession, "subject", lambda self: person(self.person))
    ran: list[str] = []

    def killed(key: str) -> None:
        ran.append(key)
        if len(ran) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_part(plan_in(tmp_path / "a"), FAST, cohort, killed)
    assert len(rows_of(plan_in(tmp_path / "a"))) == 3 * len((0, 5))
    run_part(plan_in(tmp_path / "a"), FAST, cohort, ran.append)
    assert sorted(ran) == sorted({*ran})
    run_part(plan_in(tmp_path / "b"), FAST, cohort)
    again, once = (rows_of(plan_in(tmp_path / name)) for name in "ab")
    pd.testing.assert_frame_equal(again, once)


@pytest.mark.slow
def test_another_computer_continues_from_the_rows_alone(tmp_path: Path) -> None:
    here, there = plan_in(tmp_path / "here"), plan_in(tmp_path / "there")
    run_part(replace(here, first=2), FAST, "gaussian")
    keep(here, rows_of(here))
    shutil.copy(here.file, there.file)
    ran: list[str] = []
    require_same(there, FAST)
    run_part(there, FAST, "gaussian", ran.append)
    assert ran == ["random.gaussian.00002-00002", "even.gaussian.00002-00002"]
    run_part(here, FAST, "gaussian")
    pd.testing.assert_frame_equal(rows_of(there), rows_of(here))
    table_of(as_study(rows_of(there)), timed(there))


@pytest.mark.slow
@pytest.mark.parametrize("other", [{"f1": 0.5}, {"seed": 4}, {"trial": 7}])
def test_rows_of_another_comparison_are_not_continued(tmp_path: Path, other: Mapping[str, float]) -> None:
    plan = plan_in(tmp_path / "plan")
    run_part(replace(plan, first=1), FAST, "gaussian")
    keep(plan, rows_of(plan).assign(**other))
    with pytest.raises(SystemExit, match="another comparison"):
        require_same(plan_in(tmp_path / "plan"), FAST)


def person(number: int) -> isiw.subjects.SimulatedSubject:
    return isiw.subjects.cohort("gaussian", 3, seed=1)[number]


@pytest.mark.slow
def test_the_first_people_come_first_and_the_others_later(tmp_path: Path) -> None:
    plan, ran = plan_in(tmp_path), list[str]()
    run_part(replace(plan, first=1), FAST, "gaussian", ran.append)
    assert len(ran) == 2
    run_part(replace(plan, first=1), FAST, "gaussian", ran.append)
    assert len(ran) == 2
    run_part(plan, FAST, "gaussian", ran.append)
    assert len({*ran}) == len(ran) == 6


def test_recorded_people_state_their_own_hit_delay(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    stated = replace(person(0), stated_hit_delay_ms=(170.0, 3.0))
    monkeypatch.setattr(running.RecordedSession, "subject", lambda _self: stated)
    units: list[Unit] = recorded_units(plan_in(tmp_path).study(FAST, RECORDED))
    settings: dict[str, Any] = dict(units[0].sessions[0].settings)
    assert (settings["hit_delay_ms"], settings["particles"]) == ((170.0, 3.0), 20)
    assert (units[0].sessions[0].cohort, units[0].key) == (RECORDED, "random.recorded.00000-00000")


@pytest.mark.slow
def test_the_matrix_repeats_no_named_strategy() -> None:
    labels = [strategy.label for strategy in matrix("particles")]
    assert "particles+straddle" in labels
    assert not {"particles+alternating", "particles+mutual-information", "particles+even"} & set(labels)


@pytest.mark.slow
def test_a_quick_look_has_rows_of_every_family() -> None:
    words = expanded("compare", ["--quick"])
    named = words[words.index("--parts") + 1].split(",")
    rows = int(words[words.index("--rows") + 1])
    run = chosen(parts(1, 1, rows), named)
    models = {
        type(isiw.make_strategy(row.name).model) for part in run for row in part.strategies if ":" not in row.name
    }
    assert models == {type(isiw.make_strategy(name).model) for name in isiw.list_strategies()}
    assert all(len(part.strategies) <= rows for part in run if part.name != "named")
    assert {row.label for part in run for row in part.strategies if ":" in row.name} == {
        f"gp+botorch-{name}" for name in ("ei", "nipv", "jes")
    }


def test_a_comparison_with_one_person_says_that_it_cannot() -> None:
    assert "too few people" in choosing(pd.DataFrame({"low": [math.nan], "difference": [0.1]}))
    main = pd.DataFrame(
        {"wrong_20": [0.5, math.nan], "f1_20": [0.7, 0.6], "f1_40": [0.7, 0.6], "people": 2}, index=["default", GUESS]
    )
    assert "50 % of the default's answers" in trusting(main)


def test_the_best_of_the_others_is_one_of_those_that_most_people_have() -> None:
    rows = {"strategy": ["few", "many", "worse"], "people": [10, 200, 200], "difference": [0.2, 0.01, -0.1]}
    compared = pd.DataFrame({**rows, "low": [-0.3, -0.02, -0.15], "high": [0.7, 0.04, -0.05]})
    assert "best of those on the most people is `many` (+.01, −.02 to +.04, 200 people)" in choosing(compared)


def test_what_a_gaussian_process_says_of_itself_is_what_was_measured() -> None:
    rows = pd.DataFrame(json.loads(FAMILY.read_text(encoding="utf-8"))["All rows"])
    named = [name for name in isiw.list_strategies() if name.startswith("gp-")]
    own = rows[(rows["cohort"] == "recruitment") & rows["strategy"].isin(named)].set_index("strategy")
    assert sorted(own.index) == sorted(named)
    for name in named:
        said = measured_of(name)
        assert said is not None
        assert said.people == own["people"][name]
        assert said.coverage == pytest.approx(own.loc[name, ["coverage_20", "coverage_40"]], abs=0.005)
        assert said.wrong == pytest.approx(own.loc[name, ["wrong_20", "wrong_40"]], abs=0.005)
