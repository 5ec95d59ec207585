"""A strategy that somebody else tells of trials: the session that it was given to asks and learns no more."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from isiw.devices.info import DeviceInfo
from isiw.errors import StrategyError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.resuming import open_session
from isiw.session.sink import SessionUpdate
from isiw.session.threshold import open_threshold, read_threshold
from isiw.strategy.strategy import Strategy
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.trials import Trial
from scripted import ScriptedDevice, scripted_strategy

TOLD: dict[str, Callable[[Strategy], None]] = {
    "a pair": lambda strategy: strategy.tell(100.0, 0.1),
    "a tap alone": lambda strategy: strategy.tell(100.0, 0.1, pulse=False),
    "a mistrial": lambda strategy: strategy.count_mistrial(),
}


@pytest.mark.parametrize("told", TOLD.values(), ids=TOLD)
def test_a_strategy_that_was_told_beside_the_session_chooses_no_isi(
    log: Path, told: Callable[[Strategy], None]
) -> None:
    strategy = scripted_strategy(9)
    with open_session(strategy, log) as session:
        session.tell(session.ask(), 0.1)
        told(strategy)
        for call in (session.ask, session.estimate, session.decision):
            with pytest.raises(StrategyError, match="resume it with a new strategy"):
                call()
    assert [len(read_session(log).intents), len(read_session(log).table)] == [1, 1]


def test_an_outcome_that_was_told_twice_is_logged_once_and_its_isi_is_not_repeated(log: Path) -> None:
    strategy = scripted_strategy(9)
    with open_session(strategy, log) as session:
        isi_ms = session.ask()
        strategy.tell(isi_ms, 0.1)
        for call in (session.ask, lambda: session.tell(isi_ms, 0.1)):
            with pytest.raises(StrategyError, match="one of them twice"):
                call()
    assert [trial.mep_mv for trial in read_session(log).table] == [0.1]
    with open_session(scripted_strategy(9), log, resume=True) as resumed:
        assert resumed.strategy.delivered == 1


def test_two_sessions_with_one_strategy_are_refused_even_if_both_asked_first(tmp_path: Path) -> None:
    strategy, logs = scripted_strategy(9), [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    with open_session(strategy, logs[0]) as first, open_session(strategy, logs[1]) as second:
        asked_ms = [first.ask(), second.ask()]
        first.tell(asked_ms[0], 0.1)
        with pytest.raises(StrategyError, match="a strategy of its own"):
            second.tell(asked_ms[1], 0.2)
        first.tell(first.ask(), 0.3)
    assert [trial.mep_mv for trial in read_session(logs[1]).table] == [0.2]


def test_a_session_learns_again_what_is_its_own_once_a_trial_is_excluded(log: Path) -> None:
    strategy = scripted_strategy(9)
    with open_session(strategy, log) as session:
        session.tell(session.ask(), 0.1)
        strategy.tell(100.0, 0.1)
        session.exclude(0)
        session.tell(session.ask(), 0.2)
        assert session.strategy.delivered == 2


def test_a_strategy_that_is_told_from_within_a_session_ends_it(log: Path) -> None:
    strategy, device = scripted_strategy(9), ScriptedDevice()

    def on_trial(_: SessionUpdate) -> None:
        strategy.learn(Trial.of(100.0, 0.1))

    with pytest.raises(StrategyError, match="not this session's"):
        Session(device, strategy, log=log, on_trial=on_trial).run()
    assert len(device.delivered) == len(read_session(log).table) == 1


def test_two_searches_for_a_threshold_with_one_method_are_refused(tmp_path: Path) -> None:
    search, device = make_threshold_search("bayes", IntensityRange(20, 80)), DeviceInfo("x", "impact", simulated=True)
    logs = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    with open_threshold(search, logs[0], device=device) as a, open_threshold(search, logs[1], device=device) as b:
        a.ask()
        b.ask()
        a.tell(0.2)
        with pytest.raises(StrategyError, match="a strategy of its own"):
            b.tell(0.01)
        with pytest.raises(StrategyError, match="Deliver nothing"):
            b.ask()
    assert [outcome.mep_mv for outcome in read_threshold(logs[1]).outcomes] == [0.01]
