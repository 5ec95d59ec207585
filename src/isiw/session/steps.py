"""The steps of a session: ask, wait, log the intent, deliver, judge, log the trial, and conclude it."""

from __future__ import annotations

import itertools
import statistics
from collections import deque
from typing import Final

from isiw.devices.protocol import Answer
from isiw.errors import DeviceError, DeviceTimeoutError, LimitExceededError, NotDelivered, told
from isiw.findings import Finding
from isiw.log.schema import Event, Header, Intent, Waveform
from isiw.session.examination import WindowExamination
from isiw.session.pausing import Pausing
from isiw.session.rig import Rig
from isiw.session.sink import Sink
from isiw.session.updates import SessionUpdate
from isiw.signals.judgement import judge, judge_measurement
from isiw.signals.watch import Watch
from isiw.strategy.stopping import StopDecision, StopKind, stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.text.shown import shown
from isiw.trials import Measurement, Stimulus, Sweep, Trial
from isiw.visit import Control

_LAST: Final = 20

_NAP_S = 0.25  # how long a pause may go unnoticed between two stimuli

_NOTHING_GIVEN = (NotDelivered, LimitExceededError)
"""What a device raises only before it delivers."""


def paused(reason: str) -> StopDecision:
    """The decision that does not stop, of a session that waits for a person."""
    return StopKind.PAUSED.go_on(f"The session is paused: {reason}")


def ended(reason: str) -> StopDecision:
    """The decision that does not stop, of a session that a person has ended."""
    return StopKind.PAUSED.go_on(f"The session was ended before its time: {reason}")


class Pace:
    """The usual time between the last stimuli; a rest or a pause among them does not change it."""

    def __init__(self) -> None:
        self._ends_s: deque[float] = deque(maxlen=_LAST + 1)

    def passed(self, now_s: float) -> None:
        """A stimulus was delivered."""
        self._ends_s.append(now_s)

    def left_s(self, stimuli: int) -> float | None:
        """About how long so many stimuli take [s]; None before the second one."""
        gaps_s = [after - before for before, after in itertools.pairwise(self._ends_s)]
        return stimuli * statistics.median(gaps_s) if gaps_s else None


