"""Logged ask/tell, for labs that keep their own loop: the same log as a session's, written ahead of everything."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from typing import Any, Generic, Self, TypeVar

from isiw import schedule
from isiw.checks import flag, number, text
from isiw.decision import StopDecision
from isiw.devices.allowed import require_intensity, require_isi, require_left, require_state
from isiw.devices.clock import ROUNDING_S, Clock, Pacing
from isiw.errors import ClockWarning, InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.findings import REMEDIES, Finding, Kind, Severity
from isiw.log.headers import Header
from isiw.log.moments import Ages
from isiw.log.new_verdicts import isi_confirmed, isi_doubted, newly_doubted
from isiw.log.schema import Event, Intent
from isiw.log.writer import LogWriter
from isiw.session.earlier import Earlier
from isiw.session.examination import Examination, examination_of, limit_reached
from isiw.session.judging import Judging
from isiw.session.sink import Sink
from isiw.signals.plausible import (
    Doubts,
    counted_of,
    isi_far,
    odd_amplitudes,
    odd_background,
    require_plausible,
    require_plausible_range,
    unconfirmed,
)
from isiw.strategy.outcomes import Outcome
from isiw.strategy.strategy import Strategy
from isiw.summary import IN_DOUBT
from isiw.trials import Status, Stimulus, Trial, TrialTable, require_pulse

RecordedT = TypeVar("RecordedT")


class Recording(Generic[RecordedT]):
    """An examination whose loop is somebody else's, and its open log; as a context manager it closes that."""

    _examination: Examination[Any, Any, RecordedT]
    _pacing: Pacing
    _asked: object = None
    _decide: Callable[[], StopDecision] | None = None  # otherwise than what is learnt decides

    def __init__(self, log: LogWriter, clock: Clock) -> None:
        self._log, self._clock, self._sink = log, clock, Sink(log=log)

    def fail(self, error: BaseException) -> None:
        """Log the error that ended the session, and close the log."""
        try:
            if self._sink.is_open:
                self._examination.log_failure(error)
                self._log.sync()
        finally:
            self.close()

    def close(self) -> None:
        """Close the log; calling it again is harmless."""
        self._log.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            self.close()
        else:
            self.fail(error)

    def _require_durable(self) -> None:
        """Return once everything logged is on the disk, at the log's path; raise LogError where it is not."""
        self._log.sync()
        self._log.require_in_place()

    def _conclude(self, trial: RecordedT) -> None:
        """Put a trial on disk, then learn it, then put on disk what is known.

        Of a log that is no longer at its path the trial is kept all the same: closing saves what the session holds.
        """
        self._pacing.came()
        self._examination.came(trial)
        self._asked = None
        self._require_durable()
        self._examination.conclude(self._decide)


