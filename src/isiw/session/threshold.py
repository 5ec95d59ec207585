"""A logged search for the motor threshold: what is about to be given is on disk first, and what came of it at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from isiw.checks import number, text, whole
from isiw.decision import StopDecision
from isiw.devices.clock import Clock, MonotonicClock, Pacing, VirtualClock
from isiw.devices.info import DeviceInfo
from isiw.devices.limited import require_real_time
from isiw.devices.limits import PulseLimits
from isiw.errors import DamagedLogError, InvalidValueError, LimitExceededError
from isiw.log.headers import StrategyRecipe, ThresholdHeader
from isiw.log.kinds import LogKind, of_another_kind
from isiw.log.pulses import pulse_ages
from isiw.log.reader import ThresholdRecord
from isiw.log.record import SessionRecord, read_any
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Intent, PulseOutcome, ThresholdEstimateRecord
from isiw.log.writer import LogWriter
from isiw.session.assembly import begun, require_parts
from isiw.session.examination import Examination
from isiw.session.recorder import Recording
from isiw.strategy.threshold.curve import CurvePulses
from isiw.strategy.threshold.estimate import ThresholdEstimate
from isiw.strategy.threshold.pulses import Pulse
from isiw.strategy.threshold.search import ThresholdSearch, make_threshold_search
from isiw.trials import Stimulus
from isiw.visit import interval_s

UNKNOWN = "outcome unknown"
BY_HAND = DeviceInfo("a stimulator that is set by hand", "impact")


def open_threshold(  # noqa: PLR0913 - what a search may state
    search: ThresholdSearch,
    log: str | Path,
    *,
    device: DeviceInfo = BY_HAND,
    min_iti_s: float = 5.0,
    max_pulses: int = 100,
    clock: Clock | None = None,
    subject: str = "",
    muscle: str = "",
    config: Mapping[str, Any] | None = None,
) -> ThresholdRecorder:
    """Open a search for the motor threshold: ask it for intensities, and tell it what came of them.

    Args:
        search: chooses intensities and learns; before its first pulse.
        log: where the log is; it must not exist yet.
        device: what stimulates.
        min_iti_s: shortest time between two pulses, which `ask` waits for [s].
        max_pulses: most pulses, lost ones included.
        clock: tells the time, and waits; a virtual one for a simulated device only, where it is the default.
        subject: the person's code, for the log.
        muscle: whose MEPs they are, for the log and for a session that knows the pulses.
        config: anything that should be kept in the log, as TOML values.

    Raises:
        DeviceError: a virtual clock for a device that is not simulated.
        InvalidValueError: no search, one that knows of pulses already, limits that limit nothing or do
            not hold the pulses over a curve, or an interval in ms.
        LogError: there is a log already, or it cannot be written.
    """
    path = require_parts(log, search=(search, ThresholdSearch), device=(device, DeviceInfo))
    clock = _clock_for(device, clock)
    if search.pulses:
        raise InvalidValueError("the search knows of pulses that are not this log's", got=len(search.pulses))
    if isinstance(search.method, CurvePulses) and search.method.budget > max_pulses:
        raise InvalidValueError(
            "the pulses over the curve do not fit into the limit",
            got=f"{search.method.budget} pulses, max_pulses = {max_pulses}",
            remedy=f"Say --max-pulses {search.method.budget} if your ethics approval allows it, or name fewer.",
        )
    header = ThresholdHeader(
        **begun(seed=0),
        subject=text("subject", subject),
        muscle=text("muscle", muscle),
        search=StrategyRecipe(name=search.name, seed=0, settings=search.settings),
        intensities=search.space,
        min_iti_s=interval_s("min_iti_s", min_iti_s),
        max_pulses=whole("max_pulses", max_pulses, least=1),
        device=device,
        config=dict(config or {}),
    )
    return ThresholdRecorder(search, LogWriter.create(path, header), header, clock)


def _clock_for(device: DeviceInfo, clock: Clock | None) -> Clock:
    clock = clock or (VirtualClock() if device.simulated else MonotonicClock())
    require_real_time(device, clock)
    return clock


def resume_threshold(
    log: str | Path, search: ThresholdSearch | None = None, *, clock: Clock | None = None
) -> ThresholdRecorder:
    """Continue a search where its log ends. A pulse without an outcome in it counts, and nothing is learnt from it.

    Args:
        log: the log, finished or not.
        search: needed if the method is one of your own: the same again.
        clock: as for `open_threshold`.

    Raises:
        DamagedLogError: the end of the log is missing, so that the number of pulses is unknown.
        DeviceError: a virtual clock for a device that is not simulated.
        InvalidValueError: a search with another range than the log's, or none for a method of one's own.
        LogError: no such log, or one of something else.
    """
    salvaged = salvage(log)
    record = _threshold_of(read_any(salvaged, LogKind.THRESHOLD))
    record.require_read()
    clock = _clock_for(record.header.device, clock)
    if record.end_lost:
        raise DamagedLogError(
            "the log's end is missing, so the number of pulses given is unknown",
            got=str(record.path),
            remedy="Begin a new log, with the pulses that the stimulator has counted taken off max_pulses.",
        )
    search = search_of(record, search)
    writer = LogWriter.continuing(log, salvaged, record.header)
    recorder = ThresholdRecorder(search, writer, record.header, clock, record.outcomes, pulse_ages(salvaged).ages_s)
    recorder.conclude_open(record.unknown)
    return recorder


def read_threshold(path: str | Path) -> ThresholdRecord:
    """Read the log of a search for the motor threshold, finished or not, whole or damaged.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one of something else.
        DamagedLogError: a log of which not even the header can be read.
    """
    return _threshold_of(read_any(salvage(path), LogKind.THRESHOLD))


def _threshold_of(record: SessionRecord | ThresholdRecord) -> ThresholdRecord:
    if isinstance(record, ThresholdRecord):
        return record
    raise of_another_kind(record.path, LogKind.SEARCH, LogKind.THRESHOLD)


def search_of(record: ThresholdRecord, search: ThresholdSearch | None = None) -> ThresholdSearch:
    """The search of a log, which has learnt its pulses."""
    recipe, space = record.header.search, record.header.intensities
    if search is not None and search.space != space:
        raise InvalidValueError(
            "the search has another range of intensities than the log", got=search.space, expected=str(space)
        )
    search = search or make_threshold_search(recipe.name, space, **recipe.settings)
    search.pulses = _learnable(record.outcomes)
    return search


def _a_reason(reason: str) -> str:
    if not text("reason", reason).strip():
        raise InvalidValueError("nothing is left out without a reason", got=reason, expected="a few words")
    return reason


def _learnable(outcomes: Iterable[PulseOutcome]) -> tuple[Pulse, ...]:
    """The pulses that are learnt from some outcomes."""
    return tuple(
        Pulse(number("intensity_pct_mso", each.intensity_pct_mso), each.mep_mv, each.response, each.place_mm)
        for each in outcomes
        if not each.reason
    )


@dataclass(frozen=True)
class _Pulses:
    """The outcomes of pulses as they count now, in order; the length is how many were given, or may have been."""

    outcomes: tuple[PulseOutcome, ...] = ()

    def __len__(self) -> int:
        return max((outcome.trial for outcome in self.outcomes), default=-1) + 1

    def appended(self, outcome: PulseOutcome) -> _Pulses:
        return _Pulses(tuple(sorted((*self.outcomes, outcome), key=lambda each: each.trial)))


class _ThresholdLearner:
    """A search as an examination sees it."""

    def __init__(self, search: ThresholdSearch) -> None:
        self.search = search

    def knows(self, trials: _Pulses) -> bool:
        return self.search.pulses == _learnable(trials.outcomes)

    def learn(self, outcome: PulseOutcome) -> None:
        self.search.pulses = (*self.search.pulses, *_learnable([outcome]))

    def trouble_with(self, outcome: PulseOutcome) -> None:
        """Nothing goes wrong when a pulse is learnt."""

    def doubt(self, outcomes: Any) -> None:
        """Nothing here changes with time."""

    def learn_again(self, trials: _Pulses) -> None:
        self.search.pulses = _learnable(trials.outcomes)

    def judged(self, trials: _Pulses, verdict: Event) -> _Pulses:
        reason, number = {"reason": verdict.text}, verdict.trial
        return _Pulses(tuple(x.model_copy(update=reason) if x.trial == number else x for x in trials.outcomes))

    def decision(self) -> StopDecision:
        return self.search.decision()

    def record(self, trial: int, decision: StopDecision, _: float | None) -> ThresholdEstimateRecord:
        return ThresholdEstimateRecord(trial=trial, estimate=self.search.estimate(), decision=decision)


class ThresholdRecorder(Recording[PulseOutcome]):
    """An open search; `open_threshold` opens one. As a context manager it closes its log.

    Args:
        search: chooses intensities and learns.
        log: the open log.
        header: what the session is: who stimulates, and how often and how fast at most.
        clock: tells the time, and waits.
        earlier: what came of the pulses before; the search has learnt them.
        ages_s: how long ago these were [s].
    """

    def __init__(
        self,
        search: ThresholdSearch,
        log: LogWriter,
        header: ThresholdHeader,
        clock: Clock,
        earlier: Iterable[PulseOutcome] = (),
        ages_s: Sequence[float] = (),
    ) -> None:
        super().__init__(log, clock)
        self.header = header
        self._examination: Examination[_ThresholdLearner, _Pulses, PulseOutcome] = Examination(
            _ThresholdLearner(search), _Pulses(tuple(earlier)), self._sink
        )
        self._pacing = Pacing(PulseLimits(min_iti_s=header.min_iti_s), clock, ages_s)
        self._asked: float | None = None
        self.place_mm: tuple[float, float] | None = None

    @property
    def search(self) -> ThresholdSearch:
        """The search, which chooses intensities and learns."""
        return self._examination.learner.search

    @property
    def outcomes(self) -> tuple[PulseOutcome, ...]:
        """The outcome of each pulse so far, as it counts now, in order."""
        return self._examination.trials.outcomes

    @property
    def given(self) -> int:
        """Number of pulses that were given, or may have been; also the number of the next one."""
        return len(self._examination.trials)

    def conclude_open(self, intents: Sequence[Intent]) -> None:
        """Log that nobody knows the outcome of pulses that were given by the log, or may have been."""
        for intent in intents:
            known = intent.model_dump(include={"trial", "intensity_pct_mso", "place_mm"})
            self._conclude(PulseOutcome(**known, reason=UNKNOWN))
        self._examination.event("resume", f"Went on after {self.given} pulses.", durable=True)

    def ask(self) -> float:
        """The next intensity [% MSO], the same until its outcome; on disk as about to be given before this returns."""
        self._examination.conclude()
        self._examination.require_own()
        if self._asked is not None:
            self._require_durable()
        else:
            if self.given >= self.header.max_pulses:
                raise LimitExceededError(
                    f"the limit of {self.header.max_pulses} pulses is reached, so no further pulse follows",
                    remedy="For more pulses begin a new log with a larger --max-pulses (max_pulses in Python).",
                )
            intensity, self.place_mm = self.search.ask(), self.search.place_mm
            self._clock.sleep_s(self._pacing.wait_s())
            at = {"intensity_pct_mso": intensity, "place_mm": self.place_mm}
            self._examination.intend(Intent.of(Stimulus(self.given, None), self._clock.now_s(), **at))
            self._log.require_in_place()
            self._asked = intensity
        return self._asked

    def tell(self, mep_mv: float | None = None, *, response: bool | None = None) -> None:
        """Report the outcome of the intensity that was asked; it is on disk before the search learns it.

        Args:
            mep_mv: peak-to-peak amplitude of the MEP [mV]; 0 is below the detection limit.
            response: whether a response was seen, instead of an amplitude.

        Raises:
            InvalidValueError: nothing was asked, or a value that cannot be, or a slip of unit; nothing is logged, and
                the right value can be told.
            LogError: the log cannot be written.
        """
        pulse = self.search.checked(self._require_asked(), mep_mv, response=response)
        self._conclude(self._outcome(mep_mv=pulse.mep_mv, response=pulse.response))

    def lost(self, reason: str) -> None:
        """That nothing can be learnt from the pulse that was asked; it counts as given.

        Args:
            reason: why.

        Raises:
            InvalidValueError: nothing was asked, or there is no reason.
            LogError: the log cannot be written.
        """
        self._require_asked()
        self._conclude(self._outcome(reason=_a_reason(reason)))

    def withdraw(self) -> None:
        """Say that the pulse that was asked is not given: it does not count, and can be asked again.

        Raises:
            InvalidValueError: nothing was asked.
            LogError: the log cannot be written.
        """
        self._require_asked()
        self._examination.event("refused", "not given, said the operator", self.given, durable=True)
        self._asked = None

    def exclude(self, trial: int, reason: str) -> None:
        """Let a pulse not count from here on: an event is appended, nothing is erased.

        Args:
            trial: its number.
            reason: why.

        Raises:
            InvalidValueError: no pulse that counts has this number, or there is no reason.
            LogError: the log cannot be written.
        """
        counting = [outcome.trial for outcome in self.outcomes if not outcome.reason]
        if whole("the number of a pulse", trial) not in counting:
            raise InvalidValueError(
                "cannot exclude this pulse",
                got=trial,
                expected=f"a pulse that counts: {', '.join(map(str, counting)) or 'none'}",
            )
        text = _a_reason(reason)
        self._examination.judge(lambda _: Event(kind="exclusion", trial=trial, text=text))
        self._examination.conclude()

    def estimate(self) -> ThresholdEstimate:
        """The estimate of the threshold now."""
        return self.search.estimate()

    def decision(self) -> StopDecision:
        """The decision to stop now or not, with its reason."""
        return self.search.decision()

    def _require_asked(self) -> float:
        if self._asked is None:
            raise InvalidValueError(
                "no pulse is waiting for an outcome", remedy="Call ask() first, then deliver, then tell()."
            )
        return self._asked

    def _outcome(self, **outcome: Any) -> PulseOutcome:
        intensity = self._require_asked()
        return PulseOutcome(trial=self.given, intensity_pct_mso=intensity, place_mm=self.place_mm, **outcome)
