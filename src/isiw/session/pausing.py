"""Pauses and interrupts: signals of the operator and the system, Pause, Continue and Stop, and how it goes on.

Each signal disarms at once, and interrupts if nothing is in flight. A held key is one act: Pause while the session is
paused does nothing, and Continue needs a press of its own, a second after the pause and after any other press of
Continue. After Pause or Stop nothing arms without that.
"""

from __future__ import annotations

import math
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, NamedTuple, ParamSpec, Self, TypeVar

from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError
from isiw.findings import Kind

if TYPE_CHECKING:
    from isiw.session.examination import WindowExamination
    from isiw.session.rig import Rig

P = ParamSpec("P")
T = TypeVar("T")

_PAUSING = ("SIGINT", "SIGTSTP")  # Ctrl-C and Ctrl-Z; Windows has no Ctrl-Z
_ENDING = ("SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")  # the last three are not on every system
_SUSPENDING = getattr(signal, "SIGTSTP", None)
_PAUSING_SIGNALS = tuple(getattr(signal, name) for name in _PAUSING if hasattr(signal, name))
_SIGNALS = (*_PAUSING_SIGNALS, *(getattr(signal, name) for name in _ENDING if hasattr(signal, name)))

_HANDLED = 0  # no signal has this number
_REACTION_S = 5.0  # a main thread that runs no handler for so long is stuck
_DISARMING_S = 30.0
_GLANCE_S = 0.01


class Interrupts:
    """Hears Ctrl-C, Ctrl-Z, Ctrl-backslash, a request to terminate, and a terminal's closing.

    At each of them a thread of its own disarms at once, whatever the main thread is busy with. Besides, each arrives as
    a KeyboardInterrupt in the main thread: at once inside `allowed`, else at the next entry into it or at the very end.
    Ctrl-Z suspends the process when the device is disarmed. Outside the main thread, which is where Python delivers
    signals, nothing is heard; what the process ignores, as under nohup, it goes on ignoring.
    """

    def __init__(
        self,
        disarm: Callable[[], object],
        stuck: Callable[[], object],
        away: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        self._disarm, self._stuck, self._away = disarm, stuck, away
        self._pending = self._allowed = False
        self._heard = self._disarmed = self._handled = 0
        self._acknowledged = self._settled = self._ended = 0
        self._before: dict[signal.Signals, Any] = {}
        self._watcher: threading.Thread | None = None
        self._over = False

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._ears, mouth = socket.socketpair()
            mouth.setblocking(False)  # noqa: FBT003 - its only argument
            self._mouth, self._mouth_before = mouth, signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
            self._watcher = threading.Thread(target=self._watch, name="isiw interrupts", daemon=True)
            self._watcher.start()
            heard = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._receive) for number in heard}
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if self._watcher is not None:
            self._over = True
            signal.set_wakeup_fd(self._mouth_before)
        for number, handler in self._before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        if self._watcher is not None:
            self._mouth.close()
            self._watcher.join(_DISARMING_S)
            self._ears.close()
        if self._pending and error is None:
            raise KeyboardInterrupt

    @property
    def heard(self) -> bool:
        """True if a signal came that is not settled."""
        return self._handled > self._settled

    @property
    def insisted(self) -> bool:
        """True if more than one did."""
        return self._handled > self._settled + 1

    @property
    def ending(self) -> bool:
        """True if the session is to end, and not only to pause."""
        return self._ended > self._settled or self.insisted

    def acknowledge(self) -> None:
        """Let no KeyboardInterrupt come for what was heard, and return once the device was disarmed for it."""
        self._acknowledged = self._handled  # before the next line: a signal between them is heard later
        self._pending = False
        self._wait_until_disarmed()

    def settle(self) -> None:
        """Forget what was acknowledged, as the operator has decided to go on; what came since still holds."""
        self._settled = self._acknowledged

    @contextmanager
    def allowed(self) -> Iterator[None]:
        """Within, an interrupt arrives at once."""
        before, self._allowed = self._allowed, True
        try:
            if self._pending:
                self._pending = False
                raise KeyboardInterrupt
            yield
        finally:
            self._allowed = before

    def freely(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call what may be interrupted at any time, as no stimulus is in flight and no record half written."""
        with self.allowed():
            return call(*args, **kwargs)

    def _receive(self, number: int, _: FrameType | None) -> None:
        self._handled += 1
        with suppress(OSError):
            self._mouth.send(bytes([_HANDLED]))  # behind the signals that this is for: two at once are handled as one
        if number not in _PAUSING_SIGNALS:
            self._ended = self._handled
        if number == _SUSPENDING:  # stop the process as Ctrl-Z does, but disarmed; it goes on here
            self._wait_until_disarmed()
            with self._away():
                os.kill(os.getpid(), signal.SIGSTOP)
        if self._allowed:
            self._allowed = False  # one is enough; the next must not interrupt the cleanup
            raise KeyboardInterrupt
        self._pending = True

    def _watch(self) -> None:
        """Disarm at every signal, however busy the main thread is."""
        with suppress(OSError):  # closed at the end
            while command := self._next():
                if command[0] == _HANDLED:
                    self._disarmed += 1
                    self._heard = self._disarmed
                elif command[0] in _SIGNALS:
                    self._heard += 1
                    self._disarm()

    def _next(self) -> bytes:
        """The next byte; if more than one signal waits for its handler, the main thread has to react by then."""
        insisting = self._heard > max(self._disarmed, self._settled + 1)
        self._ears.settimeout(_REACTION_S if insisting else None)
        try:
            return self._ears.recv(1)
        except TimeoutError:
            if not self._over:
                self._stuck()
            self._ears.settimeout(None)
            return self._ears.recv(1)

    def _wait_until_disarmed(self) -> None:
        end_s = time.monotonic() + _DISARMING_S
        while self._disarmed < self._handled and time.monotonic() < end_s:
            time.sleep(_GLANCE_S)


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


def paused(reason: str) -> StopDecision:
    """The decision that does not stop, of a session that waits for a person."""
    return StopKind.PAUSED.go_on(f"The session is paused: {reason}")


def ended(reason: str) -> StopDecision:
    """The decision that does not stop, of a session that a person has ended."""
    return StopKind.PAUSED.go_on(f"The session was ended before its time: {reason}")


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
