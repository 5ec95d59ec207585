"""Whether a paused session goes on: asked of everybody who can answer, and the first answer counts."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from isiw.errors import InvalidValueError

__all__ = ["Asking"]

_NAP_S: Final = 0.05


class Asking:
    """A question that is answered from another thread: by a key, or a button."""

    def __init__(self) -> None:
        self.asked = False
        self._answer: bool | None = None

    def wait(self, nobody: Callable[[], bool]) -> bool:
        """Wait for an answer; where nobody is left who could give one, it is no.

        Args:
            nobody: whether nobody is left.
        """
        self._answer, self.asked = None, True  # an answer that came too late for the last question is none to this one
        try:
            while self._answer is None and not nobody():
                time.sleep(_NAP_S)
            return bool(self._answer)
        finally:
            self.asked = False

    def answer(self, *, goes_on: bool) -> None:
        """Answer; from any thread.

        Args:
            goes_on: whether the session goes on.

        Raises:
            InvalidValueError: nobody asks.
        """
        if not self.asked:
            raise InvalidValueError("the session does not wait for an answer", remedy="Pause it first.")
        self._answer = goes_on
