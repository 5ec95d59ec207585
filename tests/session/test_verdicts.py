"""What an operator says about trials: events of the log, learnt at once, kept by a session that was killed."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest

import isiw
from forked import Forked
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError, LogError
from isiw.findings import Kind
from isiw.log.new_verdicts import LOOKED_AT
from isiw.log.record import read_session
from isiw.log.schema import EstimateRecord, Event, Intent
from isiw.report import final_statement
from isiw.session.afterwards import estimate_again, exclude, include
from isiw.session.loop import Session
from isiw.session.resuming import open_session, resume
from isiw.session.rig import Safeguards
from isiw.session.sink import SessionUpdate
from isiw.strategy.catalogue import make_strategy
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus
from scripted import ScriptedDevice, scripted_strategy, told_to

Act: TypeAlias = Callable[[Session], None]

TESTS = Path(__file__).parents[1]


def loud_in(*trials: int) -> ScriptedDevice:
    """A rig whose EMG is too loud in some trials."""

    def answer(stimulus: Stimulus) -> Measurement:
        loud = 50.0 if stimulus.trial in trials else 1.0
        return Measurement(0.01 + (stimulus.isi_ms or 0) / 1e4, stimulus.isi_ms, background_rms_uv=loud)

    return ScriptedDevice(answer)


def session_that(acts: dict[int, Act], log: Path, rig: ScriptedDevice | None = None, trials: int = 8) -> Session:
    """A session in which something is done after some trials."""

    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index in acts:
            acts[update.trial.index](session)

    session = Session(rig or ScriptedDevice(), scripted_strategy(trials), log=log, on_trial=on_trial)
    return session


def verdicts(log: Path) -> list[tuple[str, int | None, str]]:
    return [(event.kind, event.trial, event.text) for event in read_session(log).events]


def test_an_excluded_trial_is_unlearnt_before_the_next_is_asked_for(log: Path) -> None:
    session = session_that({4: lambda session: session.exclude(2, "a cough")}, log)
    result = session.run()
    assert verdicts(log) == [("exclusion", 2, "a cough")]
    assert [trial.index for trial in result.trials if trial.excluded] == [2]
    assert len(told_to(session.strategy)) == len(result.trials) - 1
    record = read_session(log)
    strategy = scripted_strategy(8)
    for trial in result.trials.trials[:5]:
        if trial.index != 2:
            strategy.tell(trial.isi_ms, trial.mep_mv)
    assert strategy.ask() == record.intents[5].isi_ms
    assert "excluded or included" not in final_statement(record)


def test_the_estimate_behind_a_verdict_is_without_the_trial(log: Path) -> None:
    session_that({4: lambda session: session.exclude(2)}, log).run()
    history = read_session(log).history
    place = next(place for place, entry in enumerate(history) if isinstance(entry, Event))
    assert [type(entry) for entry in history[place : place + 3]] == [Event, EstimateRecord, Intent]


def test_including_undoes_an_exclusion(log: Path, tmp_path: Path) -> None:
    undisturbed = Session(ScriptedDevice(), scripted_strategy(8), log=tmp_path / "undisturbed.mcap").run()

    def both(session: Session) -> None:
        session.exclude(2, "a cough")
        session.include(2)

    result = session_that({4: both}, log).run()
    assert result.trials == undisturbed.trials
    assert [kind for kind, _, _ in verdicts(log)] == ["exclusion", "inclusion"]


def test_the_trial_that_was_excluded_last_is_known_whatever_its_number(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        for mep_mv in (0.1, 0.2, 0.05, 0.3):
            session.tell(session.ask(), mep_mv)
        session.exclude(3)
        session.exclude(1)
        assert session.last_excluded == 1
        session.include(1)
        assert session.last_excluded == 3
        session.include(3)
        assert session.last_excluded is None


def test_rejecting_is_an_exclusion_with_its_own_reason_and_accepting_undoes_it(log: Path) -> None:
    session_that({2: lambda session: session.reject(2), 4: lambda session: session.accept(2)}, log).run()
    assert verdicts(log) == [("exclusion", 2, LOOKED_AT), ("inclusion", 2, "Included again by the operator.")]
    assert read_session(log).table[2].told


def test_a_mistrial_with_an_mep_can_be_accepted_and_keeps_what_it_was_rejected_for(log: Path) -> None:
    session = session_that({3: lambda session: session.accept(1)}, log, loud_in(1))
    result = session.run()
    trial = result.trials[1]
    assert (trial.status, trial.overruled) == (Status.ACCEPTED, Kind.BACKGROUND_ACTIVITY)
    assert told_to(session.strategy)[1] == pytest.approx((trial.isi_ms, trial.mep_mv))
    assert read_session(log).table == result.trials
    assert verdicts(log) == [("acceptance", 1, "Accepted by the operator all the same: background activity.")]
    assert read_session(log).trials["overruled"][1] == "background activity"


def test_a_mistrial_without_an_mep_cannot_be_accepted_and_the_message_says_so(log: Path) -> None:
    def answer(stimulus: Stimulus) -> Measurement | Sweep:
        lost = stimulus.trial == 2
        return Sweep({}, t_tms_ms=0.0) if lost else Measurement(0.01 + (stimulus.isi_ms or 0) / 1e4, stimulus.isi_ms)

    def refused(session: Session) -> None:
        with pytest.raises(InvalidValueError, match=r"no MEP was measured.*missing channel"):
            session.accept(2)

    session_that({3: refused}, log, ScriptedDevice(answer)).run()
    assert verdicts(log) == []


def test_no_operator_accepts_an_amplitude_that_no_muscle_gives(log: Path) -> None:
    def answer(stimulus: Stimulus) -> Sweep | Measurement:
        if stimulus.trial != 2:
            return Measurement(0.01 + (stimulus.isi_ms or 0) / 1e4, stimulus.isi_ms)
        emg_mv = 0.001 * np.random.default_rng(0).standard_normal(4000)
        emg_mv[3100:3120] += np.linspace(0.0, 194.0, 20)
        emg = Channel(emg_mv, 5000.0, "mV", t0_ms=-600.0)
        return Sweep({"emg": emg}, t_valve_ms=-(stimulus.isi_ms or 0.0), t_tms_ms=0.0)

    def refused(session: Session) -> None:
        assert session.trials[2].reason is Kind.IMPLAUSIBLE
        with pytest.raises(InvalidValueError, match=r"trial 2 .*194 mV"):
            session.accept(2)

    session_that({3: refused}, log, ScriptedDevice(answer)).run()
    assert verdicts(log) == []


@pytest.mark.parametrize(
    "act",
    [
        lambda session: session.exclude(99),
        lambda session: session.include(0),
        lambda session: session.accept(0),
        lambda session: session.reject(99),
    ],
)
def test_what_makes_no_sense_is_refused_and_not_logged(log: Path, act: Act) -> None:
    def refused(session: Session) -> None:
        with pytest.raises(InvalidValueError, match=r"cannot \w+ this trial; got \d+"):
            act(session)

    session_that({3: refused}, log).run()
    assert verdicts(log) == []


def test_notes_are_events(log: Path) -> None:
    session_that({1: lambda session: session.note("coil moved back")}, log).run()
    assert verdicts(log) == [("note", 1, "coil moved back")]


def test_without_a_running_session_there_is_nothing_to_note_in(log: Path) -> None:
    session = Session(ScriptedDevice(), scripted_strategy(2), log=log)
    for act in (session.note, lambda text: session.exclude(0, text)):
        with pytest.raises(InvalidValueError, match=r"not running|cannot exclude"):
            act("early")
    session.run()
    with pytest.raises(InvalidValueError, match="not running"):
        session.note("late")


def test_excluding_what_the_session_wanted_to_end_with_lets_it_go_on(log: Path) -> None:
    result = session_that({7: lambda session: session.exclude(7, "startled")}, log).run()
    assert result.decision.stop
    assert len(result.trials) == 8
    assert read_session(log).estimates[-1].decision == result.decision


def test_an_exclusion_afterwards_has_a_reason(log: Path) -> None:
    session_that({}, log, trials=2).run()
    with pytest.raises(InvalidValueError, match="needs a reason"):
        exclude(log, 0, " ")


def test_while_a_session_waits_another_thread_can_do_all_of_it_and_pause(log: Path) -> None:
    reasons: list[str] = []
    waiting = threading.Event()

    class Clock:
        """Real, but for intervals of which each lasts until the operator has had his way."""

        def __init__(self) -> None:
            self.time_s, self.naps = 0.0, 0

        def now_s(self) -> float:
            return self.time_s

        def sleep_s(self, duration_s: float) -> None:
            if len(session.trials) == 4 and not reasons:
                waiting.set()
                done.wait(0.01)
            else:
                self.time_s += duration_s

    done = threading.Event()

    def operate() -> None:
        assert waiting.wait(60)
        session.note("from elsewhere")
        session.exclude(1, "from elsewhere")
        session.include(1)
        session.reject(3)
        session.pause("A break.")
        done.set()

    def on_pause(reason: str) -> bool:
        reasons.append(reason)
        return True

    rig = ScriptedDevice(simulated=False)
    guards = Safeguards(on_pause=on_pause)
    session = Session(rig, scripted_strategy(8), log=log, clock=Clock(), safeguards=guards)
    other = threading.Thread(target=operate)
    other.start()
    result = session.run()
    other.join()
    assert [kind for kind, _, _ in verdicts(log)] == ["note", "exclusion", "inclusion", "exclusion", "pause", "pause"]
    assert reasons == ["A break."]
    assert rig.calls.count("stage") == 2
    assert len(result.trials) == 8
    assert result.trials[3].excluded


KILLED = """
import os, signal, sys
sys.path[:0] = [{tests!r}, {tests!r} + "/session"]
from scripted import scripted_strategy
from test_verdicts import loud_in, session_that

