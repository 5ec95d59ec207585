"""The faulty device, and sessions that stand it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from benchmarks.faulty_device import Fault, FaultyDevice, Fired, check_ledger
from benchmarks.soak import Soaked, check

from isiw.devices.clock import VirtualClock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Readiness
from isiw.errors import DeviceError, NotDelivered
from isiw.log.record import SessionRecord, read_session
from isiw.session.loop import Session
from isiw.trials import Stimulus
from scripted import ScriptedDevice, scripted_strategy

Run: TypeAlias = tuple[list[Fired], SessionRecord]

LIMITS = Limits(0, 200, min_iti_s=5.0, max_pulses=10)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 12))])
def test_a_session_with_a_device_that_fails_in_every_way_loses_nothing_and_gives_nothing_twice(
    tmp_path: Path, seed: int
) -> None:
    soaked = Soaked(tmp_path, seed, trials=8, rate=0.2)
    record = soaked.run()
    assert len(record.table) == 8
    check(soaked, record)


def faulty(fault: Fault, **arguments: Any) -> FaultyDevice:
    device = FaultyDevice(ScriptedDevice(), 1, VirtualClock(), rate=1.0, faults=[fault], **arguments)
    device.stage()
    return device


def test_the_same_seed_fails_in_the_same_way() -> None:
    def happened(seed: int) -> list[Readiness]:
        device = FaultyDevice(
            ScriptedDevice(), seed, VirtualClock(), rate=0.5, faults=[Fault.NOT_READY, Fault.HOT_COIL]
        )
        return [device.readiness() for _ in range(20)]

    assert happened(3) == happened(3) != happened(4)


def test_what_is_refused_is_not_fired() -> None:
    device = faulty(Fault.REFUSED)
    with pytest.raises(NotDelivered):
        device.deliver(Stimulus(0, 50.0), 1.0)
    assert device.ledger == []


def test_what_fails_after_firing_was_fired() -> None:
    device = faulty(Fault.FAILS_AFTER)
    with pytest.raises(DeviceError):
        device.deliver(Stimulus(0, 50.0), 1.0)
    assert device.ledger == [Fired(0, 50.0, 0.0)]
    assert device.happened == {Fault.FAILS_AFTER: 1}


@pytest.mark.parametrize(
    "fault", [Fault.NO_ANSWER, Fault.WRONG_KIND, Fault.WRONG_ISI, Fault.MISSING_CHANNEL, Fault.DUPLICATE]
)
def test_a_wrong_answer_is_wrong(fault: Fault) -> None:
    device, right = faulty(fault), ScriptedDevice()
    device.deliver(Stimulus(0, 50.0), 1.0)
    assert device.deliver(Stimulus(1, 60.0), 1.0) != right.deliver(Stimulus(1, 60.0), 1.0)


def test_a_device_stops_at_the_third_attempt_at_the_latest() -> None:
    device = faulty(Fault.STOP_FAILS)
    for _ in range(2):
        with pytest.raises(DeviceError):
            device.stop()
        assert device.armed
    device.stop()
    assert not device.armed


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """The ledger and the log of a session in which nothing failed."""
    clock = VirtualClock()
    device = FaultyDevice(ScriptedDevice(), 1, clock, rate=0.0)
    Session(device, scripted_strategy(4), log=tmp_path / "s.mcap", clock=clock).run()
    return device.ledger, read_session(tmp_path / "s.mcap")


def test_a_ledger_and_its_log_agree(run: Run) -> None:
    check_ledger(*run, LIMITS)


@pytest.mark.parametrize(
    ("change", "broken"),
    [
        (lambda fired: [*fired, fired[-1]], "fired twice"),
        (lambda fired: [*fired, Fired(4, 50.0, 99.0)], "without an intent"),
        (lambda fired: fired[:-1], "that was not fired"),
        (lambda fired: [dataclasses.replace(fired[0], isi_ms=1.0), *fired[1:]], "what the intent says"),
        (lambda fired: [*fired[:-1], dataclasses.replace(fired[-1], t_s=fired[-2].t_s + 4.9)], "5 s apart"),
    ],
)
def test_a_ledger_and_a_log_that_disagree_are_told(
    run: Run, change: Callable[[list[Fired]], list[Fired]], broken: str
) -> None:
    ledger, record = run
    with pytest.raises(AssertionError, match=broken):
        check_ledger(change(ledger), record, LIMITS)


def test_more_pairs_than_the_limit_are_told(run: Run) -> None:
    with pytest.raises(AssertionError, match="at most 3 pairs"):
        check_ledger(*run, dataclasses.replace(LIMITS, max_pulses=3))
