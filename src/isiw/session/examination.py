"""The examination: what is known of a person, and the one way in which a trial or a verdict changes it.

The intent is on disk before the stimulus, the trial before it is learnt, and it is learnt before the next stimulus.
Each step is taken once, even if the next one is interrupted. After a verdict all trials are learnt again.
"""

from __future__ import annotations

import operator
import threading
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Final, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

from isiw import checks, sentences
from isiw.change import Change
from isiw.errors import LimitExceededError, StrategyError, error_text
from isiw.findings import Finding, Kind, Severity
from isiw.log.headers import Header
from isiw.log.schema import Correction, EstimateRecord, Event, EventKind, Intent, Record
from isiw.log.verdicts import correction, excluded_by, is_logged, under_all
from isiw.session.sink import Sink
from isiw.signals.tap import TapResponses
from isiw.strategy.choice import candidate_isis
from isiw.strategy.course import details_of
from isiw.strategy.stopping import OF_THE_WINDOW, StopDecision, stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.trials import Sweep, Trial, TrialTable
from isiw.types import FloatArray
from isiw.visit import PAIRS_FIRST

TrialT = TypeVar("TrialT")
TrialT_contra = TypeVar("TrialT_contra", contravariant=True)

DIGITS = 4
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
    def belief(self, trial: int, decision: StopDecision, next_isi_ms: float | None, /) -> Record: ...


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
        self._doubted = {event.finding for event in self._events}
        self._refusal: Exception | None = None
        self._lock = threading.RLock()

    @property
    def last(self) -> int | None:
        """The number of the last trial; None before the first."""
        return len(self.trials) - 1 if len(self.trials) else None

    @property
    def last_excluded(self) -> int | None:
        """The trial that was excluded last, of those that are; None if none is."""
        excluded = excluded_by(self._events)
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
        checks.text("the key of a note", key or "")
        with self._lock:
            event = Event(kind="note", trial=self.last if trial is None else trial, text=text, key=key)
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
            self.overruled = True
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
        self,
        decide: Callable[[], StopDecision] | None = None,
        ask_next: Callable[[], float | None] = lambda: None,
    ) -> Known | None:
        """Learn what is not learnt yet, and log what is known then, as `log_belief` does; None if all was learnt."""
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
        known = self.log_belief(decide, ask_next) if len(self.trials) else None
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
        if doubt is not None and doubt.kind not in self._doubted and self._sink.is_open:
            self._doubted.add(doubt.kind)
            self.event("doubt", f"{doubt}", finding=doubt.kind)

    def log_belief(
        self,
        decide: Callable[[], StopDecision] | None = None,
        ask_next: Callable[[], float | None] = lambda: None,
    ) -> Known:
        """Log, if the log is open, what is known after the last trial, whether to stop, and else what is asked next."""
        decision = self._freely(decide or self.learner.decision)
        known = Known(decision, None if decision.stop else ask_next())
        if self._sink.is_open:
            self._sink.append(self._freely(self.learner.belief, len(self.trials) - 1, *known))
            self._sink.log.sync()
        return known


class _WindowLearner:
    """A strategy as an examination sees it; another one once all trials were learnt again."""

    def __init__(self, strategy: Strategy, events: Iterable[Event] = ()) -> None:
        self.strategy, self._changes = strategy, changed_after(events)

    def knows(self, trials: TrialTable) -> bool:
        return self.strategy.delivered == len(trials)

    def learn(self, trial: Trial) -> None:
        learn(self.strategy, trial)

    def trouble_with(self, trial: Trial) -> str | None:
        return self.strategy.trouble if trial.told else None

    def doubt(self, trials: TrialTable) -> Finding | None:
        return change_found(self.strategy.estimate().change, trials.told)

    def learn_again(self, trials: TrialTable) -> None:
        self.strategy = relearned(self.strategy, trials, self._changes)

    def judged(self, trials: TrialTable, verdict: Event) -> TrialTable:
        self._changes += changed_after([verdict])
        return under_all(trials, [verdict])

    def decision(self) -> StopDecision:
        return self.strategy.decision()

    def belief(self, trial: int, decision: StopDecision, next_isi_ms: float | None) -> EstimateRecord:
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
    return Finding(Kind.CHANGED, Severity.DOUBT, sentences.at_a_trial(change, at), remedy)


