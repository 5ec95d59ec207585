from __future__ import annotations

import threading
from typing import Any, Never, cast

import pytest

from isiw.devices.clock import MonotonicClock, VirtualClock
from isiw.devices.info import DeviceInfo
from isiw.devices.limited import LimitedDevice
from isiw.devices.limits import Limits
from isiw.devices.protocol import Readiness
from isiw.errors import DeviceError, InvalidValueError, LimitExceededError, NotDelivered
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from isiw.visit import Visit
from scripted import ScriptedDevice

LIMITS = Limits(low_ms=0, high_ms=200, min_iti_s=5.0, max_pulses=3)


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def inner() -> ScriptedDevice:
    return ScriptedDevice()


@pytest.fixture
def limited(inner: ScriptedDevice, clock: VirtualClock) -> LimitedDevice:
    device = LimitedDevice(inner, LIMITS, clock)
    device.stage()
    clock.sleep_s(device.wait_s())
    return device


@pytest.mark.parametrize("isi_ms", [-0.001, 200.001, 1e9])
def test_an_isi_beyond_the_range_is_refused_before_anything_is_delivered(
    limited: LimitedDevice, inner: ScriptedDevice, isi_ms: float | None
) -> None:
    with pytest.raises(LimitExceededError, match="beyond the limits"):
        limited.deliver(Stimulus(0, isi_ms), 1.0)
    assert inner.delivered == []
    assert limited.pulses_left == 3


@pytest.mark.parametrize("isi_ms", [0.0, 200.0, None])
def test_the_ends_of_the_range_and_tms_alone_are_allowed(
    limited: LimitedDevice, inner: ScriptedDevice, isi_ms: float | None
) -> None:
    limited.deliver(Stimulus(0, isi_ms), 1.0)
    assert inner.delivered == [Stimulus(0, isi_ms)]


def test_a_stimulus_before_the_interval_is_over_is_refused(
    limited: LimitedDevice, inner: ScriptedDevice, clock: VirtualClock
) -> None:
    limited.deliver(Stimulus(0, 10), 1.0)
    clock.sleep_s(4.999)
    with pytest.raises(LimitExceededError, match="too early"):
        limited.deliver(Stimulus(1, 10), 1.0)
    assert len(inner.delivered) == 1
    clock.sleep_s(limited.wait_s())
    limited.deliver(Stimulus(1, 10), 1.0)
    assert len(inner.delivered) == 2


