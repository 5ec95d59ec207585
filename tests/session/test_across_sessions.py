"""Spacing and limits hold from one session to the next."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Protocol

import pytest

from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError, LimitExceededError, LogError
from isiw.log.reader import read_session
from isiw.session.loop import Session
from isiw.session.resume import resume
from isiw.session.rig import Safeguards
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy

LIMITS = Limits(0, 200, 5.0, 100, max_period_pulses=5, period_s=3600.0)


class MakeSession(Protocol):
    def __call__(self, name: str, subject: str = "P07", **changes: Any) -> Session: ...


@pytest.fixture
def clock() -> FakeRealClock:
    return FakeRealClock()


@pytest.fixture
def session(tmp_path: Path, clock: FakeRealClock) -> MakeSession:
    """Makes a session of a real device's, of three trials, in one folder."""

    def make(name: str, subject: str = "P07", **changes: Any) -> Session:
        guards = Safeguards(earlier_logs=tmp_path)
        settings: dict[str, Any] = {
            "limits": LIMITS,
            "clock": clock,
            "safeguards": guards,
            "subject": subject,
        } | changes
        return Session(ScriptedDevice(simulated=False), scripted_strategy(3), log=tmp_path / name, **settings)

    return make


def test_earlier_sessions_of_the_subject_count_for_the_period(session: MakeSession, tmp_path: Path) -> None:
    session("a.mcap").run()
    session("b.mcap").run()
    last_s = read_session(tmp_path / "a.mcap").intents[-1].t_s
    times_s = [intent.t_s for intent in read_session(tmp_path / "b.mcap").intents]
    assert times_s[:2] == [last_s + 5.0, last_s + 10.0]  # the fourth and the fifth of the period
    assert times_s[2] > last_s + 3000.0


def test_sessions_of_other_subjects_do_not_count(session: MakeSession, tmp_path: Path) -> None:
    session("a.mcap").run()
    session("b.mcap", subject="P08").run()
    last_s = read_session(tmp_path / "a.mcap").intents[-1].t_s
    assert read_session(tmp_path / "b.mcap").intents[-1].t_s == last_s + 15.0


def test_an_earlier_log_that_cannot_be_read_refuses_the_session(session: MakeSession, tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"no log")
    with pytest.raises(LogError):
        session("b.mcap").run()
    assert not list(tmp_path.glob("b.mcap*"))


def test_without_a_subject_earlier_logs_cannot_be_found(session: MakeSession) -> None:
    with pytest.raises(InvalidValueError, match="Give the session a subject"):
        session("a.mcap", subject="")


def test_a_resumed_session_counts_its_own_earlier_stimuli_for_the_period(
    session: MakeSession, tmp_path: Path, clock: FakeRealClock
) -> None:
    session("a.mcap").run()
    limits = dataclasses.replace(LIMITS, max_period_pulses=3)
    device = ScriptedDevice(simulated=False)
    resume(tmp_path / "a.mcap", device, scripted_strategy(4), limits=limits, clock=clock, verify=False).run()
    intents = read_session(tmp_path / "a.mcap").intents
    assert len(intents) == 4
    assert intents[3].t_s - intents[2].t_s > 3000


def test_without_the_dead_mans_switch_the_session_ends_before_its_first_stimulus(
    session: MakeSession, tmp_path: Path
) -> None:
    refused = session("a.mcap", safeguards=Safeguards(dead_man=lambda: False))
    with pytest.raises(LimitExceededError, match="dead man"):
        refused.run()
    record = read_session(tmp_path / "a.mcap")
    assert record.intents == ()
    assert [event.kind for event in record.events] == ["limit"]
