"""The closed loop: ask, log the intent, deliver, judge, log the trial, tell.

What is on disk is always ahead of what happens next: the intent before its stimulus, the trial before it is told.
"""

from __future__ import annotations

import datetime as dt
import importlib.metadata
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import isiw
from isiw.checks import deadline, number
from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Answer, Device
from isiw.errors import (
    DeviceError,
    DeviceTimeoutError,
    InvalidValueError,
    LimitExceededError,
    LogError,
    NotDelivered,
    StrategyError,
    told,
)
from isiw.log.durable import log_of
from isiw.log.pulses import earlier_pulses_s
from isiw.log.schema import Estimate, Event, EventKind, Header, Intent, Record, StrategyRecipe, Waveform
from isiw.log.writer import LogWriter
from isiw.session.operator import goes_on
from isiw.session.rig import Rig, require_matching
from isiw.session.safeguards import Safeguards
from isiw.session.watch import Watch
from isiw.signals.judgement import SignalLimits, judge, judge_measurement
from isiw.strategy.stopping import StopDecision, stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.trials import Measurement, Stimulus, Sweep, Trial, TrialTable
from isiw.window import WindowEstimate

__all__ = ["Session", "SessionResult", "SessionUpdate", "learn"]

P = ParamSpec("P")
T = TypeVar("T")

_PACKAGES = ("numpy", "torch", "botorch", "gpytorch")

_NOTHING_GIVEN = (NotDelivered, LimitExceededError, LogError)
"""What is raised only before a stimulus is delivered."""

_NAP_S = 0.25  # how long a pause may go unnoticed between two stimuli


@dataclass(frozen=True)
class SessionUpdate:
    """What is known after one trial.

    Args:
        trial: the trial.
        estimate: what is believed about the window.
        decision: whether the session stops here, and why.
        next_isi_ms: what is asked next [ms]; None where the session stops.
        stimuli_left: how many stimuli the budget and the limits still allow.
    """

    trial: Trial
    estimate: WindowEstimate
    decision: StopDecision
    next_isi_ms: float | None
    stimuli_left: int


@dataclass(frozen=True)
class SessionResult:
    """How a session ended.

    Args:
        estimate: what is believed about the window.
        decision: why it ended.
        trials: all its trials.
        log: its log.
    """

    estimate: WindowEstimate
    decision: StopDecision
    trials: TrialTable
    log: Path

    def __str__(self) -> str:
        return f"{self.estimate}\nTrials: {self.trials}\nEnded: {self.decision.reason}\nLog: {self.log}"


def versions() -> dict[str, str]:
    """The versions that what a strategy asks depends on, by package."""
    installed = {package: importlib.metadata.version(package) for package in _PACKAGES}
    return {"isiw": isiw.__version__, "python": platform.python_version()} | installed


def learn(strategy: Strategy, trial: Trial) -> None:
    """Tell a strategy one trial, or count it where there is nothing to tell.

    Args:
        strategy: the strategy.
        trial: the trial.
    """
    if trial.told:
        strategy.learn(trial.isi_ms, trial.mep_mv, isi_sd_ms=trial.isi_sd_ms)
    else:
        strategy.count_mistrial()