class Steps:
    """Takes one step of a session after the other; each is taken once, also where the one after is interrupted."""

    def __init__(
        self,
        examination: WindowExamination,
        rig: Rig,
        sink: Sink,
        pausing: Pausing,
        watch: Watch,
        header: Header,
        backoffs_s: tuple[float, ...],
    ) -> None:
        self._examination, self._rig, self._sink, self._pausing = examination, rig, sink, pausing
        self._watch, self._header, self._backoffs_s = watch, header, backoffs_s
        self._pace, self._freely = Pace(), rig.interrupts.freely

    @property
    def _strategy(self) -> Strategy:
        return self._examination.learner.strategy

    def next(self) -> StopDecision | None:
        """Conclude the trial that was delivered, or deliver the next; the decision, where there is one."""
        trial = self._examination.unconcluded
        known = self._examination.conclude(self._decision, self._next_isi_ms)
        if trial is not None and known is not None:
            self._report(trial, known.decision, known.next_isi_ms)
            return known.decision
        if (decision := self.at_the_end()) is None:
            self._one_trial()
        return decision

    def at_the_end(self) -> StopDecision | None:
        """The decision to stop, by the strategy or the limits; None where there is a stimulus to deliver."""
        if (decision := self._freely(self._strategy.decision)).stop:
            return decision
        return None if self._rig.pulses_left else self._stop_at_limit()

    def log_belief(self) -> None:
        """Log what is known after the last trial."""
        self._examination.log_belief(self._decision, self._next_isi_ms)

    def seen(self) -> None:
        """A person has seen the reason of a pause, and the session goes on."""
        self._watch = self._watch.seen()

    def _stop_at_limit(self) -> StopDecision:
        decision = StopKind.LIMIT.stop(f"The limit of {self._header.limits.max_pulses} pulses is reached.")
        self._examination.event("limit", decision.reason)
        self._examination.log_belief(lambda: decision)
        return decision

    def _report(self, trial: Trial, decision: StopDecision, next_isi_ms: float | None) -> None:
        """Tell the sink that a trial is concluded, and pause where a person should look at the data first."""
        if not decision.stop and (pause := self._watch.pause) is not None:
            self._pausing.reason, self._pausing.kind = f"{pause}", pause.kind
        left = self._stimuli_left()
        estimate = self._strategy.estimate()
        update = SessionUpdate(trial, estimate, decision, next_isi_ms, left, self._pace.left_s(left))
        self._freely(self._sink.updated, update)

    def _decision(self) -> StopDecision:
        """The strategy's decision; none is made on data that a person should look at first."""
        pause = self._watch.pause
        return self._strategy.decision() if pause is None or not self._stimuli_left() else paused(f"{pause}")

    def _stimuli_left(self) -> int:
        budget = stimuli_left(self._strategy.stopping, self._strategy.spent)
        return self._rig.pulses_left if budget is None else min(budget, self._rig.pulses_left)

    def _one_trial(self) -> None:
        """Ask and deliver; what was refused before firing is tried again."""
        number = len(self._examination.trials)
        stimulus = Stimulus(number, self._next_isi_ms(), self._next_control is Control.TAP_ALONE)
        for backoff_s in self._backoffs_s:
            try:
                return self._deliver_in_time(stimulus)
            except NotDelivered:
                if self._pausing.due:
                    raise
                self._freely(self._rig.clock.sleep_s, backoff_s)
        return self._deliver_in_time(stimulus)

    @property
    def _next_control(self) -> Control | None:
        return self._header.protocol.control(len(self._examination.trials), self._header.seed)

    def _next_isi_ms(self) -> float | None:
        """What is asked next [ms]; None where a control trial comes next."""
        return None if self._next_control else self._freely(self._strategy.ask, self._header.ask_deadline_s)

    def _deliver_in_time(self, stimulus: Stimulus) -> None:
        self._freely(self._wait)
        if not self._disturbed:
            fallback = None if stimulus.isi_ms is None else self._strategy.fallback_reason
            self._deliver(stimulus, fallback)
            self._pace.passed(self._rig.clock.now_s())

    def _wait(self) -> None:
        """Sleep until limits and protocol allow the next stimulus, or an operator has another wish."""
        number = len(self._examination.trials)
        rests = self._header.protocol.rests_before(number)
        try:
            while not self._disturbed and (wait_s := self._wait_s()) > 0:
                self._sink.waiting(wait_s, f"Rest after {number} trials" if rests else "Next stimulus")
                self._rig.clock.sleep_s(min(wait_s, _NAP_S))
        finally:
            self._sink.waited()

    @property
    def _disturbed(self) -> bool:
        return self._pausing.reason is not None or self._examination.overruled

    def _wait_s(self) -> float:
        """How long until limits and protocol allow the next stimulus [s]."""
        protocol = self._header.protocol
        return self._rig.wait_s(protocol.interval_s(len(self._examination.trials), self._header.seed))

    def _deliver(self, stimulus: Stimulus, fallback: str | None) -> None:
        """Deliver a pair of stimuli or a control trial, unless a trial was judged since it was asked for."""
        self._require_allowed(stimulus)
        if not self._examination.intend(Intent.of(stimulus, self._rig.clock.now_s()), fallback):
            return
        trial: Trial | None = None
        doubt: Finding | None = None
        try:
            self._sink.log.require_in_place()
            trial = Trial.unknown(stimulus)  # from here on it may have been given, whatever fails
            answer = self._answer(stimulus)
            trial = self._judged(stimulus, answer)
            self._watch = self._watch.after(trial, answer)
            doubt = self._watch.doubts.new
        except Exception as error:
            if trial is None or isinstance(error, _NOTHING_GIVEN):
                trial = None
                self._examination.log_refusal("refused", error, stimulus.trial)
                raise
            if not self._pausing.due:
                raise
            self._sink.faults.append(f"While the device was being disarmed: {told(error)}")
        finally:
            if trial is not None:
                self._examination.came(trial)
                if doubt is not None:
                    self._examination.event("doubt", f"{doubt}", finding=doubt.kind)
            self._examination.log_faults()
            self._sink.log.sync()

    def _require_allowed(self, stimulus: Stimulus) -> None:
        """Raise where the limits or the device do not allow a stimulus, before anything is logged of it."""
        try:
            self._rig.check(stimulus)
        except NotDelivered as error:
            self._examination.log_refusal("limit", error)
            raise

    def _answer(self, stimulus: Stimulus) -> Answer:
        """What came of a stimulus; its waveforms are logged, also where it comes too late."""
        try:
            answer = self._rig.deliver(stimulus, self._header.timeout_s)
        except DeviceTimeoutError:
            late = self._rig.late_answer()
            if late is not None:
                self._log_waveforms(stimulus, late)
                self._sink.append(Event(kind="late", trial=stimulus.trial, text=_late_text(late)))
            raise
        self._log_waveforms(stimulus, answer)
        return answer

    def _log_waveforms(self, stimulus: Stimulus, answer: Answer) -> None:
        if isinstance(answer, Sweep):
            for name, channel in answer.channels.items():
                self._sink.append(Waveform.of(stimulus.trial, channel), name)

    def _judged(self, stimulus: Stimulus, answer: Answer) -> Trial:
        space, signals = self._header.space, self._header.signals
        if isinstance(answer, Sweep):
            return judge(answer, stimulus, space, signals)
        if isinstance(answer, Measurement):
            return judge_measurement(answer, stimulus, space, signals)
        raise DeviceError(
            f"the device's deliver returned {shown(answer)}",
            expected="an isiw.Sweep or an isiw.Measurement",
            remedy="Let it return what it recorded, or the MEP that it measured: isiw.Measurement(mep_mv, isi_ms).",
        )


def _late_text(answer: Answer) -> str:
    what = f"{answer.mep_mv:g} mV" if isinstance(answer, Measurement) else "a sweep"
    return f"An answer came after the deadline: {what}. It is in the log, but is not used."
