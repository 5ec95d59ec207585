"""The examination: what is known of a person, and the one way in which a trial or a verdict changes it.

The intent is on disk before the stimulus, the trial before it is learnt, and it is learnt before the next stimulus.
Each step is taken once, even if the next one is interrupted. After a verdict all trials are learnt again.
"""

from __future__ import annotations

import operator
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np

from isiw import checks, summary
from isiw.change import Change
from isiw.decision import StopDecision, StopKind
from isiw.errors import LimitExceededError, StrategyError, error_text
from isiw.estimate import WindowEstimate
from isiw.findings import Finding, Kind, Severity
from isiw.log.new_verdicts import is_logged, or_remark
from isiw.log.schema import EstimateRecord, Event, EventKind, Intent, Record
from isiw.log.verdicts import changed_after, doubted_by, excluded_by, under_all
from isiw.session.sink import Sink
from isiw.strategy.choice import candidate_isis
from isiw.strategy.strategy import Strategy
from isiw.trials import Trial, TrialTable
from isiw.types import FloatArray

TrialT = TypeVar("TrialT")
TrialT_contra = TypeVar("TrialT_contra", contravariant=True)

DIGITS = 4
_EXACT: Final = 22  # of powers of ten up to here none is rounded itself
"""Significant digits of predicted amplitudes and scores, which are for pictures."""


class _Trials(Protocol[TrialT_contra]):
    """All trials so far, as they count now; its length is how many stimuli were given."""

    def __len__(self) -> int: ...
    def appended(self, trial: TrialT_contra, /) -> Any: ...


TableT = TypeVar("TableT", bound=_Trials[Any])
LearnerT = TypeVar("LearnerT", bound="_Learner[Any, Any]")


class _Learner(Protocol[TableT, TrialT_contra]):
    """A learner from stimuli: a strategy for a window, or a search for a threshold."""

    def knows(self, trials: TableT, /) -> bool: ...
    def learn(self, trial: TrialT_contra, /) -> None: ...
    def trouble_with(self, trial: TrialT_contra, /) -> str | None: ...
    def doubt(self, trials: TableT, /) -> Finding | None: ...
    def learn_again(self, trials: TableT, /) -> None: ...
    def judged(self, trials: TableT, verdict: Event, /) -> TableT: ...
    def decision(self) -> StopDecision: ...
    def record(self, trial: int, decision: StopDecision, next_isi_ms: float | None, /) -> Record: ...


def limit_reached(most: int, before: int) -> StopDecision:
    """The decision to stop where so many pulses were given as the limits allow, some of them before the session."""
    of_them = f", {before} of them before the session," if before else ""
    return StopKind.LIMIT.stop(f"The limit of {most} pulses{of_them} is reached.")


class Known(NamedTuple):
    """The decision that follows from what is known now, and the next ISI [ms] if it was asked for."""

    decision: StopDecision
    next_isi_ms: float | None