def _late_text(answer: Answer) -> str:
    what = f"{answer.mep_mv:g} mV" if isinstance(answer, Measurement) else "a sweep"
    return f"An answer came after the deadline: {what}. It is not told."


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
        space = strategy.space
        self._limits = limits or Limits.of_space(space)
        self._safeguards = safeguards or Safeguards()
        self._rig = Rig(device, self._limits, clock, self._safeguards)
        self._clock, self._interrupts, info = self._rig.clock, self._rig.interrupts, self._rig.info
        require_matching(info, strategy)
        timeout_s = number("timeout_s", timeout_s, above=0)
        ask_deadline_s = deadline("ask_deadline_s", ask_deadline_s)
        self.strategy = strategy
        self.trials = TrialTable()
        self.log_path = log_of(Path(log))
        self._signals = signals or SignalLimits()
        self._on_trial, self._timeout_s, self._ask_deadline_s = on_trial, timeout_s, ask_deadline_s
        recipe = strategy.recipe
        self._header = Header(
            isiw_version=isiw.__version__,
            created=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
            subject=subject,
            seed=recipe.seed,
            strategy=StrategyRecipe(name=recipe.name, seed=recipe.seed, settings=dict(recipe.settings)),
            space=space,
            limits=self._limits,
            device=info,
            signals=self._signals,
            timeout_s=timeout_s,
            ask_deadline_s=ask_deadline_s,
            versions={name: version for name, version in versions().items() if name != "isiw"},
            config=dict(config or {}),
        )
        if self._safeguards.earlier_logs is not None and not subject:
            raise InvalidValueError(
                "earlier logs count for the same subject only, and there is none", remedy="Give the session a subject."
            )
        self._open_log: Callable[[Header], LogWriter] = partial(LogWriter.create, log)
        self._first_records: Sequence[Record] = ()
        self._own_earlier_s: Callable[[], Sequence[float]] = tuple
        self._unconcluded: Trial | None = None
        self._pause_reason: str | None = None
        self._resumed = False
        self._watch = Watch(space, self._signals, self._limits.max_consecutive_mistrials)

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
        self.trials, self._open_log, self._first_records = trials, open_log, first_records
        self._own_earlier_s, self._resumed = earlier_s, True
        self._watch = self._watch.resumed(trials)

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
        if self.strategy.delivered > len(self.trials):
            raise StrategyError(
                "the strategy knows of trials that are not this session's",
                got=f"{self.strategy.delivered} trials",
                expected=f"{len(self.trials)} trials",
                remedy="Make a new one, or give the session strategy.restarted().",
            )
        earlier_s = self._earlier_s()
        with self._rig.driven(), self._open_log(self._header) as self._log:
            self._rig.log = self._log
            try:
                self._log_beginning()
                with self._rig.armed(len(self.trials), earlier_s):
                    decision = self._loop()
                self._log_faults()
            except BaseException as error:
                self._log_faults()
                self._log_failure(error)
                if not (self._rig.staged_once or self._resumed):
                    self._log.discard()
                raise
        return SessionResult(self.strategy.estimate(), decision, self.trials, self._log.path)

    def pause(self, reason: str) -> None:
        """Disarm now, and pause before the next stimulus; from any thread, also from `on_trial`.

        `Safeguards.on_pause` or the operator decides how it goes on; where nobody can, the session ends, and can be
        resumed.

        Args:
            reason: why, for the operator and the log.
        """
        self._pause_reason = reason
        self._rig.disarm()

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

    def _freely(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call what may be interrupted at any time, as no stimulus is in flight and no record half written."""
        with self._interrupts.allowed():
            return call(*args, **kwargs)

    def _log_beginning(self) -> None:
        for record in self._first_records:
            self._log.append(record)
        if self.trials:
            self._log_estimate(len(self.trials) - 1)

    def _log_failure(self, error: BaseException) -> None:
        kind: EventKind = "limit" if isinstance(error, LimitExceededError) else "fault"
        self._log_event(kind, "Interrupted by the operator." if isinstance(error, KeyboardInterrupt) else told(error))

    def _log_event(self, kind: EventKind, text: str) -> None:
        self._log.append(Event(kind=kind, trial=len(self.trials) - 1 if self.trials else None, text=text))

    def _log_faults(self) -> None:
        """Log what went wrong and was overcome, in whichever thread."""
        while self._rig.faults:
            self._log_event("fault", self._rig.faults.popleft())

    def _loop(self) -> StopDecision:
        decision = None
        while decision is None or not decision.stop:
            if self._pausing:
                if (paused := self._pause(self._pause_reason or "Interrupted by the operator.")) is not None:
                    return paused
                continue
            try:
                decision = self._next_step()
            except KeyboardInterrupt:
                if not self._interrupts.heard:
                    raise
            except NotDelivered:
                if not self._pausing:
                    raise
        return decision

    def _next_step(self) -> StopDecision | None:
        """Conclude the trial that was delivered, or deliver the next; the decision to stop, where there is one."""
        if self._unconcluded is not None:
            return self._concluded(self._unconcluded)
        if (decision := self._freely(self.strategy.decision)).stop:
            return decision
        if not self._rig.pulses_left:
            return self._stop_at_limit()
        self._one_trial()
        return None

    @property
    def _pausing(self) -> bool:
        return self._pause_reason is not None or self._interrupts.heard

    def _pause(self, reason: str) -> StopDecision | None:
        """Disarm, and arm again only where somebody says so; where nobody does, what the session ends with."""
        self._rig.disarm()
        self._log_faults()
        if self._interrupts.ending:
            raise KeyboardInterrupt
        self._interrupts.acknowledge()
        self._log_event("pause", reason)
        self._log.sync()
        if not self._freely(self._safeguards.on_pause or goes_on, reason):
            if self._interrupts.heard:
                raise KeyboardInterrupt
            return StopDecision(stop=False, reason=f"The session is paused: {reason}")
        self._interrupts.settle()
        self._pause_reason = None
        self._watch = self._watch.seen()
        self._log_event("pause", "The operator goes on.")
        self._rig.stage()
        return None

    def _stop_at_limit(self) -> StopDecision:
        decision = StopDecision(stop=True, reason=f"The limit of {self._limits.max_pulses} pulses is reached.")
        self._log_event("limit", decision.reason)
        estimate = self._freely(self.strategy.estimate)
        self._log.append(Estimate.of(len(self.trials) - 1, estimate, decision, None))
        return decision

    def _one_trial(self) -> None:
        stimulus = Stimulus(len(self.trials), self._freely(self.strategy.ask, self._ask_deadline_s))
        if self.strategy.fallback_reason is not None:
            self._log.append(Event(kind="fallback", trial=stimulus.trial, text=self.strategy.fallback_reason))
        for backoff_s in self._safeguards.backoffs_s:
            try:
                return self._deliver(stimulus)
            except NotDelivered:
                if self._pausing:
                    raise
                self._freely(self._clock.sleep_s, backoff_s)
        return self._deliver(stimulus)

    def _concluded(self, trial: Trial) -> StopDecision:
        """Learn from a delivered trial and report; each step is taken once, also where the one after is interrupted."""
        if self.strategy.delivered < len(self.trials):
            self._freely(learn, self.strategy, trial)
        if trial.told and self.strategy.trouble is not None:
            self._log.append(Event(kind="fit", trial=trial.index, text=self.strategy.trouble))
        decision, next_isi_ms = self._log_estimate(trial.index)
        self._unconcluded = None
        if not decision.stop and self._watch.reason is not None:
            self._pause_reason = self._watch.reason
        if self._on_trial is not None:
            estimate = self._freely(self.strategy.estimate)
            update = SessionUpdate(trial, estimate, decision, next_isi_ms, self._stimuli_left())
            self._freely(self._on_trial, update)
        return decision

    def _log_estimate(self, trial: int) -> tuple[StopDecision, float | None]:
        """Put what is believed after a trial on disk; the decision and the next ISI [ms]."""
        estimate, decision = self._freely(self.strategy.estimate), self._freely(self._decision)
        next_isi_ms = None if decision.stop else self._freely(self.strategy.ask, self._ask_deadline_s)
        self._log.append(Estimate.of(trial, estimate, decision, next_isi_ms))
        self._log.sync()
        return decision, next_isi_ms

    def _decision(self) -> StopDecision:
        """The strategy's decision; none is made on data that a person should look at first."""
        if self._watch.reason is None or not self._stimuli_left():
            return self.strategy.decision()
        return StopDecision(stop=False, reason=f"The session is paused: {self._watch.reason}")

    def _stimuli_left(self) -> int:
        budget = stimuli_left(self.strategy.stopping, len(self.trials))
        return self._rig.pulses_left if budget is None else min(budget, self._rig.pulses_left)

    def _wait(self) -> None:
        """Sleep until the limits allow the next stimulus, or somebody wants to pause."""
        while self._pause_reason is None and (wait_s := self._rig.wait_s()) > 0:
            self._clock.sleep_s(min(wait_s, _NAP_S))

    def _deliver(self, stimulus: Stimulus) -> None:
        """Deliver, with the intent on disk before and the trial after, whatever the device does."""
        self._freely(self._wait)
        self._require_allowed(stimulus)
        self._log.append(Intent(trial=stimulus.trial, isi_ms=stimulus.isi_ms, t_s=self._clock.now_s()))
        self._log.sync()
        trial: Trial | None = Trial.unknown(stimulus)
        try:
            answer = self._answer(stimulus)
            trial = self._judged(stimulus, answer)
            self._watch = self._watch.after(trial, answer)
        except _NOTHING_GIVEN as error:
            trial = None
            self._log.append(Event(kind="refused", trial=stimulus.trial, text=told(error)))
            raise
        except Exception as error:
            if not self._pausing:
                raise
            self._rig.faults.append(f"While the device was being disarmed: {told(error)}")
        finally:
            if trial is not None:
                self._log.append(trial)
                self.trials = self.trials.appended(trial)
                self._unconcluded = trial
            self._log_faults()
            self._log.sync()

    def _require_allowed(self, stimulus: Stimulus) -> None:
        """Raise where the limits or the device do not allow a stimulus, before anything is logged of it."""
        try:
            self._rig.check(stimulus)
        except NotDelivered as error:
            self._log_event("limit", told(error))
            raise

    def _answer(self, stimulus: Stimulus) -> Answer:
        """What came of a stimulus; its waveforms are logged, also where it comes too late."""
        self._log.require_in_place()
        try:
            answer = self._rig.deliver(stimulus, self._timeout_s)
        except DeviceTimeoutError:
            late = self._rig.late_answer()
            if late is not None:
                self._log_waveforms(stimulus, late)
                self._log.append(Event(kind="late", trial=stimulus.trial, text=_late_text(late)))
            raise
        self._log_waveforms(stimulus, answer)
        return answer

    def _log_waveforms(self, stimulus: Stimulus, answer: Answer) -> None:
        if isinstance(answer, Sweep):
            for name, channel in answer.channels.items():
                self._log.append(Waveform.of(stimulus.trial, channel), name)

    def _judged(self, stimulus: Stimulus, answer: Answer) -> Trial:
        space = self.strategy.space
        if isinstance(answer, Sweep):
            return judge(answer, stimulus, space, self._signals)
        if isinstance(answer, Measurement):
            return judge_measurement(answer, stimulus, space, self._signals)
        raise DeviceError(
            "the device answered with something else than its promise", got=answer, expected="a Sweep or a Measurement"
        )
