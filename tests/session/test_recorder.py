"""Logged ask/tell: the log of a session, for a loop of the lab's own."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Never

import numpy as np
import pytest

from forked import Forked
from isiw.change import MOST_NOTED
from isiw.design import DesignSpace
from isiw.devices.clock import VirtualClock
from isiw.devices.limits import Limits
from isiw.errors import (
    DamagedLogError,
    DeviceError,
    ImplausibleDataWarning,
    InvalidValueError,
    LimitExceededError,
    LogError,
    OutOfSpaceError,
    StrategyError,
)
from isiw.findings import Kind
from isiw.log.record import read_session
from isiw.log.schema import EstimateRecord, Event, Intent
from isiw.log.writer import LogWriter
from isiw.report import final_statement
from isiw.session import examination
from isiw.session.afterwards import exclude
from isiw.session.examination import relearned
from isiw.session.loop import Session
from isiw.session.recorder import Recorder
from isiw.session.resuming import open_session, resume
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.trials import Trial, TrialTable
from isiw.types import Reference
from known import instance, known
from logs import cut_after
from scripted import FakeRealClock, RememberingPosterior, ScriptedDevice, scripted_strategy, told_to


class BusyClock(FakeRealClock):
    """In the middle of the first wait something else happens."""

    def __init__(self, meanwhile: Callable[[], object]) -> None:
        super().__init__()
        self.meanwhile: Callable[[], object] | None = meanwhile

    def sleep_s(self, duration_s: float) -> None:
        meanwhile, self.meanwhile = self.meanwhile, None
        super().sleep_s(duration_s / 2)
        if meanwhile is not None:
            meanwhile()
        super().sleep_s(duration_s / 2)


class MeetingClock(FakeRealClock):
    """Whoever waits wakes up together with another one."""

    def __init__(self) -> None:
        super().__init__()
        self.both = threading.Barrier(2)

    def sleep_s(self, duration_s: float) -> None:
        self.both.wait(10.0)
        super().sleep_s(duration_s)


def mep_at(isi_ms: float) -> float:
    return 0.01 + isi_ms / 1e4


def run(session: Recorder, trials: int) -> list[float]:
    asked: list[float] = []
    for _ in range(trials):
        asked.append(session.ask())
        session.tell(asked[-1], mep_at(asked[-1]))
    return asked


def test_a_loop_of_ones_own_leaves_the_log_of_a_session(log: Path) -> None:
    with open_session(scripted_strategy(3), log, subject="P1") as session:
        while not session.decision().stop:
            run(session, 1)
    record = read_session(log)
    assert [type(entry) for entry in record.history] == [Intent, Trial, EstimateRecord] * 3
    assert record.finished
    assert (record.header.subject, len(record.table.told)) == ("P1", 3)
    assert "The budget of 3 stimuli is used up." in final_statement(record)


def test_it_asks_what_the_strategy_alone_would_have_asked(log: Path) -> None:
    alone = scripted_strategy(9)
    asked: list[float] = []
    for _ in range(4):
        asked.append(alone.ask())
        alone.tell(asked[-1], mep_at(asked[-1]))
    with open_session(scripted_strategy(9), log) as session:
        assert run(session, 4) == asked


def test_the_intent_is_on_disk_before_the_isi_is_known_and_the_trial_before_it_is_learnt(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    strategy = scripted_strategy(3)
    learned: list[Trial] = []
    learn = strategy.learn

    def watched(*told: Any, **more: Any) -> None:
        learned.append(read_session(log).table[-1])
        learn(*told, **more)

    monkeypatch.setattr(strategy, "learn", watched)
    with open_session(strategy, log) as session:
        isi_ms = session.ask()
        assert session.ask() == isi_ms
        assert [intent.isi_ms for intent in read_session(log).intents] == [isi_ms]
        session.tell(isi_ms + 0.5, 0.02)
        assert [(trial.isi_ms, trial.mep_mv) for trial in learned] == [(isi_ms + 0.5, 0.02)]


def test_a_slip_is_refused_and_can_be_put_right(log: Path) -> None:
    with open_session(scripted_strategy(3), log) as session:
        isi_ms = session.ask()
        for told in ((isi_ms / 1000, 0.02), (isi_ms, 2e-5), (0.02, isi_ms)):
            with pytest.raises(InvalidValueError):
                session.tell(*told)
        assert len(session.trials) == 0
        session.tell(isi_ms, 0.02)
    assert len(read_session(log).table.told) == 1


def test_a_pulse_before_the_impact_is_a_mistrial(log: Path) -> None:
    with open_session(scripted_strategy(3, space=DesignSpace(0, 200, reference="impact")), log) as session:
        session.ask()
        with pytest.raises(InvalidValueError, match=r'session.mistrial\("TMS before impact"\)'):
            session.tell(-0.5, 0.02)
        session.mistrial("TMS before impact")
    assert [trial.reason for trial in read_session(log).table] == [Kind.TMS_BEFORE_IMPACT]


def test_an_isi_that_nobody_knows_is_not_learnt_from(log: Path) -> None:
    with open_session(scripted_strategy(3), log) as session:
        with pytest.raises(InvalidValueError, match=r"too uncertain.*50 ms"):
            session.tell(session.ask(), 0.02, isi_sd_ms=100.0)
        session.tell(session.ask(), 0.02, isi_sd_ms=50.0)
    assert len(read_session(log).table.told) == 1


def test_a_doubt_is_a_warning_and_an_event(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        for mep_mv in (8.0, 6.0):
            session.tell(session.ask(), mep_mv)
        with pytest.warns(ImplausibleDataWarning, match="in µV") as warned:
            session.tell(session.ask(), 12.0)
    assert [warning.filename for warning in warned] == [__file__]
    assert [event.kind for event in read_session(log).events] == ["doubt"]


@pytest.mark.parametrize(("rms_uv", "said"), [(0.004, "Is it in mV"), (9e3, "Is it in nV"), (4.0, None), (0.0, None)])
def test_emg_before_the_pulse_in_another_unit_is_a_doubt(log: Path, rms_uv: float, said: str | None) -> None:
    doubts = list[str]()
    with open_session(scripted_strategy(9), log, on_doubt=lambda finding: doubts.append(f"{finding}")) as session:
        for mep_mv in (0.1, 0.2):
            session.tell(session.ask(), mep_mv, background_rms_uv=rms_uv)
    assert len(doubts) == (said is not None)
    assert all(f"{said}" in doubt for doubt in doubts)


def test_mistrials_count_with_their_reason_and_are_asked_again(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        isi_ms = session.ask()
        session.mistrial("no impact")
        assert session.ask() == isi_ms
        session.mistrial("the person laughed")
    record = read_session(log)
    assert [trial.reason for trial in record.table] == [Kind.NO_IMPACT, Kind.REJECTED]
    assert [(event.kind, event.trial, event.text) for event in record.events] == [("note", 1, "the person laughed")]


def test_three_mistrials_in_a_row_are_a_warning(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        for _ in range(2):
            session.ask()
            session.mistrial(Kind.NO_IMPACT)
        session.ask()
        with pytest.warns(ImplausibleDataWarning, match="air supply") as warned:
            session.mistrial(Kind.NO_IMPACT)
    assert [warning.filename for warning in warned] == [__file__]


def test_doubts_go_to_who_wants_them_in_place_of_a_warning(log: Path) -> None:
    doubts: list[str] = []
    with open_session(scripted_strategy(9), log, on_doubt=doubts.append) as session:
        for _ in range(3):
            session.ask()
            session.mistrial(Kind.NO_IMPACT)
    assert len(doubts) == 1
    with open_session(scripted_strategy(9), log, resume=True, on_doubt=doubts.append) as session:
        for mep_mv in (8.0, 6.0, 12.0):
            session.tell(session.ask(), mep_mv)
    assert "in µV" in doubts[1]


@pytest.mark.parametrize("limit", [{"intensity_pct_mso": 55.0}, {"max_coil_c": 40.0}])
def test_a_limit_on_what_a_loop_of_ones_own_does_not_report_is_refused_at_once(
    log: Path, space: DesignSpace, limit: dict[str, float]
) -> None:
    limits = Limits.of_space(space, min_iti_s=5.0)
    with pytest.raises(InvalidValueError, match="neither intensity nor coil temperature"):
        open_session(scripted_strategy(9), log, limits=replace(limits, **limit))  # type: ignore[arg-type] # all are numbers
    assert not log.exists()


@pytest.mark.parametrize("limits", [{}, {"max_pulses": 500}, {"max_consecutive_mistrials": 5}])
def test_a_loop_of_ones_own_waits_for_no_interval_that_nobody_stated(
    log: Path, space: DesignSpace, limits: dict[str, Any]
) -> None:
    clock = VirtualClock()
    with open_session(scripted_strategy(9), log, limits=Limits.of_space(space, **limits), clock=clock) as session:
        session.ask()
    assert clock.now_s() == 0.0
    assert read_session(log).header.limits.min_iti_s == 0.0


def test_where_isiw_delivers_an_interval_that_nobody_stated_is_5_s(log: Path, space: DesignSpace) -> None:
    Session(ScriptedDevice(), scripted_strategy(3), log=log, limits=Limits.of_space(space, max_pulses=20)).run()
    record = read_session(log)
    assert record.header.limits.min_iti_s == 5.0
    assert record.intents[2].t_s - record.intents[1].t_s == pytest.approx(5.0)


def test_it_says_what_is_open_and_how_long_the_next_ask_would_wait(log: Path, space: DesignSpace) -> None:
    limits = Limits.of_space(space, min_iti_s=7.0)
    with open_session(scripted_strategy(9), log, limits=limits, clock=VirtualClock()) as session:
        assert (session.asked, session.wait_s()) == (None, 7.0)
        isi_ms = session.ask()
        assert (known(session.asked).isi_ms, session.wait_s()) == (isi_ms, 0.0)
        session.tell(isi_ms, 0.02)
        assert (session.asked, session.wait_s()) == (None, 7.0)


def test_nothing_can_be_told_that_was_not_asked(log: Path) -> None:
    with open_session(scripted_strategy(3), log) as session:
        with pytest.raises(InvalidValueError, match="waiting for an outcome"):
            session.tell(50.0, 0.02)
        with pytest.raises(InvalidValueError, match="waiting for an outcome"):
            session.mistrial("no impact")


def test_tms_alone_is_told_without_being_asked(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        session.tell(None, 0.01)
        session.ask()
        with pytest.raises(InvalidValueError, match="kind of trial"):
            session.tell(None, 0.01)
    assert read_session(log).table[0].commanded_isi_ms is None


def test_a_tap_alone_is_told_without_being_asked_and_says_what_is_its_own(log: Path, space: DesignSpace) -> None:
    with open_session(make_strategy(space=space, particles=100), log=log) as session:
        for isi_ms in (0.0, 20.0, 40.0):
            session.tell(isi_ms, 0.2, pulse=False)
        session.tell(session.ask(), mep_interval_mv=(0.0, 0.05))
        session.tell(session.ask(), 0.1, mep_sd_mv=0.02)
        with pytest.raises(InvalidValueError, match="not of the kind"):
            session.tell(session.ask(), 0.1, pulse=False)
        session.mistrial(Kind.NO_PULSE)
        told = session.estimate().probability
    record = read_session(log)
    assert [intent.tap_alone for intent in record.intents] == [True] * 3 + [False] * 3
    assert [trial.isi_ms for trial in record.table][:3] == [0.0, 20.0, 40.0]
    assert record.table[3].mep_interval_mv == (0.0, 0.05)
    with resume(log) as again:
        assert isinstance(again, Recorder)
        assert again.estimate().probability == told
        assert again.strategy.spent == 3


def test_a_tap_alone_that_is_lost_is_logged_as_one(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        with pytest.raises(OutOfSpaceError):
            session.tell(900.0, 0.1, pulse=False)
        session.mistrial(Kind.REJECTED)
    record = read_session(log)
    assert [(trial.tap_alone, trial.reason) for trial in record.table] == [(True, Kind.REJECTED)]


def test_tms_alone_that_was_given_is_logged_at_once_whatever_the_limits_allow(log: Path, space: DesignSpace) -> None:
    clock, limits = VirtualClock(), Limits.of_space(space, min_iti_s=7.0, max_pulses=2)
    with open_session(scripted_strategy(9), log, limits=limits, clock=clock) as session:
        for _ in range(3):
            session.tell(None, 0.01)
        assert clock.now_s() == 0.0
        assert session.wait_s() == 7.0
        with pytest.raises(LimitExceededError, match="2 pulses"):
            session.ask()
    record = read_session(log)
    assert len(record.table.told) == 3
    assert [(event.kind, event.text) for event in record.events] == [("limit", "TMS alone was given beyond 2 pulses.")]


def test_the_limits_hold(log: Path, space: DesignSpace) -> None:
    clock = VirtualClock()
    limits = Limits.of_space(space, min_iti_s=7.0, max_pulses=3)
    with open_session(scripted_strategy(9), log, limits=limits, clock=clock) as session:
        run(session, 2)
        session.ask()
        assert not session.decision().stop
        session.tell(session.ask(), 0.1)
        decision = session.decision()
        with pytest.raises(LimitExceededError, match="3 pulses"):
            session.ask()
    assert (decision.stop, decision.reason) == (True, "The limit of 3 pulses is reached.")
    record = read_session(log)
    assert [intent.t_s for intent in record.intents] == [7.0, 14.0, 21.0]
    assert record.decision == decision
    assert "esume with" not in final_statement(record)


def test_tms_alone_that_is_told_while_an_ask_waits_has_its_interval_too(log: Path, space: DesignSpace) -> None:
    clock = BusyClock(lambda: session.tell(None, 0.01))
    session = open_session(scripted_strategy(9), log, limits=Limits.of_space(space, min_iti_s=5.0), clock=clock)
    with session:
        run(session, 1)
    intents = read_session(log).intents
    assert [(intent.isi_ms is None, intent.t_s) for intent in intents] == [(True, 102.5), (False, 107.5)]


def test_tms_alone_that_is_told_while_an_ask_waits_may_have_been_the_last_pulse(log: Path, space: DesignSpace) -> None:
    clock, limits = BusyClock(lambda: session.tell(None, 0.01)), Limits.of_space(space, min_iti_s=5.0, max_pulses=1)
    session = open_session(scripted_strategy(9), log, limits=limits, clock=clock)
    with session, pytest.raises(LimitExceededError, match="1 pulses"):
        session.ask()
    assert [intent.isi_ms for intent in read_session(log).intents] == [None]


def test_two_who_ask_at_once_get_the_same_isi_and_one_intent(log: Path, space: DesignSpace) -> None:
    clock, asked = MeetingClock(), list[float]()
    with open_session(scripted_strategy(9), log, limits=Limits.of_space(space, min_iti_s=5.0), clock=clock) as session:
        threads = [threading.Thread(target=lambda: asked.append(session.ask())) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(20.0)
        assert len(asked) == 2
        assert len(set(asked)) == 1
        session.tell(asked[0], 0.02)
    assert [intent.trial for intent in read_session(log).intents] == [0]


def test_rests_between_blocks_are_waited_for_also_after_resuming(log: Path, space: DesignSpace) -> None:
    clock = VirtualClock(1000.0)
    limits = replace(Limits.of_space(space, min_iti_s=5.0), max_block_pulses=2, rest_s=120.0)
    with open_session(scripted_strategy(9), log, limits=limits, clock=clock) as session:
        run(session, 3)
    with open_session(scripted_strategy(9), log, resume=True, limits=limits, clock=clock) as session:
        run(session, 2)
    t_s = [intent.t_s for intent in read_session(log).intents]
    assert t_s[:3] == [1005.0, 1010.0, 1130.0]
    assert t_s[3] >= 1130.0 + 120.0 - 1.0  # by the calendar, on which all three were just now


def test_a_resumed_session_keeps_the_logged_limits_unless_others_are_given(log: Path, space: DesignSpace) -> None:
    with open_session(scripted_strategy(9), log, limits=Limits.of_space(space, min_iti_s=0.0, max_pulses=2)) as session:
        run(session, 2)
    with open_session(scripted_strategy(9), log, resume=True) as session, pytest.raises(LimitExceededError):
        session.ask()
    assert read_session(log).header.limits.max_pulses == 2
    more = Limits.of_space(space, min_iti_s=0.0, max_pulses=3)
    with open_session(scripted_strategy(9), log, resume=True, limits=more) as session:
        run(session, 1)


def test_a_resumed_session_keeps_the_logged_configuration_unless_another_is_given(log: Path) -> None:
    with open_session(scripted_strategy(9), log, config={"coil": "figure of eight"}) as session:
        run(session, 1)
    for given, kept in ((None, {"coil": "figure of eight"}), ({"coil": "round"}, {"coil": "round"})):
        with open_session(scripted_strategy(9), log, resume=True, config=given):
            pass
        assert read_session(log).header.config == kept


def test_a_session_does_not_go_on_with_the_log_of_another_person(log: Path) -> None:
    with open_session(scripted_strategy(9), log, subject="P1") as session:
        run(session, 1)
    before = log.read_bytes()
    with pytest.raises(InvalidValueError, match="another person's"):
        open_session(scripted_strategy(9), log, resume=True, subject="P2")
    assert log.read_bytes() == before
    for subject in ("", "P1", "P1 "):
        with open_session(scripted_strategy(9), log, resume=True, subject=subject):
            pass
        assert read_session(log).header.subject == "P1"


def test_a_loop_of_the_labs_own_does_not_go_on_with_simulated_trials(log: Path) -> None:
    Session(ScriptedDevice(simulated=True), scripted_strategy(3), log=log).run()
    before = log.read_bytes()
    with pytest.raises(DeviceError, match="not from a person"):
        open_session(scripted_strategy(9), log, resume=True)
    assert log.read_bytes() == before


def test_a_session_goes_on_in_its_own_design_space(log: Path) -> None:
    def strategy(reference: Reference) -> Strategy:
        return make_strategy("even", space=DesignSpace(0, 320, reference=reference), seed=1, max_trials=8)

    with open_session(strategy("impact"), log) as session:
        run(session, 2)
    with pytest.raises(StrategyError, match=r"another design space.*valve.*impact"):
        open_session(strategy("valve"), log, resume=True)
    assert read_session(log).header.space.reference == "impact"


def test_a_doubt_is_in_the_final_statement(log: Path) -> None:
    with open_session(scripted_strategy(9), log, on_doubt=lambda _text: None) as session:
        for _ in range(5):
            session.tell(session.ask(), 0.05)
    assert "Doubt since trial 3: " in final_statement(read_session(log))


def test_a_resumed_session_logs_what_is_believed_after_trials_were_judged_anew(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        run(session, 4)
    exclude(log, 1, "sneezed")
    assert "excluded or included" in str(read_session(log))
    assert "isiw.open_session(" in final_statement(read_session(log))
    with open_session(scripted_strategy(9), log, resume=True):
        pass
    record = read_session(log)
    assert not record.is_judged_since
    assert record.estimates[-1].trial == 3


def test_an_error_after_the_log_was_closed_stays_the_error_it_is(log: Path) -> None:
    def loop() -> None:
        with open_session(scripted_strategy(9), log) as session:
            session.close()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        loop()


def test_an_error_without_words_of_its_own_is_logged_and_the_log_closed(log: Path) -> None:
    class SpeechlessError(Exception):
        def __str__(self) -> str:
            raise RuntimeError("no words")

    with pytest.raises(SpeechlessError), open_session(scripted_strategy(9), log):
        raise SpeechlessError
    record = read_session(log)
    assert record.finished
    assert "Speechless" in record.events[-1].text


def test_what_is_asked_again_as_the_first_ask_failed_is_one_stimulus(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_session(scripted_strategy(9), log) as session:
        monkeypatch.setattr("isiw.log.writer.LogWriter.require_in_place", failing)
        with pytest.raises(LogError):
            session.ask()
        monkeypatch.undo()
        run(session, 1)
    record = read_session(log)
    assert len(record.intents) == 2
    assert record.given == len(record.table) == 1


def failing(_: object) -> Never:
    raise LogError("the log is no longer at its path")


def test_an_exclusion_with_a_key_is_done_once_whatever_came_since(log: Path) -> None:
    with open_session(scripted_strategy(), log) as session:
        run(session, 3)
        session.exclude(1, "sneezed", key="k1")
        session.include(1, key="k2")
        session.exclude(1, "sneezed", key="k1")
        assert not session.trials[1].excluded
        with pytest.raises(InvalidValueError, match="key 'k1' is that of something else"):
            session.exclude(2, "sneezed", key="k1")
    assert [event.key for event in read_session(log).events] == ["k1", "k2"]


def test_an_excluded_trial_is_unlearnt_and_stays_so(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        asked = run(session, 3)
        session.exclude(1, "sneezed")
        assert [isi for isi, _ in told_to(session.strategy)] == [asked[0], asked[2]]
        with pytest.raises(InvalidValueError, match="cannot exclude this trial"):
            session.exclude(1)
        after = session.ask()
    with open_session(scripted_strategy(9), log, resume=True) as resumed:
        assert [isi for isi, _ in told_to(resumed.strategy)] == [asked[0], asked[2]]
        assert resumed.trials[3].reason is Kind.OUTCOME_UNKNOWN
        assert resumed.ask() == after


def test_a_change_is_learnt_where_it_was_noted_also_after_a_verdict_and_after_resuming(log: Path) -> None:
    def changes(session: Recorder) -> tuple[int, ...]:
        return instance(RememberingPosterior, session.strategy.posterior).changes

    with open_session(scripted_strategy(9), log) as session:
        run(session, 3)
        for _ in range(2):  # it is sent again
            session.note_change("coil re-seated", key="c1")
        assert changes(session) == (3,)
        run(session, 2)
        session.exclude(1)
        assert changes(session) == (2,)
        after = session.ask()
    with open_session(scripted_strategy(9), log, resume=True) as resumed:
        assert changes(resumed) == (2,)
        assert resumed.ask() == after
        resumed.note_change("coil re-seated", key="c1")
        for log_it in (resumed.note, resumed.note_change):
            with pytest.raises(InvalidValueError, match="a key of its own"):
                log_it("and again", key="c1")
        assert changes(resumed) == (2,)
    events = [event for event in read_session(log).events if event.kind == "change"]
    assert [(event.trial, event.text) for event in events] == [(2, "coil re-seated")]


def test_several_changes_at_one_trial_are_one(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        run(session, 2)
        for number in range(70):
            session.note_change(f"the coil moved {number}")
        run(session, 1)
        assert instance(RememberingPosterior, session.strategy.posterior).changes == (2,)
    assert len([event for event in read_session(log).events if event.kind == "change"]) == 70


def test_more_changes_than_are_learnt_are_remarks_and_somebody_is_told_once(log: Path) -> None:
    said: list[str] = []
    with open_session(scripted_strategy(40), log, on_doubt=said.append) as session:
        for number in range(MOST_NOTED + 4):
            run(session, 1)
            for _ in range(2):  # it is sent again
                session.note_change(f"the coil moved {number}", key=f"c{number}")
        session.note_change("the coil moved 3", key="c3")
        learnt = tuple(range(1, MOST_NOTED + 1))
        assert instance(RememberingPosterior, session.strategy.posterior).changes == learnt
        with pytest.raises(InvalidValueError, match="Give each note, change, exclusion and inclusion a key of its own"):
            session.note("the coil moved 22", key="c22")
    assert len(said) == 1
    assert "20 changes were noted, and no more are learnt" in said[0]
    events = read_session(log).events
    remarks = [event for event in events if event.finding is Kind.MANY_CHANGES and event.kind == "note"]
    assert [event.text for event in remarks] == [f"the coil moved {number}" for number in range(20, 24)]
    with open_session(scripted_strategy(40), log, resume=True) as resumed:
        assert instance(RememberingPosterior, resumed.strategy.posterior).changes == learnt


def test_a_log_of_an_earlier_version_with_more_changes_resumes_with_those_that_are_learnt(log: Path) -> None:
    with open_session(scripted_strategy(70), log) as session:
        for number in range(MOST_NOTED + 2):
            run(session, 1)
            session._examination.judge(  # noqa: SLF001 - as earlier versions logged it
                lambda _, number=number: Event(kind="change", trial=number, text="the coil moved")  # type: ignore[misc]
            )
    with open_session(scripted_strategy(70), log, resume=True) as resumed:
        changes = instance(RememberingPosterior, resumed.strategy.posterior).changes
        assert changes == tuple(range(1, MOST_NOTED + 1))
    assert "20 changes were noted" in [event.text for event in read_session(log).events if event.kind == "resume"][-1]


@pytest.mark.parametrize("nothing", [None, 3, np.arange(3)])
def test_what_is_said_about_a_session_is_a_text(log: Path, nothing: Any) -> None:
    with open_session(scripted_strategy(9), log) as session:
        run(session, 1)
        with pytest.raises(InvalidValueError, match="a note must"):
            session.note(nothing)
        with pytest.raises(InvalidValueError, match="reason of an exclusion"):
            session.exclude(0, nothing)
        session.ask()
        with pytest.raises(InvalidValueError, match="reason of a mistrial"):
            session.mistrial(nothing)
        for said in () if nothing is None else (session.note, partial(session.exclude, 0)):
            with pytest.raises(InvalidValueError, match="the key of"):
                said("coil moved", key=nothing)
    record = read_session(log)
    assert not record.events
    assert record.table[0].counts


def test_a_resumed_session_asks_what_an_uninterrupted_one_would_have(log: Path, tmp_path: Path) -> None:
    with open_session(scripted_strategy(9), tmp_path / "whole.mcap") as session:
        whole = run(session, 6)
    with open_session(scripted_strategy(9), log, resume=True) as session:
        first = run(session, 4)
    with open_session(scripted_strategy(9), log, resume=True) as session:
        assert first + run(session, 2) == whole
    assert [event.kind for event in read_session(log).events] == ["resume"]
    assert len(read_session(log).table) == 6


def test_a_log_without_its_end_goes_on_once_somebody_says_how_many_stimuli_it_lost(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        run(session, 6)
    cut_after(log, 4)
    with pytest.raises(DamagedLogError, match="stimulator's counter"):
        open_session(scripted_strategy(9), log, resume=True)
    with open_session(scripted_strategy(9), log, resume=True, lost_pulses=2) as session:
        assert [trial.told for trial in session.trials] == [True] * 4 + [False] * 2
    assert "cut off" in read_session(log).losses[0]


def test_a_session_with_a_device_goes_on_with_the_log(log: Path) -> None:
    with open_session(scripted_strategy(6), log) as session:
        run(session, 4)
    result = resume(log, ScriptedDevice(simulated=False), scripted_strategy(6), clock=FakeRealClock()).run()
    assert len(result.trials) == 6


def test_a_log_is_never_overwritten_and_a_used_strategy_is_refused(log: Path) -> None:
    with open_session(scripted_strategy(3), log) as session:
        run(session, 1)
    with pytest.raises(LogError, match="never overwritten"):
        open_session(scripted_strategy(3), log)
    with pytest.raises(StrategyError, match="not this session's"):
        open_session(session.strategy, log.with_name("t.mcap"))


def test_what_ends_the_loop_is_logged_and_the_log_is_closed(log: Path) -> None:
    def loop() -> None:
        with open_session(scripted_strategy(3), log) as session:
            session.ask()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        loop()
    record = read_session(log)
    assert record.finished
    assert record.events[-1].text.startswith("ZeroDivisionError")
    assert len(record.unknown) == 1


VICTIM = """
import sys, time
sys.path.insert(0, {tests!r})
from scripted import scripted_strategy
from isiw.session.resuming import open_session

