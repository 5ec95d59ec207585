"""The closed loop: ask, log the intent, deliver, judge, log the trial, tell.

What is on disk is always ahead of what happens next: the intent before its stimulus, the trial before it is told.
"""

from __future__ import annotations

import datetime as dt
import importlib.metadata
import math
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import isiw
from isiw.checks import deadline, number
from isiw.devices.clock import Clock, MonotonicClock, VirtualClock
from isiw.devices.limits import LimitedDevice, Limits
from isiw.devices.protocol import Answer, Device, DeviceInfo
from isiw.errors import DeviceError, LimitExceededError, StrategyError
from isiw.log.durable import log_of
from isiw.log.schema import Estimate, Event, EventKind, Header, Intent, Record, StrategyRecipe, Waveform, waveform_topic
from isiw.log.writer import LogWriter
from isiw.session.interrupts import DeferredInterrupts
from isiw.session.watch import Watch
from isiw.signals.judgement import EMG_UNITS_MV, SignalLimits, judge, judge_measurement, require_unit
from isiw.strategy.stopping import StopDecision, stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.trials import Measurement, Stimulus, Sweep, Trial, TrialTable
from isiw.window import WindowEstimate

__all__ = ["Session", "SessionResult", "SessionUpdate", "learn"]

_PACKAGES = ("numpy", "torch", "botorch", "gpytorch")


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


