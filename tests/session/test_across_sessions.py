"""Spacing and limits hold from one session to the next."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import pytest

from isiw.devices.limits import Limits
from isiw.errors import ClockWarning, InvalidValueError, LimitExceededError, LogError
from isiw.findings import Kind
from isiw.log import moments, writer
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.resuming import open_session, resume
from isiw.session.rig import Safeguards
from isiw.trials import Status, Trial
from isiw.visit import VisitProtocol
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy

LIMITS = Limits(0, 200, min_iti_s=5.0, max_pulses=100, max_period_pulses=5, period_s=3600.0)


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


def test_a_block_of_earlier_sessions_counts_however_long_it_took(
    session: MakeSession, tmp_path: Path, clock: FakeRealClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    real_ns = time.time_ns()
    monkeypatch.setattr(moments, "boot_s", clock.now_s)
    monkeypatch.setattr(time, "time_ns", lambda: real_ns + round(1e9 * clock.now_s()))
    limits = Limits(0, 200, min_iti_s=5.0, max_block_pulses=4, rest_s=120.0, period_s=120.0)
    session("a.mcap", limits=limits, protocol=VisitProtocol(iti_s=(100.0, 100.0))).run()
    session("b.mcap", limits=limits).run()
    last_s = read_session(tmp_path / "a.mcap").intents[-1].t_s
    assert [intent.t_s - last_s for intent in read_session(tmp_path / "b.mcap").intents] == [5.0, 125.0, 130.0]


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


@pytest.fixture
def set_forward(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Sets the computer's clock two hours forward."""
    for module in (moments, writer):
        monkeypatch.setattr(module, "boot_id", lambda: "this start")
    monkeypatch.setattr(moments, "boot_s", time.monotonic)
    real = time.time_ns

    def forward() -> None:
        monkeypatch.setattr(time, "time_ns", lambda: real() + 7200 * 10**9)

    return forward


def test_a_clock_that_is_set_forward_makes_no_earlier_session_old(
    session: MakeSession, tmp_path: Path, set_forward: Callable[[], None]
) -> None:
    session("a.mcap").run()
    set_forward()
    with pytest.warns(ClockWarning, match="set forward by 2:00:00"):
        session("b.mcap").run()
    last_s = read_session(tmp_path / "a.mcap").intents[-1].t_s
    record = read_session(tmp_path / "b.mcap")
    assert record.intents[2].t_s > last_s + 3000.0
    assert any("set forward by 2:00:00" in event.text for event in record.events if event.kind == "fault")


def test_a_clock_that_is_set_forward_makes_no_stimulus_of_a_resumed_session_old(
    session: MakeSession, tmp_path: Path, clock: FakeRealClock, set_forward: Callable[[], None]
) -> None:
    session("a.mcap").run()
    set_forward()
    limits = dataclasses.replace(LIMITS, max_period_pulses=3)
    device = ScriptedDevice(simulated=False)
    again = resume(tmp_path / "a.mcap", device, scripted_strategy(4), limits=limits, clock=clock, verify=False)
    with pytest.warns(ClockWarning, match="set forward by 2:00:00"):
        again.run()
    intents = read_session(tmp_path / "a.mcap").intents
    assert intents[3].t_s - intents[2].t_s > 3000


def test_a_loop_of_its_own_that_goes_on_says_that_the_clock_was_set(
    tmp_path: Path, clock: FakeRealClock, set_forward: Callable[[], None]
) -> None:
    own: dict[str, Any] = {
        "limits": Limits(0, 200, min_iti_s=0.0, max_pulses=9, max_period_pulses=3, period_s=3600.0),
        "clock": clock,
    }
    said: list[str] = []
    with open_session(scripted_strategy(9), tmp_path / "a.mcap", **own) as begun:
        for _ in range(3):
            begun.tell(begun.ask(), 0.1)
    set_forward()
    with open_session(scripted_strategy(9), tmp_path / "a.mcap", resume=True, on_doubt=said.append, **own) as again:
        assert again.wait_s() > 3000.0
    assert ["set forward by 2:00:00" in each for each in said] == [True]
    assert [event.text for event in read_session(tmp_path / "a.mcap").events if event.kind == "fault"] == said


def test_stimuli_before_the_session_count_for_its_limit(tmp_path: Path, clock: FakeRealClock) -> None:
    lost = Trial(1, Status.MISTRIAL, 50.0, Kind.OUTCOME_UNKNOWN)
    before = (Trial(0, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=0.1), lost)
    limits = Limits(0, 200, min_iti_s=5.0, max_pulses=4)
    for folder in (tmp_path / "run", tmp_path / "own"):
        strategy = scripted_strategy(9)
        strategy.learn_all(before)
        if folder.name == "run":
            device = ScriptedDevice(simulated=False)
            result = Session(device, strategy, log=folder / "a.mcap", limits=limits, clock=clock).run()
            assert "4 pulses, 2 of them before the session, is reached" in result.decision.reason
            assert len(device.delivered) == 2
            continue
        for resumed in (False, True):
            again = scripted_strategy(9) if resumed else strategy
            with open_session(again, folder / "a.mcap", resume=resumed, limits=limits, clock=clock) as session:
                session.tell(session.ask(), 0.1)
        with open_session(scripted_strategy(9), folder / "a.mcap", resume=True, limits=limits) as session:
            assert session.strategy.earlier_given == 1  # a strategy knows what it has learnt, and the log the others
            with pytest.raises(LimitExceededError, match="limit of 4 pulses"):
                session.ask()
