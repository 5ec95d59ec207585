"""Earlier trials of a visit: learnt before the first ask, logged, and counted by one limit alone."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pandas as pd
import pytest

import isiw
from isiw.trials import Status, Trial

SPACE = isiw.DesignSpace(0, 200, reference="impact")
SETTINGS: dict[str, Any] = {"particles": 200, "max_trials": 4}


@cache  # trials never change
def earlier(n: int = 60, factor: float = 1.0) -> tuple[Trial, ...]:
    """Trials of a person with a window of 102–163 ms, some of them outside the narrow space."""
    responder = isiw.subjects.cohort("recruitment", 1, 3)[0].begin(3)
    isis_ms = np.random.default_rng(3).uniform(-5.0, 240.0, n).tolist()
    meps_mv = [factor * responder.respond(isi_ms, "impact").mep_mv for isi_ms in isis_ms]
    return isiw.analyse(isis_ms, meps_mv, space=SPACE, particles=50).record.table.trials


@pytest.mark.slow
def test_a_session_knows_earlier_trials_and_no_budget_counts_them(tmp_path: Path) -> None:
    trials = earlier()
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0, max_pulses=len(trials) + 5)
    strategy = isiw.make_strategy(space=SPACE, seed=2, **SETTINGS)
    with isiw.open_session(strategy, tmp_path / "a.mcap", earlier=trials, limits=limits) as session:
        assert (session.estimate().probability or 0.0) > 0.9
        for mep_mv in (0.02, 0.05, 0.1, 0.07):
            session.tell(session.ask(), mep_mv)
        assert session.decision().stop
    record = isiw.read_session(tmp_path / "a.mcap")
    assert len(record.table) == 4
    assert record.header.earlier == tuple(trial for trial in trials if trial.told)
    assert not record.header.earlier_same_level
    told = f"{len(record.header.earlier)} trials, learnt before the first"
    assert ("earlier", told) in isiw.report.tables.first_facts(record)


@pytest.mark.parametrize(("most", "says"), [(60, "used up the limit"), (63, "does not fit into the limits")])
def test_earlier_trials_leave_less_of_the_limit_of_pulses(tmp_path: Path, most: int, says: str) -> None:
    strategy = isiw.make_strategy("incremental", space=SPACE, max_trials=4)
    limits = isiw.Limits.of_space(SPACE, max_pulses=most)
    with pytest.raises(isiw.errors.InvalidValueError, match=says):
        isiw.open_session(strategy, tmp_path / "a.mcap", earlier=earlier(), limits=limits)
    assert list(tmp_path.iterdir()) == []


def test_a_session_that_goes_on_knows_them_still(tmp_path: Path) -> None:
    trials = earlier(20)
    asked = []
    for resumed in (False, True):
        log = tmp_path / f"{resumed}.mcap"
        strategy = isiw.make_strategy(space=SPACE, seed=2, **SETTINGS)
        session = isiw.open_session(strategy, log, earlier=trials)
        session.tell(session.ask(), 0.05)
        if resumed:
            session.close()
            session = isiw.open_session(isiw.make_strategy(space=SPACE, seed=2, **SETTINGS), log, resume=True)
        asked.append(session.ask())
        session.close()
    assert asked[0] == asked[1]
    record = isiw.read_session(log)
    said = f"{len(record.header.earlier)} earlier trials were learnt first."
    assert isiw.report.words.counts_sentence(record).endswith(said)
    assert record.pairs == session.estimate().pairs == len(record.header.earlier) + 1
    assert record.rests_on_data
    assert "Fewer than three" not in isiw.report.drawn.drawn(record)["beliefs"][0]["found"]


@pytest.mark.parametrize("no_trials", [pd.DataFrame({"isi_ms": [40.0], "mep_mv": [0.1]}), "P01.mcap", 7, np.array(7)])
def test_what_is_no_sequence_of_trials_is_refused_with_the_way_to_them(no_trials: Any, tmp_path: Path) -> None:
    strategy = isiw.make_strategy("incremental", space=SPACE)
    with pytest.raises(isiw.errors.InvalidValueError, match=r"read_session\(log\)\.table"):
        isiw.open_session(strategy, tmp_path / "a.mcap", earlier=no_trials)
    with pytest.raises(isiw.errors.InvalidValueError, match=r"read_session\(log\)\.table"):
        strategy.learn_all(no_trials)


@pytest.mark.parametrize(
    ("before_mv", "own", "is_silent"),
    [
        (0.3, {"mep_mv": 0.0}, False),
        (0.0, {"mep_mv": 0.0}, True),
        (0.0, {"mep_mv": 0.3}, False),
        (0.0, {"mep_interval_mv": (0.05, np.inf)}, False),
        (0.0, {"mep_interval_mv": (0.0, 0.05)}, True),
    ],
)
def test_a_log_is_silent_where_its_session_is_whatever_was_learnt_first(
    tmp_path: Path, before_mv: float, own: dict[str, Any], *, is_silent: bool
) -> None:
    trials = [Trial(n, Status.ACCEPTED, 90.0, isi_ms=90.0, mep_mv=before_mv) for n in range(5)]
    strategy, log = isiw.make_strategy(space=SPACE, seed=2, **SETTINGS), tmp_path / "a.mcap"
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0)
    with isiw.open_session(strategy, log, earlier=trials, limits=limits) as session:
        for _ in range(3):
            session.tell(session.ask(), **own)
        estimate = session.estimate()
    record = isiw.read_session(log)
    assert record.is_silent == estimate.silent == is_silent
    assert str(estimate) in str(record)
    assert ("all 8 trials that count are 0" in isiw.report.final_statement(record)) == is_silent


def over_the_curve(number: int, seed: int) -> list[tuple[float, float]]:
    """Intensities [% RMT] and MEPs [mV] of pulses over a saturating curve."""
    rng = np.random.default_rng(seed)
    pct_rmt = rng.uniform(90.0, 140.0, number)
    meps_mv = 0.01 + 1.5 / (1.0 + np.exp(-(pct_rmt - 112.0 + rng.normal(0.0, 6.0, number)) / 4.0))
    return list(zip(pct_rmt.tolist(), meps_mv.tolist(), strict=True))


def given(number: int, seed: int) -> tuple[Trial, ...]:
    pulses = enumerate(over_the_curve(number, seed))
    return tuple(Trial(n, "accepted", None, mep_mv=mep_mv, intensity_pct_rmt=pct) for n, (pct, mep_mv) in pulses)  # type: ignore[arg-type]


@pytest.mark.slow
@hypothesis.settings(max_examples=8, deadline=None, derandomize=True)
@hypothesis.given(
    before=st.integers(0, 4), within=st.lists(st.integers(0, 3), min_size=1, max_size=4), seed=st.integers(0, 99)
)
def test_a_session_with_pulses_over_the_curve_resumes_with_the_same_asks(
    tmp_path_factory: pytest.TempPathFactory, before: int, within: list[int], seed: int
) -> None:
    """`within` are numbers of pulses of TMS alone before each pair, the session is resumed before the last one."""
    asked: list[list[float]] = []
    for resumed in (False, True):
        log = tmp_path_factory.mktemp("log") / "a.mcap"
        strategy = isiw.make_strategy(space=SPACE, seed=seed, particles=40)
        session = isiw.open_session(strategy, log, earlier=given(before, seed), limits=isiw.Limits.of_space(SPACE))
        asks: list[float] = []
        for place, pulses in enumerate(within):
            for pct_rmt, mep_mv in over_the_curve(pulses, seed + 100 * place):
                session.tell(None, mep_mv, intensity_pct_rmt=pct_rmt)
            if resumed and place == len(within) - 1:
                session.close()
                session = isiw.resume(log)  # type: ignore[assignment]
            asks.append(session.ask())
            session.tell(asks[-1], 0.03 * (1 + place))
        asked.append([*asks, session.ask()])
        session.close()
        record = isiw.read_session(log)
        told = [trial.intensity_pct_rmt for trial in record.table.told if trial.isi_ms is None]
        assert told == [pct for n, k in enumerate(within) for pct, _ in over_the_curve(k, seed + 100 * n)]
        assert [trial.intensity_pct_rmt for trial in record.header.earlier] == [
            pct for pct, _ in over_the_curve(before, seed)
        ]
        assert record.trials["intensity_pct_rmt"].notna().sum() == len(told)
    assert asked[0] == asked[1]


def test_an_intensity_of_a_pair_is_refused_before_anything_is_logged(tmp_path: Path) -> None:
    session = isiw.open_session(isiw.make_strategy("nr", space=SPACE), tmp_path / "a.mcap")
    isi_ms = session.ask()
    with pytest.raises(isiw.errors.StrategyError, match="no law of pairs at another intensity"):
        session.tell(isi_ms, 0.1, intensity_pct_rmt=110.0)
    session.tell(isi_ms, 0.1)
    session.tell(None, 0.1, intensity_pct_rmt=110.0)
    session.close()
    assert [trial.intensity_pct_rmt for trial in isiw.read_session(tmp_path / "a.mcap").table] == [None, 110.0]


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_the_window_is_taken_over_whatever_the_level_was(factor: float) -> None:
    subject, found = isiw.subjects.cohort("recruitment", 1, 3)[0], []
    for seed in range(3):
        strategy = isiw.make_strategy(space=SPACE, seed=seed, particles=500)
        strategy.learn_all(earlier(factor=factor))
        responder = subject.begin(4)
        for isi_ms in (130.0, 20.0, 120.0, 180.0, 140.0, 60.0):
            strategy.learn(Trial.of(isi_ms, responder.respond(isi_ms, "impact").mep_mv))
        found.append(isiw.metrics.f1(strategy.estimate().window, subject.window(SPACE), SPACE))
    assert sum(found) / len(found) > 0.8


def test_at_the_same_level_they_are_learnt_as_if_they_were_the_sessions_own() -> None:
    trials = [trial for trial in earlier(10) if trial.isi_ms is not None and SPACE.admits(trial.isi_ms)]
    told, known = (isiw.make_strategy(space=SPACE, seed=2, **SETTINGS) for _ in range(2))
    for trial in trials:
        told.learn(Trial.of(trial.isi_ms, trial.mep_mv))
    known.learn_all(trials, same_level=True)
    assert str(known.estimate()) == str(told.estimate())
    assert known.spent == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gp-straddle", "nr", "pf", "incremental"])
def test_strategies_that_cannot_widen_what_they_believe_learn_them_as_they_are(name: str) -> None:
    strategy = isiw.make_strategy(name, SPACE, seed=1)
    strategy.learn_all(earlier(30))
    assert strategy.ask() in SPACE.grid_ms
    assert strategy.estimate().pairs == len([trial for trial in earlier(30) if trial.told])
