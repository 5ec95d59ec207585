"""A device that fails in every way a device can, and keeps its own ledger of what it fired."""

from __future__ import annotations

import itertools
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from isiw.checks import number
from isiw.devices.allowed import require_isi
from isiw.devices.clock import Clock
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.devices.protocol import Answer, Device, Readiness, require_staged
from isiw.errors import DeviceError, NotDelivered
from isiw.log.record import SessionRecord
from isiw.log.schema import Event, Intent
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.testing.suites import require
from isiw.trials import Status, Stimulus

_HOT_C = 90.0
_COOL_C = 25.0
_LONGEST_HANG_S = 600.0
_ROUNDING_S = 1e-6


class Fault(StrEnum):
    """What can go wrong."""

    STAGE_FAILS = "stage fails"
    STAGE_HANGS = "stage hangs"
    STOP_FAILS = "stop fails"
    STOP_HANGS = "stop hangs"
    UNSTAGE_FAILS = "unstage fails"
    UNSTAGE_HANGS = "unstage hangs"
    NOT_READY = "not ready"
    HOT_COIL = "hot coil"
    REFUSED = "refused before firing"
    FAILS_BEFORE = "fails before firing"
    FAILS_AFTER = "fails after firing"
    HANGS_BEFORE = "hangs before firing"
    HANGS_AFTER = "hangs after firing"
    LATE = "answers too late"
    NO_ANSWER = "answers with nothing"
    WRONG_KIND = "answers for another kind of trial"
    WRONG_ISI = "answers for another ISI"
    DUPLICATE = "gives the answer before once more"
    NAN = "answers with NaN"
    MISSING_CHANNEL = "leaves out a channel"


_HANGS = (Fault.STAGE_HANGS, Fault.STOP_HANGS, Fault.UNSTAGE_HANGS, Fault.HANGS_BEFORE, Fault.HANGS_AFTER)
_OF_STAGE = (Fault.STAGE_FAILS, Fault.STAGE_HANGS)
_OF_STOP = (Fault.STOP_FAILS, Fault.STOP_HANGS)
_OF_UNSTAGE = (Fault.UNSTAGE_FAILS, Fault.UNSTAGE_HANGS)
_OF_READINESS = (Fault.NOT_READY, Fault.HOT_COIL)
_OF_DELIVERY = tuple(fault for fault in Fault if fault not in {*_OF_STAGE, *_OF_STOP, *_OF_UNSTAGE, *_OF_READINESS})


@dataclass(frozen=True)
class Fired:
    """One pair of stimuli that really left the device.

    Args:
        trial: number of the trial.
        isi_ms: the ISI [ms]; None for TMS alone.
        t_s: when, by the device's clock [s].
    """

    trial: int
    isi_ms: float | None
    t_s: float


