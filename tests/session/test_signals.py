"""Signals and pauses: each disarms, whatever the session is busy with, and goes on only where somebody says so."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from forked import Forked
from isiw.decision import StopKind
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.pausing import Interrupts
from isiw.session.resuming import resume
from isiw.session.rig import INTERRUPTED, Safeguards
from isiw.session.sink import SessionUpdate
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from scripted import ScriptedDevice, scripted_strategy

pytestmark = [pytest.mark.skipif(os.name == "nt", reason="POSIX signals"), pytest.mark.usefixtures("terminal")]

TESTS = Path(__file__).parents[1]
HANG_S = 20.0  # what hangs is interrupted at once; where it is not, the test fails after this time


def goes_on_after(reasons: list[str]) -> Callable[[str], bool]:
    """What goes on after every pause, and keeps the reasons."""

    def on_pause(reason: str) -> bool:
        reasons.append(reason)
        return True

    return on_pause


def hanging_once(call: Callable[..., Any], number: signal.Signals, when: Callable[[], bool]) -> Callable[..., Any]:
    """Sends a signal and hangs, the first time that `when` holds."""
    state = {"left": 1}

    def wrapped(*args: Any, **kwargs: Any) -> Any:
        if state["left"] and when():
            state["left"] = 0
            signal.raise_signal(number)
            time.sleep(HANG_S)
            pytest.fail("the signal was not heard")
        return call(*args, **kwargs)

    return wrapped


def session_hanging_in(
    verb: str, number: signal.Signals, log: Path, on_pause: Callable[[str], bool] | None = None
) -> tuple[ScriptedDevice, Session]:
    device, strategy = ScriptedDevice(), scripted_strategy(6)

    def when() -> bool:
        return len(device.delivered) == 2

    on_trial = hanging_once(lambda _: None, number, when) if verb == "on_trial" else None
    if verb != "on_trial":
        setattr(strategy, verb, hanging_once(getattr(strategy, verb), number, when))
    return device, Session(device, strategy, log=log, on_trial=on_trial, safeguards=Safeguards(on_pause=on_pause))


@pytest.mark.parametrize("verb", ["ask", "learn", "estimate", "decision", "on_trial"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_a_signal_is_heard_while_nothing_is_in_flight(log: Path, verb: str, number: signal.Signals) -> None:
    device, session = session_hanging_in(verb, number, log)
    with pytest.raises(KeyboardInterrupt):
        session.run()
    assert "stop" in device.calls
    assert len(device.delivered) == 2
    record = read_session(log)
    assert record.finished
    assert len(record.table) == 2
    assert resume(log, ScriptedDevice(), scripted_strategy(6)).run().decision.stop


@pytest.mark.parametrize("verb", ["ask", "learn", "estimate", "decision", "on_trial"])
def test_after_ctrl_c_a_session_goes_on_as_if_nothing_had_happened_where_the_operator_says_so(
    log: Path, tmp_path: Path, verb: str
) -> None:
    undisturbed = Session(ScriptedDevice(), scripted_strategy(6), log=tmp_path / "undisturbed.mcap").run()
    disarmed_when_asked: list[tuple[str, str]] = []

    def on_pause(reason: str) -> bool:
        disarmed_when_asked.append((reason, device.calls[-1]))
        return True

    device, session = session_hanging_in(verb, signal.SIGINT, log, on_pause)
    result = session.run()
    assert disarmed_when_asked == [("Interrupted by the operator.", "stop")]
    assert device.calls.count("stage") == 2
    assert result.trials == undisturbed.trials
    record = read_session(log)
    assert [event.kind for event in record.events] == ["pause", "pause"]
    assert len(record.estimates) == 6


def test_a_second_ctrl_c_while_the_operator_is_asked_ends_the_session(log: Path) -> None:
    def on_pause(reason: str) -> bool:
        del reason
        signal.raise_signal(signal.SIGINT)
        time.sleep(HANG_S)
        return True

    device, session = session_hanging_in("ask", signal.SIGINT, log, on_pause)
    with pytest.raises(KeyboardInterrupt):
        session.run()
    assert len(device.delivered) == 2
    assert device.calls.count("stage") == 1
    assert read_session(log).finished


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGQUIT])
def test_a_request_to_end_is_no_question(log: Path, number: signal.Signals) -> None:
    asked: list[str] = []
    _, session = session_hanging_in("ask", number, log, goes_on_after(asked))
    with pytest.raises(KeyboardInterrupt):
        session.run()
    assert asked == []


def test_a_ctrl_c_that_somebody_swallows_stops_the_session_all_the_same(log: Path) -> None:
    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            with suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)

    device = ScriptedDevice()
    with pytest.raises(KeyboardInterrupt):
        Session(device, scripted_strategy(6), log=log, on_trial=on_trial).run()
    assert len(device.delivered) == 3
    assert len(read_session(log).table) == 3


def test_ctrl_c_in_the_middle_of_a_delivery_disarms_at_once_and_loses_no_outcome(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stopped = threading.Event()

    def answer(stimulus: Stimulus) -> Measurement:
        if stimulus.trial == 2:
            os.kill(os.getpid(), signal.SIGINT)
            assert stopped.wait(HANG_S)
        return Measurement(0.1, stimulus.isi_ms)

    device = ScriptedDevice(answer)
    monkeypatch.setattr(device, "stop", stopped.set)
    with pytest.raises(KeyboardInterrupt):
        Session(device, scripted_strategy(6), log=log).run()
    record = read_session(log)
    assert [trial.told for trial in record.table] == [True] * 3
    assert len(device.delivered) == 3


def test_a_pause_disarms_at_once_and_goes_on_armed_where_the_operator_says_so(log: Path, tmp_path: Path) -> None:
    undisturbed = Session(ScriptedDevice(), scripted_strategy(6), log=tmp_path / "undisturbed.mcap").run()
    calls_then: list[list[str]] = []

    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            session.pause("The subject needs a break.")
            calls_then.append(list(device.calls))

    device, reasons = ScriptedDevice(), list[str]()
    guards = Safeguards(on_pause=goes_on_after(reasons))
    session = Session(device, scripted_strategy(6), log=log, on_trial=on_trial, safeguards=guards)
    result = session.run()
    assert calls_then == [["stage", "stop"]]
    assert reasons == ["The subject needs a break."]
    assert device.calls.count("stage") == 2
    assert result.trials == undisturbed.trials


def test_without_anybody_to_ask_a_pause_ends_the_session_and_it_can_be_resumed(log: Path) -> None:
    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            session.pause("Three mistrials in a row.")

    session = Session(ScriptedDevice(), scripted_strategy(6), log=log, on_trial=on_trial)
    result = session.run()
    assert result.decision.reason == "The session is paused: Three mistrials in a row."
    assert len(result.trials) == 3
    assert len(resume(log, ScriptedDevice(), scripted_strategy(6)).run().trials) == 6


def test_a_session_that_was_ended_does_not_say_that_it_is_paused(log: Path) -> None:
    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            session.end("Ended on the live page.")

    session = Session(ScriptedDevice(), scripted_strategy(6), log=log, on_trial=on_trial)
    result = session.run()
    assert (result.decision.stop, result.decision.kind) == (False, StopKind.PAUSED)
    assert result.decision.reason == "The session was ended before its time: Ended on the live page."
    assert len(resume(log, ScriptedDevice(), scripted_strategy(6)).run().trials) == 6


def test_a_request_to_end_that_comes_just_before_a_pause_is_asked_about_ends_the_session(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    acknowledge, reasons = Interrupts.acknowledge, list[str]()

    def after_a_signal(self: Interrupts) -> None:
        signal.raise_signal(signal.SIGTERM)
        acknowledge(self)

    monkeypatch.setattr(Interrupts, "acknowledge", after_a_signal)
    device, session = session_hanging_in("ask", signal.SIGINT, log, goes_on_after(reasons))
    with pytest.raises(KeyboardInterrupt):
        session.run()
    assert reasons == []
    assert len(device.delivered) == 2


VICTIM = """
import hashlib, sys, threading, time
sys.path.insert(0, {tests!r})
from scripted import ScriptedDevice, scripted_strategy
from isiw.session.loop import Session

