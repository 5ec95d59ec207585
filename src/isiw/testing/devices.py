"""The conformance suite of devices, which drives one as a session does: within limits and deadlines."""

from __future__ import annotations

import gc
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Final

from isiw.checks import number
from isiw.design import DesignSpace
from isiw.devices.clock import Clock, MonotonicClock, VirtualClock
from isiw.devices.deadlines import PunctualDevice
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.devices.protocol import VERBS, Answer, Device, DiesArmed, HasMemory, Readiness, readiness_of
from isiw.errors import DeviceError, DeviceTimeoutError, IsiwError, NotDelivered, StillArmedError, error_text
from isiw.findings import Kind
from isiw.log.schema import waveform_topic
from isiw.session.rig import Rig, Safeguards, exclusive, own_reference
from isiw.session.sink import Sink
from isiw.signals import SignalLimits, judge, judge_measurement
from isiw.signals.plausible import Counted
from isiw.signals.rig import Evidence, too_early_by_chance
from isiw.signals.watch import findings
from isiw.sweeps import Measurement, Sweep
from isiw.testing.device_table import (
    OF_TIMING,
    Delivery,
    DeviceTable,
    announcement,
    artefact_in_window,
    device_table,
    late_artefact,
    late_deflection,
    wrong_hit_delay,
)
from isiw.testing.suites import broken, require, require_maker
from isiw.text.sanitize import shown
from isiw.trials import Stimulus, Trial

_DISARMED_S: Final = 2.0


def check_device(
    make: Callable[[], Device],
    space: DesignSpace,
    *,
    timeout_s: float = 30.0,
    iti_s: float = 5.0,
    limits: Limits | None = None,
    clock: Clock | None = None,
    signals: SignalLimits | None = None,
    say: Callable[[str], None] = print,
) -> DeviceTable:
    """Check that a device keeps the promises of `isiw.Device`. It stimulates: put the coil on a phantom.

    It delivers three pairs of stimuli, TMS alone, a tap alone if the device says that it can, and five pairs more
    if the device has a memory. It tries six more times while the device is disarmed and must refuse. It says so
    beforehand, and ends with a table of what was found. Every delivery goes through the guards of a session: limits,
    readiness, deadlines, and signals, which disarm at once. Whatever happens, the device is disarmed at the end.

    Args:
        make: makes the device, in the same state each time; called three times if the device has a memory.
        space: ISIs that it can deliver, on its reference.
        timeout_s: how long one delivery may take [s]; past it, the device is stopped from another thread.
        iti_s: how long to wait before each of these deliveries [s]; the limits may ask for more.
        limits: what may be delivered, as a session's; the space, 5 s between stimuli and 200 pulses by default.
        clock: waits; a virtual one by default if the device is simulated.
        signals: what a session's sweeps must keep.
        say: takes what is said to whoever watches.

    Raises:
        AssertionError: a promise is broken, a session would reject a trial, or a real device shows an MEP of a phantom,
            or the artefact of its pulse at another time than it reports; the message says which, and why.
        DeviceError: the device failed, is not ready, or is driven by a session.
        LimitExceededError: the limits do not allow a stimulus; it was not delivered.
        InvalidValueError: an inter-trial interval that is negative or not finite, or no function that makes a device.
    """
    rules, least_s = _Rules(space, signals or SignalLimits()), number("iti_s", iti_s, least=0)
    pace = CheckPace(timeout_s, least_s, limits or Limits.of_space(space, min_iti_s=least_s), clock or MonotonicClock())
    table = _checked(make, rules, pace, say, virtual=clock is None)
    gc.collect()  # a device that is gone offers no streams, whose listeners would stay away from the next one
    return table


def _checked(
    make: Callable[[], Device], rules: _Rules, pace: CheckPace, say: Callable[[str], None], *, virtual: bool
) -> DeviceTable:
    """The table of a device; where `virtual`, a simulated one does not really wait."""
    require_maker(make, "the device")
    device = make()
    lacking = [verb for verb in VERBS if not hasattr(device, verb)]
    require(not lacking, f"a device has {', '.join(VERBS)}", f"{shown(device)} without {', '.join(lacking)}")
    _check_description(device, rules.space)
    if virtual and device.describe().simulated:
        pace = replace(pace, clock=VirtualClock())
    say(announcement(device, max(pace.iti_s, pace.limits.iti_s)))
    deliveries = _check_delivery(device, rules, pace, say)
    if isinstance(device, HasMemory):
        _check_memory(make, rules.space, pace)
    table = device_table(device.describe(), deliveries, rules.limits)
    say(str(table))
    _require_usable(deliveries, rules, real=not device.describe().simulated)
    return table