class FaultyDevice:
    """A device around another that fails at random, the same way for the same seed.

    At most two attempts at `stop` in a row fail. What hangs, hangs until `release` is called; it fires nothing then,
    since the device has been disarmed meanwhile.

    Args:
        device: what answers where nothing fails; it delivers every pair that is fired.
        seed: seed of the faults.
        clock: tells when a pair is fired.
        rate: the share of calls that fail.
        faults: what may fail.
        late_s: how long an answer that comes too late takes [s]; longer than the session's `timeout_s`.
        on_fire: is called with each stimulus before it is fired.

    Raises:
        InvalidValueError: a rate that is no share.
    """

    def __init__(
        self,
        device: Device,
        seed: int,
        clock: Clock,
        *,
        rate: float = 0.1,
        faults: Iterable[Fault] = tuple(Fault),
        late_s: float = 0.5,
        on_fire: Callable[[Stimulus], object] = lambda _: None,
    ) -> None:
        self._device, self._clock, self._on_fire, self._late_s = device, clock, on_fire, late_s
        self._rng = np.random.default_rng(seed)
        self._rate = number("rate", rate, least=0, most=1)
        self._faults = tuple(faults)
        self._released = threading.Event()
        self._staged = False
        self._stops_failed = 0
        self._last: Answer | None = None
        self.ledger: list[Fired] = []
        self.happened: Counter[Fault] = Counter()

    @property
    def armed(self) -> bool:
        """Whether it could fire now."""
        return self._staged

    def release(self) -> None:
        """Let everything go on that hangs; what hangs afterwards waits for the next release."""
        released, self._released = self._released, threading.Event()
        released.set()

    def describe(self) -> DeviceInfo:
        """What the device around is."""
        return self._device.describe()

    def readiness(self) -> Readiness:
        """Whether it is ready, and how hot its coil is."""
        fault = self._drawn(_OF_READINESS)
        coil_c = _HOT_C if fault is Fault.HOT_COIL else _COOL_C
        return Readiness(ready=fault is not Fault.NOT_READY, reason=fault or "", coil_c=coil_c)

    def stage(self) -> None:
        """Arm, or fail with the device armed."""
        self._staged = True
        self._device.stage()
        self._fail(self._drawn(_OF_STAGE))

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Fire and answer, or fail in one of many ways.

        Args:
            stimulus: what to deliver.
            timeout_s: the longest the call may take [s].

        Raises:
            NotDelivered: refused before firing.
            DeviceError: not staged, or a fault.
        """
        require_staged("the faulty device", staged=self._staged)
        fault = self._drawn(_OF_DELIVERY)
        if fault is Fault.REFUSED:
            raise NotDelivered("the faulty device refuses")
        if fault in {Fault.FAILS_BEFORE, Fault.HANGS_BEFORE}:
            self._fail(fault)
        require_staged("the faulty device", staged=self._staged)
        answer = self._fired(stimulus, timeout_s)
        if fault in {Fault.FAILS_AFTER, Fault.HANGS_AFTER}:
            self._fail(fault)
        if fault is Fault.LATE:
            self._released.wait(self._late_s)
        before, self._last = self._last, answer
        return _spoilt(answer, fault, before)

    def stop(self) -> None:
        """Disarm, unless it fails before."""
        fault = self._drawn(_OF_STOP) if self._stops_failed < 2 else None
        self._stops_failed += 1 if fault else -self._stops_failed
        self._fail(fault)
        self._staged = False
        self._device.stop()

    def unstage(self) -> None:
        """Let go, or fail."""
        self._staged = False
        self._fail(self._drawn(_OF_UNSTAGE))
        self._device.unstage()

    def _drawn(self, possible: tuple[Fault, ...]) -> Fault | None:
        """What goes wrong this time; None where nothing does."""
        candidates = [fault for fault in self._faults if fault in possible]
        if not candidates or self._rng.random() >= self._rate:
            return None
        fault = candidates[int(self._rng.integers(len(candidates)))]
        self.happened[fault] += 1
        return fault

    def _fail(self, fault: Fault | None) -> None:
        if fault is None:
            return
        if fault in _HANGS:
            self._released.wait(_LONGEST_HANG_S)
        raise DeviceError(f"fault: {fault}")

    def _fired(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        self._on_fire(stimulus)
        self.ledger.append(Fired(stimulus.trial, stimulus.isi_ms, self._clock.now_s()))
        return self._device.deliver(stimulus, timeout_s)


def _spoilt(answer: Answer, fault: Fault | None, before: Answer | None) -> Answer:
    """The answer as a fault leaves it."""
    if fault is Fault.NO_ANSWER:
        return None  # type: ignore[return-value]  # the fault is that it is none
    if fault is Fault.DUPLICATE and before is not None:
        return before
    return _spoilt_measurement(answer, fault) if isinstance(answer, Measurement) else _spoilt_sweep(answer, fault)


def _spoilt_sweep(answer: Sweep, fault: Fault | None) -> Answer:
    if fault is Fault.MISSING_CHANNEL:
        return replace(answer, channels={})
    if fault is Fault.NAN:
        broken = {name: replace(channel, values=channel.values * np.nan) for name, channel in answer.channels.items()}
        return replace(answer, channels=broken)
    return replace(answer, t_tms_ms=None) if fault in {Fault.WRONG_KIND, Fault.WRONG_ISI} else answer


def _spoilt_measurement(answer: Measurement, fault: Fault | None) -> Answer:
    if fault is Fault.WRONG_KIND:
        return replace(answer, isi_ms=0.0 if answer.isi_ms is None else None)
    if fault is Fault.WRONG_ISI and answer.isi_ms is not None:
        return replace(answer, isi_ms=answer.isi_ms + 1e3)
    if fault is Fault.NAN:
        return replace(answer, mep_mv=float("nan"))
    if fault is Fault.MISSING_CHANNEL:
        return Sweep({"force": Channel(np.zeros(10), 1000.0, "N")})
    return answer


def check_ledger(ledger: Iterable[Fired], record: SessionRecord, limits: Limits) -> None:
    """Check that a log tells of every pair that was fired, and that none exceeded the limits.

    Args:
        ledger: what was fired, in order.
        record: the log.
        limits: what the session was allowed to deliver.

    Raises:
        AssertionError: the log and the ledger disagree, or a limit was passed; the message says which.
    """
    fired = list(ledger)
    trials = {trial.index: trial for trial in record.table}
    open_isis = _isis_of_open_intents(record)
    counts = Counter(each.trial for each in fired)
    require(max(counts.values(), default=0) <= 1, "no trial is fired twice", str(counts.most_common(1)))
    require(set(counts) <= set(open_isis), "no pair is fired without an intent", str(set(counts) - set(open_isis)))
    for each in fired:
        intended, promise = open_isis[each.trial], f"what is fired is what the intent says, in trial {each.trial}"
        require(intended == each.isi_ms, promise, f"{each.isi_ms} ms instead of {intended} ms")
        if each.isi_ms is not None:
            require_isi(limits, each.isi_ms)
    known = {intent.trial for intent in record.unknown} | set(trials)
    require(set(counts) <= known, "every pair that was fired is in the log", f"not {set(counts) - known}")
    accepted = {index for index, trial in trials.items() if trial.status is Status.ACCEPTED}
    require(accepted <= set(counts), "no trial counts that was not fired", str(accepted - set(counts)))
    require(list(trials) == list(range(len(trials))), "the trials are numbered without a gap")
    require(len(fired) <= limits.max_pulses, f"at most {limits.max_pulses} pairs are fired", str(len(fired)))
    for before, after in itertools.pairwise(fired):
        spent_s = after.t_s - before.t_s
        require(spent_s >= limits.iti_s - _ROUNDING_S, f"pairs come {limits.iti_s:g} s apart", f"{spent_s:g} s")


def _isis_of_open_intents(record: SessionRecord) -> dict[int, float | None]:
    """The ISI of each intent that was not refused, by trial [ms]."""
    isis: dict[int, float | None] = {}
    for entry in record.history:
        if isinstance(entry, Intent):
            require(entry.trial not in isis, "there is one intent for a stimulus", f"two in trial {entry.trial}")
            isis[entry.trial] = entry.isi_ms
        elif isinstance(entry, Event) and entry.kind == "refused" and entry.trial is not None:
            isis.pop(entry.trial, None)
    return isis
