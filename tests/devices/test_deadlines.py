"""A device whose verbs hang, fail or answer too late."""

from __future__ import annotations

import threading
import time

import pytest

from isiw.devices.deadlines import Deadlines, PunctualDevice
from isiw.devices.protocol import Readiness
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, StillArmedError
from isiw.trials import Measurement, Stimulus

SHORT_S = 0.05
STIMULUS = Stimulus(0, 50.0)


@pytest.fixture
def released():
    """What hangs, hangs until this is set, at the end of the test."""
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def reports():
    return []


@pytest.fixture
def punctual(reports):
    def make(device, **deadlines):
        return PunctualDevice(device, Deadlines(**deadlines), report=reports.append)

    return make


def hanging(released):
    def hang(*_):
        released.wait(60)

    return hang


def test_what_ends_in_time_is_passed_on(scripted_device, punctual) -> None:
    device = scripted_device()
    wrapped = punctual(device)
    wrapped.stage()
    assert wrapped.deliver(STIMULUS, 5.0) == Measurement(0.015, 50.0)
    wrapped.stop()
    wrapped.unstage()
    assert device.calls == ["stage", "stop", "unstage"]


def test_what_a_device_raises_is_raised(scripted_device, punctual) -> None:
    def answer(_) -> None:
        raise DeviceError("coil too hot")

    with pytest.raises(DeviceError, match="coil too hot"):
        punctual(scripted_device(answer)).deliver(STIMULUS, 5.0)


def test_all_verbs_run_in_one_thread(scripted_device, punctual) -> None:
    threads = set()

    class Affine(scripted_device):
        def stage(self) -> None:
            threads.add(threading.get_ident())

        unstage = stop = stage

        def deliver(self, stimulus, timeout_s):
            self.stage()
            return super().deliver(stimulus, timeout_s)

    wrapped = punctual(Affine())
    wrapped.stage()
    wrapped.deliver(STIMULUS, 5.0)
    wrapped.stop()
    wrapped.unstage()
    assert len(threads) == 1
    assert threading.get_ident() not in threads


def test_a_delivery_that_never_returns_is_given_up_and_stopped_from_outside(
    scripted_device, punctual, released
) -> None:
    device = scripted_device(hanging(released))
    wrapped = punctual(device)
    wrapped.stage()
    with pytest.raises(DeviceTimeoutError, match="deliver took too long"):
        wrapped.deliver(STIMULUS, SHORT_S)
    assert device.calls == ["stage", "stop"]
    assert wrapped.late_answer(SHORT_S) is None


@pytest.mark.parametrize("verb", ["stage", "unstage"])
def test_every_verb_has_a_deadline(scripted_device, punctual, released, verb) -> None:
    device = scripted_device()
    setattr(device, verb, hanging(released))
    with pytest.raises(DeviceTimeoutError, match=f"{verb} took too long"):
        getattr(punctual(device, stage_s=SHORT_S, unstage_s=SHORT_S), verb)()
    assert device.calls == ["stop"]


def test_a_device_that_does_not_say_what_it_is_is_given_up(scripted_device, punctual, released) -> None:
    device = scripted_device()
    device.describe = hanging(released)
    with pytest.raises(DeviceTimeoutError, match="describe took too long"):
        punctual(device, describe_s=SHORT_S)


def test_readiness_has_a_deadline(scripted_device, punctual, released) -> None:
    device = scripted_device()
    device.readiness = hanging(released)
    with pytest.raises(DeviceTimeoutError, match="readiness took too long"):
        punctual(device, readiness_s=SHORT_S).readiness()


def test_a_device_that_says_nothing_of_its_state_is_ready(scripted_device, punctual) -> None:
    assert punctual(scripted_device()).readiness() == Readiness()


def test_a_late_answer_is_kept_apart(scripted_device, punctual, released) -> None:
    def answer(stimulus):
        released.wait(60)
        return Measurement(0.2, stimulus.isi_ms)

    wrapped = punctual(scripted_device(answer))
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, SHORT_S)
    released.set()
    assert wrapped.late_answer(30.0) == Measurement(0.2, 50.0)


def test_an_answer_that_was_late_when_somebody_looked_is_late(scripted_device, punctual) -> None:
    def answer(stimulus):
        time.sleep(2 * SHORT_S)  # the delivery itself is what takes too long
        return Measurement(0.2, stimulus.isi_ms)

    wrapped = punctual(scripted_device(answer))
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, SHORT_S)
    assert wrapped.late_answer(30.0) == Measurement(0.2, 50.0)


def test_a_device_that_is_armed_too_late_is_disarmed_once_more(scripted_device, punctual, released) -> None:
    device, armed_late = scripted_device(), threading.Event()
    stopped_after = threading.Event()

    def stage() -> None:
        released.wait(60)
        armed_late.set()

    def stop() -> None:
        if armed_late.is_set():
            stopped_after.set()

    device.stage, device.stop = stage, stop
    with pytest.raises(DeviceTimeoutError):
        punctual(device, stage_s=SHORT_S).stage()
    assert not stopped_after.is_set()
    released.set()
    assert stopped_after.wait(30)


def test_a_stop_that_fails_is_tried_again_and_told(scripted_device, punctual, reports) -> None:
    device, failures = scripted_device(), [RuntimeError("port busy"), RuntimeError("port busy")]

    def stop() -> None:
        if failures:
            raise failures.pop()
        device.calls.append("stop")

    device.stop = stop
    punctual(device).stop()
    assert device.calls == ["stop"]
    assert [text for text in reports if "RuntimeError: port busy" in text] == reports
    assert len(reports) == 2


def test_a_stop_that_hangs_is_tried_again_from_outside(scripted_device, punctual, released, reports) -> None:
    device, attempts = scripted_device(), []

    def stop() -> None:
        attempts.append(threading.get_ident())
        if len(attempts) == 1:
            released.wait(60)

    device.stop = stop
    wrapped = punctual(device, stop_s=0.5)
    wrapped.stage()
    wrapped.stop()
    assert len(set(attempts)) == 2
    assert "no return within 0.5 s" in reports[0]


def test_a_device_that_cannot_be_stopped_is_still_armed(scripted_device, punctual, released) -> None:
    device = scripted_device()
    device.stop = hanging(released)
    with pytest.raises(StillArmedError, match=r"cannot be disarmed.*interlock"):
        punctual(device, stop_s=SHORT_S, stop_attempts=2).stop()


def test_a_delivery_that_nobody_waits_for_any_more_is_given_up(scripted_device, released) -> None:
    insisted = threading.Event()
    device = scripted_device(lambda _: insisted.set() or released.wait(60))
    wrapped = PunctualDevice(device, given_up=insisted.is_set)
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, 60.0)


@pytest.mark.parametrize("values", [{"stop_s": 0.0}, {"stage_s": -1.0}, {"stop_attempts": 0}])
def test_deadlines_that_nobody_can_keep_are_refused(values) -> None:
    with pytest.raises(InvalidValueError):
        Deadlines(**values)
