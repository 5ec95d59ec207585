"""What the operator's screen shows, as a terminal would."""

from __future__ import annotations

import os
import re
import select
import threading

import pytest

from isiw.session.terminal import ERASED, Keys, Screen, drop_typed_ahead, goes_on, typed


def seen(written: str) -> list[str]:
    """The lines that a terminal shows after it was sent a text."""
    lines = []
    for line in written.split("\n"):
        last = re.split(r"\r\x1b\[K|\r", line)[-1].removesuffix("\x1b[K")
        while ERASED in last:
            at = last.index(ERASED)
            last = last[: at - 1] + last[at + len(ERASED) :]
        lines.append(last)
    return lines


def test_how_things_stand_stays_below_what_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with Screen() as screen:
        screen.say("trial 0", "17 left")
        screen.say("paused")
        screen.say("trial 1", "16 left")
    assert seen(capsys.readouterr().err) == ["trial 0", "paused", "trial 1", "16 left", ""]


def test_in_a_narrow_terminal_the_last_line_is_cut_and_what_is_said_is_folded(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the terminal itself breaks could not be taken back, and would stay behind."""
    monkeypatch.setattr("isiw.session.terminal._wide", lambda: 30)
    with Screen() as screen:
        screen.say("The session is paused, as three trials in a row were lost.", "next 135 ms, 17 left, ~1:44 min")
        for sign in ["Note: ", *"the arm was moved a little, to the left"]:
            screen.type(sign)
        screen.say("trial 1")
    lines = seen(capsys.readouterr().err)
    assert lines == [
        "The session is paused, as",
        "three trials in a row were",
        "lost.",
        "trial 1",
        "s moved a little, to the left",
        "",
    ]
    assert max(map(len, lines)) <= 30


def test_a_countdown_takes_the_last_line_and_gives_it_back(capsys: pytest.CaptureFixture[str]) -> None:
    with Screen() as screen:
        screen.say("trial 0", "17 left")
        screen.count_down("Rest: 1:00 left")
        screen.say("paused")
        screen.counted_down()
    assert seen(capsys.readouterr().err) == ["trial 0", "paused", "17 left", ""]


def test_what_is_being_typed_is_not_torn_apart(capsys: pytest.CaptureFixture[str]) -> None:
    with Screen() as screen:
        screen.say("trial 0", "17 left")
        for sign in ("Note: ", "a", "b", ERASED, "c"):
            screen.type(sign)
        screen.say("trial 1", "16 left")
        screen.type("d")
        screen.type("\n")
        screen.say("The note is in the log.")
    written = capsys.readouterr().err
    assert seen(written) == ["trial 0", "trial 1", "Note: acd", "The note is in the log.", "16 left", ""]


@pytest.mark.parametrize("key", ["[A", "OR", "O5R", "[15~", "[1;5A", "[[A", "r", "\x1b[A", "]0;q\x07", "P1r\x1b\\"])
def test_a_longer_key_is_no_letter_also_where_it_comes_in_parts(key: str) -> None:
    assert typed(f"a\x1b{key}b") == ("ab", "")
    for length in range(len(key)):
        characters, begun = typed(f"a\x1b{key[:length]}")
        assert characters == "a"
        assert typed(f"{begun}{key[length:]}b") == ("b", "")


@pytest.mark.skipif(os.name == "nt", reason="a POSIX terminal")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_where_a_key_fails_in_an_unforeseen_way_nobody_is_there_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(key: str) -> None:
        raise KeyError(key)

    operator, terminal = os.openpty()
    gone = threading.Event()
    with os.fdopen(terminal) as keyboard:
        monkeypatch.setattr("sys.stdin", keyboard)
        with Keys(fails, gone.set):
            os.write(operator, b"z")
            assert gone.wait(10.0)
    os.close(operator)


def test_terminals_obey_nothing_that_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with Screen() as screen:
        screen.say("\x1b]0;taken\x07P07\x1b[2J", "\x1b[2Jleft")
    assert capsys.readouterr().err == "P07\nleft\n"


def test_signs_that_a_terminal_lacks_do_not_silence_the_screen(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("isiw.session.terminal.sys.stderr", Ascii())
    with Screen() as screen:
        screen.say("▁▂▃ left")
    assert capsys.readouterr().out == "??? left\n"


class Ascii:
    encoding = "ascii"

    def write(self, text: str) -> None:
        print(text.encode("ascii").decode(), end="")  # noqa: T201 - what pytest captures

    def flush(self) -> None:
        """Nothing is held back."""


@pytest.mark.skipif(os.name == "nt", reason="POSIX terminals")
def test_what_was_typed_before_a_question_is_no_answer_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    operator, terminal = os.openpty()
    with os.fdopen(terminal, encoding="utf-8") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        os.write(operator, b"0.08\n")
        while not select.select([terminal], [], [], 0.1)[0]:
            pass
        drop_typed_ahead()
        os.write(operator, b"0.05\n")
        assert stdin.readline() == "0.05\n"
    os.close(operator)


@pytest.mark.skipif(os.name == "nt", reason="POSIX terminals")
def test_a_yes_that_was_typed_before_a_pause_does_not_continue_it(monkeypatch: pytest.MonkeyPatch) -> None:
    operator, terminal = os.openpty()
    asked = threading.Event()

    def ask(*_: object, **__: object) -> None:
        asked.set()
        os.write(operator, b"n\n")

    with os.fdopen(terminal, encoding="utf-8") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        monkeypatch.setattr("isiw.session.terminal.is_terminal", lambda _: True)  # what pytest captures is none
        monkeypatch.setattr("isiw.session.terminal.alarm", ask)
        os.write(operator, b"y\n")
        while not select.select([terminal], [], [], 0.1)[0]:
            pass
        assert not goes_on("The MEPs have gone.")
    assert asked.is_set()
    os.close(operator)
