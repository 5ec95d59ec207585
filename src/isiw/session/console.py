"""The operator's console: the keys while a session runs, how a pause is decided, and what the screen shows."""

from __future__ import annotations

import itertools
import math
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Final, Protocol

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.protocol import unprotected
from isiw.errors import InvalidValueError, LogError, error_text
from isiw.estimate import WindowEstimate
from isiw.log.headers import Header
from isiw.sentences import asked, interval_cell, outcome
from isiw.session.pausing import Asking
from isiw.session.sink import SessionUpdate
from isiw.session.state import State
from isiw.session.terminal import COLUMNS, ERASED, ESCAPE, Keys, Screen, columns, folded, is_terminal
from isiw.text.sanitize import plain
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import TrialTable

PROGRESS_HEADINGS: Final = ("trial", "ISI", "MEP", "P", "window", "start", "end", "left")
"""The columns of `progress_row`; start and end are 90 % intervals, left is what the budget still allows."""

PROGRESS_LEGEND: Final = (
    "P: probability of a window. start, end: 90 % intervals of its edges [ms],",
    "< before and > after the range of ISIs. left: stimuli that are still allowed.",
)
"""The meaning of the headings and signs of the table."""

SPARKS: Final = "▁▂▃▄▅▆▇█"
MOST_SPARKS: Final = 28

_WIDTHS = (5, 9, 27, 4, 10, 7, 7, 4)


def progress_row(update: SessionUpdate, first: StimulusWords = TAP) -> tuple[str, ...]:
    """One trial in words and figures, as in `PROGRESS_HEADINGS`.

    Args:
        update: what is known after the trial.
        first: what the conditioning stimulus is called.
    """
    trial, estimate = update.trial, update.estimate
    found = _found(estimate) if estimate.rests_on_data else ("", "–", "", "")
    return (str(trial.index), asked(trial, first), outcome(trial), *found, str(update.stimuli_left))


def show_progress(row: Sequence[str]) -> None:
    """Print a row of the table."""
    sys.stdout.write(f"{_short_of(fitted(row), _most())}\n")
    sys.stdout.flush()


def _most() -> int:
    """The most columns of a row: if a terminal is narrower than the table, its last cells are cut off."""
    return columns() if is_terminal(sys.stdout) else COLUMNS


def aligned(row: Sequence[str]) -> str:
    """A row whose cells stand below those of other rows."""
    return " ".join(cell.ljust(width) for cell, width in zip(row, _WIDTHS, strict=False)).rstrip()


def fitted(row: Sequence[str]) -> str:
    """The same within 80 columns: what is too long for its column is cut short."""
    return aligned([_short_of(plain(cell), width) for cell, width in zip(row, _WIDTHS, strict=False)])


def _short_of(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 1]}…"


def standing(update: SessionUpdate, space: DesignSpace) -> str:
    """A session's state in a line: the expected MEP over the ISIs, [ ] around the window, what is next and left."""
    following = "" if update.next_isi_ms is None else f"next {update.next_isi_ms:.4g} ms, "
    left_s = None if update.left_s is None else round(update.left_s)
    pace = "" if left_s is None else f", ~{left_s // 60}:{left_s % 60:02d} min"
    text = f"{following}{update.stimuli_left} left{pace}"
    drawn = f"{_profile(update.estimate, space)}{text}"
    return _short_of(text if len(drawn) >= columns() else drawn, COLUMNS - 1)


def _profile(estimate: WindowEstimate, space: DesignSpace) -> str:
    """The expected MEP, on a logarithmic scale from its smallest to its largest; empty if there is none."""
    isi_ms = np.linspace(space.low_ms, space.high_ms, MOST_SPARKS)
    if (band := estimate.profile(isi_ms)) is None:
        return ""
    size = np.log(np.maximum(band.median_mv, 1e-6))
    level = (size - size.min()) / max(float(np.ptp(size)), math.log(2.0))  # what hardly differs is drawn flat
    sparks = [SPARKS[round(float(height) * (len(SPARKS) - 1))] for height in level]
    return f"{space.low_ms:g} {_bracketed(sparks, isi_ms.tolist(), estimate)} {space.high_ms:g} ms  "


def _bracketed(sparks: Sequence[str], isi_ms: Sequence[float], estimate: WindowEstimate) -> str:
    """The signs of a profile, with brackets around each segment of the window."""
    window = estimate.window if estimate.rests_on_data else None
    inside = [False, *([False] * len(sparks) if window is None else window.mask(isi_ms).tolist()), False]
    edges = {(False, True): "[", (True, False): "]"}
    marks = [edges.get(pair, "") for pair in itertools.pairwise(inside)]
    return "".join(itertools.chain(*zip(marks, [*sparks, ""], strict=True)))


def _found(estimate: WindowEstimate) -> tuple[str, ...]:
    """Probability, window, start and end; where too little was measured to speak of them, they are not said."""
    start, end = estimate.edges
    return (
        "" if estimate.probability is None else f"{estimate.probability:.2f}",
        str(estimate.window or ("–" if estimate.probability is None else "none")),
        interval_cell(start),
        interval_cell(end),
    )


KEYS: Final = (
    "p pause, x exclude the last trial, u undo that, n note, c note a change (coil, electrodes, gain),\n"
    "? these keys, a accept or j reject the last MEP, Ctrl-C pause, Ctrl-C twice end"
)
_WORTH_COUNTING_S = 15.0