@dataclass(frozen=True)
class _Rules:
    """By what a session would judge the answers."""

    space: DesignSpace
    limits: SignalLimits

    def judged(self, answer: Answer, stimulus: Stimulus) -> Trial:
        if isinstance(answer, Sweep):
            for name in answer.channels:
                waveform_topic(name)
            return judge(answer, stimulus, self.space, self.limits)
        return judge_measurement(answer, stimulus, self.space, self.limits)


def _check_delivery(device: Device, rules: _Rules, pace: CheckPace, say: Callable[[str], None]) -> list[Delivery]:
    guarded = Guarded(device, pace)
    with guarded.exclusive():
        guarded.require_stop()
        say("Disarmed: a stimulus must be refused before the device is armed.")
        with guarded.armed(kept_disarmed=True):
            guarded.require_refusal("before stage()")
        with guarded.armed():
            space, deliveries = rules.space, []
            between_ms = float(space.grid_ms[(len(space.grid_ms) - 1) // 3])
            isis_ms = (space.low_ms, None, between_ms, space.high_ms)
            stimuli = [Stimulus(trial, isi_ms) for trial, isi_ms in enumerate(isis_ms)]
            stimuli += [Stimulus(4, None, tap_alone=True)] if guarded.info.tap_alone else []
            for stimulus in stimuli:
                say(f"Armed: {_named(stimulus)} comes next.")
                answer, took_s = guarded.deliver(stimulus)
                trial = _checked_answer(guarded.info, stimulus, answer, rules)
                deliveries.append(Delivery(stimulus, answer, trial, took_s))
            if guarded.info.if_isiw_dies is not None:
                say(_disarmed_if_isiw_dies(device, guarded.info))
            say("Disarmed: stimuli must be refused after stop() and unstage(), five times.")
            for _ in range(2):
                guarded.disarm()
                guarded.require_refusal("after stop()")
        for _ in range(2):
            with guarded.armed(kept_disarmed=True):
                guarded.require_refusal("after unstage()")
        with guarded.armed():
            guarded.disarm()
            guarded.require_refusal("after being staged again and stopped")
    return deliveries


def _disarmed_if_isiw_dies(device: Device, info: DeviceInfo) -> str:
    """Kill a process that has armed the staged device, and say how long it stayed armed."""
    took_s = None
    if isinstance(device, DiesArmed):
        try:
            took_s = device.die_armed(_DISARMED_S)
        except DeviceError as error:
            promise = f"{info.name} is disarmed within {_DISARMED_S:g} s when a process dies that has armed it"
            raise broken(promise, error_text(error)) from error
    if took_s is not None:
        return f"A process that had armed {info.name} was killed: disarmed after {1e3 * took_s:.0f} ms."
    return f"{info.name} says that it is disarmed if isiw dies, by a {info.if_isiw_dies}. That was not tried."


def _check_description(device: Device, space: DesignSpace) -> None:
    info = device.describe()
    require(isinstance(info, DeviceInfo), "describe() returns a DeviceInfo before it is staged", shown(info))
    again = device.describe()
    require(info == again, "describe() says the same each time", f"{info}, then {again}")
    require(
        info.reference == space.reference,
        f"the device counts ISIs from the event that the space counts from, {space.reference}",
        f"{info.reference}. {own_reference(info.reference)}",
    )


def _checked_answer(info: DeviceInfo, stimulus: Stimulus, answer: Answer, rules: _Rules) -> Trial:
    require(isinstance(answer, Sweep | Measurement), "deliver returns a Sweep or a Measurement", shown(answer))
    if isinstance(answer, Sweep):
        units = {name: channel.unit for name, channel in answer.channels.items()}
        described = dict(info.channels)
        require(units == described, f"a sweep has the channels and units of describe(), {described}", str(units))
        require("emg" in units, "a sweep has a channel emg", ", ".join(units) or "no channels")
        timed = answer.t_tms_ms is not None
        promise = "a sweep has the time of the pulse, t_tms_ms, and a tap alone has no pulse"
        require(timed is not stimulus.tap_alone, promise, f"t_tms_ms = {answer.t_tms_ms} of {_named(stimulus)}")
    else:
        promise = "a device that returns a Measurement describes no channels"
        require(not info.channels, promise, f"a Measurement, and the channels {', '.join(info.channels)}")
        alone, promise = stimulus.isi_ms is None, "the realised ISI is None for TMS alone, and only then"
        require((answer.isi_ms is None) is alone, promise, f"isi_ms = {answer.isi_ms} of {_named(stimulus)}")
    try:
        return rules.judged(answer, stimulus)
    except IsiwError as error:
        raise broken("a session can judge what deliver returns", str(error)) from error


def _named(stimulus: Stimulus) -> str:
    if stimulus.isi_ms is not None:
        return f"a pair at {stimulus.isi_ms:g} ms"
    return "a tap alone" if stimulus.tap_alone else "TMS alone"


def _require_usable(deliveries: Sequence[Delivery], rules: _Rules, *, real: bool) -> None:
    """Raise if a session would reject what was delivered, or pause over it, or take an artefact for an MEP."""
    delay = wrong_hit_delay(deliveries) if rules.space.reference == "impact" else None
    lost, texts, said = Counter[Kind](), dict[Kind, str](), list[str]()
    for delivery in deliveries:
        trial = delivery.trial
        found = next(findings(Evidence(trial, delivery.answer, rules.limits)), None)
        if found is None or too_early_by_chance(trial, rules.space):
            continue
        if trial.reason is None:
            said.append(f"{found}")
        else:
            kind = Kind.ISI_OFF if delay and found.kind in OF_TIMING else found.kind
            lost[kind] += 1
            texts.setdefault(kind, delay if delay and kind is Kind.ISI_OFF else f"{found}")
    said = [f"{n} of {len(deliveries)} trials would be rejected: {texts[kind]}" for kind, n in lost.items()] + said
    told = [Counted(delivery.trial.mep_mv) for delivery in deliveries if delivery.trial.mep_mv is not None]
    said += [f"{doubt}" for doubt in findings(Evidence(told=told)) if doubt.kind is not Kind.EQUAL][:1]
    if (late := late_deflection(deliveries)) is not None:
        said.append(late)
    artefact = (artefact_in_window(deliveries, rules.limits) or late_artefact(deliveries)) if real else None
    if artefact is not None:
        said.append(artefact)
    faults = "\n\n".join(dict.fromkeys(fault[0].upper() + fault[1:] for fault in said))
    require(not said, "a session can use what deliver returns", f"\n\n{faults}")


def _check_memory(make: Callable[[], Device], space: DesignSpace, pace: CheckPace) -> None:
    grid = space.grid_ms
    stimuli = [Stimulus(trial, float(grid[trial * (len(grid) - 1) // 3])) for trial in range(4)]
    uninterrupted = _answers(make(), stimuli, pace)
    resumed = make()
    if isinstance(resumed, HasMemory):
        resumed.resume_after(stimuli[:3])
    (last,) = _answers(resumed, stimuli[3:], pace)
    promise = "after resume_after a device answers as if it had never been interrupted"
    require(_same(last, uninterrupted[3]), promise, f"{shown(last)} instead of {shown(uninterrupted[3])}")


def _answers(device: Device, stimuli: Sequence[Stimulus], pace: CheckPace) -> list[Answer]:
    guarded = Guarded(device, pace)
    with guarded.exclusive(), guarded.armed():
        return [guarded.deliver(stimulus)[0] for stimulus in stimuli]


def _same(one: Answer, other: Answer) -> bool:
    if isinstance(one, Sweep) and isinstance(other, Sweep):
        same_times = (one.t_valve_ms, one.t_tms_ms, one.t_hit_ms) == (other.t_valve_ms, other.t_tms_ms, other.t_hit_ms)
        pairs = [(channel.values, other.channels[name].values) for name, channel in one.channels.items()]
        return same_times and all(a.shape == b.shape and bool((a == b).all()) for a, b in pairs)
    return one == other


@dataclass(frozen=True)
class CheckPace:
    """The pace of the deliveries of a check; the limits may ask for longer waits."""

    timeout_s: float
    iti_s: float
    limits: Limits
    clock: Clock
    given_s: list[float] = field(default_factory=list)  # when each delivery ended, of all devices of the check


class Guarded:
    """A device that is checked, behind the guards of a session."""

    def __init__(self, device: Device, pace: CheckPace) -> None:
        self._device, self._pace, self._delivered = device, pace, 0
        self._kept = _KeptDisarmed(device)
        self._sink = Sink()
        self._rig = Rig(self._kept, pace.limits, pace.clock, Safeguards(), self._sink, waits_for_nobody=True)

    @property
    def info(self) -> DeviceInfo:
        """The device's description."""
        return self._rig.info

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Within, no session drives the device, and every signal disarms it and ends the check."""
        with exclusive(self._device, self._rig.info), self._rig.interrupts:
            yield
        faults = "; ".join(self._sink.faults)
        require(not faults, "stop and unstage work in any state", faults)

    @contextmanager
    def armed(self, *, kept_disarmed: bool = False) -> Iterator[None]:
        """Within, the device is staged; behind it, it is disarmed and let go of, whatever happened."""
        self._kept.now = kept_disarmed
        now_s = self._pace.clock.now_s()
        self._rig.begin(self._delivered, [now_s - given_s for given_s in self._pace.given_s])
        with self._rig.armed():
            yield

    def disarm(self) -> None:
        """Disarm the staged device, and let stimuli get through to it all the same."""
        self._rig.disarm()
        self._kept.now = True
        self._rig.stage()

    def deliver(self, stimulus: Stimulus) -> tuple[Answer, float]:
        """Deliver a stimulus, as a session tries again what is refused before firing, and say how long it took [s]."""
        for backoff_s in Safeguards().backoffs_s:
            try:
                return self._tried(stimulus)
            except NotDelivered:
                self._sleep(backoff_s)
        return self._tried(stimulus)

    def require_refusal(self, when: str) -> None:
        """Raise if the disarmed device does not refuse to deliver."""
        try:
            self._tried(Stimulus(0, None))
        except DeviceError:
            return
        except (AssertionError, IsiwError):  # it is too slow, or the limits do not allow it
            raise
        except Exception as error:
            raise broken(f"deliver raises a DeviceError {when}", error_text(error)) from error
        raise broken(f"deliver raises a DeviceError {when}", "it delivered and raised nothing")

    def require_stop(self) -> None:
        """Raise if `stop` fails before anything is armed; once the device is armed that would be too late."""
        punctual = PunctualDevice(self._device)
        try:
            punctual.stop()
        except StillArmedError as error:
            raise broken("stop works in any state", error_text(error)) from error
        finally:
            punctual.release_thread()

    def _tried(self, stimulus: Stimulus) -> tuple[Answer, float]:
        self._sleep(self._pace.iti_s)
        while (wait_s := self._rig.limited.wait_s()) > 0:
            self._sleep(wait_s)
        began_s, timeout_s = time.monotonic(), self._pace.timeout_s
        try:
            answer = self._rig.limited.deliver(stimulus, timeout_s)
        except DeviceTimeoutError as error:
            if (spent_s := time.monotonic() - began_s) > timeout_s:
                seen = f"nothing after {spent_s:.3g} s, when it timed out and was disarmed"
                raise broken(_in_time(timeout_s), seen) from error
            raise
        self._delivered += 1
        self._pace.given_s.append(self._pace.clock.now_s())
        spent_s = time.monotonic() - began_s
        require(spent_s <= timeout_s, _in_time(timeout_s), f"{spent_s:.3g} s")
        return answer, spent_s

    def _sleep(self, duration_s: float) -> None:
        self._rig.interrupts.freely(self._pace.clock.sleep_s, duration_s)


def _in_time(timeout_s: float) -> str:
    return f"deliver returns or raises within its timeout of {timeout_s:g} s"


class _KeptDisarmed:
    """A device from which `stage` can be kept, for whoever asks whether it refuses what gets through to it then."""

    def __init__(self, device: Device) -> None:
        self._device, self.now = device, False

    def describe(self) -> DeviceInfo:
        return self._device.describe()

    def stage(self) -> None:
        if not self.now:
            self._device.stage()

    def readiness(self) -> Readiness:
        return readiness_of(self._device)

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        try:
            return self._device.deliver(stimulus, timeout_s)
        except DeviceError as error:
            if not self.now:
                raise
            raise NotDelivered(error_text(error)) from error  # disarmed, it has delivered nothing

    def stop(self) -> None:
        self._device.stop()

    def unstage(self) -> None:
        self._device.unstage()