def all_of_it(session):
    session.note("a remark")
    session.exclude(0, "a cough")
    session.reject(2)
    session.exclude(3, "by mistake")
    session.include(3)
    session.accept(1)

session_that({{4: all_of_it, 5: lambda _: os.kill(os.getpid(), signal.SIGKILL)}}, {log!r}, loud_in(1)).run()
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_and_resumed_session_has_them_all_and_asks_what_it_would_have_asked(log: Path) -> None:
    with Forked(KILLED.format(tests=str(TESTS), log=str(log))) as killed:
        assert killed.returncode == -signal.SIGKILL
    session = resume(log, loud_in(), scripted_strategy(8))
    assert [trial.index for trial in session.trials if not trial.told] == [0, 2]
    assert session.trials[1].overruled is Kind.BACKGROUND_ACTIVITY
    result = session.run()
    kinds = ["note", "exclusion", "exclusion", "exclusion", "inclusion", "acceptance", "resume"]
    assert [kind for kind, _, _ in verdicts(log)] == kinds
    assert resume(log, loud_in(), scripted_strategy(8)).trials == result.trials  # which compares what was asked


def test_in_a_log_at_rest_trials_are_excluded_and_included(log: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(4), log=log).run()
    exclude(log, 2, "a cough")
    assert "excluded or included" in final_statement(read_session(log))
    include(log, 2)
    assert all(trial.told for trial in read_session(log).table)
    with pytest.raises(InvalidValueError, match=r"cannot include.* got 2; "):
        include(log, 2)


