import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Never

import numpy as np
import pytest

import isiw
from isiw.errors import InvalidValueError
from isiw.models.protocol import Posterior
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.types import Array
from known import known
from scripted import ScriptedDevice, scripted_strategy


@dataclass(frozen=True)
class HeldUp:
    """An acquisition function that answers when it is let go."""

    go: threading.Event
    needs: tuple[type, ...] = ()
    asked: list[int] = field(default_factory=list)

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        del posterior
        self.asked.append(len(isi_ms))
        assert self.go.wait(30)
        scores: Array = -np.abs(isi_ms - 40.0)[None]
        return scores


@dataclass(frozen=True)
class Broken:
    """An acquisition function that fails."""

    needs: tuple[type, ...] = ()

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Never:
        raise ArithmeticError(f"no scores after {posterior.trials} trials at {len(isi_ms)} ISIs")


@pytest.fixture
def held_up(released: threading.Event) -> Strategy:
    usual = scripted_strategy()
    return Strategy(usual.space, usual.model, HeldUp(released), Budget(2))


def test_past_the_deadline_an_isi_of_the_grid_is_asked_with_the_reason(held_up: Strategy) -> None:
    isi_ms = held_up.ask(deadline_s=0.01)
    assert isi_ms in held_up.space.grid_ms
    assert "0.01 s" in known(held_up.fallback_reason)


def test_the_fallback_stays_until_the_next_tell_and_no_longer(held_up: Strategy, released: threading.Event) -> None:
    first = held_up.ask(deadline_s=0.01)
    released.set()
    assert held_up.ask() == first
    assert held_up.fallback_reason is not None
    held_up.tell(first, 0.02)
    assert held_up.fallback_reason is None
    assert held_up.ask() == 40.0
    assert held_up.fallback_reason is None


def test_fallbacks_differ_from_trial_to_trial(held_up: Strategy) -> None:
    asked = []
    for _ in range(4):
        asked.append(held_up.ask(deadline_s=0.0))
        held_up.tell(asked[-1], 0.02 + 1e-4 * asked[-1])
    assert len(set(asked)) == 4


def test_within_the_deadline_the_choice_is_the_usual_one(held_up: Strategy, released: threading.Event) -> None:
    released.set()
    assert held_up.ask(deadline_s=30.0) == 40.0
    assert held_up.fallback_reason is None


@pytest.mark.parametrize("deadline_s", [float("inf"), 1e300])
def test_a_deadline_that_never_comes_is_none(
    held_up: Strategy, released: threading.Event, deadline_s: float | None
) -> None:
    released.set()
    assert held_up.ask(deadline_s=deadline_s) == 40.0
    assert held_up.fallback_reason is None


def test_a_session_may_be_given_all_the_time_there_is(tmp_path: Path) -> None:
    log = tmp_path / "session.mcap"
    isiw.Session(ScriptedDevice(), scripted_strategy(2), log=log, ask_deadline_s=float("inf")).run()
    assert isiw.read_session(log).header.ask_deadline_s is None


def test_a_choice_that_fails_within_the_deadline_is_an_error_not_a_fallback() -> None:
    usual = scripted_strategy()

    with pytest.raises(ArithmeticError, match="no scores"):
        Strategy(usual.space, usual.model, Broken(), Budget(2)).ask(deadline_s=30.0)


@pytest.mark.parametrize("deadline_s", [-1.0, float("nan")])
def test_an_invalid_deadline_is_refused(held_up: Strategy, deadline_s: float | None) -> None:
    with pytest.raises(InvalidValueError, match="deadline_s"):
        held_up.ask(deadline_s=deadline_s)


def test_a_session_logs_every_fallback_on_its_trial(held_up: Strategy, tmp_path: Path) -> None:
    log = tmp_path / "session.mcap"
    isiw.Session(ScriptedDevice(), held_up, log=log, ask_deadline_s=0.01).run()
    record = isiw.read_session(log)
    events = [event for event in record.events if event.kind == "fallback"]
    assert [event.trial for event in events] == [0, 1]
    assert "evenly spaced" in events[0].text
