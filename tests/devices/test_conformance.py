"""Our own devices pass the suite that others are given, and the suite finds what is broken."""

from __future__ import annotations

import dataclasses
import os
import re
import signal
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.devices.clock import Clock, MonotonicClock, VirtualClock
from isiw.devices.info import DeviceInfo
from isiw.devices.limited import LimitedDevice
from isiw.devices.limits import Limits
from isiw.devices.protocol import CallbackDevice, Readiness
from isiw.devices.robot.tapper import Tapper, TapperSettings
from isiw.devices.simulated import RecordedPerson, RecordedTrials, Recordings, SimulatedDevice, SimulatedPerson
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, LimitExceededError, NotDelivered
from isiw.session.rig import exclusive
from isiw.signals.impact import impact_time
from isiw.subjects.cohorts import cohort
from isiw.subjects.subject import Response
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.testing import check_device
from isiw.testing.device_table import Delivery, deflections_ms, late_deflection
from isiw.trials import Status, Stimulus, Trial, TrialTable
from isiw.types import Reference
from known import instance, known
from wrong_rigs import NAMED, WRONG, WrongRig, rig
from wrong_rigs import SPACE as RIG_SPACE


def responder(reference: Reference = "valve") -> Callable[[float | None], Response]:
    begun = cohort("drift", 1, 0)[0].begin(5)
    return lambda isi_ms: begun.respond(isi_ms, reference)


def made_up_recordings() -> Recordings:
    time_ms = np.arange(-150, 301) / 3.0
    rng = np.random.default_rng(0)
    mep = 0.5 * np.sin((time_ms - 18) / 2) * ((time_ms > 18) & (time_ms < 30))
    return Recordings(time_ms, 0.001 * rng.standard_normal((3, 451)), np.stack([mep, 2 * mep]))


def table() -> TrialTable:
    trials = [Trial(0, Status.ACCEPTED, None, mep_mv=0.01)]
    trials += [
        Trial(1 + k, Status.ACCEPTED, isi, isi_ms=isi, mep_mv=isi / 1e3) for k, isi in enumerate((0, 66, 133, 200))
    ]
    return TrialTable(tuple(trials))


def test_a_simulated_device_conforms(space: DesignSpace) -> None:
    check_device(lambda: SimulatedDevice(SimulatedPerson(responder(), "valve")), space)


def test_a_device_of_recorded_sweeps_conforms(space: DesignSpace) -> None:
    check_device(lambda: SimulatedDevice(RecordedPerson(responder(), "valve", made_up_recordings(), seed=1)), space)


def test_a_replaying_device_conforms(space: DesignSpace) -> None:
    check_device(lambda: SimulatedDevice(RecordedTrials(table(), "valve")), space)


def test_a_device_of_functions_conforms(space: DesignSpace) -> None:
    info = DeviceInfo("functions", "valve")
    device = CallbackDevice(lambda stimulus, timeout_s: Measurement(timeout_s, stimulus.isi_ms), info)
    check_device(lambda: device, space, clock=VirtualClock())


def test_a_limited_device_conforms(space: DesignSpace) -> None:
    limits = Limits.of_space(space, min_iti_s=0.0)
    device = SimulatedDevice(SimulatedPerson(responder(), "valve"))
    check_device(lambda: LimitedDevice(device, limits, VirtualClock()), space)


class Careless(SimulatedDevice):
    """Fires although it is stopped."""

    def __init__(self) -> None:
        super().__init__(SimulatedPerson(responder(), "valve"))

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:
        del timeout_s
        return Measurement(0.1, stimulus.isi_ms)


class Forgetful(SimulatedDevice):
    """Begins anew instead of resuming."""

    def resume_after(self, stimuli: Sequence[Stimulus]) -> None:
        del stimuli


class Inaccurate(SimulatedDevice):
    """Fires too late."""

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:
        answer = instance(Measurement, super().deliver(stimulus, timeout_s))
        late_ms = None if answer.isi_ms is None else answer.isi_ms + 20
        return Measurement(answer.mep_mv, late_ms)


def test_the_suite_finds_a_device_that_fires_unarmed(space: DesignSpace) -> None:
    with pytest.raises(AssertionError, match=r"before stage\(\)"):
        check_device(Careless, space)