def test_the_interval_runs_from_the_end_of_the_last_attempt(inner: ScriptedDevice, clock: VirtualClock) -> None:
    def slow(stimulus: Stimulus) -> Never:
        del stimulus
        clock.sleep_s(3.0)
        raise DeviceError("no answer")

    inner.answer = slow
    limited = LimitedDevice(inner, LIMITS, clock)
    limited.stage()
    clock.sleep_s(limited.wait_s())
    with pytest.raises(DeviceError, match="no answer"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert limited.wait_s() == 5.0


def test_a_delivery_that_fails_counts_as_delivered(limited: LimitedDevice, inner: ScriptedDevice) -> None:
    def failing(stimulus: Stimulus) -> Never:
        raise RuntimeError(stimulus)

    inner.answer = failing
    with pytest.raises(RuntimeError):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert limited.pulses_left == 2


def test_no_pulse_beyond_the_largest_number_is_delivered(
    limited: LimitedDevice, inner: ScriptedDevice, clock: VirtualClock
) -> None:
    for trial in range(3):
        limited.deliver(Stimulus(trial, 10), 1.0)
        clock.sleep_s(5.0)
    assert limited.pulses_left == 0
    with pytest.raises(LimitExceededError, match="limit of 3 pulses"):
        limited.deliver(Stimulus(3, 10), 1.0)
    assert len(inner.delivered) == 3


def test_pulses_of_an_earlier_run_count(inner: ScriptedDevice, clock: VirtualClock) -> None:
    limited = LimitedDevice(inner, LIMITS, clock, delivered=3)
    limited.stage()
    with pytest.raises(LimitExceededError, match="limit of 3 pulses"):
        limited.deliver(Stimulus(3, 10), 1.0)
    assert inner.delivered == []


@pytest.mark.parametrize("delivered", [0, 1])
def test_the_first_stimulus_waits_a_whole_interval(inner: ScriptedDevice, clock: VirtualClock, delivered: int) -> None:
    assert LimitedDevice(inner, LIMITS, clock, delivered=delivered).wait_s() == LIMITS.min_iti_s


def test_nothing_is_delivered_unless_staged(inner: ScriptedDevice, clock: VirtualClock) -> None:
    limited = LimitedDevice(inner, LIMITS, clock)
    with pytest.raises(DeviceError, match="not staged"):
        limited.deliver(Stimulus(0, 10), 1.0)
    limited.stage()
    limited.stop()
    with pytest.raises(DeviceError, match="not staged"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []
    assert limited.pulses_left == 3


def test_a_device_that_fails_to_stage_stays_disarmed(
    inner: ScriptedDevice, clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> Never:
        raise DeviceError("no power")

    monkeypatch.setattr(inner, "stage", broken)
    limited = LimitedDevice(inner, LIMITS, clock)
    with pytest.raises(DeviceError, match="no power"):
        limited.stage()
    with pytest.raises(DeviceError, match="not staged"):
        limited.deliver(Stimulus(0, 10), 1.0)


@pytest.mark.parametrize("error", [NotDelivered("no charge"), LimitExceededError("the device's own limit")])
def test_what_was_refused_before_firing_does_not_count(
    limited: LimitedDevice, inner: ScriptedDevice, error: DeviceError
) -> None:
    def refusing(stimulus: Stimulus) -> Never:
        del stimulus
        raise error

    inner.answer = refusing
    with pytest.raises(type(error)):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert limited.pulses_left == 3
    assert limited.wait_s() == 0.0


def test_earlier_stimuli_count_for_the_block_and_the_period(inner: ScriptedDevice, clock: VirtualClock) -> None:
    limits = Limits(0, 200, min_iti_s=5.0, max_block_pulses=3, rest_s=60.0, max_period_pulses=4, period_s=1000.0)
    assert LimitedDevice(inner, limits, clock, earlier_s=(10.0, 15.0, 20.0)).wait_s() == 50.0
    assert LimitedDevice(inner, limits, clock, earlier_s=(100.0, 200.0, 300.0, 400.0)).wait_s() == 600.0


def test_of_two_threads_only_one_delivers_at_a_time() -> None:
    together = threading.Barrier(2)

    def answer(stimulus: Stimulus) -> Measurement:
        return Measurement(0.1, stimulus.isi_ms)

    inner = ScriptedDevice(answer)
    clock = MonotonicClock()
    limited = LimitedDevice(inner, Limits(0, 200, min_iti_s=0.05, max_pulses=1000), clock)
    limited.stage()
    clock.sleep_s(limited.wait_s())  # the interval before the first one
    refused: list[LimitExceededError] = []

    def deliver(number: int) -> None:
        together.wait()
        try:
            limited.deliver(Stimulus(number, 10), 1.0)
        except LimitExceededError as error:
            refused.append(error)

    for _ in range(20):
        before = len(inner.delivered)
        threads = [threading.Thread(target=deliver, args=(number,)) for number in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(inner.delivered) == before + 1
        clock.sleep_s(limited.wait_s())  # the interval before the next two
    assert len(refused) == 20
    assert all("too early" in str(error) for error in refused)


def test_a_limit_cannot_be_loosened_while_the_device_is_in_use(limited: LimitedDevice, inner: ScriptedDevice) -> None:
    loose = Limits(0, 1000, min_iti_s=0.0, max_pulses=1000)
    with pytest.raises(AttributeError):
        limited.limits = loose  # type: ignore[misc]  # which is what is tested
    mine, clock = Limits(0, 200, min_iti_s=5.0, max_pulses=3), VirtualClock()
    device = LimitedDevice(inner, mine, clock)
    object.__setattr__(mine, "high_ms", 1000.0)
    device.stage()
    clock.sleep_s(5.0)  # the interval before the first one
    with pytest.raises(LimitExceededError, match="beyond the limits"):
        device.deliver(Stimulus(0, 500.0), 1.0)


class Claiming(float):
    """A number that says anything about itself."""

    def __le__(self, other: object) -> bool:
        return True

    def __ge__(self, other: object) -> bool:
        return True


def test_a_number_that_pretends_to_be_within_the_limits_is_refused(
    limited: LimitedDevice, inner: ScriptedDevice
) -> None:
    stimulus = Stimulus(0, Claiming(5000.0))
    assert type(stimulus.isi_ms) is float
    with pytest.raises(LimitExceededError, match="beyond the limits"):
        limited.deliver(stimulus, 1.0)
    assert inner.delivered == []


class Reporting:
    """A device that reports its state, wrapped around another."""

    def __init__(self, inner: ScriptedDevice, state: Readiness) -> None:
        self._inner, self.state = inner, state

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def readiness(self) -> Readiness:
        return self.state


def reporting(
    inner: ScriptedDevice, clock: VirtualClock, state: Readiness, **limits: Any
) -> tuple[Reporting, LimitedDevice]:
    device = Reporting(inner, state)
    limited = LimitedDevice(device, Limits(0, 200, min_iti_s=5.0, max_pulses=9, **limits), clock)
    limited.stage()
    clock.sleep_s(limited.wait_s())
    return device, limited


def test_a_device_that_is_not_ready_delivers_nothing_and_may_be_tried_again(
    inner: ScriptedDevice, clock: VirtualClock
) -> None:
    device, limited = reporting(inner, clock, Readiness(ready=False, reason="charging"))
    with pytest.raises(NotDelivered, match="charging"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []
    device.state = Readiness()
    limited.deliver(Stimulus(0, 10), 1.0)
    assert len(inner.delivered) == 1


@pytest.mark.parametrize("state", [None, True])
def test_a_state_that_is_none_delivers_nothing(inner: ScriptedDevice, clock: VirtualClock, state: Any) -> None:
    device, limited = reporting(inner, clock, Readiness())
    device.state = state
    with pytest.raises(DeviceError, match=r"readiness\(\).*isiw.Readiness"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []


def test_a_hot_coil_delivers_nothing(inner: ScriptedDevice, clock: VirtualClock) -> None:
    device, limited = reporting(inner, clock, Readiness(coil_c=39.0), max_coil_c=40.0)
    limited.check(Stimulus(0, 10))
    device.state = Readiness(coil_c=41.0)
    with pytest.raises(LimitExceededError, match="41 °C"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []


def test_the_intensity_at_staging_is_locked_also_when_it_is_staged_again(
    inner: ScriptedDevice, clock: VirtualClock
) -> None:
    device, limited = reporting(inner, clock, Readiness(intensity_pct_mso=55.0))
    device.state = Readiness(intensity_pct_mso=60.0)
    limited.stop()
    limited.stage()
    clock.sleep_s(limited.wait_s())
    with pytest.raises(LimitExceededError, match=r"60 % MSO.*55 % MSO"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []


@pytest.mark.parametrize(("noted", "delivered"), [(None, 1), (60.0, 0)])
def test_an_intensity_that_is_reported_only_after_staging_binds_as_well(
    inner: ScriptedDevice, clock: VirtualClock, noted: float | None, delivered: int
) -> None:
    device = Reporting(inner, Readiness())
    limited = LimitedDevice(device, LIMITS, clock, noted=Visit(intensity_pct_mso=noted))
    limited.stage()
    device.state = Readiness(intensity_pct_mso=55.0)
    for _ in range(delivered):
        clock.sleep_s(limited.wait_s())
        limited.deliver(Stimulus(0, 10), 1.0)
    device.state = Readiness(intensity_pct_mso=61.0)
    clock.sleep_s(limited.wait_s())
    with pytest.raises(LimitExceededError, match=r"61 % MSO.*(55|60) % MSO"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert len(inner.delivered) == delivered


def test_an_intensity_is_the_same_up_to_what_a_conversion_loses(inner: ScriptedDevice, clock: VirtualClock) -> None:
    device, limited = reporting(inner, clock, Readiness(intensity_pct_mso=55.0))
    device.state = Readiness(intensity_pct_mso=55.000001)
    limited.deliver(Stimulus(0, 10), 1.0)
    assert len(inner.delivered) == 1


def test_another_intensity_than_the_visit_notes_delivers_nothing(inner: ScriptedDevice, clock: VirtualClock) -> None:
    device = Reporting(inner, Readiness(intensity_pct_mso=60.0))
    limited = LimitedDevice(
        device, Limits(0, 200, min_iti_s=5.0, max_pulses=9), clock, noted=Visit(intensity_pct_mso=55.0)
    )
    limited.stage()
    clock.sleep_s(limited.wait_s())
    with pytest.raises(LimitExceededError, match=r"60 % MSO.*55 % MSO"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []


@pytest.mark.parametrize(("reported", "stops"), [(55.0, False), (55.4, False), (50.0, True), (None, False)])
def test_a_device_that_reports_another_intensity_than_it_was_asked_to_set_fires_no_more(
    inner: ScriptedDevice, clock: VirtualClock, reported: float | None, *, stops: bool
) -> None:
    inner.info = DeviceInfo("scripted", "valve", simulated=True, sets_intensity=True)
    device = Reporting(inner, Readiness(intensity_pct_mso=45.0))
    visit = Visit(intensity_pct_rmt=90.0, intensity_pct_mso=45.0)
    limited = LimitedDevice(
        device, Limits(0, 200, min_iti_s=5.0, max_pulses=9, max_intensity_pct_rmt=110.0), clock, noted=visit
    )
    limited.stage()
    for trial in range(2):
        clock.sleep_s(limited.wait_s())
        if trial and stops:
            with pytest.raises(LimitExceededError, match=r"has set another intensity.*50 % MSO.*55\.0 % MSO"):
                limited.deliver(Stimulus(trial, 10, intensity_pct_rmt=90.0), 1.0)
        else:
            limited.deliver(Stimulus(trial, 10, intensity_pct_rmt=110.0), 1.0)
            device.state = Readiness(intensity_pct_mso=reported)
    assert len(inner.delivered) == 2 - stops


@pytest.mark.parametrize(("reported", "stops"), [(50.0, False), (55.4, False), (56.0, True), (95.0, True)])
def test_an_intensity_that_is_set_by_hand_is_never_above_the_highest(
    inner: ScriptedDevice, clock: VirtualClock, reported: float, *, stops: bool
) -> None:
    device, visit = Reporting(inner, Readiness()), Visit(intensity_pct_rmt=90.0, intensity_pct_mso=45.0)
    limited = LimitedDevice(
        device, Limits(0, 200, min_iti_s=5.0, max_pulses=9, max_intensity_pct_rmt=110.0), clock, noted=visit
    )
    limited.stage()
    clock.sleep_s(limited.wait_s())
    device.state = Readiness(intensity_pct_mso=reported)
    if stops:
        with pytest.raises(LimitExceededError, match=r"reports a higher intensity.*at most 55\.0 % MSO"):
            limited.deliver(Stimulus(0, 10), 1.0)
    else:
        limited.deliver(Stimulus(0, 10), 1.0)
    assert len(inner.delivered) == (not stops)


def test_a_whole_interval_passes_after_each_arming(inner: ScriptedDevice, clock: VirtualClock) -> None:
    _, limited = reporting(inner, clock, Readiness())
    limited.deliver(Stimulus(0, 10), 1.0)
    clock.sleep_s(60.0)
    limited.stop()
    assert limited.wait_s() == 0.0
    limited.stage()
    assert limited.wait_s() == LIMITS.min_iti_s


def test_a_device_that_is_stopped_while_it_is_checked_delivers_nothing(
    inner: ScriptedDevice, clock: VirtualClock
) -> None:
    def held() -> bool:
        guarded.stop()
        return True

    guarded = LimitedDevice(inner, LIMITS, clock, dead_man=held)
    guarded.stage()
    clock.sleep_s(guarded.wait_s())
    with pytest.raises(NotDelivered, match="not staged"):
        guarded.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []


@pytest.mark.parametrize("held", [False, None, 1, "yes"])
def test_without_the_dead_mans_switch_nothing_is_delivered(
    inner: ScriptedDevice, clock: VirtualClock, held: object
) -> None:
    limited = LimitedDevice(inner, LIMITS, clock, dead_man=lambda: cast("bool", held))
    limited.stage()
    clock.sleep_s(limited.wait_s())
    with pytest.raises(LimitExceededError, match="dead man"):
        limited.deliver(Stimulus(0, 10), 1.0)
    assert inner.delivered == []


def test_a_virtual_clock_is_for_simulated_devices_only() -> None:
    with pytest.raises(DeviceError, match="simulated=True"):
        LimitedDevice(ScriptedDevice(simulated=False), LIMITS, VirtualClock())


def test_a_word_is_neither_simulated_nor_ready() -> None:
    with pytest.raises(InvalidValueError, match=r"DeviceInfo.simulated.*got 'false'"):
        DeviceInfo("rig", "impact", simulated=cast("bool", "false"))
    with pytest.raises(InvalidValueError, match=r"Readiness.ready"):
        Readiness(ready=cast("bool", "no"))


@pytest.mark.parametrize(
    ("own", "words"), [({"shortest_iti_s": 6.0}, "min_iti_s = 5"), ({"most_pulses": 2}, "max_pulses = 3")]
)
def test_limits_that_allow_more_than_the_device_gives_are_refused(
    own: dict[str, Any], words: str, inner: ScriptedDevice, clock: VirtualClock
) -> None:
    inner.info = DeviceInfo("scripted", "valve", simulated=True, **own)
    with pytest.raises(DeviceError, match=words):
        LimitedDevice(inner, LIMITS, clock)
    inner.info = DeviceInfo("scripted", "valve", simulated=True, shortest_iti_s=5.0, most_pulses=3)
    LimitedDevice(inner, LIMITS, clock)
