"""Verdicts on trials, while a session is open and afterwards, and a logged session's estimate made again."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path

import isiw
from isiw.errors import ImplausibleDataWarning, LogError, warn
from isiw.findings import Finding
from isiw.intervention import Arm
from isiw.log.kinds import LogKind, kind_of, of_another_kind, require_session
from isiw.log.reader import read_salvaged
from isiw.log.salvage import salvage
from isiw.log.schema import Event
from isiw.log.verdicts import LOOKED_AT, MANY_CHANGES, acceptance, change, doubted_by, exclusion, inclusion
from isiw.log.writer import LogWriter
from isiw.session.examination import WindowExamination, estimate_record, learn
from isiw.session.replay import strategy_of
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


def estimate_again(
    path: str | Path, strategy: Strategy | None = None, *, replayed: Callable[[int], None] = lambda _: None
) -> None:
    """Compute a session's estimate from its trials as they count now, and append it to the log. Delivers nothing.

    Args:
        path: the log, with or without `.part`; no session may be writing it.
        strategy: needed if the session's strategy was built from a user's own objects: the same again.
        replayed: called after each trial with how many the strategy knows.

    Raises:
        LogError: no such log, one without trials, or one that is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        StrategyError: the strategy cannot be made again.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    record.require_end()
    record.require_read()
    if not record.table:
        raise LogError("there is no trial to estimate from", got=str(record.path))
    made = strategy_of(record.header) if strategy is None else strategy.restarted()
    trials = sorted([*record.table, *record.unknown_trials], key=lambda trial: trial.index)
    for number, trial in enumerate(trials, start=1):
        learn(made, trial)
        replayed(number)
    made.in_doubt = record.in_doubt
    last = record.table[-1].index
    said = f"Estimated again with isiw {isiw.__version__} from the trials as they count now."
    with LogWriter.continuing(path, salvaged, record.header) as log:
        log.append(Event(kind="note", trial=last, text=" ".join([said, *record.losses])))
        log.append(estimate_record(made, last, made.decision(), None))


def exclude(path: str | Path, trial: int, reason: str) -> None:
    """Exclude a trial afterwards: an event is appended to the log, nothing is erased. Resuming learns without it.

    Args:
        path: the log, with or without `.part`.
        trial: the trial's number.
        reason: why, for whoever reads the log.

    Raises:
        LogError: no such log, or it is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        InvalidValueError: no such trial, or one that counts for nothing anyway.
    """
    _judge(path, lambda trials, events: exclusion(trials, trial, reason, events=events))


def include(path: str | Path, trial: int) -> None:
    """Let a trial count again that was excluded: an event is appended to the log. Resuming learns with it.

    Args:
        path: the log, with or without `.part`.
        trial: the trial's number.

    Raises:
        LogError: no such log, or it is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        InvalidValueError: no excluded trial has this number.
    """
    _judge(path, lambda trials, _: inclusion(trials, trial))


def open_arm(path: str | Path) -> Arm:
    """Open the concealed arm of an intervention, so that it may be shown: an event says so, and when, in the log.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such log, one of no intervention, or one that is still being written.
        DamagedLogError: the log's end is missing.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    intervention = record.header.intervention
    if intervention is None:
        raise of_another_kind(record.path, kind_of(record.header), LogKind.INTERVENTION)
    if record.conceals:
        record.require_end()
        record.require_read()
        last = record.table[-1].index if record.table else None
        text = f"The arm was opened: {intervention.arm.words}."
        with LogWriter.continuing(path, salvaged, record.header) as log:
            log.append(Event(kind="opening", trial=last, text=text))
    return intervention.arm


def _judge(path: str | Path, verdict: Callable[[TrialTable, Sequence[Event]], Event]) -> None:
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    require_session(record.path, record.header)
    event = verdict(record.table, record.events)
    record.require_end()
    if record.losses:  # then the header may be written again
        record.require_read()
    with LogWriter.continuing(path, salvaged, record.header) as log:
        log.append(event)
        if record.losses:
            log.append(Event(kind="fault", trial=event.trial, text=" ".join(record.losses)))