class Plain(Careless):
    """Refuses with an error of its own."""

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:
        raise RuntimeError(f"not armed: {stimulus}, {timeout_s}")


def test_the_suite_says_how_a_device_refuses_that_raises_an_error_of_its_own(space: DesignSpace) -> None:
    expected = r"deliver raises a DeviceError before stage\(\); found: RuntimeError: not armed"
    with pytest.raises(AssertionError, match=expected):
        check_device(Plain, space)


def test_the_suite_makes_the_device_itself(space: DesignSpace) -> None:
    device: Any = Careless()
    with pytest.raises(InvalidValueError, match="makes the device itself"):
        check_device(device, space)


def test_the_suite_finds_a_device_that_cannot_resume(space: DesignSpace) -> None:
    with pytest.raises(AssertionError, match="never been interrupted"):
        check_device(lambda: Forgetful(SimulatedPerson(responder(), "valve")), space)


def test_the_suite_finds_a_device_with_wrong_timing(space: DesignSpace) -> None:
    with pytest.raises(AssertionError, match=r"3 of 5 trials .* 20 ms.* 0 ms"):
        check_device(lambda: Inaccurate(SimulatedPerson(responder(), "valve")), space)


def test_the_suite_finds_a_device_on_another_reference(space: DesignSpace) -> None:
    with pytest.raises(AssertionError, match=r", valve; found: impact\."):
        check_device(lambda: SimulatedDevice(SimulatedPerson(responder("impact"), "impact")), space)


class Hardware:
    """Stays armed until it is told otherwise, fails at one delivery, and remembers when it fired."""

    def __init__(self, fails_at: int | None = None, clock: Clock | None = None) -> None:
        self.fails_at, self.clock = fails_at, clock or VirtualClock()
        self.armed, self.taken = False, False
        self.fired_s: list[float] = []

    def describe(self) -> DeviceInfo:
        return DeviceInfo("hardware", "valve")

    def stage(self) -> None:
        self.armed = self.taken = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement | Sweep:
        del timeout_s
        if not self.armed:
            raise DeviceError("not armed")
        self.fired_s.append(self.clock.now_s())
        if stimulus.trial == self.fails_at:
            raise DeviceTimeoutError("no answer")
        return Measurement(0.1, stimulus.isi_ms)

    def stop(self) -> None:
        self.armed = False

    def unstage(self) -> None:
        self.armed = self.taken = False


class RememberingHardware(Hardware):
    """Has a memory."""

    def resume_after(self, stimuli: Sequence[Stimulus]) -> None:
        del stimuli


class LateHardware(Hardware):
    """Answers with an ISI that nobody commanded."""

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:
        super().deliver(stimulus, timeout_s)
        return Measurement(0.1, 1000.0)


@pytest.mark.parametrize(
    ("device", "error"),
    [
        (Hardware(fails_at=1), DeviceTimeoutError),
        (RememberingHardware(fails_at=3), DeviceTimeoutError),
        (LateHardware(), AssertionError),
    ],
)
def test_a_device_that_fails_the_suite_is_left_disarmed(
    space: DesignSpace, device: Hardware, error: type[Exception]
) -> None:
    with pytest.raises(error):
        check_device(lambda: device, space, clock=VirtualClock())
    assert device.fired_s
    assert not device.armed
    assert not device.taken


def test_an_inter_trial_interval_passes_before_each_delivery(space: DesignSpace) -> None:
    clock = VirtualClock()
    device = RememberingHardware(clock=clock)
    check_device(lambda: device, space, clock=clock)
    assert len(device.fired_s) == 9
    assert np.diff([0.0, *device.fired_s]).min() >= 5.0


def test_the_suite_waits_in_real_time_for_a_device_that_is_not_simulated(space: DesignSpace) -> None:
    device = Hardware(clock=MonotonicClock())
    check_device(lambda: device, space, iti_s=0.01)
    assert np.diff(device.fired_s).min() >= 0.01


@pytest.mark.parametrize("iti_s", [-1.0, np.nan, np.inf])
def test_an_invalid_interval_is_an_error(space: DesignSpace, iti_s: float) -> None:
    device = Hardware()
    with pytest.raises(InvalidValueError, match="iti_s"):
        check_device(lambda: device, space, iti_s=iti_s)
    assert not device.fired_s


