"""Verdicts on trials while a session is open."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from isiw.errors import ImplausibleDataWarning, warn
from isiw.findings import Finding
from isiw.log.new_verdicts import LOOKED_AT, MANY_CHANGES, acceptance, change, exclusion, inclusion
from isiw.log.schema import Event
from isiw.log.verdicts import doubted_by
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
        """Log a remark; with a key that the same one has already, nothing. A key of something else is refused."""
        self._examination.note(text, key=key)

    def remark(self, event: Event) -> None:
        """Log an event that changes no trial, as a note does."""
        self._examination.remark(event)

    def note_change(self, text: str, *, key: str | None = None) -> None:
        """Log that something bears on all MEPs from here on; a strategy that reckons with changes expects one.

        Several at one trial are one change. At most 20 (`isiw.change.MOST_NOTED`) are learnt in a session; further ones
        are kept as remarks, which the first of them says as a doubt. A key is as for `note`.

        Warns:
            ImplausibleDataWarning: more changes than are learnt, once, where neither keys nor `on_doubt` are there.
        """
        noted: list[Event] = []

        def verdict(trials: TrialTable) -> Event:
            noted.append(self._examination.learner.noted(change(trials, text, key)))
            return noted[0]

        self._judge(verdict)
        if noted[0].finding is MANY_CHANGES.kind and self._examination.is_new(MANY_CHANGES):
            self._warn(MANY_CHANGES)

    def _warn(self, doubt: Finding) -> None:
        """Log a doubt, and say it."""
        self._examination.event("doubt", f"{doubt}", finding=doubt.kind, durable=True)
        self._say(f"{doubt}", ImplausibleDataWarning)

    def _say(self, doubt: str, category: type[Warning]) -> None:
        """Say a doubt to whoever is there."""
        warn(doubt, category)

    @property
    def last_excluded(self) -> int | None:
        """The trial that was excluded last, of those that are; None if none is."""
        return self._examination.last_excluded

    @property
    def in_doubt(self) -> tuple[int, ...]:
        """The trials that do not count, as realised ISIs that are far from those asked were not confirmed."""
        return tuple(doubted_by(self._examination.events))

    def exclude(self, trial: int, reason: str = "", *, key: str | None = None) -> None:
        """Let a trial not count from here on: an event is appended, and the strategy learns again without it.

        With a key that the same exclusion has already, nothing happens, whatever came since: a request that is
        repeated late undoes nothing. A key of something else is refused.
        """
        self._judge(lambda trials: exclusion(trials, trial, reason, key, self._examination.events))

    def include(self, trial: int, *, key: str | None = None) -> None:
        """Let a trial count again that was excluded, and learn again with it; a key is as for `exclude`."""
        self._judge(lambda trials: inclusion(trials, trial, key, self._examination.events))

    def reject(self, trial: int) -> None:
        """Let a trial not count whose MEP an operator has looked at; an exclusion with this reason."""
        self.exclude(trial, LOOKED_AT)

    def accept(self, trial: int) -> None:
        """Let a trial count all the same that was judged a mistrial or excluded, once an operator has looked at it."""
        self._judge(lambda trials: acceptance(trials, trial, self.strategy.space))
