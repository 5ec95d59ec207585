"""What the tap alone does to the EMG: learnt while the session runs, corrected by appended events, and resumed."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.log.record import read_session
from isiw.log.schema import Event, Intent
from isiw.session import steps
from isiw.session.loop import Session
from isiw.session.resuming import resume
from isiw.session.rig import Safeguards
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.trials import TrialTable
from isiw.visit import VisitProtocol
from isiw.window import Window
from known import known
from session.test_resume import stop_after
from tapped import IMPACT, TapRig, reflex

NO_TAPS = VisitProtocol(taps_first=0)


def on_nothing(isi_ms: float | None, rng: np.random.Generator) -> float:  # noqa: ARG001 - the same at every ISI
    return 0.15 * float(np.exp(0.6 * rng.standard_normal()))


def silent(isi_ms: float | None, rng: np.random.Generator) -> float:  # noqa: ARG001 - no MEP at any ISI
    return 0.0


def few(trials: int = 12, seed: int = 0) -> Strategy:
    return make_strategy("even", space=IMPACT, max_trials=trials, seed=seed, particles=100)


def ran(rig: TapRig, log: Path, strategy: Strategy, **options: Any) -> Session:
    safeguards = Safeguards(on_pause=lambda _: True)
    session = Session(rig, strategy, log=log, safeguards=safeguards, **options)
    session.run(progress=False)
    return session


def test_three_taps_alone_follow_on_the_first_four_trials_and_use_up_no_budget(log: Path) -> None:
    rig = TapRig()
    session = ran(rig, log, few(6))
    assert [stimulus.tap_alone for stimulus in rig.delivered] == [False] * 4 + [True] * 3 + [False] * 2
    assert {trial.tap_mv is None for trial in session.trials.trials[7:]} == {False}


def test_a_verdict_that_comes_while_a_stimulus_is_chosen_mixes_no_two(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = itertools.cycle((True, False, False))  # as where a verdict comes between any two
    monkeypatch.setattr(steps.OwnResponse, "wants_tap", property(lambda _: next(looks)))
    rig = TapRig()
    ran(rig, log, few(2))
    assert {(stimulus.tap_alone, stimulus.isi_ms is None) for stimulus in rig.delivered} == {
        (True, True),
        (False, False),
    }


def test_more_taps_alone_follow_while_a_window_is_found_that_the_response_could_explain() -> None:
    rig, trials = TapRig(reflex(0.3)), TrialTable()
    for isi_ms in (None, None, None, 20.0, 30.0, 100.0, 20.0):
        trials = trials.appended(rig.trial(isi_ms, pulse=isi_ms is not None))
    assert rig.taps.wants_taps(Window(10.0, 60.0), trials)
    assert not rig.taps.wants_taps(Window(90.0, 110.0), trials)
    assert not rig.taps.wants_taps(None, trials)
    for _ in range(9):
        trials = trials.appended(rig.trial(None, pulse=False))
        assert not rig.taps.wants_taps(Window(10.0, 60.0), trials)
    trials = trials.appended(rig.trial(20.0)).appended(rig.trial(20.0)).appended(rig.trial(20.0))
    assert not rig.taps.wants_taps(Window(10.0, 60.0), trials)


@pytest.mark.parametrize(("tap_alone", "protocol"), [(False, VisitProtocol()), (True, NO_TAPS)])
def test_none_is_given_where_the_device_cannot_or_nobody_wants_it(
    log: Path, protocol: VisitProtocol, *, tap_alone: bool
) -> None:
    rig = TapRig(reflex(0.3), tap_alone=tap_alone)
    ran(rig, log, few(3), protocol=protocol)
    assert not any(stimulus.tap_alone for stimulus in rig.delivered)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Of a person without any MEP, whose tap evokes a reflex."""
    log = tmp_path_factory.mktemp("whole") / "s.mcap"
    return ran(TapRig(reflex(0.3), mep_mv=silent), log, few(), protocol=NO_TAPS)


def test_earlier_amplitudes_are_corrected_in_the_log_and_learnt_again(whole: Session) -> None:
    session, record = whole, read_session(whole.log_path)
    corrections = [event for event in record.events if event.kind == "correction"]
    assert corrections
    assert record.table == session.trials
    for trial in record.table:
        assert known(trial.mep_mv) - (trial.tap_mv or 0.0) < 0.15
    fresh = few()
    for trial in record.table:
        fresh.learn(trial)
    assert fresh.estimate().probability == session.strategy.estimate().probability


@pytest.mark.slow
def test_a_resumed_session_corrects_and_asks_as_an_uninterrupted_one(log: Path, tmp_path: Path) -> None:
    strategy = make_strategy(space=IMPACT, max_trials=12, particles=100)
    whole = ran(TapRig(reflex(0.3), mep_mv=silent), tmp_path / "whole.mcap", strategy.restarted(), protocol=NO_TAPS)
    with pytest.raises(KeyboardInterrupt):
        ran(TapRig(reflex(0.3), mep_mv=silent), log, strategy, protocol=NO_TAPS, on_trial=stop_after(8))
    safeguards = Safeguards(on_pause=lambda _: True)
    again = resume(log, TapRig(reflex(0.3), mep_mv=silent), safeguards=safeguards)
    again.run(progress=False)
    assert again.trials == whole.trials


