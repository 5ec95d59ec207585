"""Held keys, double presses, two pages and lost connections: nothing arms after Pause or Stop without an act."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import pytest

from isiw.errors import InvalidValueError
from isiw.session import pausing
from isiw.session.pausing import Asking, Pausing

pytestmark = pytest.mark.needs_a_second

Press = tuple[str, float, int]
"""What is pressed or happens, how long after the last one [s], and at which of two pages."""

WHAT: Final = ("pause", "continue", "continue for the pause that is shown", "stop", "look", "step")
LATER_S: Final = (0.0, 0.03, 0.5, 0.999, 1.0, 1.5)


@dataclass
class Bench:
    """A session's pauses with a rig that notes whether it is armed, and people at two pages and a keyboard."""

    presses: Iterator[Press]
    now_s: float = 0.0
    armed: bool = True
    over: bool = False
    forbidden: bool = False  # after Pause or Stop, until a press of Continue of its own
    last_s: float = -10.0  # when Pause or Continue was pressed last, or a pause began
    shown: list[int | None] = field(default_factory=lambda: [None, None])

    # The rig, the signals and the examination that `Pausing` knows.
    heard = ending = False

    @property
    def interrupts(self) -> Any:
        return self

    def freely(self, call: Callable[..., bool], *args: Any) -> bool:
        return call(*args)

    def acknowledge(self) -> None: ...
    def settle(self) -> None: ...
    def log_faults(self) -> None: ...
    def event(self, *_: object, **__: object) -> None: ...

    def disarm(self) -> None:
        self.armed = False

    def stage(self) -> None:
        assert not self.forbidden, "armed without a press of Continue of its own"
        self.armed = True

    def run(self) -> None:
        """Let the session run and the people press until nothing more happens, or it ends."""
        self.asking = Asking(lambda: self.now_s)
        self.pauses: Pausing = Pausing(self, self, self.asking)  # type: ignore[arg-type]
        for press in self.presses:
            if self.happens(press) == "step" and self.pauses.due:
                self.last_s = self.now_s
                if self.pauses.until_decided(lambda _: self.asking.wait(self._nobody)) is not None:
                    self.over = True
                    break
        assert not (self.over and self.armed)

    def _nobody(self) -> bool:
        """While the session waits, people press; once they have left, nobody is there."""
        press = next(self.presses, None)
        if press is None:
            return True
        self.happens(press)
        return False

    def happens(self, press: Press) -> str:
        what, later_s, page = press
        self.now_s += later_s
        number = self.pauses.waiting.number if self.pauses.waiting else None
        if what == "pause":
            self.pauses.now("A look.")
            self.forbidden, self.last_s = True, self.now_s
        elif what == "stop":
            self.pauses.end("The end.")
            self.forbidden = self.over = True
        elif what == "look":
            self.shown[page] = number
        elif what.startswith("continue"):
            self.go_on(number if what == "continue" else self.shown[page] or 0)
        assert not (self.armed and self.forbidden)
        return what

    def go_on(self, number: int | None) -> None:
        own = self.now_s - self.last_s >= pausing.SEPARATE_S
        try:
            self.asking.answer(goes_on=True, number=number)
        except InvalidValueError:
            pass
        else:
            assert own, "Continue counted though it was no press of its own"
            assert number == self.pauses.waiting.number if self.pauses.waiting else number is None
            self.forbidden = self.over
        self.last_s = self.now_s


@pytest.mark.parametrize("sequences", [200, pytest.param(10_000, marks=pytest.mark.slow)])
def test_nothing_arms_after_pause_or_stop_without_a_press_of_its_own(
    sequences: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pausing, "_POLL_S", 0.0)
    draw = random.Random(71)  # noqa: S311 - of presses
    for _ in range(sequences):
        presses = [(draw.choice(WHAT), draw.choice(LATER_S), draw.randrange(2)) for _ in range(draw.randrange(60))]
        held: list[Press] = [(draw.choice(WHAT[:3]), 0.03, draw.randrange(2))] * 40
        at = draw.randrange(len(presses) + 1)
        Bench(iter([*presses[:at], *held[: draw.choice((0, 40))], *presses[at:]])).run()


def after(presses: list[Press], monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(pausing, "_POLL_S", 0.0)
    bench = Bench(iter(presses))
    bench.run()
    return bench


PAUSED: Final[list[Press]] = [("pause", 5.0, 0), ("step", 0.1, 0)]


def test_a_held_continue_never_continues_and_one_of_its_own_does(monkeypatch: pytest.MonkeyPatch) -> None:
    held: list[Press] = [("continue", 0.03, 0)] * 100
    assert not after([*PAUSED, *held], monkeypatch).armed
    assert after([*PAUSED, *held, ("continue", 1.0, 0), ("step", 0.1, 0)], monkeypatch).armed


def test_a_held_pause_is_one_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = after([*PAUSED, *[("pause", 0.03, 0)] * 100, ("continue", 1.0, 0), *[("step", 1.0, 0)] * 3], monkeypatch)
    assert bench.armed
    assert bench.asking.number == 1


def test_continue_on_a_page_that_shows_an_earlier_pause_does_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    again: list[Press] = [("look", 0.1, 1), ("continue", 1.0, 0), *PAUSED]
    bench = after([*PAUSED, *again, (WHAT[2], 5.0, 1)], monkeypatch)
    assert not bench.armed


def test_why_continue_does_nothing_is_said() -> None:
    asking = Asking(lambda: 3.0)

    def nobody() -> bool:
        with pytest.raises(InvalidValueError, match="a press of its own, 1 s after the pause"):
            asking.answer(goes_on=True)
        return True

    assert asking.wait(nobody) is False