def learn(strategy: Strategy, trial: Trial) -> None:
    """Tell a strategy one trial, or count it if there is nothing to tell."""
    if trial.told:
        strategy.learn(trial.isi_ms, None if trial.mep_interval_mv else trial.mep_mv, **details_of(trial))
    elif trial.counts and trial.isi_ms is not None:  # a tap alone with an amplitude
        strategy.learn_tap(trial.isi_ms, trial.mep_mv)
    elif trial.is_control:
        strategy.count_control(trial.mep_mv if trial.tap_alone and trial.counts else None)
    elif trial.excluded and trial.reason is None:
        strategy.count_excluded()
    else:
        strategy.count_mistrial()


def changed_after(events: Iterable[Event]) -> list[int]:
    """The trials after which somebody noted a change."""
    return [event.trial for event in events if event.kind == "change" and event.trial is not None]


def relearned(strategy: Strategy, trials: Iterable[Trial], changes: Sequence[int] = ()) -> Strategy:
    """The same strategy, which has learnt all trials from the beginning, and what changed after some of them."""
    again = strategy.restarted()
    for trial in trials:
        learn(again, trial)
        for _ in range(changes.count(trial.index)):
            again.note_change()
    return again


def estimate_record(
    strategy: Strategy, trial: int, decision: StopDecision, next_isi_ms: float | None
) -> EstimateRecord:
    """The record of what a strategy knows after a trial; scores are those that it has worked out anyway."""
    record = EstimateRecord.after(trial, strategy.estimate(), decision, next_isi_ms)
    more: dict[str, Any] = {}
    if record.grid_ms and (band := strategy.prediction_mv()) is not None:
        more = {"predicted_low_mv": _rounded(band[0]), "predicted_high_mv": _rounded(band[1])}
    if next_isi_ms is not None and (choice := strategy.choice) is not None:
        more["chosen_by"] = choice.by
        if choice.scores is not None:
            more["scored_ms"] = tuple(candidate_isis(strategy.space).tolist())
            more["scores"] = _rounded(choice.scores.detach().double().numpy())
    return record.model_copy(update=more)


def _rounded(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(f"{value:.{DIGITS}g}") for value in values)


KNOWN: Final = "What the first stimulus alone does to the EMG is known now, and was subtracted."
LONGER: Final = "A longer ISI shows the first stimulus's own response, which may explain the enhancement so far."

LEAST_PROBABILITY: Final = 0.9
"""A window that is as probable as this should not be the first stimulus's own response."""


class OwnResponse:
    """Learns the response from each sweep, and says what should be given so that more is known of it."""

    def __init__(self, examination: WindowExamination, header: Header, taps: TapResponses) -> None:
        self._examination, self._taps = examination, taps
        self._protocol, device, self._high_ms = header.protocol, header.device, header.space.high_ms
        self._gives_taps = bool(self._protocol.taps_first) and device.tap_alone and "emg" in device.channels

    def after(self, trial: Trial, sweep: Sweep) -> Trial:
        """Learn from a sweep; its trial with the amplitude without the response, as far as that is known."""
        self._taps = self._taps.after(trial, sweep)
        return self._taps.measured(trial)

    def correct(self) -> None:
        """Correct earlier amplitudes by what is known now."""
        self._taps, others = self._taps.corrected(self._examination.trials)
        for trial in others:
            right = Correction(mep_mv=trial.mep_mv, mep_sd_mv=trial.mep_sd_mv, tap_mv=trial.tap_mv)
            self._examination.judge(partial(correction, number=trial.index, why=KNOWN, corrected=right))

    @property
    def wants_tap(self) -> bool:
        """True if a tap alone should come next."""
        trials = self._examination.trials
        if not self._gives_taps or len(trials) < PAIRS_FIRST:
            return False
        window = self._examination.learner.strategy.estimate().window
        return len(trials) < PAIRS_FIRST + self._protocol.taps_first or self._taps.wants_taps(window, trials)

    @property
    def least_isi_ms(self) -> float | None:
        """From which ISI on a pair would show the response at trials that a window rests on; None if none is needed."""
        estimate, trials = self._examination.learner.strategy.estimate(), self._examination.trials
        if (estimate.probability or 0.0) < LEAST_PROBABILITY:
            return None
        least_ms = self._taps.shown_from_ms(estimate.window, trials)
        return None if least_ms is None or least_ms > self._high_ms else least_ms

    def decided(self, decision: StopDecision) -> StopDecision:
        """A decision to stop on a window waits until an ISI has shown that it is not the response, or none is left."""
        if not decision.stop or decision.kind not in OF_THE_WINDOW or self.least_isi_ms is None:
            return decision
        strategy = self._examination.learner.strategy
        if stimuli_left(strategy.stopping, strategy.spent) == 0:
            return decision
        return decision.kind.go_on(f"It is too early to stop. {LONGER}")