def test_a_loop_of_ones_own_can_do_all_of_it(log: Path) -> None:
    limits = Limits.of_space(scripted_strategy().space, min_iti_s=0.0)
    with open_session(scripted_strategy(9), log, limits=limits) as recorder:
        for number in range(4):
            recorder.tell(recorder.ask(), 0.02 + number / 1e3)
        recorder.exclude(0, "a cough")
        recorder.reject(1)
        recorder.include(0)
        recorder.accept(1)
        recorder.reject(2)
        assert [trial.index for trial in recorder.trials if not trial.told] == [2]
        assert len(told_to(recorder.strategy)) == 3
        recorder.ask()
        recorder.mistrial("no impact")
        with pytest.raises(InvalidValueError, match="no MEP was measured"):
            recorder.accept(4)
        recorder.ask()
    kinds = ["exclusion", "exclusion", "inclusion", "inclusion", "exclusion"]
    assert [kind for kind, _, _ in verdicts(log)] == kinds
    assert len(read_session(log).estimates) == 10
    with isiw.open_session(scripted_strategy(9), log, resume=True) as recorder:
        assert [trial.told for trial in recorder.trials] == [True, True, False, True, False, False]


def test_excluded_trials_are_not_told_as_lost(log: Path) -> None:
    with open_session(make_strategy("particles-mi", particles=50), log) as session:
        for trial in range(6):
            session.tell(session.ask(), 0.1 + trial / 1e3)
        for trial in (3, 4, 5):
            session.exclude(trial)
        session.ask()
        assert session.strategy.fallback_reason is None
        assert session.strategy.spent == 6


@pytest.mark.parametrize("number", [True, 0.0, "0", None])
def test_a_trial_is_named_by_a_whole_number(log: Path, number: Any) -> None:
    with open_session(scripted_strategy(9), log) as session:
        for _ in range(2):
            session.tell(session.ask(), 0.1)
        session.exclude(1)
        for judge in (session.exclude, session.include, session.reject, session.accept):
            with pytest.raises(InvalidValueError, match="the number of a trial must be a whole number"):
                judge(number)
    with pytest.raises(InvalidValueError, match="the number of a trial must be a whole number"):
        exclude(log, number, "a cough")
    assert [event.kind for event in read_session(log).events] == ["exclusion"]


@pytest.mark.parametrize(
    "again",
    [
        lambda log: exclude(log, 4, "a cough"),
        lambda log: include(log, 2),
        lambda log: estimate_again(log, scripted_strategy(8)),
    ],
    ids=["exclude", "include", "estimate"],
)
def test_a_closed_log_to_which_a_full_disk_adds_nothing_stays_as_it_was(
    again: Callable[[Path], None], tmp_path: Path
) -> None:
    resource = pytest.importorskip("resource")
    log = tmp_path / "s.mcap"
    session_that({4: lambda session: session.exclude(2)}, log).run()
    before, (usual, most) = log.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before), most))
    try:
        with pytest.raises(LogError, match=r"stays as it was\. Make room, and give the command again"):
            again(log)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (usual, most))
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == {log: before}
    again(log)
    assert log.read_bytes() != before