class Examination(Generic[LearnerT, TableT, TrialT]):
    """The trials so far and what was learnt from them, ahead of which is always the log. Safe in several threads."""

    def __init__(
        self,
        learner: LearnerT,
        trials: TableT,
        sink: Sink,
        events: Iterable[Event] = (),
        freely: Callable[..., Any] = operator.call,
    ) -> None:
        self.learner, self.trials, self._sink, self._freely = learner, trials, sink, freely
        self.unconcluded: TrialT | None = None
        self.overruled = False
        self._learnt = trials
        self._learning: TrialT | None = None
        self._events = list(events)
        self._doubted = {event.finding for event in self.events}
        self._refusal: Exception | None = None
        self._lock = threading.RLock()

    @property
    def last(self) -> int | None:
        """The number of the last trial; None before the first."""
        return len(self.trials) - 1 if len(self.trials) else None

    def is_new(self, finding: Finding) -> bool:
        """True where the finding's kind was no doubt before; from now on it was."""
        new = finding.kind not in self._doubted
        self._doubted.add(finding.kind)
        return new

    @property
    def events(self) -> tuple[Event, ...]:
        """What was noted and judged so far, and what happened before the session was resumed."""
        return tuple(self._events)

    @property
    def last_excluded(self) -> int | None:
        """The trial that was excluded last, of those that are; None if none is."""
        excluded = excluded_by(self.events)
        return excluded[-1] if excluded else None

    def event(
        self,
        kind: EventKind,
        text: str,
        trial: int | None = None,
        *,
        finding: Kind | None = None,
        durable: bool = False,
    ) -> None:
        """Log that something happened, to the last trial if none is said; `durable` returns once it is on the disk."""
        self._sink.append(Event(kind=kind, finding=finding, trial=self.last if trial is None else trial, text=text))
        if durable:
            self._sink.log.sync()

    def note(self, text: str, trial: int | None = None, key: str | None = None) -> None:
        """Put a remark on disk; with a key that the same one has already, nothing."""
        checks.text("a note", text)
        checks.text("the key of a note", "" if key is None else key)
        self.remark(Event(kind="note", trial=self.last if trial is None else trial, text=text, key=key))

    def remark(self, event: Event) -> None:
        """Put an event on disk that changes no trial; with a key that the same one has already, nothing."""
        with self._lock:
            if not is_logged(event, self._events):
                self._sink.append(event)
                self._events.append(event)
        self._sink.log.sync()

    def log_faults(self) -> None:
        """Log what went wrong and was overcome, in whichever thread."""
        while self._sink.faults:
            self.event("fault", self._sink.faults.popleft())

    def log_refusal(self, kind: EventKind, error: Exception, trial: int | None = None) -> None:
        """Log that a stimulus was refused; if that ends the session, it is not logged again."""
        self.event(kind, error_text(error), trial)
        self._refusal = error

    def log_failure(self, error: BaseException) -> None:
        """Log what ends a session before its time."""
        if error is not self._refusal:
            if isinstance(error, KeyboardInterrupt):  # a wish of the operator, and no fault
                self.event("pause", "Interrupted by the operator.")
            else:
                self.event("limit" if isinstance(error, LimitExceededError) else "fault", error_text(error))

    def intend(self, intent: Intent, fallback: str | None = None) -> bool:
        """Put on disk what is about to be delivered; False, and nothing is, if a trial was judged since the ask."""
        with self._lock:
            if self.overruled:
                return False
            if fallback is not None:
                self._sink.append(Event(kind="fallback", trial=intent.trial, text=fallback))
            self._sink.append(intent)
        self._sink.log.sync()
        return True

    def came(self, trial: TrialT) -> None:
        """Log what came of a stimulus; it stays unconcluded until it is learnt and what is known then is logged."""
        with self._lock:
            self._sink.append(trial)  # type: ignore[arg-type]  # a Trial or a PulseOutcome
            self.trials = self.trials.appended(trial)
            self.unconcluded = trial

    def judge(self, verdict: Callable[[TableT], Event]) -> None:
        """Put a verdict on disk, unless it was logged with its key before; all trials are then learnt again."""
        with self._lock:
            event = verdict(self.trials)
            if is_logged(event, self._events):
                return
            self._sink.append(event)
            self.trials = self.learner.judged(self.trials, event)
            self._events.append(event)
            self.overruled = self.overruled or event.kind != "note"
        self._sink.log.sync()

    def require_own(self) -> None:
        """Raise StrategyError if the learner knows other trials than it has learnt here."""
        if not self.learner.knows(self._learnt):
            raise StrategyError(
                "the strategy has learnt trials that are not this session's, or one of them twice",
                remedy="Deliver nothing. What was reported is in the log: close the session, and resume it with a new "
                "strategy. Give each session a strategy of its own, and report outcomes to the session alone.",
            )

    def conclude(
        self, decide: Callable[[], StopDecision] | None = None, ask_next: Callable[[], float | None] = lambda: None
    ) -> Known | None:
        """Learn what is not learnt yet, and log what is known then, as `log_estimate` does; None if all was learnt."""
        trial = self.unconcluded
        if not self.overruled and trial is None:
            return None
        if self.overruled:
            self.overruled = False
            try:
                self._freely(self.learner.learn_again, self.trials)
            except BaseException:
                self.overruled = True
                raise
            self._learnt, self._learning = self.trials, trial
        if trial is not None:
            self._learn(trial)
        known = self.log_estimate(decide, ask_next) if len(self.trials) else None
        if trial is not None:
            self.unconcluded = None
        return known

    def _learn(self, trial: TrialT) -> None:
        if self._learning is not trial or not self.learner.knows(self.trials):  # else it was interrupted behind it
            self.require_own()
            self._learning = trial
            self._freely(self.learner.learn, trial)
        self._learnt = self.trials
        if (trouble := self.learner.trouble_with(trial)) is not None and self._sink.is_open:
            self.event("fit", trouble)
        doubt = self._freely(self.learner.doubt, self.trials)
        if doubt is not None and self._sink.is_open and self.is_new(doubt):
            self.event("doubt", f"{doubt}", finding=doubt.kind)

    def log_estimate(
        self, decide: Callable[[], StopDecision] | None = None, ask_next: Callable[[], float | None] = lambda: None
    ) -> Known:
        """Log, if the log is open, what is known after the last trial, whether to stop, and else the next ISI."""
        decision = self._freely(decide or self.learner.decision)
        known = Known(decision, None if decision.stop else ask_next())
        if self._sink.is_open:
            self._sink.append(self._freely(self.learner.record, len(self.trials) - 1, *known))
            self._sink.log.sync()
        return known


