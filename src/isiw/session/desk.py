"""The operator's desk: what each key does while a session runs, how a pause is decided, and what the screen shows."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Final, Protocol

from isiw.errors import InvalidValueError, LogError, told
from isiw.log.headers import Header
from isiw.session.progress import fitted, progress_row, show_legend, show_progress, standing
from isiw.session.sink import SessionUpdate
from isiw.session.steps import Asking
from isiw.session.terminal import ERASED, ESCAPE, Keys, Screen, columns, is_terminal
from isiw.trials import TrialTable

KEYS: Final = (
    "p pause, x exclude the last trial, u undo that, n note, c note a change (coil, electrodes, gain),\n"
    "? these keys, a accept or j reject the last MEP, Ctrl-C pause, Ctrl-C twice end"
)
_WORTH_COUNTING_S = 15.0


class Operated(Protocol):
    """What the keys do something to: a session."""

    @property
    def trials(self) -> TrialTable:
        """All trials so far."""

    @property
    def last_excluded(self) -> int | None:
        """The trial that was excluded last, of those that are; None where none is."""

    def pause(self, reason: str) -> None:
        """Disarm now, and pause."""

    def note(self, text: str) -> None:
        """Log a remark."""

    def note_change(self, text: str) -> None:
        """Log that something changed that bears on all MEPs from here on."""

    def exclude(self, trial: int, reason: str = "") -> None:
        """Let a trial not count."""

    def include(self, trial: int) -> None:
        """Let an excluded trial count again."""

    def accept(self, trial: int) -> None:
        """Let a mistrial count."""

    def reject(self, trial: int) -> None:
        """Let a trial not count whose MEP was looked at."""


class Desk:
    """Turns keys into what a session does, and answers it when it has paused."""

    def __init__(self, session: Operated, asking: Asking | None = None) -> None:
        self._session, self.screen, self._asking = session, Screen(), asking or Asking()
        self._keys: Keys | None = None
        self._note: str | None = None
        self._keep: Callable[[str], None] = session.note
        self._typed = "note"
        self._left_alone = False
        self._counted: int | None = None
        self.shown: int | None = None

    @contextmanager
    def staffed(self) -> Iterator[None]:
        """Within, keys of the terminal are heard."""
        self.screen = Screen()
        with self.screen, Keys(self.press, self.leave) as keys:
            self._keys = keys
            self.screen.say(f"Keys: {KEYS}.")
            try:
                yield
            finally:
                self._keys = None

    @property
    def is_staffed(self) -> bool:
        """Whether keys of the terminal are heard."""
        return self._keys is not None

    def away(self) -> AbstractContextManager[None]:
        """Within, the keys are not heard."""
        return nullcontext() if self._keys is None else self._keys.away()

    def leave(self) -> None:
        """Nobody is there any more: whatever is asked is answered with no."""
        self._left_alone = True

    def goes_on(self, reason: str) -> bool:
        """Wait for the key that says whether a paused session goes on."""
        self.screen.say(f"{reason} The device is disarmed. r goes on, q ends the session, which can be resumed later.")
        if self.shown is not None and self.shown != (last := self._session.trials[-1].index):
            self.shown = last
            self.screen.say(
                f"Trial {last} was delivered; its row appears when the session goes on. x, a and j now act on "
                f"trial {last}."
            )
        if self._note is not None:
            self.screen.say("First finish the note with Enter, or drop it with Esc.")
        return self._asking.wait(lambda: self._left_alone)

    def show(self, row: str, standing: str) -> None:
        """Show a row of the table, and below it how the session stands."""
        self.screen.say(row, standing)

    def count_down(self, left_s: float, text: str) -> None:
        """Show how long a wait still lasts, where it is worth it."""
        left = round(left_s)
        if (left_s >= _WORTH_COUNTING_S or self._counted is not None) and left != self._counted:
            self._counted = left
            if self._note is None:
                self.screen.count_down(f"{text}: {left // 60}:{left % 60:02d} left")

    def counted_down(self) -> None:
        """The wait is over."""
        if self._counted is not None:
            self._counted = None
            self.screen.counted_down()

    def press(self, key: str) -> None:
        """Do what a key stands for, or take it for the note that is being typed."""
        try:
            if self._note is not None:
                self._type(self._note, key)
            elif key.lower() in "rq":
                self._decide(key.lower())
            elif (act := self._acts.get(key.lower())) is not None:
                act()
        except (InvalidValueError, LogError) as error:
            self.screen.say(f"{error}")

    @property
    def _acts(self) -> dict[str, Callable[[], None]]:
        return {
            "p": lambda: self._session.pause("Paused by the operator."),
            "x": self._exclude,
            "u": self._undo,
            "a": lambda: self._judge(self._session.accept, "counts"),
            "j": lambda: self._judge(self._session.reject, "is rejected and does not count"),
            "n": lambda: self._begin("note", self._session.note),
            "c": lambda: self._begin("change", self._session.note_change),
            "?": lambda: self.screen.say(f"Keys: {KEYS}."),
        }

    def _decide(self, key: str) -> None:
        try:
            self._asking.answer(goes_on=key == "r")
        except InvalidValueError:
            self.screen.say("The session is not paused; p pauses it.")

    def _judge(self, say: Callable[[int], None], outcome: str) -> None:
        number = self._last()
        say(number)
        self.screen.say(f"Trial {number} {outcome}.")

    def _last(self) -> int:
        if not self._session.trials:
            raise InvalidValueError("there is no trial yet")
        return self._session.trials[-1].index if self.shown is None else self.shown

    def _exclude(self) -> None:
        self._judge(
            lambda number: self._session.exclude(number, "Excluded by the operator."), "is excluded; u undoes it"
        )

    def _undo(self) -> None:
        if (number := self._session.last_excluded) is None:
            raise InvalidValueError("no trial is excluded")
        self._session.include(number)
        self.screen.say(f"Trial {number} counts again.")

    def _begin(self, what: str, keep: Callable[[str], None]) -> None:
        self._note, self._typed, self._keep = "", what, keep
        self.screen.type(f"{what.capitalize()} (Enter keeps it, Esc drops it): ")

    def _type(self, note: str, key: str) -> None:
        if key in "\r\n":
            self._note = None
            self.screen.type("\n")
            if note.strip():
                self._keep(note.strip())
                self.screen.say(f"The {self._typed} is in the log.")
        elif key == ESCAPE:
            self._note = None
            self.screen.type("\n")
        elif key in "\x7f\b":
            self._note = note[:-1]
            self.screen.type(ERASED if note else "")
        elif key.isprintable():
            self._note = note + key
            self.screen.type(key)


class Table:
    """The table of trials on the screen; if it cannot be shown any more, a fault says so, and the session goes on."""

    def __init__(self, desk: Desk, header: Header, faults: deque[str], *, shown: bool) -> None:
        self._desk, self._header, self._faults, self._shown = desk, header, faults, shown
        if shown:
            show_legend()

    def updated(self, update: SessionUpdate) -> None:
        """Show a trial: in a terminal with a last line that says how the session stands."""
        if not self._shown:
            return
        try:
            self._show(update)
        except (OSError, UnicodeError) as error:  # a full disk, a reader who has gone, a sign that is lacking
            self._faults.append(f"the table of trials cannot be shown any more: {told(error)}")
            self._shown = False

    def _show(self, update: SessionUpdate) -> None:
        row = progress_row(update, self._header.stimulus)
        if self._desk.is_staffed and is_terminal(sys.stdout):
            self._desk.show(fitted(row)[: columns()], standing(update, self._header.space))
        else:
            show_progress(row)
        self._desk.shown = update.trial.index

    def waiting(self, left_s: float, text: str) -> None:
        """Count down until the next stimulus."""
        if self._desk.is_staffed:
            self._desk.count_down(left_s, text)

    def waited(self) -> None:
        """The wait is over."""
        if self._desk.is_staffed:
            self._desk.counted_down()
