"""Logged ask/tell, for labs that keep their own loop: the same log as a session's, written ahead of everything."""

from __future__ import annotations

import itertools
import threading
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from isiw.checks import number, text
from isiw.devices.clock import Clock, MonotonicClock
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo, Readiness
from isiw.errors import ImplausibleDataWarning, InvalidValueError, StrategyError
from isiw.log.durable import part_of
from isiw.log.reader import read_salvaged
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Header
from isiw.log.writer import LogWriter
from isiw.session.believed import believed
from isiw.session.header import header_of, require_parts
from isiw.session.journal import Journal, learn, relearned
from isiw.session.judging import Judging
from isiw.session.replay import replay, warn_where_differing
from isiw.session.resume import ages_s, as_resumed, require_same_person, resumption, with_lost_pulses
from isiw.signals.faults import remedy_for
from isiw.signals.judgement import SignalLimits
from isiw.signals.plausibility import doubt_of, doubts_of, require_plausible
from isiw.strategy.stopping import StopDecision
from isiw.strategy.strategy import Strategy
from isiw.trials import MistrialReason, Status, Stimulus, Trial, TrialTable
from isiw.visit import Visit, VisitProtocol
from isiw.window import WindowEstimate

__all__ = ["OWN_LOOP", "Recorder", "open_session"]

OWN_LOOP = "a loop of the lab's own"
"""What the log calls the device of such a session."""