device, strategy = ScriptedDevice(), scripted_strategy(10)
device.stop = lambda: print("disarmed", flush=True)
ask = strategy.ask
def asked(*_):
    if len(device.delivered) < 3:
        return ask()
    threading.Timer(1.0, print, ("hanging",), {{"flush": True}}).start()  # when it hangs, and not before
    {hang}
strategy.ask = asked
Session(device, strategy, log={log!r}).run()
"""
BUSY_IN_C = 'hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)'


def victim(log: Path, hang: str) -> Forked:
    process = Forked(VICTIM.format(tests=str(TESTS), log=str(log), hang=hang))
    assert process.stdout.readline() == "hanging\n"
    return process


@pytest.mark.slow
def test_a_session_that_is_busy_outside_python_is_disarmed_by_the_first_signal_and_ended_by_the_second(
    log: Path,
) -> None:
    with victim(log, BUSY_IN_C) as process:
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "disarmed\n"
        process.send_signal(signal.SIGINT)
        assert "does not react" in process.stderr.read()
        assert process.returncode == INTERRUPTED
    record = read_session(log)
    assert record.losses == ()
    assert len(record.table) == 3
    assert "does not react" in record.events[-1].text
    assert len(resume(log, ScriptedDevice(), scripted_strategy(10)).run().trials) == 10


@pytest.mark.slow
def test_ctrl_z_disarms_before_it_suspends_and_a_continued_session_arms_for_nobody(log: Path) -> None:
    with victim(log, "time.sleep(600)") as process:
        process.send_signal(signal.SIGTSTP)
        _, status = os.waitpid(process.process, os.WUNTRACED)
        assert os.WIFSTOPPED(status)
        assert process.stdout.readline() == "disarmed\n"
        process.send_signal(signal.SIGCONT)
        assert process.returncode != 0
    assert len(read_session(log).table) == 3
    assert len(resume(log, ScriptedDevice(), scripted_strategy(10)).run().trials) == 10
