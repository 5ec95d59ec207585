import threading
from dataclasses import dataclass, field
from typing import Never

import pytest
import torch

import isiw
from isiw.errors import InvalidValueError
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy


@dataclass(frozen=True)
class HeldUp:
    """An acquisition function that answers when it is let go."""

    go: threading.Event
    needs: tuple[type, ...] = ()
    asked: list[int] = field(default_factory=list)

    def __call__(self, posterior, isi_ms):
        del posterior
        self.asked.append(len(isi_ms))
        assert self.go.wait(30)
        return -torch.abs(isi_ms - 40.0)[None]


@pytest.fixture
def go():
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def held_up(scripted_strategy, go) -> Strategy:
    usual = scripted_strategy()
    return Strategy(usual.space, usual.model, HeldUp(go), Budget(2))


def test_past_the_deadline_an_isi_of_the_grid_is_asked_with_the_reason(held_up) -> None:
    isi_ms = held_up.ask(deadline_s=0.01)
    assert isi_ms in held_up.space.grid_ms
    assert "0.01 s" in held_up.fallback_reason


def test_the_fallback_stays_until_the_next_tell_and_no_longer(held_up, go) -> None:
    first = held_up.ask(deadline_s=0.01)
    go.set()
    assert held_up.ask() == first
    assert held_up.fallback_reason is not None
    held_up.tell(first, 0.02)
    assert held_up.fallback_reason is None
    assert held_up.ask() == 40.0
    assert held_up.fallback_reason is None


def test_fallbacks_differ_from_trial_to_trial(held_up) -> None:
    asked = []
    for _ in range(4):
        asked.append(held_up.ask(deadline_s=0.0))
        held_up.tell(asked[-1], 0.02 + 1e-4 * asked[-1])
    assert len(set(asked)) == 4


def test_within_the_deadline_the_choice_is_the_usual_one(held_up, go) -> None:
    go.set()
    assert held_up.ask(deadline_s=30.0) == 40.0
    assert held_up.fallback_reason is None


@pytest.mark.parametrize("deadline_s", [float("inf"), 1e300])
def test_a_deadline_that_never_comes_is_none(held_up, go, deadline_s) -> None:
    go.set()
    assert held_up.ask(deadline_s=deadline_s) == 40.0
    assert held_up.fallback_reason is None


def test_a_session_may_be_given_all_the_time_there_is(scripted_strategy, scripted_device, tmp_path) -> None:
    log = tmp_path / "session.mcap"
    isiw.Session(scripted_device(), scripted_strategy(2), log=log, ask_deadline_s=float("inf")).run()
    assert isiw.read_session(log).header.ask_deadline_s is None


def test_a_choice_that_fails_within_the_deadline_is_an_error_not_a_fallback(scripted_strategy) -> None:
    usual = scripted_strategy()

    def broken(posterior, isi_ms) -> Never:
        raise ArithmeticError(f"no scores for {posterior.told} at {len(isi_ms)} ISIs")

    broken.needs = ()
    with pytest.raises(ArithmeticError, match="no scores"):
        Strategy(usual.space, usual.model, broken, Budget(2)).ask(deadline_s=30.0)


@pytest.mark.parametrize("deadline_s", [-1.0, float("nan")])
def test_a_deadline_that_cannot_be_is_refused(held_up, deadline_s) -> None:
    with pytest.raises(InvalidValueError, match="deadline_s"):
        held_up.ask(deadline_s=deadline_s)


def test_a_session_logs_every_fallback_on_its_trial(held_up, scripted_device, tmp_path) -> None:
    log = tmp_path / "session.mcap"
    isiw.Session(scripted_device(), held_up, log=log, ask_deadline_s=0.01).run()
    record = isiw.read_session(log)
    events = [event for event in record.events if event.kind == "fallback"]
    assert [event.trial for event in events] == [0, 1]
    assert "evenly spaced" in events[0].text
