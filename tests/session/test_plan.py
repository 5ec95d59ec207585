"""A strategy with a plan says how many stimuli it takes, and limits that do not hold these are refused."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from isiw import schedule
from isiw.decision import StopKind
from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.simulated import SimulatedDevice, SimulatedPerson
from isiw.errors import InvalidValueError
from isiw.log.record import read_session
from isiw.report.words import final_statement, truth_sentence
from isiw.session.loop import Session
from isiw.session.resuming import open_session
from isiw.strategy.catalogue import list_strategies, make_strategy
from isiw.subjects.cohorts import person_of
from isiw.visit import VisitProtocol
from isiw.window import Window
from known import known

SPACE = DesignSpace(40, 320, step_ms=5, reference="impact")
PLANNING = {"pf", "incremental"}


def device(cohort: str = "gaussian") -> SimulatedDevice:
    respond = partial(person_of(cohort, 0, 3).begin(3).respond, reference="impact")
    return SimulatedDevice(SimulatedPerson(respond, "impact"))


@pytest.mark.parametrize("name", list_strategies())
def test_only_a_strategy_with_a_plan_says_how_many_stimuli_it_takes(name: str) -> None:
    planned = make_strategy(name, SPACE, max_trials=31).stimuli_planned
    assert planned == (31 if name in PLANNING else None)


@pytest.mark.parametrize(
    ("protocol", "needed"), [({}, 400), ({"tms_alone": 0.2}, 502)], ids=["pairs alone", "with control trials"]
)
def test_limits_that_end_a_plan_are_refused_beforehand_with_the_line_to_write(
    tmp_path: Path, protocol: dict[str, Any], needed: int
) -> None:
    strategy = make_strategy("incremental", SPACE, max_trials=400)
    session = Session(device(), strategy, log=tmp_path / "s.mcap", protocol=VisitProtocol(**protocol))
    with pytest.raises(InvalidValueError, match=rf"does not fit.*200.*Write max_pulses = {needed} under \[limits\]"):
        session.run()
    assert not list(tmp_path.iterdir())
    with pytest.raises(InvalidValueError, match="Write max_pulses = 400"):
        open_session(make_strategy("incremental", SPACE, max_trials=400), tmp_path / "own.mcap")


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2, 0.5])
def test_the_stimuli_that_pairs_take_hold_the_controls_between_them(share: float) -> None:
    protocol = VisitProtocol(tms_alone=share)
    for seed in range(5):
        given = schedule.stimuli_for(protocol, 60)
        assert sum(schedule.control(protocol, trial, seed) is None for trial in range(given)) >= 60


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(PLANNING))
def test_a_plan_runs_to_its_end_within_the_limits_that_are_proposed(tmp_path: Path, name: str) -> None:
    settings = {"particles": 10, "max_trials": 120} if name == "pf" else {"trials_per_isi": 4, "max_trials": 320}
    strategy = make_strategy(name, SPACE, seed=3, **settings)
    limits = Limits.of_space(SPACE, max_pulses=known(strategy.stimuli_planned))
    Session(device(), strategy, log=tmp_path / "s.mcap", limits=limits).run()
    decision = known(read_session(tmp_path / "s.mcap").decision)
    assert decision.kind in {StopKind.SETTLED, StopKind.BUDGET}


def test_a_sweep_that_was_cut_short_never_says_that_there_is_no_window(tmp_path: Path) -> None:
    strategy = make_strategy("incremental", SPACE, max_trials=60)
    Session(device("nonresponder"), strategy, log=tmp_path / "s.mcap").run()
    record = read_session(tmp_path / "s.mcap")
    assert record.estimates[-1].has_answer
    for said in (final_statement(record), truth_sentence(record, Window(60.0, 160.0))):
        assert "o window" not in said
        assert "none was reported" not in said
    assert "is not finished: of 40–320 ms it has measured 40–60 ms" in final_statement(record)
