"""A terminal with a person at it, who presses keys and reads the screen, in the process of the test."""

from __future__ import annotations

import os
import pty
import select
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

PATIENCE_S = 20.0


class Person:
    """Somebody at a terminal.

    Args:
        terminal: the person's end.
    """

    def __init__(self, terminal: int) -> None:
        self._terminal, self.seen = terminal, ""

    def press(self, keys: str) -> None:
        os.write(self._terminal, keys.encode())

    def sees(self, text: str) -> str:
        """Wait until a text is shown, and return what was shown before it."""
        end_s = time.monotonic() + PATIENCE_S
        while text not in self.seen:
            assert time.monotonic() < end_s, f"{text!r} did not come; shown since: {self.seen!r}"
            if select.select([self._terminal], [], [], 0.02)[0]:
                self.seen += os.read(self._terminal, 65536).decode().replace("\r", "")
        before, _, self.seen = self.seen.partition(text)
        return before

    def produces(self, interval_s: float) -> None:
        self.press("f")
        time.sleep(interval_s)
        self.press("j")


@contextmanager
def somebody(monkeypatch: pytest.MonkeyPatch, does: Callable[[Person], None]) -> Iterator[Person]:
    """Within, standard input and error are a terminal at which somebody does something; what fails there fails here."""
    theirs, ours = pty.openpty()
    person, failed = Person(theirs), list[BaseException]()

    def act() -> None:
        try:
            does(person)
        except BaseException as error:  # noqa: BLE001 - it is raised again in the thread of the test
            failed.append(error)
            person.press("q")

    thread = threading.Thread(target=act, daemon=True)
    with os.fdopen(ours, "r") as stdin, open(ours, "w", closefd=False) as stderr:
        monkeypatch.setattr(sys, "stdin", stdin)
        monkeypatch.setattr(sys, "stderr", stderr)
        thread.start()
        yield person
        thread.join(PATIENCE_S)
        monkeypatch.undo()
    os.close(theirs)
    if failed:
        raise failed[0]
