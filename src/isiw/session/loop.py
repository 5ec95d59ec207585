"""The closed loop: ask, log the intent, deliver, judge, log the trial, tell.

What is on disk is always ahead of what happens next: the intent before its stimulus, the trial before it is told.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from isiw.checks import deadline, number, text
from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device
from isiw.errors import InvalidValueError, NotDelivered, StrategyError, told
from isiw.log.pulses import earlier_pulses_s
from isiw.log.schema import Event, Header, Record
from isiw.log.writer import LogWriter
from isiw.session.delivery import Delivery
from isiw.session.desk import Desk
from isiw.session.following import Follower, Followers
from isiw.session.header import header_of, require_parts
from isiw.session.journal import Journal
from isiw.session.judging import Judging
from isiw.session.pausing import Pause, Pausing
from isiw.session.progress import fitted, progress_row, show_legend, show_progress, standing
from isiw.session.rig import Rig, require_matching
from isiw.session.safeguards import Safeguards
from isiw.session.steps import Steps, ended, paused
from isiw.session.terminal import is_terminal, somebody_there
from isiw.session.updates import SessionResult, SessionUpdate
from isiw.signals.limits import SignalLimits
from isiw.signals.watch import Watch
from isiw.strategy.stopping import StopDecision
from isiw.strategy.strategy import Strategy
from isiw.trials import TrialTable
from isiw.visit import Visit, VisitProtocol

__all__ = ["Session"]


class Session(Judging):
    """One person's session, from the first ask to the decision.

    While it runs, an operator may note, exclude, include, accept and reject, from any thread and from `on_trial`.

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
        visit: what is noted about the visit, for the log.
        protocol: intervals, control trials, blocks and rests.

    Raises:
        DeviceError: the device counts its ISIs from another event than the space, or states another detection limit
            than the strategy's, or is not simulated and has a virtual clock, or delivers no tap alone where the
            protocol has some.
        InvalidValueError: a part that is something else than it should be, a time that is no positive number, a channel
            whose name or unit a session cannot use, or earlier logs without a subject to find in them.
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
        visit: Visit | None = None,
        protocol: VisitProtocol | None = None,
    ) -> None:
        self.log_path = require_parts(
            log,
            device=(device, Device),
            strategy=(strategy, Strategy),
            limits=(limits, Limits | None),
            visit=(visit, Visit | None),
            protocol=(protocol, VisitProtocol | None),
        )
        visit, protocol, self._safeguards = visit or Visit(), protocol or VisitProtocol(), safeguards or Safeguards()
        self._limits = limits or Limits.of_space(strategy.space)
        self._rig = Rig(device, self._limits, clock, self._safeguards)
        require_matching(self._rig.info, strategy, protocol)
        self._on_trial = on_trial
        self._header = header_of(
            strategy,
            subject=text("subject", subject),
            visit=visit,
            protocol=protocol,
            limits=self._limits,
            device=self._rig.info,
            signals=signals or SignalLimits(),
            timeout_s=number("timeout_s", timeout_s, above=0),
            ask_deadline_s=deadline("ask_deadline_s", ask_deadline_s),
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
        self._journal, self._space = Journal(), strategy.space
        self._pausing = Pausing(self._rig, self._journal, self._safeguards)
        self._followers = Followers(self._rig.faults)
        self._steps = self._steps_with(strategy)

    def _steps_with(self, strategy: Strategy) -> Steps:
        header, rig, journal, pausing = self._header, self._rig, self._journal, self._pausing
        max_in_a_row = header.limits.max_consecutive_mistrials
        watch = Watch(header.space, header.signals, max_in_a_row, header.detection_limit_mv)
        delivery = Delivery(rig, journal, pausing, watch, header.space, header.signals, header.timeout_s)
        return Steps(strategy, rig, journal, pausing, delivery, header, self._safeguards.backoffs_s)

    @property
    def strategy(self) -> Strategy:
        """What proposes ISIs and learns; another object once a trial was judged anew."""
        return self._steps.strategy

    @property
    def header(self) -> Header:
        """What the session is, as its log says it."""
        return self._header

    @property
    def paused(self) -> str | None:
        """Why the session waits for somebody to say whether it goes on; None where it does not."""
        pause = self.pause_waiting
        return None if pause is None else pause.reason

    @property
    def pause_waiting(self) -> Pause | None:
        """The pause that `paused` tells the reason of, with its number."""
        return self._pausing.waiting

    def follow(self, follower: Follower) -> None:
        """Let somebody look on; before `run`. Where there is no terminal, pauses are decided by who looks on.

        Args:
            follower: is told what is logged; what fails in it does not stop the session.
        """
        self._followers.add(follower)

    def continue_from(
        self,
        trials: TrialTable,
        header: Header,
        open_log: Callable[[Header], LogWriter],
        first_records: Sequence[Record],
        earlier_s: Callable[[], Sequence[float]] = tuple,
        events: Sequence[Event] = (),
    ) -> None:
        """Begin where another run ended; `isiw.resume` does this for you.

        Args:
            trials: what was delivered before; the strategy has learned it.
            header: this session's, with what it keeps of the log's.
            open_log: opens the log that goes on, with that header.
            first_records: what it holds next.
            earlier_s: says how long ago each stimulus before was [s].
            events: what happened before.
        """
        self._journal.begin_after(trials, events)
        self._header = header
        self._open_log, self._first_records = open_log, first_records
        self._own_earlier_s, self._resumed = earlier_s, True
        pauses = [event.finding for event in events if event.kind == "pause" and event.finding is not None]
        self._steps.delivery.watch = self._steps.delivery.watch.resumed(trials, pauses)

    def run(self, *, progress: bool | None = None, keys: bool = True) -> SessionResult:
        """Run to the end, and close the log whatever happens.

        Where trials are rejected again and again, or the data look like a slip of unit, it ends before its time with a
        decision that does not stop: its reason says what to do before the session is resumed.

        In a terminal the operator's keys are heard, unless `Safeguards.on_pause` says who decides; ? lists them.

        Args:
            progress: whether to print a row after each trial; by default in a terminal, where there is no `on_trial`.
            keys: whether keys may be heard.

        Raises:
            DeviceError: the device failed; it is stopped, and the trial is a mistrial "outcome unknown". Or another
                session drives it.
            InvalidValueError: a rest or a period of limits or protocol that limits nothing; nothing was delivered.
            LimitExceededError: a stimulus was refused; nothing was delivered.
            LogError: the log cannot be written, or is no longer at its path; nothing is delivered without a log.
            StrategyError: the strategy knows of trials that are not this session's; nothing was delivered.
        """
        try:
            return self._run(progress=progress, keys=keys)
        finally:
            self._followers.ended()

    def _run(self, *, progress: bool | None, keys: bool) -> SessionResult:
        self._require_own_strategy()
        self._require_effect()
        earlier_s = self._earlier_s()
        self._steps.on_trial = self._reporting(progress=progress)
        with self._rig.driven(), self._open_log(self._header) as log, self._journal.writing(log):
            self._rig.log, log.on_append = log, self._followers.logged
            try:
                self._log_beginning()
                self._rig.begin(len(self.trials), earlier_s)
                decision = self._steps.at_the_end()  # of a session that was resumed; it need not be armed for nothing
                if decision is None:
                    with self._operated(keys=keys), self._rig.armed():
                        self._log_locked_limits()
                        decision = self._loop()
                self._journal.faults(self._rig.faults)
            except BaseException as error:
                self._journal.faults(self._rig.faults)
                self._journal.failure(error)
                if not (self._rig.staged_once or self._resumed):
                    log.discard()
                raise
        return SessionResult(self.strategy.estimate(), decision, self.trials, log.path)

    def _reporting(self, *, progress: bool | None) -> Callable[[SessionUpdate], None] | None:
        """What is called after every trial."""
        shown = self._on_trial is None and is_terminal(sys.stdout) if progress is None else progress
        if shown:
            show_legend()

        def report(update: SessionUpdate) -> None:
            nonlocal shown
            self._followers.updated(update)
            if shown:
                try:
                    self._show(update)
                except (OSError, UnicodeError) as error:  # a full disk, a reader who has gone, a sign that is lacking
                    self._rig.faults.append(f"the table of trials cannot be shown any more: {told(error)}")
                    shown = False
            if self._on_trial is not None:
                self._on_trial(update)

        return report if shown or self._followers else self._on_trial

    def _show(self, update: SessionUpdate) -> None:
        """Show a trial: in a terminal with a last line that says how the session stands."""
        row, desk = progress_row(update, self.header.stimulus), self._steps.desk
        if desk is not None and is_terminal(sys.stdout):
            desk.show(fitted(row), standing(update, self._space))
        else:
            show_progress(row)
        if desk is not None:
            desk.shown = update.trial.index

    @contextmanager
    def _operated(self, *, keys: bool) -> Iterator[None]:
        """Within, the operator's keys are heard, where there is an operator at a terminal."""
        if self._safeguards.on_pause is None and self._followers:
            self._pausing.decide = lambda _: self._pausing.asking.wait(self._followers.nobody)
        if not keys or self._safeguards.on_pause is not None or not somebody_there():
            yield
            return
        desk = Desk(self, self._pausing.asking)
        with desk.staffed():
            self._steps.desk, self._pausing.decide, self._rig.interrupts.away = desk, desk.goes_on, desk.away
            try:
                yield
            finally:
                self._rig.interrupts.away = nullcontext

    def pause(self, reason: str) -> None:
        """Disarm now, and pause before the next stimulus; from any thread, also from `on_trial`.

        `Safeguards.on_pause` or the operator decides how it goes on; where nobody can, the session ends, and can be
        resumed.

        Args:
            reason: why, for the operator and the log.
        """
        self._pausing.now(reason)

    def go_on(self, number: int | None = None) -> None:
        """Let a paused session go on, as the key r does; from any thread.

        Args:
            number: the pause that is meant, as `pause_waiting` has it; by default whichever there is.

        Raises:
            InvalidValueError: it is not paused, or pauses anew, or is to end, or `Safeguards.on_pause` decides.
        """
        self._pausing.asking.answer(goes_on=True, number=number)

    def end(self, reason: str) -> None:
        """Disarm now, and end before the next stimulus; from any thread. The session can be resumed later.

        Where a pause is being decided by `Safeguards.on_pause` or in the terminal, it ends as soon as they have
        answered, whatever they answer.

        Args:
            reason: why, for the log.
        """
        self._pausing.end(reason)

    @property
    def running(self) -> bool:
        """Whether its log is open."""
        return self._journal.is_open

    def _judge(self, verdict: Callable[[TrialTable], Event]) -> None:
        self._journal.judge(verdict)

    def _require_own_strategy(self) -> None:
        if self.strategy.delivered > len(self.trials):
            raise StrategyError(
                "the strategy knows of trials that are not this session's",
                got=f"{self.strategy.delivered} trials",
                expected=f"{len(self.trials)} trials",
                remedy="Make a new one, or give the session strategy.restarted().",
            )

    def _require_effect(self) -> None:
        if not self._resumed:  # what an earlier log says goes on as it was
            self._limits.require_effect()
            self._header.protocol.require_effect(self._limits.min_iti_s)
            self._header.signals.require_behind_artefact()

    def _earlier_s(self) -> list[float]:
        """How long ago each earlier stimulus was to the same person, as far as the logs to look at know [s]."""
        limits, folder = self._limits, self._safeguards.earlier_logs
        matter = (limits.max_block_pulses, limits.max_period_pulses, self._header.protocol.block_trials)
        if self._header.device.simulated or not any(matter):
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
            self._steps.log_estimate(len(self.trials) - 1)

    def _log_locked_limits(self) -> None:
        """Log the intensity that the device reported when it was armed, so that a resumed session is held to it."""
        if self._rig.limits != self._header.limits:
            self._header = self._header.model_copy(update={"limits": self._rig.limits})
            self._journal.log.append(self._header)

    def _loop(self) -> StopDecision:
        decision = None
        while decision is None or not decision.stop or self._journal.overruled:
            if self._pausing.due:
                if (reason := self._pausing.until_decided()) is not None:
                    return ended(reason) if self._pausing.asking.over else paused(reason)
                self._steps.delivery.watch = self._steps.delivery.watch.seen()
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
