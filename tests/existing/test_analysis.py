from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import isiw
from isiw.errors import InvalidValueError, LogError, StrategyError
from isiw.existing.analysis import analysed
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people
from isiw.figures import Estimate
from isiw.trials import Trial

SPACE = isiw.DesignSpace(0, 200, 5, reference="impact")
FEW: dict[str, Any] = {"particles": 100}


def told(n: int = 12, seed: int = 3, person: int = 0) -> tuple[list[float], list[float]]:
    """ISIs and MEPs of a simulated person."""
    responder = isiw.subjects.cohort("gaussian", person + 1, seed)[person].begin(seed)
    isis_ms = np.random.default_rng(seed).choice(SPACE.grid_ms, n).tolist()
    return isis_ms, [responder.respond(isi_ms, "impact").mep_mv for isi_ms in isis_ms]


def belief(estimate: Estimate) -> dict[str, Any]:
    """What an estimate says of the window, and not of what is asked next."""
    return estimate.model_dump(
        exclude={"next_isi_ms", "stop", "reason", "stop_kind", "chosen_by", "scored_ms", "scores"}
    )


def test_trials_that_exist_say_what_a_strategy_that_was_told_them_says() -> None:
    isis_ms, meps_mv = told()
    strategy = isiw.make_strategy(space=SPACE, seed=5, **FEW)
    for isi_ms, mep_mv in zip(isis_ms, meps_mv, strict=True):
        strategy.learn(Trial.of(isi_ms, mep_mv))
    analysis = isiw.analyse(isis_ms, meps_mv, space=SPACE, seed=5, **FEW)
    assert str(analysis.estimate) == str(strategy.estimate())
    assert analysis.estimate.pairs == len(isis_ms)


@pytest.mark.slow
def test_a_session_that_is_exported_and_analysed_again_says_the_same_to_the_last_digit(tmp_path: Path) -> None:
    space = isiw.DesignSpace(0, 300, reference="valve")
    person = isiw.subjects.cohort("recruitment", 2, 4)[1]
    responder = person.begin(4)
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(lambda isi_ms: responder.respond(isi_ms, "valve"), "valve"))
    settings = {"max_trials": 14, **FEW}
    strategy = isiw.make_strategy(space=space, seed=7, **settings)
    protocol = isiw.VisitProtocol(tms_alone=0.2)
    isiw.Session(device, strategy, log=tmp_path / "P1.mcap", subject="P1", protocol=protocol).run()
    isiw.exclude(tmp_path / "P1.mcap", 3, "moved")
    isiw.resume(tmp_path / "P1.mcap", device).run()
    measured = isiw.read_session(tmp_path / "P1.mcap")
    isiw.export.export_logs(tmp_path / "P1.mcap", tmp_path / "tables")
    (delivered,) = read_people(tmp_path / "tables" / "trials.csv", Layout(reference="valve"))
    analysis = analysed(delivered, isiw.make_strategy(space=space, seed=7, **settings))
    assert belief(analysis.record.estimates[-1]) == belief(measured.estimates[-1])
    assert [trial.isi_ms for trial in delivered.trials] == [trial.isi_ms for trial in measured.table]
    assert sum(trial.is_control for trial in delivered.trials) > 0
    assert [trial.excluded for trial in delivered.trials] == [trial.excluded for trial in measured.table]


def test_an_export_of_single_trials_at_isis_of_their_own_is_read_as_what_it_is(tmp_path: Path) -> None:
    with isiw.open_session(isiw.make_strategy("even", SPACE, 1, particles=50), log=tmp_path / "P1.mcap") as session:
        for number in range(5):
            session.tell(session.ask() + 0.1 * number, 0.1 + 0.01 * number)
        session.tell(session.ask(), mep_interval_mv=(0.05, math.inf))
        session.tell(session.ask(), mep_interval_mv=(0.0, 0.05))
    isiw.export.export_logs(tmp_path / "P1.mcap", tmp_path / "tables")
    (delivered,) = read_people(tmp_path / "tables" / "trials.csv", Layout(reference=SPACE.reference))
    record = isiw.read_session(tmp_path / "P1.mcap")
    assert list(delivered.trials) == list(record.table)
    assert record.trials[["mep_low_mv", "mep_high_mv"]].notna().sum().tolist() == [2, 1]
    assert [row[2] for row in isiw.report.words.trial_rows(record)][-2:] == ["above 50 µV", "0–50 µV"]


@pytest.mark.parametrize(
    ("dates", "day", "fact"),
    [({}, "P7", "not known; imported 20"), ({"date": "2024-05-01 10:00"}, "P7, 2024-05-01 (UTC)", "2024-05-01 10:00")],
)
def test_trials_without_dates_are_of_no_day(dates: dict[str, str], day: str, fact: str) -> None:
    isis_ms, meps_mv = told()
    table = pd.DataFrame({"isi_ms": isis_ms, "mep_mv": meps_mv, **dates})
    (delivered,) = read_people(table, Layout(reference="impact"), subject="P7")
    record = analysed(delivered, isiw.make_strategy(space=SPACE, **FEW)).record
    assert isiw.plots.session_figure(record).get_suptitle() == day
    assert dict(isiw.report.tables.first_facts(record))["date"].startswith(fact)
    ((_, _, begun, *_),) = isiw.report.comparison.comparison_rows([record])
    assert begun == (fact if dates else "not known")