def test_the_suite_finds_what_is_no_device(space: DesignSpace) -> None:
    nothing: Any = object()
    with pytest.raises(AssertionError, match=r"; found: .*without describe, stage"):
        check_device(lambda: nothing, space)


@pytest.mark.parametrize(("answer", "seen"), [(None, "None"), (0.12, r"0\.12 \(float\)")])
def test_the_suite_says_what_is_required_of_an_answer_and_what_was_seen(
    space: DesignSpace, answer: Any, seen: str
) -> None:
    class Wrong(Hardware):
        def deliver(self, stimulus: Stimulus, timeout_s: float) -> Any:
            super().deliver(stimulus, timeout_s)
            return answer

    with pytest.raises(AssertionError, match=f"deliver returns.*; found: {seen}$"):
        check_device(Wrong, space, clock=VirtualClock())


class Slow(Hardware):
    """Takes longer than it is allowed to."""

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement | Sweep:
        answer = super().deliver(stimulus, timeout_s)
        time.sleep(1.2 * timeout_s)
        return answer


def test_the_suite_finds_a_device_that_ignores_its_timeout(space: DesignSpace) -> None:
    with pytest.raises(AssertionError, match=r"timeout of 0.05 s; found: "):
        check_device(Slow, space, clock=VirtualClock(), timeout_s=0.05)


class Rig(Hardware):
    """Answers with sweeps of some channels and lengths."""

    def __init__(self, *, unit: str = "mV", length_ms: int = 600, other: str | None = None) -> None:
        super().__init__()
        self.unit, self.length_ms, self.other = unit, length_ms, other

    def describe(self) -> DeviceInfo:
        return DeviceInfo("rig", "valve", channels={"emg": self.unit} | ({self.other: "V"} if self.other else {}))

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Sweep:
        super().deliver(stimulus, timeout_s)
        noise = 0.001 * np.random.default_rng(stimulus.trial).standard_normal(5 * self.length_ms)
        channels = {name: Channel(noise, 5000.0, unit) for name, unit in self.describe().channels.items()}
        return Sweep(channels, t_valve_ms=100.0, t_tms_ms=100.0 + (stimulus.isi_ms or 0.0))


def test_a_device_of_sweeps_conforms(space: DesignSpace) -> None:
    check_device(Rig, space, clock=VirtualClock())


@pytest.mark.parametrize(
    ("rig", "broken"),
    [
        ({"unit": "microvolt"}, "can judge .*unit of the channel emg"),
        ({"other": "event"}, "can judge .*cannot have this name"),
        ({"length_ms": 310}, "rejected: missing channel"),
    ],
)
def test_the_suite_finds_sweeps_that_no_session_could_use(space: DesignSpace, rig: dict[str, Any], broken: str) -> None:
    with pytest.raises(AssertionError, match=broken):
        check_device(lambda: Rig(**rig), space, clock=VirtualClock())


class Unlearning:
    """The robot with a rig that learns nothing of when the hammer hits: it keeps to what it assumes."""

    def __init__(self, assumed_ms: float, change: Callable[[Sweep], Sweep] = lambda sweep: sweep) -> None:
        settings = TapperSettings(expected_hit_ms=assumed_ms, rate_hz=3000.0)
        self.made = partial(Tapper, lambda _: Response(None, 0.01), "subject4", settings)
        self.info, self.change = self.made().info, change

    def answer(self, stimulus: Stimulus) -> Sweep:
        return self.change(self.made().answer(stimulus))


