"""Pauses: what Pause, Continue and Stop do, whoever presses them, and how a paused session is decided.

A held key is one act: Pause while the session is paused does nothing, and Continue needs a press of its own, a second
after the pause and after any other press of Continue. After Pause or Stop nothing arms without that.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.session.examination import WindowExamination
from isiw.session.rig import Rig

SEPARATE_S: Final = 1.0
"""A press of Continue counts if neither the pause nor another one was so shortly before it [s]."""

_INTERRUPTED: Final = "Interrupted by the operator."
_POLL_S: Final = 0.05


@dataclass(frozen=True)
class Presses:
    """What was pressed so far, and what it comes to; times are those of a monotonic clock [s].

    Args:
        number: of the pause, from 1.
        asked: whether a pause waits to be decided.
        answer: what the last one was decided; None as long as it is not.
        over: whether the session is to end, which nothing takes back.
        last_s: when the pause began, or Pause or Continue were pressed last.
    """

    number: int = 0
    asked: bool = False
    answer: bool | None = None
    over: bool = False
    last_s: float = -math.inf

    @property
    def is_open(self) -> bool:
        """True if a pause waits and nothing has decided it."""
        return self.asked and self.answer is None

    def pause(self, now_s: float) -> Presses:
        """Pause was pressed."""
        return replace(self, last_s=now_s)

    def wait(self, now_s: float) -> Presses:
        """A pause begins to wait for its decision; what was decided of the last one is nothing to this one."""
        return replace(self, asked=True, answer=None, last_s=now_s)

    def go_on(self, now_s: float, number: int | None = None) -> tuple[Presses, InvalidValueError | None]:
        """Continue was pressed, for the pause of this number or whichever there is; why it counts for nothing."""
        pressed = replace(self, last_s=now_s)
        if not self.asked or self.over or self.answer is False:
            return pressed, _not_waiting()
        if number not in {None, self.number}:
            return pressed, InvalidValueError(
                "the session has paused again since", got=number, expected=f"pause {self.number}",
                remedy="Read why it is paused now, then answer that pause.",
            )  # fmt: skip
        if now_s - self.last_s < SEPARATE_S:
            return pressed, InvalidValueError(
                f"Continue needs a press of its own, {SEPARATE_S:g} s after the pause and after any other press of it",
                remedy="Let go, wait a second, and press Continue again.",
            )
        return replace(pressed, answer=True), None

    def end(self) -> tuple[Presses, InvalidValueError | None]:
        """The pause was answered with the end of the session; no is never taken back."""
        return (replace(self, answer=False), None) if self.asked else (self, _not_waiting())

    def stop(self) -> Presses:
        """Stop was pressed."""
        return replace(self, over=True)

    def decided(self) -> tuple[Presses, bool]:
        """The pause waits no longer, and whether the session goes on."""
        return replace(self, asked=False), bool(self.answer) and not self.over


def _not_waiting() -> InvalidValueError:
    return InvalidValueError("the session does not wait for an answer", remedy="Pause it first.")


class Pause(NamedTuple):
    """A pause that waits to be decided: its number in the session, from 1, and why."""

    number: int
    reason: str


class Asking:
    """A question that is answered from another thread: by a key, or a button. No is never taken back.

    Once it is `over`, this question and all that follow are answered with no.
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._presses, self._now_s, self._lock = Presses(), now_s, threading.Lock()

    @property
    def asked(self) -> bool:
        """True if a pause waits to be decided."""
        return self._presses.asked

    @property
    def over(self) -> bool:
        """True if the session is to end."""
        return self._presses.over

    @property
    def refused(self) -> bool:
        """True if a person has said that the session is not to go on."""
        return self._presses.over or self._presses.answer is False

    @property
    def number(self) -> int:
        """The number of the pause."""
        return self._presses.number

    def begin(self) -> int:
        """One more pause; its number."""
        with self._lock:
            self._presses = replace(self._presses, number=self._presses.number + 1)
            return self._presses.number

    def wait(self, nobody: Callable[[], bool]) -> bool:
        """Wait for an answer; where nobody is left who could give one, it is no."""
        with self._lock:
            self._presses = self._presses.wait(self._now_s())
        try:
            while self._presses.is_open and not self.over and not nobody():
                time.sleep(_POLL_S)
        finally:
            with self._lock:
                self._presses, goes_on = self._presses.decided()
        return goes_on

    def answer(self, *, goes_on: bool, number: int | None = None) -> None:
        """Answer the question of this number, or whichever is asked; from any thread.

        Raises:
            InvalidValueError: nothing is asked, or something else, or Continue was no press of its own.
        """
        with self._lock:
            presses = self._presses
            self._presses, wrong = presses.go_on(self._now_s(), number) if goes_on else presses.end()
        if wrong is not None:
            raise wrong

    def pressed_pause(self) -> bool:
        """Take note of a press of Pause; True if it asks for one, and False if the session is paused already."""
        with self._lock:
            is_open, self._presses = self._presses.is_open, self._presses.pause(self._now_s())
        return not is_open

    def stop(self) -> None:
        """Answer this question and all that follow with no."""
        with self._lock:
            self._presses = self._presses.stop()


class Pausing:
    """The reasons to pause a session, and how it goes on."""

    def __init__(self, rig: Rig, examination: WindowExamination, asking: Asking) -> None:
        self._rig, self._examination, self._asking = rig, examination, asking
        self.reason: str | None = None
        self.kind: Kind | None = None
        self.waiting: Pause | None = None

    @property
    def due(self) -> bool:
        """True if the session is to pause before the next stimulus."""
        return self.reason is not None or self._rig.interrupts.heard

    def now(self, reason: str) -> None:
        """Disarm, and pause before the next stimulus, unless it is paused; from any thread."""
        if self._asking.pressed_pause():
            self.reason, self.kind = reason, None
        self._rig.disarm()

    def end(self, reason: str) -> None:
        """Disarm, and end before the next stimulus, whatever is answered to a pause; from any thread."""
        self._asking.stop()
        self.reason, self.kind = reason, None
        self._rig.disarm()

    def until_decided(self, decide: Callable[[str], bool]) -> str | None:
        """Pause until somebody says that the session goes on; if nobody does, the reason that it ends with."""
        rig, interrupts = self._rig, self._rig.interrupts
        rig.disarm()
        self._examination.log_faults()
        interrupts.acknowledge()
        if interrupts.ending:
            raise KeyboardInterrupt
        reason, kind, self.reason, self.kind = self.reason or _INTERRUPTED, self.kind, None, None
        self._examination.event("pause", reason, finding=kind, durable=True)
        if not self._goes_on(reason, decide):
            if interrupts.heard:
                raise KeyboardInterrupt
            if self.reason is not None:  # what somebody said meanwhile
                reason, self.reason = self.reason, None
                self._examination.event("pause", reason)
            return reason
        interrupts.settle()
        self._examination.event("pause", "The operator continued.")
        if not self.due:
            rig.stage()
            if self.due:  # Pause was pressed while it was being armed
                rig.disarm()
        return None

    def _goes_on(self, reason: str, decide: Callable[[str], bool]) -> bool:
        if self._asking.over:
            return False
        self.waiting = Pause(self._asking.begin(), reason)
        try:
            return self._rig.interrupts.freely(decide, reason) is True and not self._asking.over
        finally:
            self.waiting = None
