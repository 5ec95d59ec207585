from __future__ import annotations

import threading

import pytest

from isiw.dissertation.interval.task import Presses


class Times:
    """A clock that shows what the test says."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Times:
    return Times()


def pressed(clock: Times, *keys: tuple[str, float]) -> Presses:
    presses = Presses(clock)
    for key, at_ms in keys:
        clock.now_s = 100.0 + at_ms / 1000
        presses.press(key)
    return presses


def test_an_interval_is_the_time_between_the_two_presses(clock: Times) -> None:
    assert pressed(clock, ("f", 0), ("j", 294)).next_ms() == pytest.approx(294)


def test_a_key_that_is_held_down_begins_one_interval(clock: Times) -> None:
    assert pressed(clock, ("f", 0), ("f", 250), ("f", 280), ("j", 300)).next_ms() == pytest.approx(300)


def test_an_end_without_a_start_is_nothing(clock: Times) -> None:
    assert pressed(clock, ("j", 0), ("f", 100), ("x", 150), ("J", 400), ("j", 500)).next_ms() == pytest.approx(300)


def test_a_start_that_was_forgotten_does_not_count(clock: Times) -> None:
    assert pressed(clock, ("f", 0), ("f", 60_000), ("j", 60_310)).next_ms() == pytest.approx(310)


def test_nothing_is_begun_during_a_rest(clock: Times) -> None:
    presses = pressed(clock, ("f", 0))
    presses.resting = True
    presses.press("f")
    presses.press("j")
    presses.resting = False
    clock.now_s = 200.0
    presses.press("j")
    presses.press("f")
    clock.now_s = 200.3
    presses.press("j")
    assert presses.next_ms() == pytest.approx(300)


@pytest.mark.parametrize("how", ["q", "Q"])
def test_who_leaves_is_not_waited_for(clock: Times, how: str) -> None:
    assert pressed(clock, ("f", 0), (how, 10), ("j", 300)).next_ms() is None


def test_a_terminal_that_is_closed_ends_the_waiting(clock: Times) -> None:
    presses = Presses(clock)
    threading.Timer(0.05, presses.press, ["q"]).start()
    assert presses.next_ms() is None
