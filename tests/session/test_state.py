"""The words of a session's states, and when each holds."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest

from isiw.devices.protocol import Answer
from isiw.errors import DeviceError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.rig import Safeguards
from isiw.session.sink import Sink
from isiw.session.state import SENTENCES, Fault, State, state_of
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from scripted import ScriptedDevice, scripted_strategy


def test_every_state_has_a_word_and_a_sentence_of_its_own() -> None:
    assert list(SENTENCES) == list(State)
    assert len(set(SENTENCES.values())) == len(State)
    assert [f"{state}" for state in State if state is not State.NOT_BEGUN] == [
        "RUNS", "REST", "PAUSED", "FAULT", "ENDED", "NO CONNECTION",
    ]  # fmt: skip


def test_whatever_holds_there_is_one_state_and_a_fault_is_never_hidden() -> None:
    flags = ("begun", "running", "paused", "rests", "fault")
    for values in itertools.product((False, True), repeat=len(flags)):
        facts = dict(zip(flags, values, strict=True))
        state = state_of(**facts)
        assert (state is State.FAULT) == facts["fault"]
        assert (state in {State.RUNS, State.REST, State.PAUSED}) == (facts["running"] and not facts["fault"])


def seen_by(device: ScriptedDevice, log: Path, *, ends: bool = False) -> tuple[Session, list[tuple[State, bool]]]:
    """A session that pauses once, and its state and lamp before, in each trial, in the pause, and at the end."""
    seen: list[tuple[State, bool]] = []

    def on_pause(_: str) -> bool:
        seen.append((session.state, session.armed))
        return not ends

    session = Session(
        device, scripted_strategy(3), log=log, safeguards=Safeguards(on_pause=on_pause),
        on_trial=lambda update: session.pause("A look.") if update.trial.index == 1 else None,
    )  # fmt: skip
    answer: Callable[[Stimulus, float], Answer] = device.deliver

    def delivering(stimulus: Stimulus, timeout_s: float) -> Answer:
        seen.append((session.state, session.armed))
        return answer(stimulus, timeout_s)

    device.deliver = delivering  # type: ignore[method-assign]
    seen.append((session.state, session.armed))
    return session, seen


def test_a_session_says_whether_it_runs_is_paused_or_has_ended_and_whether_it_is_armed(log: Path) -> None:
    session, seen = seen_by(ScriptedDevice(), log)
    session.run()
    seen.append((session.state, session.armed))
    runs, paused = (State.RUNS, True), (State.PAUSED, False)
    assert seen == [(State.NOT_BEGUN, False), runs, runs, paused, runs, (State.ENDED, False)]
    assert session.fault is None


def test_a_fault_is_told_from_an_end_with_its_trial_and_whether_the_pulse_may_have_been_given(log: Path) -> None:
    def vanishing(stimulus: Stimulus) -> Measurement:
        if stimulus.trial == 2:
            raise DeviceError("USB device vanished", remedy="Set [device] port.")
        return Measurement(0.05, stimulus.isi_ms)

    session, _ = seen_by(ScriptedDevice(vanishing), log)
    with pytest.raises(DeviceError):
        session.run()
    assert (session.state, session.armed) == (State.FAULT, False)
    assert session.fault == Fault("USB device vanished", 2, given=True)
    assert session.fault.about_the_trial == "The pulse of trial 2 may have been given, and counts."


def test_an_interrupt_is_no_fault_of_the_session_nor_of_its_log(log: Path) -> None:
    def interrupted(_: Stimulus) -> Measurement:
        raise KeyboardInterrupt

    session, _ = seen_by(ScriptedDevice(interrupted), log)
    with pytest.raises(KeyboardInterrupt):
        session.run()
    assert session.state is State.ENDED
    assert [event.kind for event in read_session(log).events] == ["pause"]


def test_a_wait_keeps_its_end_while_it_lasts_and_a_rest_is_another_one() -> None:
    sink = Sink()
    sink.waiting(10.0)
    first = sink.wait
    sink.waiting(9.99)
    assert sink.wait is first
    sink.waiting(60.0, rests=True)
    assert sink.wait is not None
    assert sink.wait.rests
    sink.waiting(None)
    assert sink.wait is None