@pytest.mark.parametrize(("assumed_ms", "change"), [(162.0, "add"), (202.0, "take off")])
def test_a_wrong_hit_delay_is_told_with_the_milliseconds_to_correct(assumed_ms: float, change: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_device(lambda: SimulatedDevice(Unlearning(assumed_ms)), RIG_SPACE)
    said = re.search(
        r"\n\n3 of 5 trials would be rejected: the impact came (\d+) ms after the valve command; "
        rf"your rig assumes {assumed_ms:.0f} ms: {change} (\d+) ms.$",
        str(caught.value),
    )
    hit_ms, by_ms = map(float, known(said).groups())
    assert hit_ms == pytest.approx(182, abs=3)
    assert by_ms == pytest.approx(20, abs=3)


def test_each_fault_of_a_rig_is_a_paragraph_of_its_own() -> None:
    def tense(sweep: Sweep) -> Sweep:
        return WRONG["tense muscle"](sweep) if sweep.t_valve_ms is None else sweep

    with pytest.raises(AssertionError) as caught:
        check_device(lambda: SimulatedDevice(Unlearning(162.0, tense)), RIG_SPACE)
    _, *faults = str(caught.value).split("\n\n")
    assert [fault.partition(":")[0] for fault in faults] == [f"{n} of 5 trials would be rejected" for n in (3, 1)]
    assert "µV RMS, at most" in faults[1]


@pytest.mark.parametrize("wrong", WRONG)
def test_the_suite_names_what_is_wrong_with_a_rig_and_says_what_it_found(wrong: str) -> None:
    said: list[str] = []
    with pytest.raises(AssertionError, match=NAMED[wrong]):
        check_device(lambda: rig(wrong), RIG_SPACE, say=said.append)
    assert said[-1].startswith("background EMG")


def test_a_right_rig_passes_with_a_table_of_what_was_found() -> None:
    rows = dict(check_device(rig, DesignSpace(20, 320, reference="impact")).rows)
    assert rows["impact found"] == "3 of 3"
    assert rows["background EMG"].endswith("µV RMS (a session accepts 10 at most)")
    assert len(rows["realised minus wanted ISI"].split(",")) == 3
    assert "ms from the pulse" in rows["pulse artefact"]
    assert "emg in mV" in rows["units"]
    assert rows["judged"] == "accepted, accepted, accepted, accepted, accepted"


def test_a_hammer_that_moves_before_it_hits_is_a_row_of_the_table() -> None:
    row = dict(check_device(rig, DesignSpace(20, 320, reference="impact")).rows)["acceleration begins"]
    assert re.fullmatch(r"\d+\.\d ms before the impact", row)


def beginning(late_ms: float, hit_ms: float = 180.0) -> Delivery:
    """A pair whose acceleration is first deflected so long after its impact."""
    values = 0.01 * np.resize([1.0, -1.0], 600)
    values[round(2 * (hit_ms + late_ms)) :] += 1.0
    sweep = Sweep({"acceleration": Channel(values, 2000.0, "g")}, t_valve_ms=50.0, t_hit_ms=hit_ms, t_tms_ms=200.0)
    trial = Trial(0, Status.ACCEPTED, 20.0, isi_ms=20.0, mep_mv=0.1, t_valve_ms=50.0, t_hit_ms=hit_ms, t_tms_ms=200.0)
    return Delivery(Stimulus(0, 20.0), sweep, trial, took_s=0.1)


def test_an_acceleration_that_begins_after_the_impact_is_a_fault_with_its_milliseconds() -> None:
    deliveries = [beginning(late_ms) for late_ms in (6.5, 7.0, 30.0)]
    assert deflections_ms(deliveries) == pytest.approx([6.5, 7.0, 30.0])
    fault = known(late_deflection(deliveries))
    assert "is first deflected 7.0 ms after the reported impact" in fault
    assert fault.endswith("Is the accelerometer on the hammer? Are both times on the sweep's own clock?")


def test_an_acceleration_that_begins_before_the_impact_or_is_not_recorded_is_none() -> None:
    moves, at_the_impact = [beginning(-12.0)] * 3, [beginning(2.0)] * 3
    measured = Delivery(
        Stimulus(0, 20.0), Measurement(0.1, 20.0), Trial(0, Status.ACCEPTED, 20.0, mep_mv=0.1), took_s=0.1
    )
    assert [late_deflection(found) for found in (moves, at_the_impact, [measured], [])] == [None] * 4


def test_a_check_fails_where_the_accelerometer_is_not_on_the_hammer() -> None:
    def elsewhere(sweep: Sweep) -> Sweep:
        acceleration = sweep.channels["acceleration"]
        if sweep.t_valve_ms is None:
            return sweep
        hit_ms = impact_time(acceleration.values, acceleration.rate_hz, after_ms=sweep.t_valve_ms - acceleration.t0_ms)
        late = np.roll(acceleration.values, round(0.1 * acceleration.rate_hz))
        channels = {**sweep.channels, "acceleration": dataclasses.replace(acceleration, values=late)}
        return dataclasses.replace(sweep, channels=channels, t_hit_ms=known(hit_ms) + acceleration.t0_ms)

    with pytest.raises(AssertionError, match="Is the accelerometer on the hammer"):
        check_device(lambda: SimulatedDevice(WrongRig(elsewhere)), RIG_SPACE)


def test_the_suite_finds_a_rig_that_gives_a_pulse_with_a_tap_alone(space: DesignSpace) -> None:
    class Unaware(Rig):
        def describe(self) -> DeviceInfo:
            return dataclasses.replace(super().describe(), tap_alone=True)

    with pytest.raises(AssertionError, match="has no pulse"):
        check_device(Unaware, space, clock=VirtualClock())


@pytest.mark.parametrize(
    ("device", "announced"),
    [
        (Hardware(), "This check stimulates: 3 pairs and one magnetic pulse alone, 5 s apart. It then arms"),
        (RememberingHardware(), "This check stimulates: 8 pairs and one magnetic pulse alone, 5 s apart. It then arms"),
    ],
)
def test_the_suite_says_beforehand_that_it_stimulates(space: DesignSpace, device: Hardware, announced: str) -> None:
    said: list[tuple[int, str]] = []

    def say(text: str) -> None:
        said.append((len(device.fired_s), text))

    check_device(lambda: device, space, clock=VirtualClock(), say=say)
    assert said[0][0] == 0
    assert said[0][1].startswith(announced)


def test_a_simulated_device_is_announced_as_one(space: DesignSpace) -> None:
    said: list[str] = []
    check_device(lambda: SimulatedDevice(SimulatedPerson(responder(), "valve")), space, say=said.append)
    assert said[0] == "simulated person is simulated: nothing is delivered to anybody."


class ReportingHardware(Hardware):
    """Says how it is before each pulse."""

    def __init__(self, state: Readiness) -> None:
        super().__init__()
        self.state = state

    def readiness(self) -> Readiness:
        return self.state


@pytest.mark.parametrize(
    ("state", "limit", "error"),
    [
        (Readiness(ready=False, reason="charging"), {}, NotDelivered),
        (Readiness(coil_c=95.0), {"max_coil_c": 40.0}, LimitExceededError),
        (Readiness(intensity_pct_mso=100.0), {"intensity_pct_mso": 45.0}, LimitExceededError),
        (Readiness(), {"intensity_pct_mso": 45.0}, LimitExceededError),
        (Readiness(), {"low_ms": 5.0, "step_ms": None}, LimitExceededError),
    ],
)
def test_the_suite_gives_no_pulse_that_a_session_would_refuse(
    space: DesignSpace, state: Readiness, limit: dict[str, Any], error: type[Exception]
) -> None:
    device, limits = ReportingHardware(state), dataclasses.replace(Limits.of_space(space), **limit)
    with pytest.raises(error):
        check_device(lambda: device, space, clock=VirtualClock(), limits=limits)
    assert not device.fired_s
    assert not device.armed


def test_the_suite_gives_no_more_pulses_than_the_limits_allow(space: DesignSpace) -> None:
    device = Hardware()
    with pytest.raises(LimitExceededError, match="the limit of 2 pulses"):
        check_device(lambda: device, space, clock=VirtualClock(), limits=Limits.of_space(space, max_pulses=2))
    assert len(device.fired_s) == 2
    assert not device.armed


def test_the_suite_waits_as_long_as_the_limits_ask_for(space: DesignSpace) -> None:
    clock = VirtualClock()
    device = RememberingHardware(clock=clock)
    limits = dataclasses.replace(Limits.of_space(space, min_iti_s=20.0), max_block_pulses=6, rest_s=300.0)
    said: list[str] = []
    check_device(lambda: device, space, clock=clock, limits=limits, say=said.append)
    waits_s = np.diff([0.0, *device.fired_s])
    assert waits_s.min() >= 20.0
    assert waits_s[6] >= 300.0
    assert "20 s apart" in said[0]


def test_the_suite_tries_again_what_was_refused_before_firing(space: DesignSpace) -> None:
    class Charging(Hardware):
        refusals = 2

        def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement | Sweep:
            if self.armed and self.refusals:
                self.refusals -= 1
                raise NotDelivered("charging")
            return super().deliver(stimulus, timeout_s)

    device = Charging()
    check_device(lambda: device, space, clock=VirtualClock())
    assert len(device.fired_s) == 4


class HangingHardware(Hardware):
    """Hangs in its second delivery until it is stopped."""

    def __init__(self) -> None:
        super().__init__()
        self.stopped = threading.Event()

    def stage(self) -> None:
        super().stage()
        self.stopped.clear()

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement | Sweep:
        answer = super().deliver(stimulus, timeout_s)
        if len(self.fired_s) == 2:
            self.stopped.wait(20.0)
        return answer

    def stop(self) -> None:
        super().stop()
        self.stopped.set()


def test_a_delivery_that_hangs_is_given_up_and_the_device_disarmed(space: DesignSpace) -> None:
    device = HangingHardware()
    began_s = time.monotonic()
    with pytest.raises(AssertionError, match=r"timeout of 0.2 s.* was disarmed"):
        check_device(lambda: device, space, clock=VirtualClock(), timeout_s=0.2)
    assert time.monotonic() - began_s < 10.0
    assert len(device.fired_s) == 2
    assert not device.armed


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_between_pulses_disarms_and_ends_the_check(space: DesignSpace, number: signal.Signals) -> None:
    class Signalling(VirtualClock):
        def sleep_s(self, duration_s: float) -> None:
            super().sleep_s(duration_s)
            if len(device.fired_s) == 2:
                signal.raise_signal(number)

    device, before = Hardware(), signal.signal(number, lambda *_: None)
    try:
        with pytest.raises(KeyboardInterrupt):
            check_device(lambda: device, space, clock=Signalling())
        assert signal.getsignal(number) is not signal.SIG_DFL
    finally:
        signal.signal(number, before)
    assert len(device.fired_s) == 2
    assert not device.armed
    assert not device.taken


def test_the_suite_finds_a_stop_that_fails_before_anything_is_armed(space: DesignSpace) -> None:
    class Unstoppable(Hardware):
        def stop(self) -> None:
            raise RuntimeError("no port")

    device = Unstoppable()
    with pytest.raises(AssertionError, match=r"any state; found: .*no port"):
        check_device(lambda: device, space, clock=VirtualClock())
    assert not device.taken


def test_no_device_is_checked_that_a_session_drives(space: DesignSpace) -> None:
    device = Hardware()
    with exclusive(device, device.describe()), pytest.raises(DeviceError, match="driven by another session"):
        check_device(lambda: device, space, clock=VirtualClock())
    assert not device.taken


class PhantomRig(Hardware):
    """EMG at rest, with 3 mV of the stimulator's artefact, and a stated time of the pulse that may be too early."""

    def __init__(
        self, early_ms: float = 0.0, *, unit: str = "mV", only: Callable[[Stimulus], bool] | None = None
    ) -> None:
        super().__init__()
        self.early_ms, self.unit, self.only = early_ms, unit, only or (lambda _: True)
        self.simulated = False

    def describe(self) -> DeviceInfo:
        return DeviceInfo("rig", "impact", simulated=self.simulated, channels={"emg": self.unit})

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Sweep:
        super().deliver(stimulus, timeout_s)
        since_ms = np.arange(-600.0, 100.0, 0.2)
        emg_mv = 0.0015 * np.random.default_rng(stimulus.trial).standard_normal(since_ms.size)
        early_ms = self.early_ms if self.only(stimulus) else 0.0
        emg_mv += 3.0 * np.exp(-np.clip(since_ms, 0.0, None) / 0.5) * (since_ms >= 0)
        channel = Channel(emg_mv * {"mV": 1.0, "uV": 1e3}[self.unit], 5000.0, self.unit, t0_ms=-600.0)
        hit_ms = None if stimulus.isi_ms is None else -early_ms - stimulus.isi_ms
        return Sweep({"emg": channel}, t_tms_ms=-early_ms, t_hit_ms=hit_ms)


@pytest.mark.parametrize("unit", ["mV", "uV"])
def test_the_suite_finds_an_artefact_in_the_mep_window_of_a_phantom(unit: str) -> None:
    with pytest.raises(AssertionError, match=r"phantom.* TMS alone .* time of the pulse"):
        check_device(lambda: PhantomRig(15.0, unit=unit), RIG_SPACE, clock=VirtualClock())
    check_device(lambda: PhantomRig(unit=unit), RIG_SPACE, clock=VirtualClock())


def test_the_suite_finds_an_artefact_that_pairs_alone_have() -> None:
    def is_pair(stimulus: Stimulus) -> bool:
        return stimulus.isi_ms is not None

    with pytest.raises(AssertionError, match=r"phantom .* more than one pair"):
        check_device(lambda: PhantomRig(15.0, only=is_pair), RIG_SPACE, clock=VirtualClock())
    reflex = PhantomRig(15.0, only=lambda stimulus: stimulus.trial == 0)  # what one ISI alone shows may be the tap's
    check_device(lambda: reflex, RIG_SPACE, clock=VirtualClock())


@pytest.mark.parametrize("early_ms", [5.0, 12.0, 40.0, 47.0])
def test_the_suite_finds_a_pulse_away_from_its_reported_time_on_a_phantom(early_ms: float) -> None:
    late = rf"phantom evokes nothing, and the steepest edge of the EMG is \+{early_ms - 0.2:.1f} ms from the reported"
    with pytest.raises(AssertionError, match=late):
        check_device(lambda: PhantomRig(early_ms), RIG_SPACE, clock=VirtualClock())
    simulated = PhantomRig(early_ms)
    simulated.simulated = True
    if early_ms <= 12.0:
        check_device(lambda: simulated, RIG_SPACE)
        return
    with pytest.raises(AssertionError, match=f"at -{early_ms:.0f} ms"):
        check_device(lambda: simulated, RIG_SPACE)


class Blanking(PhantomRig):
    """Its amplifier blanks the pulse for some time, and lets go with a jump; the tap shows as clearly."""

    def __init__(self, blanked_ms: float) -> None:
        super().__init__()
        self.blanked_ms = blanked_ms

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Sweep:
        Hardware.deliver(self, stimulus, timeout_s)
        since_ms = np.arange(-600.0, 100.0, 0.2)
        emg_mv = 0.0015 * np.random.default_rng(stimulus.trial).standard_normal(since_ms.size)
        emg_mv[(since_ms >= -1.0) & (since_ms < self.blanked_ms)] = 0.0
        let_go_ms = since_ms - self.blanked_ms
        emg_mv += 0.5 * np.exp(-np.clip(let_go_ms, 0.0, None)) * (let_go_ms >= 0) * (self.blanked_ms > 0)
        if stimulus.isi_ms is not None:
            tap_ms = since_ms + stimulus.isi_ms - 20.0
            emg_mv[(tap_ms >= 0) & (tap_ms < 1)] += 3.0
        hit_ms = None if stimulus.isi_ms is None else -stimulus.isi_ms
        return Sweep({"emg": Channel(emg_mv, 5000.0, "mV", t0_ms=-600.0)}, t_tms_ms=0.0, t_hit_ms=hit_ms)


@pytest.mark.parametrize("blanked_ms", [-1.0, 5.0, 8.0])
def test_an_amplifier_that_blanks_the_pulse_and_the_artefact_of_a_tap_are_no_late_pulse(blanked_ms: float) -> None:
    check_device(lambda: Blanking(blanked_ms), DesignSpace(25, 320, reference="impact"), clock=VirtualClock())


def test_a_device_that_was_checked_is_gone_as_its_streams_would_keep_their_listeners() -> None:
    made: list[weakref.ref[SimulatedDevice]] = []

    def make() -> SimulatedDevice:
        respond = partial(cohort("gaussian", 1, 1)[0].begin(1).respond, reference="valve")
        device = SimulatedDevice(SimulatedPerson(respond, "valve"))
        made.append(weakref.ref(device))
        return device

    check_device(make, VALVE_SPACE, say=lambda _said: None)
    assert {device() for device in made} == {None}
