"""An operator's verdicts on trials while a session is open, whoever drives its loop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from isiw.log.schema import Event
from isiw.log.verdicts import LOOKED_AT, acceptance, change, exclusion, inclusion
from isiw.session.examination import WindowExamination
from isiw.strategy.strategy import Strategy
from isiw.trials import TrialTable


class Judging(ABC):
    """An open session whose trials an operator judges; each verdict is on disk when its call returns."""

    _examination: WindowExamination

    @abstractmethod
    def _judge(self, verdict: Callable[[TrialTable], Event]) -> None:
        """Put a verdict on disk, and see to it that it is learnt before the next stimulus is asked for."""

    @property
    def strategy(self) -> Strategy:
        """The strategy; another object once a trial was judged later."""
        return self._examination.learner.strategy

    @property
    def trials(self) -> TrialTable:
        """All trials so far."""
        return self._examination.trials

    def note(self, text: str, *, key: str | None = None) -> None:
        """Log a remark; with a key that a note of this session has already, nothing."""
        self._examination.note(text, key=key)

    def note_change(self, text: str, *, key: str | None = None) -> None:
        """Log that something bears on all MEPs from here on; a strategy that reckons with changes expects one."""
        self._judge(lambda trials: change(trials, text, key))

    @property
    def last_excluded(self) -> int | None:
        """The trial that was excluded last, of those that are; None if none is."""
        return self._examination.last_excluded

    def exclude(self, trial: int, reason: str = "") -> None:
        """Let a trial not count from here on: an event is appended, and the strategy learns again without it."""
        self._judge(lambda trials: exclusion(trials, trial, reason))

    def include(self, trial: int) -> None:
        """Let a trial count again that was excluded, and learn again with it."""
        self._judge(lambda trials: inclusion(trials, trial))

    def reject(self, trial: int) -> None:
        """Let a trial not count whose MEP an operator has looked at; an exclusion with this reason."""
        self.exclude(trial, LOOKED_AT)

    def accept(self, trial: int) -> None:
        """Let a trial count all the same that was judged a mistrial or excluded, once an operator has looked at it."""
        self._judge(lambda trials: acceptance(trials, trial, self.strategy.space))
