"""Ctrl-C at a safe moment: never between a stimulus and its record."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Self

__all__ = ["DeferredInterrupts"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # the last two, a closed terminal, are not on every system
_SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))


class DeferredInterrupts:
    """Holds back Ctrl-C, a request to terminate, and the closing of the terminal, except where they are allowed.

    Each arrives as a KeyboardInterrupt: at once inside `allowed`, else at the next entry into it or at the very end.
    Outside the main thread, which is where Python delivers signals, nothing is held back; what the process ignores, as
    under nohup, it goes on ignoring.
    """

    def __init__(self) -> None:
        self._pending = self._allowed = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            heard = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._receive) for number in heard}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        if self._pending and error is None:
            raise KeyboardInterrupt

    @contextmanager
    def allowed(self) -> Iterator[None]:
        """Within, an interrupt arrives at once."""
        self._allowed = True
        try:
            if self._pending:
                self._pending = False
                raise KeyboardInterrupt
            yield
        finally:
            self._allowed = False

    def _receive(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        if self._allowed:
            self._allowed = False  # one is enough; the next must not interrupt the cleanup
            raise KeyboardInterrupt
        self._pending = True