session = open_session(scripted_strategy(9), {log!r})
for _ in range(3):
    isi_ms = session.ask()
    session.tell(isi_ms, 0.01 + isi_ms / 1e4)
session.note("before the end")
session.ask()
print("hanging", flush=True)
time.sleep(600)
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_loop_loses_nothing(log: Path) -> None:
    script = VICTIM.format(tests=str(Path(__file__).parents[1]), log=str(log))
    with Forked(script) as victim:
        assert victim.stdout.readline() == "hanging\n"
        victim.send_signal(signal.SIGKILL)
    with open_session(scripted_strategy(9), log, resume=True) as session:
        assert [trial.told for trial in session.trials] == [True, True, True, False]
        assert len(told_to(session.strategy)) == 3
    assert [event.kind for event in read_session(log).events] == ["note", "resume"]


def interrupted_once(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """The next call of a function of the recorder ends in Ctrl-C."""
    place = Strategy if name == "learn" else examination
    called = getattr(place, name)

    def stopped(*_: object) -> None:
        monkeypatch.setattr(place, name, called)
        raise KeyboardInterrupt

    monkeypatch.setattr(place, name, stopped)


@pytest.mark.parametrize("name", ["relearned", "learn"])
def test_what_was_interrupted_while_it_learnt_is_learnt_before_the_next_isi(
    log: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    with open_session(scripted_strategy(20), log) as session:
        run(session, 5)
        interrupted_once(monkeypatch, name)
        step = partial(session.exclude, 2) if name == "relearned" else partial(run, session, 1)
        with pytest.raises(KeyboardInterrupt):
            step()
        run(session, 3)
        trials = session.trials
        assert [told[0] for told in told_to(session.strategy)] == [trial.isi_ms for trial in trials.told]
    record = read_session(log)
    assert [intent.trial for intent in record.intents] == list(range(len(trials)))
    assert len(record.table) == (8 if name == "relearned" else 9)
    with open_session(scripted_strategy(20), log, resume=True) as session:
        assert len(told_to(session.strategy)) == len(trials.told)


def test_an_interrupted_trial_is_in_the_next_estimate(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_session(scripted_strategy(20), log) as session:
        run(session, 2)
        interrupted_once(monkeypatch, "learn")
        with pytest.raises(KeyboardInterrupt):
            session.tell(session.ask(), 0.1)
    assert session.estimate().pairs == 3


def test_trials_are_judged_in_another_thread_without_losing_any(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learns, told = threading.Event(), relearned

    def slowly(strategy: Strategy, trials: TrialTable, changes: list[int]) -> Strategy:
        learns.set()
        time.sleep(0.2)  # long enough for several trials of the loop
        return told(strategy, trials, changes)

    monkeypatch.setattr(examination, "relearned", slowly)
    with open_session(scripted_strategy(30), log) as session:
        run(session, 4)
        judging = threading.Thread(target=session.exclude, args=(2,))
        judging.start()
        assert learns.wait(10.0)
        run(session, 8)
        judging.join()
        trials = session.trials
        assert [told[0] for told in told_to(session.strategy)] == [trial.isi_ms for trial in trials.told]
    record = read_session(log)
    assert [intent.trial for intent in record.intents] == list(range(12))
    with open_session(scripted_strategy(30), log, resume=True) as session:
        assert len(session.trials.told) == 11


def test_tms_alone_counts_also_where_what_was_told_of_it_was_refused(log: Path, space: DesignSpace) -> None:
    with open_session(scripted_strategy(9), log, limits=Limits.of_space(space, min_iti_s=0.0, max_pulses=2)) as session:
        with pytest.raises(InvalidValueError, match="mV"):
            session.tell(None, 60.0)
        run(session, 1)
        with pytest.raises(LimitExceededError):
            session.ask()
    table = read_session(log).table
    assert [trial.reason for trial in table] == [Kind.OUTCOME_UNKNOWN, None]
    assert table[0].commanded_isi_ms is None


def test_tms_alone_that_was_refused_can_be_told_rightly(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        with pytest.raises(InvalidValueError, match="mV"):
            session.tell(None, 60.0)
        session.tell(None, 0.06)
        run(session, 1)
    assert [trial.mep_mv for trial in read_session(log).table][:1] == [0.06]


def test_a_trial_whose_writing_was_interrupted_once_it_was_in_the_log_is_not_asked_again(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_session(scripted_strategy(20), log) as session:
        isi_ms = session.ask()

        def stopped(_: LogWriter) -> None:
            monkeypatch.undo()
            raise KeyboardInterrupt

        monkeypatch.setattr(LogWriter, "sync", stopped)
        with pytest.raises(KeyboardInterrupt):
            session.tell(isi_ms, 0.1)
        assert session.asked is None
        run(session, 2)
    record = read_session(log)
    assert [intent.trial for intent in record.intents] == [trial.index for trial in record.table] == [0, 1, 2]
    assert record.estimates[-1].trial == 2
