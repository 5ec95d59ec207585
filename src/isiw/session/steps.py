"""The steps of a session: ask, wait, deliver, learn, decide."""

from __future__ import annotations

from collections.abc import Callable

from isiw.errors import NotDelivered
from isiw.log.schema import Event, Header
from isiw.session.believed import believed
from isiw.session.delivery import Delivery
from isiw.session.desk import Desk
from isiw.session.journal import Journal, learn, relearned
from isiw.session.pace import Pace
from isiw.session.pausing import Pausing
from isiw.session.rig import Rig
from isiw.session.updates import SessionUpdate
from isiw.strategy.stopping import StopDecision, StopKind, stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, Trial
from isiw.visit import Control
from isiw.window import WindowEstimate

__all__ = ["Steps", "ended", "paused"]

_NAP_S = 0.25  # how long a pause may go unnoticed between two stimuli


def paused(reason: str) -> StopDecision:
    """The decision that does not stop, of a session that waits for a person."""
    return StopKind.PAUSED.go_on(f"The session is paused: {reason}")


def ended(reason: str) -> StopDecision:
    """The decision that does not stop, of a session that a person has ended."""
    return StopKind.PAUSED.go_on(f"The session was ended before its time: {reason}")


class Steps:
    """Takes one step of a session after the other; each is taken once, also where the one after is interrupted.

    Args:
        strategy: proposes ISIs and learns.
        rig: waits and delivers.
        journal: the trials and their log.
        pausing: whether the session is to pause.
        delivery: delivers and judges.
        header: what the session is.
        backoffs_s: how long to wait before a stimulus is tried again that was refused before firing [s].
    """

    def __init__(
        self,
        strategy: Strategy,
        rig: Rig,
        journal: Journal,
        pausing: Pausing,
        delivery: Delivery,
        header: Header,
        backoffs_s: tuple[float, ...],
    ) -> None:
        self.strategy, self.delivery = strategy, delivery
        self.on_trial: Callable[[SessionUpdate], None] | None = None
        self.desk: Desk | None = None
        self._rig, self._journal, self._pausing, self._header = rig, journal, pausing, header
        self._pace = Pace()
        self._backoffs_s, self._freely = backoffs_s, rig.interrupts.freely

    def next(self) -> StopDecision | None:
        """Learn anew, conclude the trial that was delivered, or deliver the next; the decision, where there is one."""
        if self._journal.overruled:
            self._learn_anew()
        if self._journal.unconcluded is not None:
            return self._concluded(self._journal.unconcluded)
        if (decision := self.at_the_end()) is None:
            self._one_trial()
        return decision

    def at_the_end(self) -> StopDecision | None:
        """The decision to stop, by the strategy or the limits; None where there is a stimulus to deliver."""
        if (decision := self._freely(self.strategy.decision)).stop:
            return decision
        return None if self._rig.pulses_left else self._stop_at_limit()

    def _learn_anew(self) -> None:
        """Learn all trials as they count since one of them was judged anew."""
        self._journal.overruled = False
        try:
            self.strategy = self._freely(relearned, self.strategy, self._journal.trials)
        except BaseException:
            self._journal.overruled = True
            raise
        if self._journal.unconcluded is None and self._journal.trials:
            self.log_estimate(len(self._journal.trials) - 1)

    def _stop_at_limit(self) -> StopDecision:
        decision = StopKind.LIMIT.stop(f"The limit of {self._header.limits.max_pulses} pulses is reached.")
        self._journal.event("limit", decision.reason)
        last = len(self._journal.trials) - 1
        self._journal.log.append(self._freely(believed, self.strategy, last, decision, None))
        return decision

    def _one_trial(self) -> None:
        """Ask and deliver; what was refused before firing is tried again."""
        stimulus = Stimulus(len(self._journal.trials), self._next_isi_ms(), self._next_control is Control.TAP_ALONE)
        for backoff_s in self._backoffs_s:
            try:
                return self._deliver(stimulus)
            except NotDelivered:
                if self._pausing.due:
                    raise
                self._freely(self._rig.clock.sleep_s, backoff_s)
        return self._deliver(stimulus)

    @property
    def _next_control(self) -> Control | None:
        return self._header.protocol.control(len(self._journal.trials), self._header.seed)

    def _next_isi_ms(self) -> float | None:
        """What is asked next [ms]; None where a control trial comes next."""
        return None if self._next_control else self._freely(self.strategy.ask, self._header.ask_deadline_s)

    def _deliver(self, stimulus: Stimulus) -> None:
        self._freely(self._wait)
        if not self._disturbed:
            fallback = None if stimulus.isi_ms is None else self.strategy.fallback_reason
            self.delivery.deliver(stimulus, fallback)
            self._pace.passed(self._rig.clock.now_s())

    def _wait(self) -> None:
        """Sleep until limits and protocol allow the next stimulus, or an operator has another wish."""
        number = len(self._journal.trials)
        rests = self._header.protocol.rests_before(number)
        try:
            while not self._disturbed and (wait_s := self._wait_s()) > 0:
                if self.desk is not None:
                    self.desk.count_down(wait_s, f"Rest after {number} trials" if rests else "Next stimulus")
                self._rig.clock.sleep_s(min(wait_s, _NAP_S))
        finally:
            if self.desk is not None:
                self.desk.counted_down()

    @property
    def _disturbed(self) -> bool:
        return self._pausing.reason is not None or self._journal.overruled

    def _wait_s(self) -> float:
        """How long until limits and protocol allow the next stimulus [s]."""
        return self._rig.wait_s(self._header.protocol.interval_s(len(self._journal.trials), self._header.seed))

    def _concluded(self, trial: Trial) -> StopDecision:
        """Learn from a delivered trial and report; each step is taken once, also where the one after is interrupted."""
        if self.strategy.delivered < len(self._journal.trials):
            self._freely(learn, self.strategy, trial)
        if trial.told and self.strategy.trouble is not None:
            self._journal.log.append(Event(kind="fit", trial=trial.index, text=self.strategy.trouble))
        if (doubt := self.delivery.watch.doubts.new) is not None:
            self._journal.event("doubt", f"{doubt}", finding=doubt.kind)
        estimate, decision, next_isi_ms = self.log_estimate(trial.index)
        self._journal.unconcluded = None
        if not decision.stop and (pause := self.delivery.watch.pause) is not None:
            self._pausing.reason, self._pausing.kind = f"{pause}", pause.kind
        if self.on_trial is not None:
            left = self._stimuli_left()
            update = SessionUpdate(trial, estimate, decision, next_isi_ms, left, self._pace.left_s(left))
            self._freely(self.on_trial, update)
        return decision

    def log_estimate(self, trial: int) -> tuple[WindowEstimate, StopDecision, float | None]:
        """Put what is believed after a trial on disk; the estimate, the decision, and the next ISI [ms]."""
        estimate, decision = self._freely(self.strategy.estimate), self._freely(self._decision)
        next_isi_ms = None if decision.stop else self._next_isi_ms()
        self._journal.log.append(self._freely(believed, self.strategy, trial, decision, next_isi_ms))
        self._journal.log.sync()
        return estimate, decision, next_isi_ms

    def _decision(self) -> StopDecision:
        """The strategy's decision; none is made on data that a person should look at first."""
        pause = self.delivery.watch.pause
        return self.strategy.decision() if pause is None or not self._stimuli_left() else paused(f"{pause}")

    def _stimuli_left(self) -> int:
        budget = stimuli_left(self.strategy.stopping, self.strategy.spent)
        return self._rig.pulses_left if budget is None else min(budget, self._rig.pulses_left)
