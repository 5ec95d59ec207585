"""Whether a paused session goes on: asked of everybody who can answer, and the first answer counts."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

from isiw.errors import InvalidValueError

_NAP_S: Final = 0.05


class Asking:
    """A question that is answered from another thread: by a key, or a button. No is never taken back."""

    def __init__(self) -> None:
        self.asked = self.over = False
        self._number = 0
        self._answer: bool | None = None
        self._lock = threading.Lock()

    def next(self) -> int:
        """The number of the question that comes next."""
        self._number += 1
        return self._number

    def wait(self, nobody: Callable[[], bool]) -> bool:
        """Wait for an answer; where nobody is left who could give one, it is no.

        Args:
            nobody: whether nobody is left.
        """
        with self._lock:  # an answer that came too late for the last question is none to this one
            self._answer, self.asked = None, True
        try:
            while self._answer is None and not self.over and not nobody():
                time.sleep(_NAP_S)
        finally:
            with self._lock:
                self.asked = False
        return bool(self._answer) and not self.over

    def answer(self, *, goes_on: bool, number: int | None = None) -> None:
        """Answer; from any thread.

        Args:
            goes_on: whether the session goes on.
            number: the question that is answered; None for whichever is asked.

        Raises:
            InvalidValueError: nobody asks, or another question is asked.
        """
        with self._lock:
            if not self.asked or (goes_on and (self.over or self._answer is False)):
                raise InvalidValueError("the session does not wait for an answer", remedy="Pause it first.")
            if number not in {None, self._number}:
                raise InvalidValueError(
                    "the session has paused again since", got=number, expected=f"pause {self._number}",
                    remedy="Read why it is paused now, then answer that pause.",
                )  # fmt: skip
            self._answer = goes_on

    def end(self) -> None:
        """Let this question and all that follow be answered with no; from any thread."""
        self.over = True