def test_an_imported_log_says_the_same_and_that_it_was_no_session(tmp_path: Path) -> None:
    analysis = isiw.analyse(*told(), space=SPACE, subject="P01", **FEW)
    record = isiw.read_session(analysis.to_log(tmp_path / "P01.mcap"))
    assert record.header.imported
    assert record.header.kind == "imported"
    assert record.estimates == analysis.record.estimates
    assert record.finished
    assert "Imported trials of P01" in str(record)
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(LogError, match="never overwritten"):
        analysis.to_log(tmp_path / "P01.mcap")


def test_an_imported_log_cannot_go_on_and_no_trial_of_it_is_judged(tmp_path: Path) -> None:
    path = isiw.analyse(*told(), space=SPACE, **FEW).to_log(tmp_path / "P01.mcap")
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(lambda _: isiw.Measurement(0.1, 1.0), "impact"))
    for refused in (
        lambda: isiw.resume(path, device),
        lambda: isiw.resume(path),
        lambda: isiw.open_session(isiw.make_strategy(space=SPACE), path, resume=True),
        lambda: isiw.exclude(path, 2, "moved"),
    ):
        with pytest.raises(LogError, match="delivered without isiw"):
            refused()


@pytest.mark.slow
def test_pages_and_pictures_are_made_of_an_analysis(tmp_path: Path) -> None:
    analysis = isiw.analyse(*told(), space=SPACE, subject="P01", **FEW)
    analysis.plot(tmp_path / "P01.png")
    page = analysis.report(tmp_path / "P01.html").read_text("utf-8")
    assert "imported from arrays" in page
    assert (tmp_path / "P01.png").stat().st_size > 1000
    assert "<svg" in analysis._repr_html_()


def test_trials_without_an_isi_are_tms_alone_and_those_without_an_mep_are_lost() -> None:
    isis_ms, meps_mv = told()
    analysis = isiw.analyse([*isis_ms, np.nan, 50.0], [*meps_mv, 0.1, np.nan], space=SPACE, **FEW)
    alone, lost = analysis.record.table.trials[-2:]
    assert alone.is_control
    assert alone.told
    assert lost.reason == "outcome unknown"


def test_trials_beyond_the_space_teach_too() -> None:
    isis_ms, meps_mv = told(20)
    narrow = isiw.DesignSpace(50, 100, 5, reference="impact")
    analysis = isiw.analyse(isis_ms, meps_mv, space=narrow, **FEW)
    assert analysis.estimate.pairs == 20


@pytest.mark.slow
def test_of_long_series_every_trial_is_logged_and_some_of_the_beliefs() -> None:
    isis_ms, meps_mv = told(130)
    record = isiw.analyse(isis_ms, meps_mv, space=SPACE, particles=50).record
    assert len(record.table) == 130
    assert len(record.estimates) == 50
    assert record.estimates[-1].trial == 129


def test_what_is_odd_about_amplitudes_is_said() -> None:
    isis_ms, _ = told(8)
    record = isiw.analyse(isis_ms, [0.25] * 8, space=SPACE, **FEW).record
    assert [event.finding for event in record.events if event.kind == "doubt"] == ["equal amplitudes"]


@pytest.mark.parametrize(
    ("isis_ms", "meps_mv", "says"),
    [
        ([10, 20], [0.1], "each trial has one ISI"),
        ([np.nan], [0.1], "no pair of stimuli"),
        ([0.01, 0.02, 0.03], [0.1, 0.2, 0.1], "cannot be in ms"),
        ([10, 20, 30], [120.0, 300.0, 250.0], "cannot be in mV"),
        ([10, 20, 30], [1e-4, 3e-4, 2e-4], "cannot be in mV"),
        ([0.11, 0.52, 0.33, 0.24, 0.75, 0.4], [10, 20, 10, 20, 10, 20], "swapped"),
    ],
)
def test_numbers_that_cannot_be_are_refused(isis_ms: list[float], meps_mv: list[float], says: str) -> None:
    with pytest.raises(InvalidValueError, match=says):
        isiw.analyse(isis_ms, meps_mv, space=SPACE, **FEW)


def test_a_strategy_learns_earlier_trials_before_its_first_ask_alone_and_no_budget_counts_them() -> None:
    isis_ms, meps_mv = told(6)
    trials = isiw.analyse(isis_ms, meps_mv, space=SPACE, **FEW).record.table
    strategy = isiw.make_strategy(space=SPACE, seed=1, max_trials=2, **FEW)
    strategy.learn_all(trials)
    assert strategy.delivered == strategy.spent == 0
    assert strategy.estimate().pairs == 6
    again = strategy.restarted()
    assert again.ask() == strategy.ask()
    strategy.learn(Trial.of(strategy.ask(), 0.1))
    assert not strategy.decision().stop
    with pytest.raises(StrategyError, match="before the first ask"):
        strategy.learn_all(trials)


def test_a_space_is_the_range_of_the_isis_that_were_delivered() -> None:
    table = isiw.analyse([12.5, 80.2, 33.0], [0.1, 0.2, 0.3], space=SPACE, **FEW).record.table
    space = Delivered(table, "impact").space()
    assert (space.low_ms, space.high_ms, space.step_ms) == (12.0, 81.0, 1.0)
