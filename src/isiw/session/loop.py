"""The closed loop: what is on disk is always ahead of what happens next, by intent, trial and learning."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Unpack

from isiw.decision import StopDecision
from isiw.devices.protocol import Device, Readiness
from isiw.errors import ClockWarning, InvalidValueError, NotDelivered, warn
from isiw.log.headers import Header
from isiw.log.pulses import earlier_pulse_ages
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.pairing.fitting import require_settable
from isiw.session.assembly import Options, assembled, require_fitting, require_new
from isiw.session.console import OperatorConsole, Table
from isiw.session.earlier import Earlier
from isiw.session.intensities import require_intensities
from isiw.session.judging import Judging
from isiw.session.pausing import Pause, ended, paused
from isiw.session.sink import Follower, SessionResult, Wait
from isiw.session.state import Fault, State, state_of
from isiw.session.stated import require_limits, require_protocol, require_signals
from isiw.session.terminal import goes_on, is_attended, is_terminal
from isiw.strategy.strategy import Strategy
from isiw.trials import TrialTable


class Session(Judging):
    """One person's session, from the first ask to the decision.

    While it runs, an operator may note, exclude, include, accept and reject, from any thread and from `on_trial`.

    Args:
        device: delivers the stimuli; its ISIs count from the same event as the strategy's space.
        strategy: chooses ISIs and learns.
        log: where the log will be; must not exist yet.
        earlier: where an earlier run ended; `isiw.resume` says so.
        limits: what may be delivered; the strategy's space, 5 s between stimuli and 200 pulses by default.
        clock: tells the time and waits; a virtual one by default where the device is simulated.
        on_trial: called after every trial, when it is safely on disk.
        subject: the person's code, for the log.
        signals: what a sweep must keep to be accepted.
        config: anything that should be kept in the log, as TOML values.
        timeout_s: how long the device may take for one delivery [s]; past it, it is disarmed and the session ends.
        ask_deadline_s: how long the strategy may take for one ask [s]; past it, it falls back, and the log says so.
        safeguards: what is done about faults, pauses and earlier sessions.
        visit: what is noted about the visit, for the log.
        protocol: intervals, control trials, blocks and rests.
        first_step: the profile below the motor threshold that a search above it goes on from, for the log.
        intervention: an intervention, which uses the window that the strategy knows from trials before; its plan says
            what is delivered, and the strategy learns nothing more.

    Raises:
        DeviceError: the device counts its ISIs from another event than the space, or states another detection limit
            than the strategy's, or is not simulated and has a virtual clock, or delivers no tap alone where the
            protocol has some.
        InvalidValueError: a part that is something else than it should be, a time that is no positive number, a channel
            whose name or unit a session cannot use, or earlier logs without a subject to find in them.
    """

    def __init__(
        self,
        device: Device,
        strategy: Strategy,
        *,
        log: str | Path,
        earlier: Earlier | None = None,
        **options: Unpack[Options],
    ) -> None:
        if earlier is not None and not isinstance(earlier, Earlier):
            raise InvalidValueError(
                "earlier trials are learnt by a session's strategy",
                got=earlier,
                remedy="Call strategy.learn_all(trials) before; a log is continued by isiw.resume.",
            )
        self._earlier = Earlier(partial(LogWriter.create, log)) if earlier is None else earlier
        self._console = OperatorConsole(self)
        parts = assembled(self._console, device, strategy, log, self._earlier, options)
        self.log_path, self._header = parts.log_path, parts.header
        self._limits, self._safeguards = parts.limits, parts.safeguards
        self._sink, self._rig, self._examination, self._steps = parts.sink, parts.rig, parts.examination, parts.steps
        self._asking, self._pausing = self._console.asking, parts.pausing
        self._fault: Fault | None = None
        self._console.final = self._header.intervention is not None

    @property
    def header(self) -> Header:
        """The header of the session's log."""
        return self._header

    @property
    def paused(self) -> str | None:
        """Why the session waits for somebody to say whether it goes on; None if it does not."""
        pause = self.pause_waiting
        return None if pause is None else pause.reason

    @property
    def pause_waiting(self) -> Pause | None:
        """The pause that `paused` tells the reason of, with its number."""
        return self._pausing.waiting

    @property
    def state(self) -> State:
        """The state of the session, in the word that people read."""
        wait, was_paused = self.wait, self._asking.over or self._asking.number > 0
        return state_of(
            begun=self._rig.staged_once or bool(self._earlier.first_records) or self._fault is not None or was_paused,
            running=self.running,
            paused=self.pause_waiting is not None,
            rests=wait is not None and wait.rests,
            fault=self._fault is not None,
        )

    @property
    def armed(self) -> bool:
        """True if the device is armed, or being armed or disarmed."""
        return self._rig.is_armed

    @property
    def fault(self) -> Fault | None:
        """What ended the session, if a fault did."""
        return self._fault

    @property
    def wait(self) -> Wait | None:
        """The wait for the next stimulus; None if there is none."""
        return self._sink.wait

    @property
    def readiness(self) -> Readiness | None:
        """The device's state before the last stimulus, as it reported it; None if it reported none yet."""
        return self._rig.limited.last_readiness

    def follow(self, follower: Follower) -> None:
        """Let somebody look on; before `run`. If there is no terminal, who looks on decides about pauses.

        Args:
            follower: gets what is logged; what fails in it does not stop the session.
        """
        self._sink.followers.append(follower)

    def run(self, *, progress: bool | None = None, keys: bool = True) -> SessionResult:
        """Run to the end, and close the log whatever happens.

        Where trials are rejected again and again, or the data look like a slip of unit, it ends before its time with a
        decision that does not stop: its reason says what to do before the session is resumed.

        In a terminal the operator's keys are heard, unless `Safeguards.on_pause` says who decides; ? lists them.

        Args:
            progress: whether to print a row after each trial; by default in a terminal, if there is no `on_trial`.
            keys: whether keys may be heard.

        Raises:
            DeviceError: the device failed; it is stopped, and the trial is a mistrial "outcome unknown". Or another
                session drives it.
            InvalidValueError: a rest or a period of limits or protocol that limits nothing, or limits that do not hold
                the plan of the strategy; nothing was delivered.
            LimitExceededError: a stimulus was refused; nothing was delivered.
            LogError: the log cannot be written, or is no longer at its path; nothing is delivered without a log.
            StrategyError: the strategy knows of trials that are not this session's; nothing more is delivered.
        """
        try:
            return self._run(progress=progress, keys=keys)
        finally:
            self._sink.ended()

    def _run(self, *, progress: bool | None, keys: bool) -> SessionResult:
        require_new(self.strategy, len(self.trials))
        self.require_effect()
        earlier_s, sink = self._earlier_s(), self._sink
        shown = sink.on_trial is None and is_terminal(sys.stdout) if progress is None else progress
        table = Table(self._console, self._header, sink.faults, shown=shown)
        with self._rig.exclusive(), self._earlier.open_log(self._header) as log, sink.writing(log, table):
            try:
                for record in self._earlier.first_records:
                    sink.append(record)
                if self.trials:
                    self._steps.log_estimate()
                self._rig.begin(self._header.given_before + len(self.trials), earlier_s)
                self._take_up_blocks()
                decision = self._steps.at_the_end()  # of a session that was resumed; it need not be armed for nothing
                if decision is None:
                    arms = self._pausing.reason is None  # else Pause or Stop was pressed already
                    with self._operated(keys=keys) as decide, self._rig.armed(at_once=arms):
                        decision = self._loop(decide)
                self._examination.log_faults()
            except BaseException as error:
                self._examination.log_faults()
                self._examination.log_failure(error)
                if not isinstance(error, KeyboardInterrupt):
                    self._fault = self._steps.fault_of(error)
                if not (self._rig.staged_once or self._earlier.first_records):
                    log.discard()
                raise
        intervention = self._header.intervention
        conceals = intervention is not None and intervention.conceals
        return SessionResult(self.strategy.estimate(), decision, self.trials, log.path, conceals)

    @contextmanager
    def _operated(self, *, keys: bool) -> Iterator[Callable[[str], bool]]:
        """Within, the operator's keys are heard, if there is an operator at a terminal; what decides about pauses."""
        if self._safeguards.on_pause is not None:
            yield self._safeguards.on_pause
        elif keys and is_attended():
            with self._console.reading_keys():
                yield self._console.goes_on
        elif self._sink.followers:
            yield lambda _: self._asking.wait(self._sink.nobody)
        else:
            yield goes_on

    def pause(self, reason: str) -> None:
        """Disarm now, and pause before the next stimulus; from any thread, also from `on_trial`.

        `Safeguards.on_pause` or the operator decides how it goes on; if nobody can, the session ends, and can be
        resumed. The reason is shown, and in the log.
        """
        self._pausing.now(reason)

    def go_on(self, number: int | None = None) -> None:
        """Let a paused session go on, as the key r does; from any thread.

        Args:
            number: the pause that is meant, as `pause_waiting` has it; by default whichever there is.

        Raises:
            InvalidValueError: it is not paused, or pauses again, or is to end, or `Safeguards.on_pause` decides.
        """
        self._asking.answer(goes_on=True, number=number)

    def end(self, reason: str) -> None:
        """Disarm now, and end before the next stimulus; from any thread. The session can be resumed later.

        Where a pause is being decided by `Safeguards.on_pause` or in the terminal, it ends as soon as they have
        answered, whatever they answer. The reason is in the log.
        """
        self._pausing.end(reason)

    @property
    def shown_trials(self) -> TrialTable:
        """All trials so far that may be shown: those that would show the concealed arm of an intervention may not."""
        intervention, trials = self._header.intervention, self.trials
        if intervention is None:
            return trials
        return TrialTable(tuple(trial for trial in trials if not intervention.hides(trial.index)))

    @property
    def running(self) -> bool:
        """True if its log is open."""
        return self._sink.is_open

    def require_effect(self) -> None:
        """Raise what `run` raises before there is a log: limits or a protocol that limit nothing, or hold no plan.

        Raises:
            InvalidValueError: a rest or a period of limits or protocol that limits nothing, or limits that do not hold
                the plan of the strategy.
        """
        if not self._earlier.first_records:  # what an earlier log says goes on as it was
            require_limits(self._limits)
            require_protocol(self._header.protocol, self._limits.iti_s)
            require_signals(self._header.signals, self._header.space)
            require_fitting(self.strategy, self._header)
        require_intensities(self.strategy, self._header)

    def _judge(self, verdict: Callable[[TrialTable], Event]) -> None:
        self._examination.judge(verdict)

    def _say(self, doubt: str, category: type[Warning]) -> None:
        if self._console.reads_keys:
            self._console.screen.say(doubt)
        else:
            super()._say(doubt, category)

    def _earlier_s(self) -> list[float]:
        """The ages of earlier stimuli to the same person [s], as far as the logs to look at know."""
        limits, folder = self._limits, self._safeguards.earlier_logs
        if self._header.device.simulated or not (limits.looks_back or self._header.protocol.block_trials):
            return []
        found = [self._earlier.ages()]
        if folder is not None:
            # A block is over in less than a rest for each of its stimuli.
            most_s = max(limits.period_s, limits.rest_s * (limits.max_block_pulses or 1))
            found.append(earlier_pulse_ages(folder, self._header.subject, most_s, but=self.log_path))
        for doubt in dict.fromkeys(doubt for ages in found for doubt in ages.doubts):
            warn(doubt, ClockWarning)
            self._sink.faults.append(doubt)
        return [age_s for ages in found for age_s in ages.ages_s]

    def _log_locked_limits(self) -> None:
        """Log the intensity that the device reported first, so that a resumed session is held to it."""
        limits, intervention = self._rig.limited.limits, self._header.intervention
        if limits != self._header.limits:
            if intervention is not None:
                require_settable(intervention.plan, limits, self._header.device)
            self._header = self._header.model_copy(update={"limits": limits})
            self._sink.append(self._header)

    def _take_up_blocks(self) -> None:
        """Find out how long ago the last pair of an intervention was, if it goes on behind it."""
        if self._header.intervention is not None:
            self._steps.last_pair_came(self._earlier.ago_s(self._header.intervention.plan.last_pair))

    def _log_stop(self, reason: str) -> None:
        """Log that an intervention is over for good, if a person has ended it, and not for lack of anybody."""
        if self._header.intervention is not None and self._asking.refused:
            self._examination.event("stop", f"The intervention was ended: {reason}", durable=True)

    def _loop(self, decide: Callable[[str], bool]) -> StopDecision:
        decision = None
        while decision is None or not decision.stop or self._examination.overruled:
            self._log_locked_limits()
            if self._pausing.due:
                if (reason := self._pausing.until_decided(decide)) is not None:
                    self._log_stop(reason)
                    return ended(reason) if self._asking.over else paused(reason)
                self._steps.seen()
                continue
            try:
                decision = self._steps.next()
            except KeyboardInterrupt:
                if not self._rig.interrupts.heard:
                    raise
            except NotDelivered:
                if not self._pausing.due:
                    raise
        return decision
