"""A person at a real terminal produces intervals."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

if os.name == "nt":
    pytest.skip("a POSIX terminal", allow_module_level=True)

from interval.terminals import Person, somebody
from isiw.dissertation.interval.task import read_productions, resume_task, run_task, session_blocks
from isiw.errors import DeviceError, InvalidValueError


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "a.mcap"


def test_each_trial_is_in_the_file_before_its_feedback_is_shown(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def three_trials(person: Person) -> None:
        person.sees("target 300 ms.\n")
        for trial in range(3):
            person.produces(0.06)
            person.sees("yours")
            assert [production.trial for production in read_productions(log).productions] == list(range(trial + 1))
            (shown,) = (line for line in [person.sees(" ms\n")] if line)
            assert float(shown) == round(read_productions(log).productions[-1].produced_ms)

    with somebody(monkeypatch, three_trials):
        record = run_task(log, session_blocks(1, [3], trials=3), subject="P07")
    assert record.left == ()
    assert all(0 < production.produced_ms < 2000 for production in record.productions)


def test_who_leaves_goes_on_later_where_it_was_left(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def leaves(person: Person) -> None:
        person.sees("find the hidden target.\n")
        person.produces(0.05)
        person.sees("light")
        person.press("q")

    def goes_on(person: Person) -> None:
        person.sees("Block 1 of 1: 1 trial left, feedback: light on or off; find")
        person.produces(0.05)
        person.sees("2  light")

    blocks = session_blocks(1, [2], trials=2)
    with somebody(monkeypatch, leaves):
        assert run_task(log, blocks).left == ((1, 0),)
    with somebody(monkeypatch, goes_on):
        record = resume_task(log)
    assert [production.trial for production in record.productions] == [0, 1]
    assert [event.kind for event in record.events] == ["resume"]


def test_between_blocks_there_is_a_rest_in_which_no_key_counts(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def both_blocks(person: Person) -> None:
        seen.append(person.sees("Block 1 of 2: 1 trial, feedback: score bar; find the hidden target.\n"))
        person.produces(0.05)
        person.sees("score")
        person.sees("Rest: 0:01 left")
        began_s = time.monotonic()
        person.produces(0.05)
        seen.append(person.sees("Block 2 of 2: 1 trial, feedback: target and absolute error; target 300 ms.\n"))
        assert time.monotonic() - began_s > 0.2
        person.produces(0.05)
        person.sees("off by")

    with somebody(monkeypatch, both_blocks):
        record = run_task(log, session_blocks(1, [1, 4], trials=1), rest_s=0.6)
    assert "300" not in seen[0]
    assert "off by" not in seen[1]
    assert len(record.productions) == 2


def test_two_keys_that_arrive_together_are_no_interval_and_the_log_says_so(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stalls(person: Person) -> None:
        person.sees("300 ms.\n")
        person.press("fj")
        person.sees("does not count; press again")
        person.produces(0.05)
        person.sees("yours")

    with somebody(monkeypatch, stalls):
        record = run_task(log, session_blocks(1, [3], trials=1))
    assert [(event.kind, event.trial) for event in record.events] == [("note", 0)]
    assert len(record.productions) == 1


def test_without_a_terminal_nothing_is_begun(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(DeviceError, match=r"no terminal.*terminal window"):
            run_task(log, session_blocks(1))
    assert not list(log.parent.iterdir())


def test_a_windows_console_is_refused_since_its_keys_cannot_be_timed(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(DeviceError, match="100 ms"):
        run_task(log, session_blocks(1))


def test_a_rest_that_is_no_time_leaves_no_file(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with somebody(monkeypatch, lambda _: None), pytest.raises(InvalidValueError, match="rest_s"):
        run_task(log, session_blocks(1), rest_s=-1.0)
    assert not list(log.parent.iterdir())
