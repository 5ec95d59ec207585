"""What the operator's keys do."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from isiw.errors import InvalidValueError, LogError
from isiw.session.console import OperatorConsole
from isiw.session.pausing import Asking
from isiw.trials import Status, Trial, TrialTable


class Operated:
    """A session that remembers what was done to it."""

    def __init__(self, *trials: Trial) -> None:
        self.trials = TrialTable(trials)
        self.hidden: set[int] = set()
        self.done: list[tuple[object, ...]] = []

    @property
    def shown_trials(self) -> TrialTable:
        return TrialTable(tuple(trial for trial in self.trials if trial.index not in self.hidden))

    @property
    def last_excluded(self) -> int | None:
        return max((trial.index for trial in self.trials if trial.excluded), default=None)

    def pause(self, reason: str) -> None:
        self.done.append(("pause", reason))

    def note(self, text: str) -> None:
        self.done.append(("note", text))

    def note_change(self, text: str) -> None:
        self.done.append(("change", text))

    def exclude(self, trial: int, reason: str = "") -> None:
        self.done.append(("exclude", trial, reason))

    def include(self, trial: int) -> None:
        self.done.append(("include", trial))

    def accept(self, trial: int) -> None:
        raise InvalidValueError("no MEP was measured", got=trial)

    def reject(self, trial: int) -> None:
        self.done.append(("reject", trial))


def trial(index: int, *, excluded: bool = False) -> Trial:
    return Trial(index, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=0.1, excluded=excluded)


def press(console: OperatorConsole, keys: str) -> None:
    for key in keys:
        console.press(key)


@contextmanager
def shown(console: OperatorConsole, capsys: pytest.CaptureFixture[str]) -> Iterator[list[str]]:
    lines: list[str] = []
    with console.screen:
        yield lines
    lines += capsys.readouterr().err.splitlines()


def test_keys_mean_the_trial_on_the_screen_not_one_delivered_since() -> None:
    session = Operated(trial(0), trial(1))
    console = OperatorConsole(session)
    console.shown = 1
    session.trials = TrialTable((trial(0), trial(1), trial(2)))
    press(console, "xj")
    assert session.done == [("exclude", 1, "Excluded by the operator."), ("reject", 1)]
    console.shown = 2
    press(console, "j")
    assert session.done[-1] == ("reject", 2)


def test_keys_mean_no_trial_before_those_that_would_show_the_arm(capsys: pytest.CaptureFixture[str]) -> None:
    session = Operated(trial(0), trial(1), trial(2))
    session.hidden = {1, 2}
    console = OperatorConsole(session)
    console.shown = 0
    press(console, "x")
    console.leave()
    with shown(console, capsys) as lines:
        assert not console.goes_on("A look.")
    assert not [line for line in lines if "its row appears" in line]
    session.trials = TrialTable((*session.trials, trial(3)))
    press(console, "j")
    assert session.done == [("exclude", 2, "Excluded by the operator."), ("reject", 2)]


def test_where_no_row_is_shown_keys_mean_the_last_trial() -> None:
    session = Operated(trial(0), trial(1))
    press(OperatorConsole(session), "x")
    assert session.done == [("exclude", 1, "Excluded by the operator.")]


def test_in_a_pause_keys_mean_the_last_trial_and_it_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    session = Operated(trial(0), trial(1))
    console = OperatorConsole(session)
    console.shown = 0
    console.leave()
    with shown(console, capsys) as lines:
        assert not console.goes_on("Paused by the operator.")
        press(console, "x")
    assert any(
        "Trial 1 was delivered; its row appears when the session continues. x, a and j now act on trial 1." in line
        for line in lines
    )
    assert session.done == [("exclude", 1, "Excluded by the operator.")]


def test_each_key_does_what_it_stands_for(capsys: pytest.CaptureFixture[str]) -> None:
    session = Operated(trial(0), trial(1, excluded=True), trial(2))
    console = OperatorConsole(session)
    with shown(console, capsys) as lines:
        press(console, "pxuj")
    assert session.done == [
        ("pause", "Paused by the operator."),
        ("exclude", 2, "Excluded by the operator."),
        ("include", 1),
        ("reject", 2),
    ]
    assert lines == [
        "Trial 2 is excluded; u undoes it.",
        "Trial 1 counts again.",
        "Trial 2 is rejected and does not count.",
    ]


def test_what_cannot_be_done_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    console = OperatorConsole(Operated(trial(0)))
    with shown(console, capsys) as lines:
        press(console, "aur")
        press(OperatorConsole(Operated()), "z")
    assert lines == ["no MEP was measured; got 0", "no trial is excluded", "The session is not paused; p pauses it."]


def test_a_note_is_typed_and_its_letters_are_no_commands() -> None:
    session = Operated(trial(0))
    press(OperatorConsole(session), "nprexy\x7f caf\u00e9\n")
    assert session.done == [("note", "prex caf\u00e9")]


def test_a_change_is_typed_as_a_note_is(capsys: pytest.CaptureFixture[str]) -> None:
    session = Operated(trial(0))
    console = OperatorConsole(session)
    with shown(console, capsys) as lines:
        press(console, "ccoil\nnwell\n")
    assert session.done == [("change", "coil"), ("note", "well")]
    assert [line for line in lines if "in the log" in line] == ["The change is in the log.", "The note is in the log."]


@pytest.mark.parametrize("keys", ["nnever\x1b", "n  \n", "n\x7f\n"])
def test_a_note_can_be_dropped(keys: str) -> None:
    session = Operated(trial(0))
    console = OperatorConsole(session)
    press(console, keys)
    assert session.done == []
    press(console, "p")
    assert session.done == [("pause", "Paused by the operator.")]


class FullDisk(Operated):
    def note(self, text: str) -> None:
        raise LogError("the log cannot be written", got=text)


def test_a_note_that_cannot_be_logged_is_told_and_the_next_key_is_heard(capsys: pytest.CaptureFixture[str]) -> None:
    session = FullDisk(trial(0))
    console = OperatorConsole(session)
    with shown(console, capsys) as lines:
        press(console, "ncoil moved\np")
    assert "the log cannot be written; got 'coil moved'" in lines[-1]
    assert session.done == [("pause", "Paused by the operator.")]


@pytest.mark.parametrize(("key", "goes_on"), [("r", True), ("q", False)])
def test_a_pause_lasts_until_it_is_decided(key: str, goes_on: bool) -> None:  # noqa: FBT001
    console = OperatorConsole(Operated(trial(0)))
    answers: list[bool] = []
    paused = threading.Thread(target=lambda: answers.append(console.goes_on("A break.")))
    paused.start()
    while not answers:
        press(console, key)
        paused.join(0.01)
    assert answers == [goes_on]


def test_a_pause_is_decided_by_whoever_answers_first() -> None:
    asking, answers = Asking(), list[bool]()
    console = OperatorConsole(Operated(trial(0)), asking)
    paused = threading.Thread(target=lambda: answers.append(console.goes_on("A break.")))
    paused.start()
    while not asking.asked:
        paused.join(0.01)
    asking.answer(goes_on=True)
    paused.join()
    assert answers == [True]


def test_where_nobody_is_left_a_pause_is_answered_with_no() -> None:
    console = OperatorConsole(Operated(trial(0)))
    console.leave()
    assert console.goes_on("A break.") is False


def test_a_rest_is_counted_down_by_the_second_and_a_short_wait_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    console = OperatorConsole(Operated(trial(0)))
    with shown(console, capsys) as lines:
        for left_s in (8.0, 7.0):
            console.waiting(left_s, "Next stimulus")
        console.waiting(None, "")
        for left_s in (63.2, 63.0, 62.0, 9.0):
            console.waiting(left_s, "Rest after 12 trials")
        console.waiting(None, "")
        console.screen.say("next")
    said = [part.replace("\x1b[K", "") for part in "\n".join(lines).replace("\r", "\n").splitlines()]
    rest = "Rest after 12 trials"
    assert [part for part in said if part] == [f"{rest}: 1:03 left", f"{rest}: 1:02 left", f"{rest}: 0:09 left", "next"]
