"""The sink of a session: what it reports goes to its log first, then to all who look on, the screen, and the caller."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from isiw.decision import StopDecision
from isiw.errors import InvalidValueError, error_text
from isiw.estimate import WindowEstimate
from isiw.intervention import concealed
from isiw.log.schema import Event, Record
from isiw.log.writer import LogWriter
from isiw.trials import Trial, TrialTable


@dataclass(frozen=True)
class SessionUpdate:
    """The state of a session after one trial.

    Args:
        trial: the trial.
        estimate: the window's estimate.
        decision: whether the session stops here, and why.
        next_isi_ms: the next ISI [ms]; None if the session stops, or a control trial comes next.
        stimuli_left: how many stimuli the budget and the limits still allow.
        left_s: about how long so many take at the pace of the last ones, rests and control trials among them [s]; None
            before there is a pace.
    """

    trial: Trial
    estimate: WindowEstimate
    decision: StopDecision
    next_isi_ms: float | None
    stimuli_left: int
    left_s: float | None = None


@dataclass(frozen=True)
class SessionResult:
    """The result of a session.

    Args:
        estimate: the window's estimate.
        decision: why it ended.
        trials: all its trials.
        log: its log.
        conceals: whether the arm of an intervention is concealed, so that nothing may be shown that tells it.
    """

    estimate: WindowEstimate
    decision: StopDecision
    trials: TrialTable
    log: Path
    conceals: bool = False

    def __str__(self) -> str:
        trials = concealed(self.log) if self.conceals else f"Trials: {self.trials}"
        return f"{self.estimate}\n{trials}\nEnded: {self.decision.reason}\nLog: {self.log}"

    __repr__ = __str__  # in a notebook, too, a concealed arm stays so


class Wait(NamedTuple):
    """A wait for the next stimulus: when it ends, of a monotonic clock [s], and whether it is a rest."""

    until_s: float
    rests: bool


_SAME_S: Final = 0.5
"""A wait whose end moves by less is the same one [s]: of its clock only naps are known."""


class Follower(Protocol):
    """Somebody who looks on. Each call has to return at once; `logged` comes from several threads."""

    def logged(self, record: Record, channel_name: str | None) -> None:
        """A record was appended to the log."""

    def updated(self, update: SessionUpdate) -> None:
        """A trial is concluded."""

    def ended(self) -> None:
        """The session has ended, and its log is closed."""

    def is_attended(self) -> bool:
        """True if somebody is there who can say how a pause ends."""


class _Screen(Protocol):
    """The operator's view of a running session."""

    def updated(self, update: SessionUpdate) -> None: ...
    def waiting(self, left_s: float | None, text: str) -> None: ...
    def said(self, text: str) -> None: ...


_NEVER_HIDDEN: Final = frozenset({"limit", "fault", "refused", "pause", "note", "change", "block", "stop"})
"""Kinds of events that are shown whatever a trial's arm: they are safety's, and the operator's own."""


class Sink:
    """Takes all that happens. A follower whose call fails gets nothing more, and the session goes on.

    All goes to the log. Of trials that it `hides`, which would show a concealed arm, nobody else gets anything.
    """

    def __init__(
        self,
        on_trial: Callable[[SessionUpdate], None] | None = None,
        log: LogWriter | None = None,
        hides: Callable[[int], bool] | None = None,
    ) -> None:
        self.on_trial, self._hides = on_trial, hides
        self.followers: list[Follower] = []
        self.writer = log
        self._screen: _Screen | None = None
        self.wait: Wait | None = None
        self.faults: deque[str] = deque()
        """Faults that were overcome, in whichever thread, and are not in the log yet."""

    @contextmanager
    def writing(self, log: LogWriter, screen: _Screen | None = None) -> Iterator[None]:
        """Within, the log is open, and the operator sees what happens."""
        self.writer, self._screen = log, screen
        try:
            yield
        finally:
            self.writer = self._screen = None

    @property
    def is_open(self) -> bool:
        """True if the log is open."""
        return self.writer is not None and self.writer.is_open

    @property
    def log(self) -> LogWriter:
        """The open log."""
        if self.writer is None:
            raise InvalidValueError(
                "the session is not running, so nothing can be added to its log",
                remedy="Do it while run() is busy, from on_trial or another thread. When no session is writing the "
                "log, use isiw.exclude and isiw.include.",
            )
        return self.writer

    def append(self, record: Record, channel_name: str | None = None) -> None:
        """Log a record; it is durable after the next `sync`."""
        self.log.append(record, channel_name)
        if not self._is_hidden(record):
            self._each(lambda follower: follower.logged(record, channel_name))

    def _shows_arm(self, trial: int) -> bool:
        return self._hides is not None and self._hides(trial)

    def _is_hidden(self, record: Record) -> bool:
        """True of what would show a concealed arm; what a person has to act on is never hidden."""
        if isinstance(record, Event) and record.kind in _NEVER_HIDDEN:
            return False
        number = record.index if isinstance(record, Trial) else getattr(record, "trial", None)
        return number is not None and self._shows_arm(number)

    def say(self, text: str) -> None:
        """Say something to the operator at the screen."""
        if self._screen is not None:
            self._screen.said(text)

    def updated(self, update: SessionUpdate) -> None:
        """A trial is concluded."""
        if self._shows_arm(update.trial.index):
            return
        self._each(lambda follower: follower.updated(update))
        if self._screen is not None:
            self._screen.updated(update)
        if self.on_trial is not None:
            self.on_trial(update)

    def waiting(self, left_s: float | None, text: str = "", *, rests: bool = False) -> None:
        """The session waits for its next stimulus, perhaps at rest; no longer, if nothing is left [s]."""
        was, is_now = self.wait, None if left_s is None else Wait(time.monotonic() + left_s, rests)
        if was is None or is_now is None or was.rests != rests or abs(was.until_s - is_now.until_s) > _SAME_S:
            self.wait = is_now
        if self._screen is not None:
            self._screen.waiting(left_s, text)

    def ended(self) -> None:
        """The session has ended, and its log is closed."""
        self._each(lambda follower: follower.ended())

    def nobody(self) -> bool:
        """True if none of the followers is attended."""
        attended: list[bool] = []
        self._each(lambda follower: attended.append(follower.is_attended()))
        return not any(attended)

    def _each(self, tell: Callable[[Follower], None]) -> None:
        for follower in tuple(self.followers):
            try:
                tell(follower)
            except Exception as error:  # noqa: BLE001 - who looks on must not stop a session
                with suppress(ValueError):  # another thread, in which it failed as well, was first
                    self.followers.remove(follower)
                    self.faults.append(f"A viewer failed and gets no further updates: {error_text(error)}")