class _Operated(Protocol):
    """The session that the keys act on."""

    @property
    def trials(self) -> TrialTable: ...
    @property
    def shown_trials(self) -> TrialTable: ...
    @property
    def last_excluded(self) -> int | None: ...
    def pause(self, reason: str) -> None: ...
    def note(self, text: str) -> None: ...
    def note_change(self, text: str) -> None: ...
    def exclude(self, trial: int, reason: str = "") -> None: ...
    def include(self, trial: int) -> None: ...
    def accept(self, trial: int) -> None: ...
    def reject(self, trial: int) -> None: ...


class OperatorConsole:
    """Turns keys into what a session does, and answers it when it has paused."""

    def __init__(self, session: _Operated, asking: Asking | None = None) -> None:
        self._session, self.screen, self.asking = session, Screen(), asking or Asking()
        self._keys: Keys | None = None
        self._note: str | None = None
        self._keep: Callable[[str], None] = session.note
        self._typed = "note"
        self._left_alone = False
        self._counted: int | None = None
        self.shown: int | None = None
        self.final = False

    @contextmanager
    def reading_keys(self) -> Iterator[None]:
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
    def reads_keys(self) -> bool:
        """True if keys of the terminal are heard."""
        return self._keys is not None

    def away(self) -> AbstractContextManager[None]:
        """Within, the keys are not heard."""
        return nullcontext() if self._keys is None else self._keys.away()

    def leave(self) -> None:
        """Nobody is there any more: whatever is asked is answered with no."""
        self._left_alone = True

    def goes_on(self, reason: str) -> bool:
        """Wait for the key that says whether a paused session goes on."""
        way_on = "q ends the intervention for good" if self.final else "q ends the session; it can be resumed later"
        self.screen.say(f"{State.PAUSED}: {reason} The device is disarmed. r continues, {way_on}.")
        if self.shown is not None and self._meant != (last := self._session.trials[-1].index):
            self.shown = last
            self.screen.say(
                f"Trial {last} was delivered; its row appears when the session continues. x, a and j now act on "
                f"trial {last}."
            )
        if self._note is not None:
            self.screen.say("First finish the note with Enter, or drop it with Esc.")
        return self.asking.wait(lambda: self._left_alone)

    def waiting(self, left_s: float | None, text: str) -> None:
        """Show how long a wait still lasts, where it is worth it; None if it is over."""
        before, self._counted = self._counted, None if left_s is None else round(left_s)
        if left_s is None or self._counted is None:
            self.screen.counted_down()
        elif left_s < _WORTH_COUNTING_S and before is None:
            self._counted = None
        elif self._counted != before and self._note is None:
            self.screen.count_down(f"{text}: {self._counted // 60}:{self._counted % 60:02d} left")

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
            "x": lambda: self._judge(self._session.exclude, "is excluded; u undoes it", "Excluded by the operator."),
            "u": self._undo,
            "a": lambda: self._judge(self._session.accept, "counts"),
            "j": lambda: self._judge(self._session.reject, "is rejected and does not count"),
            "n": lambda: self._begin("note", self._session.note),
            "c": lambda: self._begin("change", self._session.note_change),
            "?": lambda: self.screen.say(f"Keys: {KEYS}."),
        }

    def _decide(self, key: str) -> None:
        try:
            self.asking.answer(goes_on=key == "r")
        except InvalidValueError as error:
            said = f"{error}" if self.asking.asked else "The session is not paused; p pauses it."
            self.screen.say(said)

    def _judge(self, say: Callable[..., None], outcome: str, *reason: str) -> None:
        if not self._session.trials:
            raise InvalidValueError("there is no trial yet")
        number = self._meant
        say(number, *reason)
        self.screen.say(f"Trial {number} {outcome}.")

    @property
    def _meant(self) -> int:
        """The trial of the last row, or a later one that gets none as it would show the arm; the last without rows."""
        if self.shown is None:
            return self._session.trials[-1].index
        given, rows = (
            {trial.index for trial in trials} for trials in (self._session.trials, self._session.shown_trials)
        )
        return max({self.shown} | given - rows)

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

    def __init__(self, console: OperatorConsole, header: Header, faults: deque[str], *, shown: bool) -> None:
        self._console, self._header, self._faults, self._shown = console, header, faults, shown
        if shown:
            between = " " if _most() < COLUMNS else "\n"
            warning = unprotected(header.device)
            sys.stdout.write(f"{folded(plain(warning))}\n" if warning else "")
            sys.stdout.write(f"{folded(between.join(PROGRESS_LEGEND))}\n")
            show_progress(PROGRESS_HEADINGS)

    def updated(self, update: SessionUpdate) -> None:
        """Show a trial: in a terminal with a last line that says how the session stands."""
        if not self._shown:
            return
        row = progress_row(update, self._header.stimulus)
        with self._shows():
            if self._console.reads_keys and is_terminal(sys.stdout):
                self._console.screen.say(fitted(row)[: columns()], standing(update, self._header.space))
            else:
                show_progress(row)
            self._console.shown = update.trial.index

    @contextmanager
    def _shows(self) -> Iterator[None]:
        """What is shown; where it cannot be, nothing is shown from then on, and the session goes on."""
        try:
            yield
        except (OSError, UnicodeError) as error:  # a full disk, a reader who has gone, a sign that is lacking
            self._faults.append(f"the table of trials cannot be shown any more: {error_text(error)}")
            self._shown = False

    def said(self, text: str) -> None:
        """Show a line that is no trial's."""
        if not self._shown:
            return
        with self._shows():
            if self._console.reads_keys:
                self._console.screen.say(text)
            else:
                sys.stdout.write(f"{folded(plain(text))}\n")
                sys.stdout.flush()

    def waiting(self, left_s: float | None, text: str) -> None:
        """Count down until the next stimulus."""
        if self._console.reads_keys:
            self._console.waiting(left_s, text)