def open_session(  # noqa: PLR0913 - all but two are keyword-only
    strategy: Strategy,
    log: str | Path,
    *,
    resume: bool = False,
    limits: Limits | None = None,
    clock: Clock | None = None,
    subject: str = "",
    visit: Visit | None = None,
    protocol: VisitProtocol | None = None,
    config: Mapping[str, Any] | None = None,
    lost_pulses: int | None = None,
    on_doubt: Callable[[str], None] | None = None,
) -> Recorder:
    """Open a session whose loop is your own: ask it for ISIs, and tell it what came of them.

    Args:
        strategy: proposes ISIs and learns; of a session that goes on, made with the same settings and seed.
        log: where the log is; it must not exist yet, unless the session goes on.
        resume: whether to go on with the log where there is one. What was asked and has no outcome in it becomes a
            mistrial.
        limits: what may be asked; the strategy's space and 200 pulses by default, without an inter-trial interval; of a
            session that goes on, the logged ones by default. Limits of the coil and of the intensity allow nothing, as
            nobody reports these here.
        clock: tells the time, and waits in `ask` until the interval, the rest and the period of the limits have passed,
            before the first stimulus, too, as nobody knows what came before.
        subject: the person's code, for the log; of a session that goes on, the logged one by default.
        visit: what is noted about the visit, for the log; of a session that goes on, the logged one by default.
        protocol: intervals, blocks and rests, which `ask` waits for; of a session that goes on, the logged one by
            default. Control trials are the loop's own: `tell(None, …)` is TMS alone.
        config: anything that should be kept in the log, as TOML values; of a session that goes on, what is logged by
            default.
        lost_pulses: as for `isiw.resume`: needed where the end of the log is missing.
        on_doubt: called with what looks like a slip in what was told, or like a rig that needs somebody to look; by
            default a warning.

    Raises:
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        DeviceError: the log is of a simulated device.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there; a subject that is no text,
            or another than the log's; a protocol with control trials.
        LogError: there is a log already, or it cannot be written or read.
        StrategyError: the strategy knows of trials already, or asks something else than the log says it asked.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    path = require_parts(
        log,
        strategy=(strategy, Strategy),
        limits=(limits, Limits | None),
        visit=(visit, Visit | None),
        protocol=(protocol, VisitProtocol | None),
    )
    if strategy.delivered:
        raise StrategyError(
            "the strategy knows of trials that are not this session's",
            got=f"{strategy.delivered} trials",
            remedy="Make it anew, or give the session strategy.restarted().",
        )
    header = header_of(
        strategy,
        subject=text("subject", subject),
        visit=visit or Visit(),
        protocol=_without_controls(protocol or VisitProtocol()),
        limits=limits or Limits.of_space(strategy.space, min_iti_s=0.0),
        device=DeviceInfo(OWN_LOOP, strategy.space.reference),
        signals=SignalLimits(),
        config=dict(config or {}),
    )
    clock = clock or MonotonicClock()
    if not (resume and (path.exists() or part_of(path).exists())):
        return Recorder(strategy, LogWriter.create(path, header), header, clock, on_doubt=on_doubt)
    given = {"subject": subject, "visit": visit, "protocol": protocol, "limits": limits, "config": config}
    unsaid = {name for name, value in given.items() if value is None or value == ""}
    return _resumed(strategy, path, header, unsaid, lost_pulses, clock, on_doubt)


def _resumed(
    strategy: Strategy,
    path: Path,
    header: Header,
    unsaid: Iterable[str],
    lost_pulses: int | None,
    clock: Clock,
    on_doubt: Callable[[str], None] | None,
) -> Recorder:
    """The session of a log, from where it ends; what nobody said anew is as it was logged."""
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    require_same_person(header, record.header)
    record = with_lost_pulses(record, lost_pulses)
    replayed = replay(record, strategy)
    warn_where_differing(replayed, record.header)
    logged = {name: getattr(record.header, name) for name in unsaid}
    header = as_resumed(header.model_copy(update=logged), record.header, replayed)
    writer = LogWriter.continuing(path, salvaged, record.header, header)
    ages = ages_s(salvaged, len(replayed.trials))
    for trial in replayed.unknown:
        writer.append(trial)
    writer.append(resumption(record, replayed))
    if record.is_judged_since:
        strategy = replayed.strategy
        writer.append(believed(strategy, len(replayed.trials) - 1, strategy.decision(), None))
    writer.sync()
    return Recorder(replayed.strategy, writer, header, clock, replayed.trials, ages, on_doubt)


def _without_controls(protocol: VisitProtocol) -> VisitProtocol:
    if protocol.tms_alone or protocol.tap_alone:
        raise InvalidValueError(
            "in a loop of one's own the protocol cannot have control trials, as ask() answers with an ISI",
            got=protocol,
            remedy="Give TMS alone whenever you like, and tell it with tell(None, mep_mv). isiw.Session interleaves "
            "control trials itself.",
        )
    return protocol


class Recorder(Judging):
    """A session whose loop is the lab's own; `isiw.open_session` opens one. As a context manager it closes its log.

    Args:
        strategy: proposes ISIs and learns.
        log: the open log.
        header: what the session is: its limits and its protocol.
        clock: tells the time, and waits.
        trials: what was delivered before; the strategy has learned it.
        earlier_s: how long ago each of these was [s].
        on_doubt: as for `open_session`.
    """

    def __init__(
        self,
        strategy: Strategy,
        log: LogWriter,
        header: Header,
        clock: Clock,
        trials: TrialTable | None = None,
        earlier_s: Sequence[float] = (),
        on_doubt: Callable[[str], None] | None = None,
    ) -> None:
        self.strategy, self._journal, self._space = strategy, Journal(trials), strategy.space
        self._log, self._clock, self._on_doubt = log, clock, on_doubt
        self._limits, self._protocol, self._seed = header.limits, header.protocol, header.seed
        self._open = ExitStack()
        self._open.enter_context(self._journal.writing(log))
        self._asked: Stimulus | None = None
        self._lock = threading.RLock()
        now_s = clock.now_s()
        self._made_s = now_s
        self._times_s = [now_s - age_s for age_s in sorted(earlier_s, reverse=True)]
        self._detection_limit_mv = header.detection_limit_mv
        self._doubted = set(doubts_of(self._meps_mv, self._detection_limit_mv))

    @property
    def _meps_mv(self) -> list[float]:
        return [trial.mep_mv for trial in self.trials.told if trial.mep_mv is not None]

    @property
    def asked(self) -> Stimulus | None:
        """What was asked and has no outcome yet; None where nothing is open."""
        return self._asked if self._asked is not None and self._asked.trial == len(self.trials) else None

    def wait_s(self) -> float:
        """How long `ask` would wait now until limits and protocol allow the next stimulus [s]."""
        if self.asked is not None:
            return 0.0
        return max(0.0, self._earliest_s(len(self.trials)) - self._clock.now_s())

    def ask(self, deadline_s: float | None = None) -> float:
        """The next ISI [ms], the same until its outcome; on disk as about to be delivered before this returns.

        Args:
            deadline_s: as for `Strategy.ask` [s].

        Raises:
            LimitExceededError: a limit is reached; deliver nothing.
            LogError: the log cannot be written, or is no longer at its path; deliver nothing.
        """
        with self._lock:
            if self.asked is not None and self.asked.isi_ms is not None:
                return self.asked.isi_ms
            if self.asked is not None:  # TMS alone that was given, and never told
                self._conclude(Trial.unknown(self.asked))
        self._wait()
        with self._lock:
            self._catch_up()
            isi_ms = self.strategy.ask(deadline_s)
            self._limits.require_isi(isi_ms)
            self._begin(isi_ms, self.strategy.fallback_reason)
            return isi_ms

    def _wait(self) -> None:
        """Wait until limits and protocol allow the next stimulus; meanwhile trials can be judged."""
        self._limits.require_left(len(self.trials))
        self._limits.require_state(Readiness())
        self._clock.sleep_s(self._earliest_s(len(self.trials)) - self._clock.now_s())

    def _begin(self, isi_ms: float | None, fallback: str | None = None) -> None:
        """Put on disk what is about to be delivered."""
        stimulus = Stimulus(len(self.trials), isi_ms)
        self._journal.intent(stimulus, self._clock.now_s(), fallback)
        self._journal.log.require_in_place()
        self._asked = stimulus

    def _catch_up(self) -> None:
        """Learn all trials anew where one was judged since, or learning one was interrupted."""
        if self._journal.overruled or self.strategy.delivered < len(self.trials):
            self.strategy, self._journal.overruled = relearned(self.strategy, self.trials), False
            if self._journal.is_open:
                self._log_estimate(len(self.trials) - 1)

    def _earliest_s(self, trial: int) -> float:
        """When limits and protocol allow a trial, by the clock [s]."""
        last_s = self._times_s[-1] if self._times_s else self._made_s
        return max(
            self._limits.earliest_s(self._times_s, self._made_s),
            last_s + self._protocol.interval_s(trial, self._seed),
        )

    def tell(
        self,
        isi_ms: float | None,
        mep_mv: float,
        *,
        isi_sd_ms: float = 0.0,
        background_rms_uv: float | None = None,
    ) -> None:
        """What came of the ISI that was asked; it is on disk before the strategy learns it.

        Args:
            isi_ms: the realised ISI on the space's reference [ms]; None is TMS alone, which was given without being
                asked for. It counts for all limits, and `wait_s` says when it may be given.
            mep_mv: peak-to-peak amplitude [mV]; 0 is below the detection limit.
            isi_sd_ms: SD of the realised ISI [ms]; 0 where it was measured.
            background_rms_uv: EMG before the pulse [µV RMS], where known.

        Raises:
            InvalidValueError: nothing was asked, a value that cannot be, or a slip of unit or order; the outcome is not
                logged, and the right value can be told. TMS alone counts as given from the first try on.
            OutOfSpaceError: an ISI beyond the space and its tolerance.
            LogError: the log cannot be written.

        Warns:
            ImplausibleDataWarning: what looks like a slip of unit; it is told and logged all the same.
        """
        with self._lock:
            self._tell(isi_ms, mep_mv, isi_sd_ms, background_rms_uv)

    def _tell(self, isi_ms: float | None, mep_mv: float, isi_sd_ms: float, background_rms_uv: float | None) -> None:
        self._catch_up()
        if isi_ms is None and self.asked is None:
            self._begin(None)  # given already, and logged whatever the limits allow
            if len(self.trials) >= self._limits.max_pulses:
                self._journal.event("limit", f"TMS alone was given beyond {self._limits.max_pulses} pulses.")
        mep_mv = number("mep_mv", mep_mv, least=0)
        isi_ms = None if isi_ms is None else number("a realised ISI [ms]", isi_ms)
        asked = self._require_asked()
        doubt = require_plausible(isi_ms, mep_mv, asked.isi_ms, self.strategy.space)
        isi_ms = None if isi_ms is None else self.strategy.space.check_realised(isi_ms)
        if (isi_ms is None) != (asked.isi_ms is None):
            raise InvalidValueError(
                "the outcome is another kind of trial than the one that was asked",
                got=isi_ms,
                expected=f"the outcome of {'TMS alone' if asked.isi_ms is None else f'{asked.isi_ms:g} ms'}",
                remedy="Tell that first, or call mistrial().",
            )
        trial = Trial(asked.trial, Status.ACCEPTED, asked.isi_ms, isi_ms=isi_ms, mep_mv=mep_mv,
                      isi_sd_ms=isi_sd_ms, background_rms_uv=background_rms_uv)  # fmt: skip
        self._conclude(trial)
        doubt = doubt or doubt_of(self._meps_mv, self._detection_limit_mv)
        if doubt is not None and doubt.kind not in self._doubted:
            self._doubted.add(doubt.kind)
            self._warn(doubt.text)

    def mistrial(self, reason: MistrialReason | str) -> None:
        """That the trial of the ISI that was asked is lost: it counts as a stimulus, and is not told.

        Args:
            reason: a `MistrialReason` or its value; any other text is logged as a note, under "rejected".

        Raises:
            InvalidValueError: nothing was asked.
            LogError: the log cannot be written.

        Warns:
            ImplausibleDataWarning: as many mistrials in a row as pause a session.
        """
        known = next((each for each in MistrialReason if each == reason), MistrialReason.REJECTED)
        with self._lock:
            self._catch_up()
            asked = self._require_asked()
            if known != reason:
                self._journal.note(str(reason), trial=asked.trial)
            self._conclude(Trial(asked.trial, Status.MISTRIAL, asked.isi_ms, known))
        lost = len(list(itertools.takewhile(lambda trial: trial.reason is not None, reversed(self.trials.trials))))
        if lost == self._limits.max_consecutive_mistrials:
            self._warn(f"{lost} trials in a row were lost: {known}. {remedy_for(known)}")

    def _judge(self, verdict: Callable[[TrialTable], Event]) -> None:
        with self._lock:
            self._journal.judge(verdict)
            self._catch_up()

    def estimate(self) -> WindowEstimate:
        """What is believed about the window now."""
        with self._lock:
            self._catch_up()
            return self.strategy.estimate()

    def decision(self) -> StopDecision:
        """Whether to stop now, and why."""
        with self._lock:
            self._catch_up()
            return self.strategy.decision()

    def close(self) -> None:
        """Close the log; calling it again is harmless."""
        self._open.close()
        self._log.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is not None:
                self._journal.failure(error)
                self._log.sync()
        finally:
            self.close()

    def _require_asked(self) -> Stimulus:
        if self.asked is None:
            raise InvalidValueError(
                "nothing was asked whose outcome this could be", remedy="Call ask() first, then deliver, then tell()."
            )
        return self.asked

    def _conclude(self, trial: Trial) -> None:
        """Put a trial on disk, then learn it, then put on disk what is believed."""
        self._times_s.append(self._clock.now_s())
        self._journal.trial(trial)
        self._log.sync()
        learn(self.strategy, trial)
        if trial.told and self.strategy.trouble is not None:
            self._log.append(Event(kind="fit", trial=trial.index, text=self.strategy.trouble))
        self._log_estimate(trial.index)

    def _log_estimate(self, trial: int) -> None:
        self._log.append(believed(self.strategy, trial, self.strategy.decision(), None))
        self._log.sync()

    def _warn(self, text: str) -> None:
        self._journal.event("doubt", text)
        self._log.sync()
        if self._on_doubt is not None:
            self._on_doubt(text)
        else:
            warnings.warn(text, ImplausibleDataWarning, stacklevel=3)