def test_a_session_that_ends_between_a_trial_and_its_corrections_has_them_once_it_is_resumed(
    log: Path, whole: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made() -> TapRig:
        return TapRig(reflex(0.3), mep_mv=silent)

    def dies(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as dying:
        dying.setattr(steps, "correction", dies)
        with pytest.raises(KeyboardInterrupt):
            ran(made(), log, few(), protocol=NO_TAPS)
    before = read_session(log)
    assert not [event for event in before.events if event.kind == "correction"]
    safeguards = Safeguards(on_pause=lambda _: True)
    again = resume(log, made(), safeguards=safeguards)
    again.run(progress=False)
    at_once = itertools.takewhile(
        lambda entry: not isinstance(entry, Intent), read_session(log).history[len(before.history) :]
    )
    assert "correction" in [entry.kind for entry in at_once if isinstance(entry, Event)]
    assert again.trials == whole.trials


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_person_whose_tap_evokes_no_response_and_who_has_no_window_gets_no_sure_one(log: Path, seed: int) -> None:
    strategy = make_strategy(space=IMPACT, seed=seed, max_trials=40)
    session = ran(TapRig(seed=seed, mep_mv=on_nothing, tap_alone=False), log, strategy)
    assert known(session.strategy.estimate().probability) < 0.9
    short = [known(trial.mep_mv) for trial in session.trials if known(trial.isi_ms) < 4]
    assert min(short, default=1.0) > 0.02


@pytest.mark.parametrize(
    ("size_mv", "protocol"),
    [
        pytest.param(0.1, VisitProtocol(), marks=pytest.mark.slow),
        pytest.param(0.3, NO_TAPS, marks=pytest.mark.slow),
        pytest.param(0.3, VisitProtocol(), marks=pytest.mark.long),
        pytest.param(0.1, NO_TAPS, marks=pytest.mark.long),
    ],
)
def test_people_without_a_window_get_no_sure_one_from_a_reflex(
    tmp_path: Path, size_mv: float, protocol: VisitProtocol
) -> None:
    sure = []
    for seed in range(5):
        session = of_a_reflex(size_mv, seed, tmp_path, protocol, particles=300)
        sure.append(known(session.strategy.estimate().probability) >= 0.9)
    assert not any(sure)  # of five: where every second is, 97 % of such tests fail


@pytest.mark.slow
def test_where_a_reflex_may_explain_a_window_a_longer_isi_is_asked_that_shows_it(log: Path) -> None:
    asked = 0
    for seed in (3, 4, 5, 6):
        session = of_a_reflex(0.1, seed, log.parent, NO_TAPS, max_trials=14)
        record = read_session(session.log_path)
        fallbacks = [event for event in record.events if event.kind == "fallback" and event.text == steps.LONGER]
        estimates = {estimate.trial: estimate for estimate in record.estimates}
        for number in (known(event.trial) for event in fallbacks):
            assert known(estimates[number - 1].probability) >= steps.LEAST_PROBABILITY
            last_met_ms = 20.0 + 8 * seed + 30.0 - 15.0  # a longer ISI has its MEP window after the reflex
            assert known(record.table[number].commanded_isi_ms) > last_met_ms
        asked += bool(fallbacks)
    assert asked >= 2
    again = resume(session.log_path, TapRig(reflex(0.1, start_ms=68.0), seed=6, mep_mv=silent))
    assert again.trials == session.trials  # what it asked is verified, and these asks are replayed as they were


@pytest.mark.slow
def test_no_session_stops_on_a_window_that_a_longer_isi_could_show_to_be_a_reflex(log: Path) -> None:
    session = of_a_reflex(0.1, 3, log.parent, NO_TAPS)
    assert not session.strategy.estimate().tap_may_explain


def test_a_session_that_wants_longer_isis_stops_all_the_same_when_its_budget_is_used_up(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(steps.OwnResponse, "least_isi_ms", 100.0)
    strategy = make_strategy(space=IMPACT, max_trials=5, particles=100, stop_no_window=0.01)
    limits = Limits.of_space(IMPACT, max_pulses=9)
    session = ran(TapRig(tap_alone=False), log, strategy, protocol=NO_TAPS, limits=limits)
    assert len(session.trials) == 5


@pytest.mark.slow
def test_where_all_isis_are_too_short_to_show_a_reflex_the_estimate_says_so(log: Path) -> None:
    session = of_a_reflex(0.3, 3, log.parent, NO_TAPS, DesignSpace(0, 60, reference="impact"), 20)
    estimate = session.strategy.estimate()
    assert known(estimate.probability) >= 0.9
    assert estimate.tap_may_explain
    assert not [event for event in read_session(session.log_path).events if event.kind == "fallback"]


def of_a_reflex(
    size_mv: float,
    seed: int,
    folder: Path,
    protocol: VisitProtocol,
    space: DesignSpace = IMPACT,
    max_trials: int = 40,
    **settings: Any,
) -> Session:
    """A session of a person without any MEP, whose tap evokes a reflex."""
    strategy = make_strategy(space=space, seed=seed, max_trials=max_trials, **settings)
    rig = TapRig(reflex(size_mv, start_ms=20.0 + 8 * seed), seed=seed, mep_mv=silent)
    return ran(rig, folder / f"{seed}.mcap", strategy, protocol=protocol)
