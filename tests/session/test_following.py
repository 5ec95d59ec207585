"""Those who look on while a session runs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from isiw.devices.clock import VirtualClock
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError
from isiw.log.record import read_session
from isiw.log.schema import Intent, Record
from isiw.session.loop import Session
from isiw.session.pausing import Asking, Interrupts
from isiw.session.rig import Safeguards
from isiw.session.sink import SessionUpdate, Sink
from isiw.session.steps import pace_s
from isiw.trials import Trial
from isiw.visit import VisitProtocol
from known import known
from scripted import SPACE, ScriptedDevice, scripted_strategy


@dataclass
class Remembering:
    """Remembers what it was told."""

    records: list[Record] = field(default_factory=list)
    updates: list[SessionUpdate] = field(default_factory=list)
    ends: int = 0

    def logged(self, record: Record, channel_name: str | None) -> None:
        del channel_name
        self.records.append(record)

    def updated(self, update: SessionUpdate) -> None:
        self.updates.append(update)

    def ended(self) -> None:
        self.ends += 1

    def is_attended(self) -> bool:
        return False


class Failing(Remembering):
    def logged(self, record: Record, channel_name: str | None) -> None:
        if isinstance(record, Trial):
            raise OSError("no more room")
        super().logged(record, channel_name)


def test_who_follows_is_told_every_record_and_update_and_the_end(tmp_path: Path) -> None:
    session, follower = Session(ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap"), Remembering()
    session.follow(follower)
    session.run()
    assert tuple(follower.records) == read_session(session.log_path).history
    assert [update.stimuli_left for update in follower.updates] == [2, 1, 0]
    assert [update.left_s for update in follower.updates] == [None, 5.0, 0.0]
    assert follower.ends == 1


def test_who_fails_is_told_nothing_more_and_the_session_goes_on(tmp_path: Path) -> None:
    session, failing = Session(ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap"), Failing()
    session.follow(failing)
    session.run()
    record = read_session(session.log_path)
    assert len(record.table) == 3
    (fault,) = [event for event in record.events if event.kind == "fault"]
    assert "no more room" in fault.text
    assert [type(entry) for entry in failing.records] == [Intent]


def test_where_a_program_decides_about_pauses_nobody_else_does(tmp_path: Path) -> None:
    answers: list[str] = []

    def on_pause(reason: str) -> bool:
        with pytest.raises(InvalidValueError, match="does not wait"):
            session.go_on()
        answers.append(session.paused or "")
        return bool(reason)

    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 0:
            session.pause("A break.")

    session = Session(
        ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap",
        safeguards=Safeguards(on_pause=on_pause), on_trial=on_trial,
    )  # fmt: skip
    session.follow(Remembering())
    session.run()
    assert answers == ["A break."]
    assert len(session.trials) == 3


def test_a_session_that_is_ended_within_a_pause_of_a_program_ends_all_the_same(tmp_path: Path) -> None:
    def on_pause(reason: str) -> bool:
        session.end("Enough.")
        return bool(reason)

    session = Session(
        ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap", safeguards=Safeguards(on_pause=on_pause),
        on_trial=lambda update: session.pause("A break.") if update.trial.index == 0 else None,
    )  # fmt: skip
    result = session.run()
    assert not result.decision.stop
    assert [event.text for event in read_session(result.log).events] == ["A break.", "Enough."]


def test_an_answer_that_came_too_late_is_none_to_the_next_question() -> None:
    asking = Asking()
    with pytest.raises(InvalidValueError):
        asking.answer(goes_on=True)
    assert asking.wait(lambda: True) is False


@pytest.mark.parametrize("answers_first", [False, True])
def test_a_question_is_answered_with_no_once_the_session_is_to_end(*, answers_first: bool) -> None:
    asking = Asking()

    def nobody() -> bool:
        if answers_first:
            asking.answer(goes_on=True)
        asking.stop()
        return False

    assert asking.wait(nobody) is False
    assert asking.wait(lambda: pytest.fail("asked though it ends")) is False


def test_only_the_question_that_is_asked_is_answered() -> None:
    asking = Asking()
    first, second = 1, 2
    assert [asking.begin() for _ in range(2)] == [first, second]

    def nobody() -> bool:
        with pytest.raises(InvalidValueError, match="paused again since"):
            asking.answer(goes_on=True, number=first)
        asking.answer(goes_on=True, number=second)
        return False

    assert asking.wait(nobody) is True


def test_no_is_not_taken_back() -> None:
    asking = Asking()

    def nobody() -> bool:
        asking.answer(goes_on=False)
        with pytest.raises(InvalidValueError):
            asking.answer(goes_on=True)
        return False

    assert asking.wait(nobody) is False


def test_a_session_that_is_ended_just_when_a_pause_was_decided_ends_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = Session(
        ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap", safeguards=Safeguards(on_pause=bool),
        on_trial=lambda update: session.pause("A break.") if update.trial.index == 0 else None,
    )  # fmt: skip
    settle = Interrupts.settle

    def ended_meanwhile(interrupts: Interrupts) -> None:
        session.end("Enough.")
        settle(interrupts)

    monkeypatch.setattr(Interrupts, "settle", ended_meanwhile)
    result = session.run()
    assert len(result.trials) == 1
    assert [event.text for event in read_session(result.log).events] == [
        "A break.",
        "The operator continued.",
        "Enough.",
    ]


def test_who_fails_in_two_threads_at_once_is_let_go_of_once() -> None:
    sink = Sink()

    class Twice(Remembering):
        def ended(self) -> None:
            super().ended()
            if self.ends == 1:
                sink.ended()  # as another thread would, which is the first to see it fail
            raise OSError("no more room")

    sink.followers.append(Twice())
    sink.ended()
    assert len(sink.faults) == 1
    assert not sink.followers


def test_the_pace_is_the_usual_one_whatever_rests_were_between() -> None:
    assert pace_s([0.0]) is None
    assert pace_s([0.0, 5.0, 10.0, 600.0, 605.0]) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("limits", "protocol"),
    [
        ({}, {"block_trials": 4, "rest_s": 60.0}),
        ({}, {"tms_alone": 0.2}),
        ({"max_block_pulses": 3, "rest_s": 40.0}, {}),
        ({"max_period_pulses": 5, "period_s": 300.0}, {"tms_alone": 0.2, "block_trials": 4, "rest_s": 60.0}),
    ],
    ids=["rests", "controls", "rests of the limits", "all"],
)
def test_the_time_that_is_left_counts_rests_and_control_trials(
    tmp_path: Path, limits: dict[str, Any], protocol: dict[str, Any]
) -> None:
    clock = VirtualClock()
    seen: list[tuple[float, float | None]] = []
    session = Session(
        ScriptedDevice(),
        scripted_strategy(12),
        log=tmp_path / "s.mcap",
        clock=clock,
        limits=replace(Limits.of_space(SPACE), **limits),
        protocol=VisitProtocol(**protocol),
        on_trial=lambda update: seen.append((clock.now_s(), update.left_s)),
    )
    session.run()
    ended_s = read_session(tmp_path / "s.mcap").intents[-1].t_s
    for now_s, left_s in seen[1:]:
        assert now_s + known(left_s) == pytest.approx(ended_s, abs=1.0)


@pytest.mark.parametrize("answer", ["n", 1, None])
def test_only_true_goes_on_after_a_pause(tmp_path: Path, answer: Any) -> None:
    device = ScriptedDevice()
    session = Session(
        device, scripted_strategy(3), log=tmp_path / "s.mcap", safeguards=Safeguards(on_pause=lambda _: answer),
        on_trial=lambda _: session.pause("A break."),
    )  # fmt: skip
    session.run()
    assert len(device.delivered) == 1


def test_a_wait_is_another_one_if_its_end_moves_or_it_becomes_a_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.session.sink.time.monotonic", lambda: 100.0)
    sink, waits = Sink(), []
    for left_s, rests in ((5.0, False), (5.2, False), (7.0, False), (7.0, True), (None, False)):
        sink.waiting(left_s, rests=rests)
        waits.append(sink.wait)
    assert waits == [(105.0, False), (105.0, False), (107.0, False), (107.0, True), None]
