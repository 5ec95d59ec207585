"""The conformance suite of devices."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from isiw.checks import check_numbers
from isiw.design import DesignSpace
from isiw.devices.clock import Clock, MonotonicClock, VirtualClock
from isiw.devices.protocol import Answer, Device, DeviceInfo, HasMemory
from isiw.errors import DeviceError, IsiwError
from isiw.log.topics import waveform_topic
from isiw.signals import SignalLimits, judge, judge_measurement
from isiw.signals.faults import likely_fault, too_early_by_chance
from isiw.signals.plausibility import DoubtKind, doubt_of
from isiw.testing.device_table import Delivery, DeviceTable, device_table
from isiw.testing.requirements import require
from isiw.trials import Measurement, Stimulus, Sweep, Trial

__all__ = ["check_device"]


def check_device(
    make: Callable[[], Device],
    space: DesignSpace,
    *,
    timeout_s: float = 30.0,
    iti_s: float = 5.0,
    clock: Clock | None = None,
    signals: SignalLimits | None = None,
    say: Callable[[str], None] = print,
) -> DeviceTable:
    """Check that a device keeps the promises of `isiw.Device`. It stimulates: put the coil on a phantom.

    It delivers three pairs of stimuli, TMS alone, a tap alone where the device says that it can, and five pairs more
    where the device has a memory. It tries six more times while the device is disarmed and must refuse. It says so
    beforehand, and ends with a table of what was found. Whatever happens, the device is disarmed at the end.

    Args:
        make: makes the device, in the same state each time; called three times where the device has a memory.
        space: ISIs that it can deliver, on its reference.
        timeout_s: how long one delivery may take [s].
        iti_s: how long to wait before each of these deliveries [s].
        clock: waits; a virtual one by default where the device is simulated.
        signals: what a session's sweeps must keep.
        say: takes what is said to whoever watches.

    Returns:
        The table.

    Raises:
        AssertionError: a promise is broken, or a session would reject a trial; the message says which, and why.
        InvalidValueError: an inter-trial interval that is negative or not finite.
    """
    device = make()
    require(isinstance(device, Device), "it has describe, stage, deliver, stop and unstage")
    _check_description(device, space)
    rules = _Rules(space, signals or SignalLimits())
    pace = _Pace(timeout_s, iti_s, clock or (VirtualClock() if device.describe().simulated else MonotonicClock()))
    say(_announcement(device, pace))
    with _disarmed_at_last(device):
        deliveries = _check_delivery(device, rules, pace)
    if isinstance(device, HasMemory):
        _check_memory(make, space, pace)
    table = device_table(device.describe(), deliveries, rules.limits)
    say(str(table))
    _require_usable(deliveries, rules)
    return table


def _announcement(device: Device, pace: _Pace) -> str:
    info = device.describe()
    if info.simulated:
        return f"{info.name} is simulated: nothing is delivered to anybody."
    pairs = 8 if isinstance(device, HasMemory) else 3
    alone = ", one magnetic pulse alone and one tap alone" if info.tap_alone else " and one magnetic pulse alone"
    return f"This check stimulates: {pairs} pairs{alone}, {pace.iti_s:g} s apart. Keep the coil on a phantom."


@dataclass(frozen=True)
class _Pace:
    """How fast deliveries may follow each other."""

    timeout_s: float
    iti_s: float
    clock: Clock

    def __post_init__(self) -> None:
        check_numbers(self, "iti_s", least=0)

    def deliver(self, device: Device, stimulus: Stimulus) -> Answer:
        """Deliver one pair of stimuli, an inter-trial interval after whatever was delivered before."""
        return self.timed(device, stimulus)[0]

    def timed(self, device: Device, stimulus: Stimulus) -> tuple[Answer, float]:
        """As `deliver`, and how long the device took [s]."""
        self.clock.sleep_s(self.iti_s)
        began_s = time.monotonic()
        answer = device.deliver(stimulus, self.timeout_s)
        spent_s = time.monotonic() - began_s
        require(spent_s <= self.timeout_s, f"deliver returns or raises within its timeout, here after {spent_s:.3g} s")
        return answer, spent_s


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


@contextmanager
def _disarmed_at_last(device: Device) -> Iterator[None]:
    try:
        yield
    finally:
        try:
            device.stop()
        finally:
            device.unstage()


def _check_delivery(device: Device, rules: _Rules, pace: _Pace) -> list[Delivery]:
    _check_refusal(device, "before stage()", pace)
    device.stage()
    space = rules.space
    between_ms = float(space.grid_ms[(len(space.grid_ms) - 1) // 3])
    stimuli = [Stimulus(trial, isi) for trial, isi in enumerate((space.low_ms, None, between_ms, space.high_ms))]
    stimuli += [Stimulus(4, None, tap_alone=True)] if device.describe().tap_alone else []
    deliveries = []
    for stimulus in stimuli:
        answer, took_s = pace.timed(device, stimulus)
        trial = _checked_answer(device.describe(), stimulus, answer, rules)
        deliveries.append(Delivery(stimulus, answer, trial, took_s))
    for verb in (device.stop, device.stop, device.unstage, device.unstage):
        verb()
        _check_refusal(device, "after stop() or unstage()", pace)
    device.stage()
    device.stop()
    _check_refusal(device, "after being staged again and stopped", pace)
    return deliveries


def _check_description(device: Device, space: DesignSpace) -> None:
    info = device.describe()
    require(isinstance(info, DeviceInfo), "describe() returns a DeviceInfo before it is staged")
    require(info == device.describe(), "describe() says the same each time")
    require(info.reference == space.reference, f"its reference is the space's, {space.reference}")


def _check_refusal(device: Device, when: str, pace: _Pace) -> None:
    try:
        pace.deliver(device, Stimulus(0, None))
    except DeviceError:
        return
    raise AssertionError(f"broken promise: deliver raises a DeviceError {when}")


def _checked_answer(info: DeviceInfo, stimulus: Stimulus, answer: Answer, rules: _Rules) -> Trial:
    require(isinstance(answer, Sweep | Measurement), "deliver returns a Sweep or a Measurement")
    if isinstance(answer, Sweep):
        units = {name: channel.unit for name, channel in answer.channels.items()}
        require(units == dict(info.channels), f"a sweep has the channels and units of describe(), here {units}")
        require("emg" in units, "a sweep has its EMG")
        timed = answer.t_tms_ms is not None
        require(timed is not stimulus.tap_alone, "a sweep has the time of the pulse, and a tap alone has no pulse")
    else:
        require(not info.channels, "a device that measures the MEP itself describes no channels")
        alone = stimulus.isi_ms is None
        require((answer.isi_ms is None) is alone, "the realised ISI is None for TMS alone, and only then")
    try:
        return rules.judged(answer, stimulus)
    except IsiwError as error:
        raise AssertionError(f"broken promise: a session can judge what deliver returns, here: {error}") from error


def _require_usable(deliveries: Sequence[Delivery], rules: _Rules) -> None:
    """Raise where a session would reject what was delivered, or would pause over it."""
    said = []
    for delivery in deliveries:
        fault = likely_fault(delivery.answer, delivery.trial, rules.limits)
        if fault is not None and not too_early_by_chance(delivery.trial, rules.space):
            said.append(
                f"{fault}" if delivery.trial.reason is None else f"a mistrial, {delivery.trial.reason}: {fault}"
            )
    meps_mv = [delivery.trial.mep_mv for delivery in deliveries if delivery.trial.mep_mv is not None]
    doubt = doubt_of(meps_mv)
    if doubt is not None and doubt.kind is not DoubtKind.EQUAL:
        said.append(doubt.text)
    require(not said, f"a session can use what deliver returns, here {'; '.join(dict.fromkeys(said))}")


def _check_memory(make: Callable[[], Device], space: DesignSpace, pace: _Pace) -> None:
    grid = space.grid_ms
    stimuli = [Stimulus(trial, float(grid[trial * (len(grid) - 1) // 3])) for trial in range(4)]
    uninterrupted = _answers(make(), stimuli, pace)
    resumed = make()
    if isinstance(resumed, HasMemory):
        resumed.resume_after(stimuli[:3])
    (last,) = _answers(resumed, stimuli[3:], pace)
    require(_same(last, uninterrupted[3]), "after resume_after it answers as if it had never been interrupted")


def _answers(device: Device, stimuli: Sequence[Stimulus], pace: _Pace) -> list[Answer]:
    with _disarmed_at_last(device):
        device.stage()
        return [pace.deliver(device, stimulus) for stimulus in stimuli]


def _same(one: Answer, other: Answer) -> bool:
    if isinstance(one, Sweep) and isinstance(other, Sweep):
        same_times = (one.t_valve_ms, one.t_tms_ms, one.t_hit_ms) == (other.t_valve_ms, other.t_tms_ms, other.t_hit_ms)
        pairs = [(channel.values, other.channels[name].values) for name, channel in one.channels.items()]
        return same_times and all(a.shape == b.shape and bool((a == b).all()) for a, b in pairs)
    return one == other
