"""Signals of the operator and the system: each disarms at once, and interrupts if nothing is in flight.

If nothing else helps the process ends, which closes what it holds open; a rig with an interlock disarms then.
"""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from types import FrameType
from typing import Any, Final, Never, ParamSpec, Self, TypeVar

from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.terminal import alarm, restore

STILL_ARMED: Final = 4
"""The exit code where a device could not be disarmed."""

INTERRUPTED: Final = 130
"""The exit code where a session did not react to Ctrl-C: what shells report for it."""

_PATIENCE_S = 2.0


def end_process(reason: str, log: LogWriter | None, code: int) -> Never:
    """End the process at once, whatever its threads are busy with."""
    ends = f"{reason} The process ends."
    end_s = time.monotonic() + _PATIENCE_S

    def show() -> None:
        restore()
        alarm(f"\n{ends}" if log is None else f"\n{ends}\nThe log is safe; resume with {log.path}.")

    def write() -> None:
        if log is not None:
            log.append(Event(kind="fault", text=ends))
            log.sync()

    # Each in a thread of its own: a terminal or a disk that holds one up, or is gone, holds up nothing else.
    steps = [threading.Thread(target=step, daemon=True) for step in (show, write)]
    try:
        for step in steps:
            step.start()
        while any(step.is_alive() for step in steps) and time.monotonic() < end_s:
            with suppress(KeyboardInterrupt):  # Ctrl-C pressed again; the process is ending already
                time.sleep(_GLANCE_S)
    finally:
        os._exit(code)


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
