from __future__ import annotations

import math
from typing import Any, Never

import pytest

from isiw.design import DesignSpace
from isiw.devices.clock import VirtualClock
from isiw.devices.limits import LimitedDevice, Limits
from isiw.errors import DeviceError, InvalidValueError, LimitExceededError
from isiw.trials import Stimulus
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
    return device


@pytest.mark.parametrize("isi_ms", [-0.001, 200.001, 1e9])
def test_an_isi_beyond_the_range_is_refused_before_anything_is_delivered(
    limited: LimitedDevice, inner: ScriptedDevice, isi_ms: float
) -> None:
    with pytest.raises(LimitExceededError, match="beyond the limits"):
        limited.deliver(Stimulus(0, isi_ms), 1.0)
    assert inner.delivered == []
    assert limited.pulses_left == 3


@pytest.mark.parametrize("isi_ms", [0.0, 200.0, None])
def test_the_ends_of_the_range_and_tms_alone_are_allowed(
    limited: LimitedDevice, inner: ScriptedDevice, isi_ms: float
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


def test_the_first_stimulus_after_a_resumption_waits_a_whole_interval(
    inner: ScriptedDevice, clock: VirtualClock
) -> None:
    limited = LimitedDevice(inner, LIMITS, clock, delivered=1)
    assert limited.wait_s() == LIMITS.min_iti_s


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


class Powerless(ScriptedDevice):
    def stage(self) -> Never:
        raise DeviceError("no power")


def test_a_device_that_fails_to_stage_stays_disarmed(clock: VirtualClock) -> None:
    limited = LimitedDevice(Powerless(), LIMITS, clock)
    with pytest.raises(DeviceError, match="no power"):
        limited.stage()
    with pytest.raises(DeviceError, match="not staged"):
        limited.deliver(Stimulus(0, 10), 1.0)


@pytest.mark.parametrize(
    "values",
    [
        {"low_ms": math.nan},
        {"high_ms": math.inf},
        {"low_ms": 300},
        {"min_iti_s": -1},
        {"min_iti_s": math.nan},
        {"max_pulses": 0},
        {"max_pulses": math.nan},
        {"max_pulses": math.inf},
        {"max_pulses": 3.0},
        {"max_pulses": True},
    ],
)
def test_limits_that_limit_nothing_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Limits(**({"low_ms": 0, "high_ms": 200} | values))


def test_limits_of_a_space_hold_exactly_its_isis(space: DesignSpace) -> None:
    limits = Limits.of_space(space, max_pulses=7)
    assert (limits.low_ms, limits.high_ms, limits.max_pulses) == (space.low_ms, space.high_ms, 7)