def _require_matching(info: DeviceInfo, strategy: Strategy) -> None:
    """Raise where the strategy would misread the device's answers."""
    if info.reference != strategy.space.reference:
        raise DeviceError(
            "the device and the design space count ISIs from different events",
            got=info.reference,
            expected=strategy.space.reference,
            remedy="Give the DesignSpace the device's reference.",
        )
    for name in info.channels:
        waveform_topic(name)
    if "emg" in info.channels:  # an acceleration is not read where the device itself knows the time of the hit
        require_unit("emg", info.channels["emg"], EMG_UNITS_MV)
    limit_mv, assumed_mv = info.detection_limit_mv, strategy.recipe.settings.get("detection_limit_mv")
    if limit_mv is not None and assumed_mv is not None and not math.isclose(limit_mv, assumed_mv):
        raise DeviceError(
            "the device and the strategy have different detection limits, so an MEP of 0 would be misunderstood",
            got=f"{limit_mv:g} mV from the device",
            expected=f"{assumed_mv:g} mV, as the strategy assumes",
            remedy=f"Make the strategy with the device's: make_strategy(..., detection_limit_mv={limit_mv:g}).",
        )


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
        timeout_s: how long the device may take for one delivery [s].
        ask_deadline_s: how long the strategy may take for one ask [s]; past it, it falls back, and the log says so.

    Raises:
        DeviceError: the device counts its ISIs from another event than the space, or states another detection limit
            than the strategy's.
        InvalidValueError: a time that is no positive number, or a channel whose name or unit a session cannot use.
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
    ) -> None:
        space, info = strategy.space, device.describe()
        _require_matching(info, strategy)
        timeout_s = number("timeout_s", timeout_s, above=0)
        ask_deadline_s = deadline("ask_deadline_s", ask_deadline_s)
        self.strategy = strategy
        self.trials = TrialTable()
        self.log_path = log_of(Path(log))
        self._raw_device = device
        self._limits = limits or Limits.of_space(space)
        self._clock = clock or (VirtualClock() if info.simulated else MonotonicClock())
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
        self._open_log: Callable[[Header], LogWriter] = partial(LogWriter.create, log)
        self._first_records: Sequence[Record] = ()
        self._watch = Watch(space, self._signals, self._limits.max_consecutive_mistrials)

    def continue_from(
        self, trials: TrialTable, open_log: Callable[[Header], LogWriter], first_records: Sequence[Record]
    ) -> None:
        """Begin where another run ended; `isiw.resume` does this for you.

        Args:
            trials: what was delivered before; the strategy has learned it.
            open_log: opens the log that goes on, with this session's header.
            first_records: what it holds next.
        """
        self.trials, self._open_log, self._first_records = trials, open_log, first_records
        self._watch = self._watch.resumed(trials)

    def run(self) -> SessionResult:
        """Run to the end, and close the log whatever happens.

        Where trials are rejected again and again, or the data look like a slip of unit, it ends before its time with a
        decision that does not stop: its reason says what to do before the session is resumed.

        Raises:
            DeviceError: the device failed; it is stopped, and the trial is a mistrial "outcome unknown".
            LimitExceededError: a stimulus was refused; nothing was delivered.
            LogError: the log cannot be written; nothing is delivered without a log.
            StrategyError: the strategy knows of trials that are not this session's; nothing was delivered.
        """
        if self.strategy.delivered > len(self.trials):
            raise StrategyError(
                "the strategy knows of trials that are not this session's",
                got=f"{self.strategy.delivered} trials",
                expected=f"{len(self.trials)} trials",
                remedy="Make a new one, or give the session strategy.restarted().",
            )
        with DeferredInterrupts() as self._interrupts, self._open_log(self._header) as self._log:
            try:
                self._log_beginning()
                with self._armed():
                    decision = self._loop()
            except BaseException as error:
                self._log_failure(error)
                raise
        return SessionResult(self.strategy.estimate(), decision, self.trials, self._log.path)

    @contextmanager
    def _armed(self) -> Iterator[None]:
        self._device = LimitedDevice(self._raw_device, self._limits, self._clock, delivered=len(self.trials))
        try:
            with self._interrupts.allowed():
                self._device.stage()
            yield
        finally:
            try:
                self._device.stop()
            finally:
                self._device.unstage()

    def _log_beginning(self) -> None:
        for record in self._first_records:
            self._log.append(record)
        if self.trials:
            self._log_estimate(len(self.trials) - 1)

    def _log_failure(self, error: BaseException) -> None:
        kind: EventKind = "limit" if isinstance(error, LimitExceededError) else "fault"
        interrupted = isinstance(error, KeyboardInterrupt)
        self._log_event(kind, "Interrupted by the operator." if interrupted else f"{type(error).__name__}: {error}")

    def _log_event(self, kind: EventKind, text: str) -> None:
        self._log.append(Event(kind=kind, trial=len(self.trials) - 1 if self.trials else None, text=text))

    def _loop(self) -> StopDecision:
        decision = self.strategy.decision()
        while not decision.stop:
            if not self._device.pulses_left:
                return self._stop_at_limit()
            decision = self._one_trial()
            if not decision.stop and self._watch.reason is not None:
                self._log_event("pause", decision.reason)
                return decision
        return decision

    def _stop_at_limit(self) -> StopDecision:
        decision = StopDecision(stop=True, reason=f"The limit of {self._limits.max_pulses} pulses is reached.")
        self._log_event("limit", decision.reason)
        self._log.append(Estimate.of(len(self.trials) - 1, self.strategy.estimate(), decision, None))
        return decision

    def _one_trial(self) -> StopDecision:
        stimulus = Stimulus(len(self.trials), self.strategy.ask(self._ask_deadline_s))
        if self.strategy.fallback_reason is not None:
            self._log.append(Event(kind="fallback", trial=stimulus.trial, text=self.strategy.fallback_reason))
        trial = self._delivered(stimulus)
        learn(self.strategy, trial)
        if trial.told and self.strategy.trouble is not None:
            self._log.append(Event(kind="fit", trial=trial.index, text=self.strategy.trouble))
        decision, next_isi_ms = self._log_estimate(trial.index)
        if self._on_trial is not None:
            update = SessionUpdate(trial, self.strategy.estimate(), decision, next_isi_ms, self._stimuli_left())
            self._on_trial(update)
        return decision

    def _log_estimate(self, trial: int) -> tuple[StopDecision, float | None]:
        """Put what is believed after a trial on disk; the decision and the next ISI [ms]."""
        estimate, decision = self.strategy.estimate(), self._decision()
        next_isi_ms = None if decision.stop else self.strategy.ask(self._ask_deadline_s)
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
        return self._device.pulses_left if budget is None else min(budget, self._device.pulses_left)

    def _delivered(self, stimulus: Stimulus) -> Trial:
        """Deliver, with the intent on disk before and the trial after, whatever the device does."""
        with self._interrupts.allowed():
            self._clock.sleep_s(self._device.wait_s())
        self._device.check(stimulus)
        self._log.append(Intent(trial=stimulus.trial, isi_ms=stimulus.isi_ms, t_s=self._clock.now_s()))
        self._log.sync()
        trial = Trial.unknown(stimulus)
        try:
            with self._interrupts.allowed():
                answer = self._device.deliver(stimulus, self._timeout_s)
            self._log_waveforms(stimulus, answer)
            trial = self._judged(stimulus, answer)
            self._watch = self._watch.after(trial, answer)
        finally:
            self._log.append(trial)
            self._log.sync()
            self.trials = self.trials.appended(trial)
        return trial

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