class _WindowLearner:
    """A strategy as an examination sees it; another one once all trials were learnt again."""

    def __init__(self, strategy: Strategy, events: Iterable[Event] = ()) -> None:
        self.strategy, self._events = strategy, list(events)
        self.strategy.in_doubt = bool(doubted_by(self._events))

    def knows(self, trials: TrialTable) -> bool:
        return self.strategy.delivered == len(trials)

    def learn(self, trial: Trial) -> None:
        self.strategy.learn(trial)

    def trouble_with(self, trial: Trial) -> str | None:
        return self.strategy.trouble if trial.told else None

    def doubt(self, trials: TrialTable) -> Finding | None:
        return change_found(self.strategy.estimate().change, trials.told)

    def learn_again(self, trials: TrialTable) -> None:
        self.strategy = relearned(self.strategy, trials, changed_after(self._events))
        self.strategy.in_doubt = bool(doubted_by(self._events))

    def judged(self, trials: TrialTable, verdict: Event) -> TrialTable:
        self._events.append(verdict)
        return under_all(trials, [verdict])

    def noted(self, change: Event) -> Event:
        """A change as it is logged; that earlier trials may have another level is one already."""
        return or_remark(change, self._events, already=bool(self.strategy.earlier) and not self.strategy.same_level)

    def decision(self) -> StopDecision:
        return self.strategy.decision()

    def record(self, trial: int, decision: StopDecision, next_isi_ms: float | None) -> EstimateRecord:
        return estimate_record(self.strategy, trial, decision, next_isi_ms)


WindowExamination: TypeAlias = Examination[_WindowLearner, TrialTable, Trial]


def examination_of(
    strategy: Strategy,
    sink: Sink,
    trials: TrialTable | None = None,
    events: Iterable[Event] = (),
    freely: Callable[..., Any] = operator.call,
) -> WindowExamination:
    """The examination in which a strategy looks for a window; it has learnt the earlier trials."""
    events = tuple(events)
    return Examination(_WindowLearner(strategy, events), trials or TrialTable(), sink, events, freely)


def change_found(change: Change | None, told: Sequence[Trial]) -> Finding | None:
    """That something changed during the session, whatever the ISI; None if it is not sure."""
    if change is None or not change.is_sure or not told:
        return None
    at = None if change.trial is None else told[min(change.trial, len(told) - 1)].index
    remedy = "" if at is None else "Did the coil or an electrode move, or was a gain or the intensity changed?"
    if change.trial == 0:
        remedy = "Are muscle, coil, gain and the scale of intensities the same? The window allows for the change."
    return Finding(Kind.CHANGED, Severity.DOUBT, summary.at_a_trial(change, at), remedy)


def relearned(strategy: Strategy, trials: Iterable[Trial], changes: Sequence[int] = ()) -> Strategy:
    """The same strategy, which has learnt all trials from the beginning, and what changed after some of them."""
    again = strategy.restarted()
    for trial in trials:
        again.learn(trial)
        if trial.index in changes:
            again.note_change()
    return again


def estimate_record(
    strategy: Strategy, trial: int, decision: StopDecision, next_isi_ms: float | None
) -> EstimateRecord:
    """The record of what a strategy knows after a trial; scores are those that it has worked out anyway."""
    record = recorded(strategy.estimate(), trial, decision, next_isi_ms)
    more: dict[str, Any] = {}
    if record.grid_ms and (band := strategy.prediction_mv()) is not None:
        more = {"predicted_low_mv": _rounded(band[0]), "predicted_high_mv": _rounded(band[1])}
    if next_isi_ms is not None and (choice := strategy.choice) is not None:
        more["chosen_by"] = choice.by
        if choice.scores is not None:
            more["scored_ms"] = tuple(candidate_isis(strategy.space).tolist())
            more["scores"] = _rounded(choice.scores.astype(float))
    return record.model_copy(update=more)


def recorded(estimate: WindowEstimate, trial: int, decision: StopDecision, next_isi_ms: float | None) -> EstimateRecord:
    """The record of an estimate after a trial, by itself."""
    stops = {"stop": decision.stop, "reason": decision.reason, "stop_kind": decision.kind}
    return estimate.in_figures(EstimateRecord, trial=trial, next_isi_ms=next_isi_ms, **stops)


def _rounded(values: FloatArray) -> tuple[float, ...]:
    """Numbers to `DIGITS` digits, as texts have them."""
    with np.errstate(divide="ignore", invalid="ignore"):
        places = DIGITS - 1 - np.floor(np.log10(np.abs(values)))
    fitting = np.isfinite(places) & (np.abs(places) <= _EXACT)
    # Of powers of ten as small both are exact, and so is the number that is nearest to the decimal one.
    up, down = (10.0 ** np.where(fitting, np.maximum(sign * places, 0.0), 0.0) for sign in (1, -1))
    rounded = np.where(fitting, np.rint(values * up / down) * down / up, values)
    for at in np.flatnonzero(~fitting & np.isfinite(values)):
        rounded[at] = float(f"{values[at]:.{DIGITS}g}")
    return tuple(rounded.tolist())