class Recorder(Recording[Trial], Judging):
    """A session whose loop is the lab's own; `isiw.open_session` opens one. As a context manager it closes its log.

    Args:
        strategy: chooses ISIs and learns.
        log: the open log.
        header: what the session is: its limits and its protocol.
        clock: tells the time, and waits.
        earlier: where the session ended before.
        on_doubt: as for `open_session`.
    """

    def __init__(
        self,
        strategy: Strategy,
        log: LogWriter,
        header: Header,
        clock: Clock,
        earlier: Earlier | None = None,
        on_doubt: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__(log, clock)
        self._on_doubt = on_doubt
        trials, events, ages = (earlier.trials, earlier.events, earlier.ages()) if earlier else (None, (), Ages())
        self._examination = examination_of(strategy, self._sink, trials, events)
        self._limits, self._protocol, self._seed = header.limits, header.protocol, header.seed
        self._given_before = header.given_before
        self._asked: Stimulus | None = None
        self._decide = self._within_limits
        self._lock = threading.RLock()
        self._pacing = Pacing(header.limits, clock, ages.ages_s)
        self._detection_limit_mv = header.detection_limit_mv
        self._doubts = Doubts.seen(counted_of(self.trials), self._detection_limit_mv)
        for doubt in ages.doubts if header.limits.looks_back else ():
            self._examination.event("fault", doubt, durable=True)
            self._say(doubt, ClockWarning)

    @property
    def asked(self) -> Stimulus | None:
        """The ISI that was asked and has no outcome yet; None if no trial is open."""
        return self._asked if self._asked is not None and self._asked.trial == len(self.trials) else None

    @property
    def intensity_pct_rmt(self) -> float | None:
        """The intensity of the pair that was asked [% RMT]; None where all pairs of the session have the usual one."""
        if (asked := self.asked) is not None:  # what a verdict since then would choose is another pair's
            return asked.intensity_pct_rmt
        return self.strategy.intensity_pct_rmt

    def _of_pair(self, pct_rmt: float | None) -> float | None:
        """The intensity of a pair as it is logged, by default that which was asked for; None for the usual one."""
        given = self.intensity_pct_rmt if pct_rmt is None else pct_rmt
        return None if given == self.strategy.usual_pct_rmt else given

    def wait_s(self) -> float:
        """Time that `ask` would wait now until limits and protocol allow the next stimulus [s]."""
        if self.asked is not None:
            return 0.0
        return self._pacing.wait_s(schedule.interval_s(self._protocol, len(self.trials), self._seed))

    @property
    def rests(self) -> bool:
        """True if the protocol has a rest before the next trial, and it is not over."""
        return schedule.rests_before(self._protocol, len(self.trials)) and self.wait_s() > 0

    def ask(self, deadline_s: float | None = None) -> float:
        """The next ISI [ms], the same until its outcome; on disk as about to be delivered before this returns.

        Args:
            deadline_s: as for `Strategy.ask` [s].

        Raises:
            LimitExceededError: a limit is reached; deliver nothing.
            LogError: the log cannot be written, or is no longer at its path; deliver nothing.
            StrategyError: the strategy was told of trials by somebody else than this session; deliver nothing.
        """
        while (isi_ms := self._asked_now(deadline_s)) is None:
            self._clock.sleep_s(self.wait_s())  # meanwhile TMS alone can be told, trials judged, and others may ask
        return isi_ms

    def _asked_now(self, deadline_s: float | None) -> float | None:
        """The ISI that is asked [ms], already or from now on; None if limits and protocol allow no stimulus yet."""
        with self._lock:
            self._require_own()
            if self.asked is not None and self.asked.isi_ms is not None:
                self._require_durable()
                return self.asked.isi_ms
            if self.asked is not None:  # TMS alone that was given, and never told
                self._conclude(Trial.unknown(self.asked))
            require_left(self._limits, self._given_before + len(self.trials))
            require_state(self._limits)
            if self.wait_s() > ROUNDING_S:
                return None
            isi_ms = self.strategy.ask(deadline_s)
            require_isi(self._limits, isi_ms)
            require_intensity(self._limits, self.intensity_pct_rmt)
            self._begin(isi_ms, self.strategy.fallback_reason)
            return isi_ms

    def _begin(self, isi_ms: float | None, fallback: str | None = None, *, tap_alone: bool = False) -> None:
        """Put on disk what is about to be delivered."""
        stimulus = Stimulus(len(self.trials), isi_ms, tap_alone, None if isi_ms is None else self.intensity_pct_rmt)
        self._examination.intend(Intent.of(stimulus, self._clock.now_s()), fallback)
        self._sink.log.require_in_place()
        self._asked = stimulus

    def tell(  # noqa: PLR0913 - what may be known of an outcome
        self,
        isi_ms: float | None,
        mep_mv: float | None = None,
        *,
        isi_sd_ms: float = 0.0,
        background_rms_uv: float | None = None,
        mep_sd_mv: float = 0.0,
        mep_interval_mv: tuple[float, float] | None = None,
        pulse: bool = True,
        confirm: bool = False,
        intensity_pct_rmt: float | None = None,
    ) -> None:
        """Report the outcome of the ISI that was asked; it is on disk before the strategy learns it.

        After three realised ISIs that are far from those asked, the trials since the first do not count and no window
        is reported, until the next `tell` confirms them, or they are excluded.

        Args:
            isi_ms: the realised ISI on the space's reference [ms]; None is TMS alone, which was given without being
                asked for. It counts for all limits, and `wait_s` says when it may be given.
            mep_mv: peak-to-peak amplitude [mV]; 0 is below the detection limit.
            isi_sd_ms: SD of the realised ISI [ms]; 0 if it was measured.
            background_rms_uv: EMG before the pulse [µV RMS], if known.
            mep_sd_mv: as for `Strategy.tell` [mV].
            mep_interval_mv: as for `Strategy.tell` [mV].
            pulse: False is a tap alone, as for `Strategy.tell`, which was given without a request.
            confirm: whether all realised ISIs are right, however far from those asked; it is logged.
            intensity_pct_rmt: as for `Strategy.tell` [% RMT]; of a pair by default the one that was asked for. One
                beyond the limits is learnt, and an event of the log says so.

        Raises:
            InvalidValueError: nothing was asked, a value that cannot be, a slip of unit or order, a pulse before the
                impact, an ISI that is too uncertain, an intensity of a tap alone, or earlier ISIs that are to be
                confirmed; the outcome is not logged, and the right value can be given. TMS alone counts as given
                from the first try on.
            OutOfSpaceError: an ISI beyond the space and its tolerance.
            LogError: the log cannot be written, or is no longer at its path; closing saves the outcome with the rest.
            StrategyError: as for `ask`; the outcome is logged.

        Warns:
            ImplausibleDataWarning: what looks like a slip of unit; it is learnt and logged all the same.
        """
        pulse = flag("pulse", pulse)
        with self._lock:
            self._examination.conclude(self._decide)
            if (isi_ms is None or not pulse) and self.asked is None:  # it was given, whatever the limits allow
                self._begin(None, tap_alone=not pulse)
                if self._given_before + len(self.trials) >= self._limits.max_pulses:
                    self._examination.event("limit", f"TMS alone was given beyond {self._limits.max_pulses} pulses.")
            require_pulse(intensity_pct_rmt, tap_alone=not pulse)
            if isi_ms is not None and pulse:
                intensity_pct_rmt = self._of_pair(intensity_pct_rmt)
            outcome = Outcome(isi_ms, mep_mv, None, isi_sd_ms, mep_sd_mv, mep_interval_mv, None, intensity_pct_rmt)
            self.strategy.require_law(outcome)
            self._tell(outcome, background_rms_uv, pulse=pulse, confirm=flag("confirm", confirm))

    def _tell(self, outcome: Outcome, background_rms_uv: float | None, *, pulse: bool, confirm: bool) -> None:
        isi_ms, mep_mv, space = outcome.isi_ms, outcome.mep_mv, self.strategy.space
        isi_ms = None if isi_ms is None else number("a realised ISI [ms]", isi_ms)
        asked = self._require_asked()
        require_plausible(isi_ms, mep_mv, asked.isi_ms, space, outcome.isi_sd_ms)
        require_plausible_range(outcome.mep_sd_mv, outcome.mep_interval_mv, outcome.intensity_pct_rmt)
        isi_ms = None if isi_ms is None else space.check_realised(isi_ms)
        if (isi_ms is None or not pulse) != (asked.isi_ms is None) or asked.tap_alone is pulse:
            raise InvalidValueError(
                "the outcome is not of the kind of trial that was requested",
                got=f"the outcome of {_kind(isi_ms, tap_alone=not pulse)}",
                expected=f"the outcome of {_kind(asked.isi_ms, tap_alone=asked.tap_alone)}",
                remedy="Tell that first, or call mistrial().",
            )
        trial = Trial(asked.trial, Status.ACCEPTED, asked.isi_ms, isi_ms=isi_ms, mep_mv=mep_mv,
                      isi_sd_ms=outcome.isi_sd_ms, background_rms_uv=background_rms_uv, tap_alone=not pulse,
                      mep_sd_mv=outcome.mep_sd_mv, mep_interval_mv=outcome.mep_interval_mv,
                      intensity_pct_rmt=outcome.intensity_pct_rmt)  # fmt: skip
        if self.in_doubt and asked.isi_ms is not None:
            self._confirm(confirm=confirm)
        self._log_beyond(trial)
        self._conclude(trial)
        if self._put_in_doubt():
            return
        odd = isi_far(isi_ms, asked.isi_ms, space), odd_background(background_rms_uv)
        amplitudes = odd_amplitudes(counted_of(self.trials), self._detection_limit_mv)
        self._doubts = self._doubts.after((*odd, *amplitudes))
        if self._doubts.new is not None:
            self._warn(self._doubts.new)

    def _log_beyond(self, trial: Trial) -> None:
        """Log that a pulse was stronger than the limits allow, ahead of its trial: it was given all the same."""
        most, pct_rmt = self._limits.max_intensity_pct_rmt, trial.intensity_pct_rmt
        if most is not None and pct_rmt is not None and pct_rmt > most:
            beyond = f"A pulse was given at {pct_rmt:g} % RMT, beyond the limit of {most:g} % RMT."
            self._examination.event("limit", beyond, trial.index)

    def _confirm(self, *, confirm: bool) -> None:
        """Let the trials in doubt count where they are confirmed, and raise where they are not."""
        if not confirm:
            wrong = "exclude those trials, put your loop right, and report this outcome again"
            raise unconfirmed(self.in_doubt, self.strategy.space, wrong)
        for trial in self.in_doubt:
            self._examination.judge(lambda _, trial=trial: isi_confirmed(trial))  # type: ignore[misc]
        self._examination.conclude(self._decide)

    def _put_in_doubt(self) -> bool:
        """Let trials not count whose realised ISIs are in doubt, and say so; True if there are any."""
        found = newly_doubted(self.trials, self._examination.events, self.strategy.space)
        for trial in found:
            self._examination.judge(lambda _, trial=trial: isi_doubted(trial))  # type: ignore[misc]
        if found:
            self._examination.conclude(self._decide)
            self._doubts = self._doubts.after((IN_DOUBT,))
            self._warn(IN_DOUBT)
        return bool(found)

    def mistrial(self, reason: Kind | str) -> None:
        """That the trial of the ISI that was asked is lost: it counts as a stimulus, and is not learnt.

        Args:
            reason: a `Kind` or its value; any other text is logged as a note, under "rejected".

        Raises:
            InvalidValueError: nothing was asked, or a reason that is no text.
            LogError: the log cannot be written.

        Warns:
            ImplausibleDataWarning: as many mistrials in a row as pause a session.
        """
        known = Kind.of_mistrial(reason := text("the reason of a mistrial", reason))
        with self._lock:
            self._examination.conclude(self._decide)
            asked = self._require_asked()
            if known != reason:
                self._examination.note(reason, trial=asked.trial)
            own: Any = {"tap_alone": asked.tap_alone, "intensity_pct_rmt": self._of_pair(asked.intensity_pct_rmt)}
            self._conclude(Trial(asked.trial, Status.MISTRIAL, asked.isi_ms, known, **own))
        lost = len(list(itertools.takewhile(lambda trial: trial.reason is not None, reversed(self.trials.trials))))
        if lost == self._limits.max_consecutive_mistrials:
            mistrials = "1 mistrial" if lost == 1 else f"{lost} mistrials in a row, the last one"
            self._warn(Finding(known, Severity.DOUBT, f"{mistrials}: {known}", REMEDIES[known]))

    def _judge(self, verdict: Callable[[TrialTable], Event]) -> None:
        with self._lock:
            self._examination.judge(verdict)
            self._examination.conclude(self._decide)

    def estimate(self) -> WindowEstimate:
        """The estimate of the window now."""
        with self._lock:
            self._require_own()
            return self.strategy.estimate()

    def decision(self) -> StopDecision:
        """The decision to stop now or not, with its reason; where the limits allow no further pulse, to stop."""
        with self._lock:
            self._require_own()
            return self._within_limits()

    def _within_limits(self) -> StopDecision:
        """The strategy's decision, or the limits' own."""
        decision, most, before = self._examination.learner.decision(), self._limits.max_pulses, self._given_before
        is_last = self.asked is None and before + len(self.trials) >= most
        return limit_reached(most, before) if is_last and not decision.stop else decision

    def _require_own(self) -> None:
        """Learn what is not learnt yet, and raise if the strategy knows anything else."""
        self._examination.conclude(self._decide)
        self._examination.require_own()

    def _require_asked(self) -> Stimulus:
        if self.asked is None:
            raise InvalidValueError(
                "no trial is waiting for an outcome", remedy="Call ask() first, then deliver, then tell()."
            )
        return self.asked

    def _say(self, doubt: str, category: type[Warning]) -> None:
        if self._on_doubt is not None:
            self._on_doubt(doubt)
        else:
            super()._say(doubt, category)


def _kind(isi_ms: float | None, *, tap_alone: bool) -> str:
    """Which kind of trial it is, in words."""
    return "a tap alone" if tap_alone else "TMS alone" if isi_ms is None else f"a pair at {isi_ms:g} ms"
