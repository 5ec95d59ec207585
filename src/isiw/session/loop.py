"""The closed loop: ask, log the intent, deliver, judge, log the trial, tell.

What is on disk is always ahead of what happens next: the intent before its stimulus, the trial before it is told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from isiw.checks import deadline, number
from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device
from isiw.errors import InvalidValueError, NotDelivered, StrategyError
from isiw.log.durable import log_of
from isiw.log.pulses import earlier_pulses_s
from isiw.log.schema import Estimate, Event, Header, Record
from isiw.log.writer import LogWriter
from isiw.session.delivery import Delivery
from isiw.session.header import header_of
from isiw.session.journal import Journal, learn
from isiw.session.pausing import Pausing
from isiw.session.rig import Rig, require_matching
from isiw.session.safeguards import Safeguards
from isiw.session.updates import SessionResult, SessionUpdate
from isiw.session.watch import Watch
from isiw.signals.judgement import SignalLimits
from isiw.strategy.stopping import StopDecision, stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, Trial, TrialTable

__all__ = ["Session"]

_NAP_S = 0.25  # how long a pause may go unnoticed between two stimuli


class Session:
    """One person's session, from the first ask to the decision.

    Args:
        device: delivers the stimuli; its ISIs count from the same event as the strategy's space.
        strategy: proposes ISIs and learns.
        log: where the log will be; must not exist yet.
        limits: what may be delivered; the strategy's space, 5 s between stimuli and 200 pulses by default.
        clock: tells the time and waits; a virtual one by default where the device is simulated.
        on_trial: called after every trial, when it is safely on disk.
        subject: the person's code, for the log.
        signals: what a sweep must keep to be accepted.
        config: anything that should be kept in the log, as TOML values.
        timeout_s: how long the device may take for one delivery [s]; past it, it is disarmed and the session ends.
        ask_deadline_s: how long the strategy may take for one ask [s]; past it, it falls back, and the log says so.
        safeguards: what is done about faults, pauses and earlier sessions.

    Raises:
        DeviceError: the device counts its ISIs from another event than the space, or states another detection limit
            than the strategy's, or is not simulated and has a virtual clock.
        InvalidValueError: a time that is no positive number, a channel whose name or unit a session cannot use, or
            earlier logs without a subject to find in them.
    """

    def __init__(  # noqa: PLR0913 - the public surface of the design; all but two are keyword-only
        self,
        device: Device,
        strategy: Strategy,
        *,
        log: str | Path,
        limits: Limits | None = None,
        clock: Clock | None = None,
        on_trial: Callable[[SessionUpdate], None] | None = None,
        subject: str = "",
        signals: SignalLimits | None = None,
        config: Mapping[str, Any] | None = None,
        timeout_s: float = 30.0,
        ask_deadline_s: float | None = None,
        safeguards: Safeguards | None = None,
    ) -> None:
        self._limits = limits or Limits.of_space(strategy.space)
        self._safeguards = safeguards or Safeguards()
        self._rig = Rig(device, self._limits, clock, self._safeguards)
        self._freely = self._rig.interrupts.freely
        require_matching(self._rig.info, strategy)
        self.strategy, self.log_path = strategy, log_of(Path(log))
        self._on_trial, self._ask_deadline_s = on_trial, deadline("ask_deadline_s", ask_deadline_s)
        self._header = header_of(
            strategy,
            subject=subject,
            limits=self._limits,
            device=self._rig.info,
            signals=signals or SignalLimits(),
            timeout_s=number("timeout_s", timeout_s, above=0),
            ask_deadline_s=self._ask_deadline_s,
            config=dict(config or {}),
        )
        if self._safeguards.earlier_logs is not None and not subject:
            raise InvalidValueError(
                "earlier logs count for the same subject only, and there is none", remedy="Give the session a subject."
            )
        self._open_log: Callable[[Header], LogWriter] = partial(LogWriter.create, log)
        self._first_records: Sequence[Record] = ()
        self._own_earlier_s: Callable[[], Sequence[float]] = tuple
        self._resumed = False
        self._journal = Journal()
        self._pausing = Pausing(self._rig, self._journal, self._safeguards)
        self._delivery = self._delivery_of(self._header)

    def _delivery_of(self, header: Header) -> Delivery:
        watch = Watch(header.space, header.signals, header.limits.max_consecutive_mistrials)
        return Delivery(self._rig, self._journal, self._pausing, watch, header.space, header.signals, header.timeout_s)

    @property
    def trials(self) -> TrialTable:
        """All trials so far."""
        return self._journal.trials

    def continue_from(
        self,
        trials: TrialTable,
        open_log: Callable[[Header], LogWriter],
        first_records: Sequence[Record],
        earlier_s: Callable[[], Sequence[float]] = tuple,
    ) -> None:
        """Begin where another run ended; `isiw.resume` does this for you.

        Args:
            trials: what was delivered before; the strategy has learned it.
            open_log: opens the log that goes on, with this session's header.
            first_records: what it holds next.
            earlier_s: says how long ago each stimulus before was [s].
        """
        self._journal.trials, self._open_log, self._first_records = trials, open_log, first_records
        self._own_earlier_s, self._resumed = earlier_s, True
        self._delivery.watch = self._delivery.watch.resumed(trials)

    def run(self) -> SessionResult:
        """Run to the end, and close the log whatever happens.

        Where trials are rejected again and again, or the data look like a slip of unit, it ends before its time with a
        decision that does not stop: its reason says what to do before the session is resumed.

        Raises:
            DeviceError: the device failed; it is stopped, and the trial is a mistrial "outcome unknown". Or another
                session drives it.
            LimitExceededError: a stimulus was refused; nothing was delivered.
            LogError: the log cannot be written, or is no longer at its path; nothing is delivered without a log.
            StrategyError: the strategy knows of trials that are not this session's; nothing was delivered.
        """
        self._require_own_strategy()
        earlier_s = self._earlier_s()
        with self._rig.driven(), self._open_log(self._header) as log:
            self._rig.log = self._journal.log = log
            try:
                self._log_beginning()
                with self._rig.armed(len(self.trials), earlier_s):
                    decision = self._loop()
                self._journal.faults(self._rig.faults)
            except BaseException as error:
                self._journal.faults(self._rig.faults)
                self._journal.failure(error)
                if not (self._rig.staged_once or self._resumed):
                    log.discard()
                raise
        return SessionResult(self.strategy.estimate(), decision, self.trials, log.path)

    def pause(self, reason: str) -> None:
        """Disarm now, and pause before the next stimulus; from any thread, also from `on_trial`.

        `Safeguards.on_pause` or the operator decides how it goes on; where nobody can, the session ends, and can be
        resumed.

        Args:
            reason: why, for the operator and the log.
        """
        self._pausing.now(reason)

    def _require_own_strategy(self) -> None:
        if self.strategy.delivered > len(self.trials):
            raise StrategyError(
                "the strategy knows of trials that are not this session's",
                got=f"{self.strategy.delivered} trials",
                expected=f"{len(self.trials)} trials",
                remedy="Make a new one, or give the session strategy.restarted().",
            )

    def _earlier_s(self) -> list[float]:
        """How long ago each earlier stimulus was to the same person, as far as the logs to look at know [s]."""
        limits, folder = self._limits, self._safeguards.earlier_logs
        if self._header.device.simulated or (limits.max_block_pulses is None and limits.max_period_pulses is None):
            return []
        earlier_s = list(self._own_earlier_s())
        if folder is not None:
            period_s = max(limits.period_s, limits.rest_s)
            earlier_s += earlier_pulses_s(folder, self._header.subject, period_s, but=self.log_path)
        return earlier_s

    def _log_beginning(self) -> None:
        for record in self._first_records:
            self._journal.log.append(record)
        if self.trials:
            self._log_estimate(len(self.trials) - 1)

    def _loop(self) -> StopDecision:
        decision = None
        while decision is None or not decision.stop:
            if self._pausing.due:
                if (paused := self._pausing.until_decided()) is not None:
                    return _paused(paused)
                self._delivery.watch = self._delivery.watch.seen()
                continue
            try:
                decision = self._next_step()
            except KeyboardInterrupt:
                if not self._rig.interrupts.heard:
                    raise
            except NotDelivered:
                if not self._pausing.due:
                    raise
        return decision

    def _next_step(self) -> StopDecision | None:
        """Conclude the trial that was delivered, or deliver the next; the decision to stop, where there is one."""
        if self._journal.unconcluded is not None:
            return self._concluded(self._journal.unconcluded)
        if (decision := self._freely(self.strategy.decision)).stop:
            return decision
        if not self._rig.pulses_left:
            return self._stop_at_limit()
        self._one_trial()
        return None

    def _stop_at_limit(self) -> StopDecision:
        decision = StopDecision(stop=True, reason=f"The limit of {self._limits.max_pulses} pulses is reached.")
        self._journal.event("limit", decision.reason)
        estimate = self._freely(self.strategy.estimate)
        self._journal.log.append(Estimate.of(len(self.trials) - 1, estimate, decision, None))
        return decision

    def _one_trial(self) -> None:
        """Ask and deliver; what was refused before firing is tried again."""
        stimulus = Stimulus(len(self.trials), self._freely(self.strategy.ask, self._ask_deadline_s))
        if self.strategy.fallback_reason is not None:
            text = self.strategy.fallback_reason
            self._journal.log.append(Event(kind="fallback", trial=stimulus.trial, text=text))
        for backoff_s in self._safeguards.backoffs_s:
            try:
                return self._deliver(stimulus)
            except NotDelivered:
                if self._pausing.due:
                    raise
                self._freely(self._rig.clock.sleep_s, backoff_s)
        return self._deliver(stimulus)

    def _deliver(self, stimulus: Stimulus) -> None:
        self._freely(self._wait)
        self._delivery.deliver(stimulus)

    def _wait(self) -> None:
        """Sleep until the limits allow the next stimulus, or somebody wants to pause."""
        while self._pausing.reason is None and (wait_s := self._rig.wait_s()) > 0:
            self._rig.clock.sleep_s(min(wait_s, _NAP_S))

    def _concluded(self, trial: Trial) -> StopDecision:
        """Learn from a delivered trial and report; each step is taken once, also where the one after is interrupted."""
        if self.strategy.delivered < len(self.trials):
            self._freely(learn, self.strategy, trial)
        if trial.told and self.strategy.trouble is not None:
            self._journal.log.append(Event(kind="fit", trial=trial.index, text=self.strategy.trouble))
        decision, next_isi_ms = self._log_estimate(trial.index)
        self._journal.unconcluded = None
        if not decision.stop and self._delivery.watch.reason is not None:
            self._pausing.reason = self._delivery.watch.reason
        if self._on_trial is not None:
            estimate = self._freely(self.strategy.estimate)
            update = SessionUpdate(trial, estimate, decision, next_isi_ms, self._stimuli_left())
            self._freely(self._on_trial, update)
        return decision

    def _log_estimate(self, trial: int) -> tuple[StopDecision, float | None]:
        """Put what is believed after a trial on disk; the decision and the next ISI [ms]."""
        estimate, decision = self._freely(self.strategy.estimate), self._freely(self._decision)
        next_isi_ms = None if decision.stop else self._freely(self.strategy.ask, self._ask_deadline_s)
        self._journal.log.append(Estimate.of(trial, estimate, decision, next_isi_ms))
        self._journal.log.sync()
        return decision, next_isi_ms

    def _decision(self) -> StopDecision:
        """The strategy's decision; none is made on data that a person should look at first."""
        reason = self._delivery.watch.reason
        return self.strategy.decision() if reason is None or not self._stimuli_left() else _paused(reason)

    def _stimuli_left(self) -> int:
        budget = stimuli_left(self.strategy.stopping, len(self.trials))
        return self._rig.pulses_left if budget is None else min(budget, self._rig.pulses_left)


def _paused(reason: str) -> StopDecision:
    return StopDecision(stop=False, reason=f"The session is paused: {reason}")
