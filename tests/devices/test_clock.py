from __future__ import annotations

from isiw.devices.clock import Clock, MonotonicClock, VirtualClock


def test_a_virtual_clock_moves_only_by_sleeping() -> None:
    clock = VirtualClock(3.0)
    assert clock.now_s() == 3.0
    clock.sleep_s(4.5)
    assert clock.now_s() == 7.5


def test_a_virtual_clock_never_runs_backwards() -> None:
    clock = VirtualClock()
    clock.sleep_s(-1.0)
    assert clock.now_s() == 0.0


def test_the_monotonic_clock_sleeps_at_least_as_long_as_told() -> None:
    clock = MonotonicClock()
    before = clock.now_s()
    clock.sleep_s(0.02)
    assert clock.now_s() - before >= 0.02


def test_the_monotonic_clock_does_not_sleep_for_a_negative_time() -> None:
    clock = MonotonicClock()
    before = clock.now_s()
    clock.sleep_s(-5.0)
    assert clock.now_s() - before < 1.0


def test_both_clocks_are_clocks() -> None:
    assert isinstance(MonotonicClock(), Clock)
    assert isinstance(VirtualClock(), Clock)
