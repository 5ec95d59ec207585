"""A device whose verbs hang, fail or answer too late."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Never, TypeAlias

import pytest

from isiw.devices.deadlines import Deadlines, PunctualDevice
from isiw.devices.protocol import Readiness
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, NotDelivered, StillArmedError
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from scripted import ScriptedDevice
from waiting import until

MakePunctual: TypeAlias = Callable[..., PunctualDevice]

SHORT_S = 0.05
STIMULUS = Stimulus(0, 50.0)


@pytest.fixture
def reports() -> list[str]:
    return []


@pytest.fixture
def punctual(reports: list[str]) -> MakePunctual:
    def make(device: ScriptedDevice, **deadlines: Any) -> PunctualDevice:
        return PunctualDevice(device, Deadlines(**deadlines), report=reports.append)

    return make


def hanging(released: threading.Event) -> Callable[..., None]:
    def hang(*_: object) -> None:
        released.wait(60)

    return hang


def test_what_ends_in_time_is_passed_on(punctual: MakePunctual) -> None:
    device = ScriptedDevice()
    wrapped = punctual(device)
    wrapped.stage()
    assert wrapped.deliver(STIMULUS, 5.0) == Measurement(0.015, 50.0)
    wrapped.stop()
    wrapped.unstage()
    assert device.calls == ["stage", "stop", "unstage"]


def test_what_a_device_raises_is_raised(punctual: MakePunctual) -> None:
    def answer(_: Stimulus) -> Never:
        raise DeviceError("coil too hot")

    with pytest.raises(DeviceError, match="coil too hot"):
        punctual(ScriptedDevice(answer)).deliver(STIMULUS, 5.0)


def test_all_verbs_run_in_one_thread(punctual: MakePunctual) -> None:
    threads: set[int] = set()

    class Affine(ScriptedDevice):
        def stage(self) -> None:
            threads.add(threading.get_ident())

        def stop(self) -> None:
            self.stage()

        def unstage(self) -> None:
            self.stage()

        def deliver(self, stimulus: Stimulus, timeout_s: float) -> Any:
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
    punctual: MakePunctual, released: threading.Event
) -> None:
    device = ScriptedDevice(hanging(released))
    wrapped = punctual(device)
    wrapped.stage()
    with pytest.raises(DeviceTimeoutError, match="in time: deliver"):
        wrapped.deliver(STIMULUS, SHORT_S)
    assert device.calls == ["stage", "stop"]
    assert wrapped.late_answer(SHORT_S) is None


@pytest.mark.parametrize("verb", ["stage", "unstage"])
def test_every_verb_has_a_deadline(punctual: MakePunctual, released: threading.Event, verb: str) -> None:
    device = ScriptedDevice()
    setattr(device, verb, hanging(released))
    with pytest.raises(DeviceTimeoutError, match=f"in time: {verb}"):
        getattr(punctual(device, stage_s=SHORT_S, unstage_s=SHORT_S), verb)()
    assert device.calls == ["stop"]


def test_a_device_that_does_not_say_what_it_is_is_given_up(
    punctual: MakePunctual, released: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = ScriptedDevice()
    monkeypatch.setattr(device, "describe", hanging(released))
    with pytest.raises(DeviceTimeoutError, match=r"in time: describe.*Nothing was armed"):
        punctual(device, describe_s=SHORT_S)


def test_readiness_has_a_deadline(
    punctual: MakePunctual, released: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = ScriptedDevice()
    monkeypatch.setattr(device, "readiness", hanging(released), raising=False)
    with pytest.raises(DeviceTimeoutError, match=r"in time: readiness.* was disarmed"):
        punctual(device, readiness_s=SHORT_S).readiness()


def test_a_device_that_says_nothing_of_its_state_is_ready(punctual: MakePunctual) -> None:
    assert punctual(ScriptedDevice()).readiness() == Readiness()


def test_a_late_answer_is_kept_apart(punctual: MakePunctual, released: threading.Event) -> None:
    def answer(stimulus: Stimulus) -> Measurement:
        released.wait(60)
        return Measurement(0.2, stimulus.isi_ms)

    wrapped = punctual(ScriptedDevice(answer))
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, SHORT_S)
    released.set()
    assert wrapped.late_answer(30.0) == Measurement(0.2, 50.0)


def test_a_delivery_that_fails_in_time_is_not_said_to_have_failed_after_its_deadline() -> None:
    def nothing(_: Stimulus) -> Measurement:
        raise DeviceTimeoutError("no recording")

    said: list[str] = []
    wrapped = PunctualDevice(ScriptedDevice(nothing), report=said.append)
    wrapped.stage()
    with pytest.raises(DeviceTimeoutError, match="no recording"):
        wrapped.deliver(STIMULUS, 30.0)
    assert wrapped.late_answer(0.0) is None
    assert said == []
    wrapped.unstage()


def test_an_answer_that_was_late_when_somebody_looked_is_late(punctual: MakePunctual) -> None:
    def answer(stimulus: Stimulus) -> Measurement:
        time.sleep(2 * SHORT_S)  # the delivery itself is what takes too long
        return Measurement(0.2, stimulus.isi_ms)

    wrapped = punctual(ScriptedDevice(answer))
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, SHORT_S)
    assert wrapped.late_answer(30.0) == Measurement(0.2, 50.0)


def test_a_device_that_is_armed_too_late_is_disarmed_once_more(
    punctual: MakePunctual, released: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    device, armed_late = ScriptedDevice(), threading.Event()
    stopped_after = threading.Event()

    def stage() -> None:
        released.wait(60)
        armed_late.set()

    def stop() -> None:
        if armed_late.is_set():
            stopped_after.set()

    monkeypatch.setattr(device, "stage", stage)
    monkeypatch.setattr(device, "stop", stop)
    with pytest.raises(DeviceTimeoutError):
        punctual(device, stage_s=SHORT_S).stage()
    assert not stopped_after.is_set()
    released.set()
    assert stopped_after.wait(30)


def test_a_staging_begins_only_after_a_stop_that_is_under_way_and_needs_one_of_its_own(
    punctual: MakePunctual, monkeypatch: pytest.MonkeyPatch
) -> None:
    device, stopping, states = ScriptedDevice(), threading.Event(), []

    def stop() -> None:
        stopping.set()
        time.sleep(SHORT_S)
        states.append("disarmed")

    monkeypatch.setattr(device, "stage", lambda: states.append("armed"))
    monkeypatch.setattr(device, "stop", stop)
    wrapped = punctual(device)
    earlier = threading.Thread(target=wrapped.stop)
    earlier.start()
    stopping.wait(30)
    wrapped.stage()
    earlier.join()
    wrapped.stop()
    assert states == ["disarmed", "armed", "disarmed"]


def test_nobody_arms_a_device_while_a_delivery_that_was_given_up_may_yet_fire(released: threading.Event) -> None:
    staged = []

    class Hanging(ScriptedDevice):
        def __init__(self) -> None:
            super().__init__()
            self.info = replace(self.info, address="COM3")

        def stage(self) -> None:
            staged.append(released.is_set())

        def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:
            del timeout_s
            released.wait(60)
            return Measurement(0.2, stimulus.isi_ms)

    device, deadlines = Hanging(), Deadlines(stop_s=SHORT_S)
    wrapped = PunctualDevice(device, deadlines)
    wrapped.stage()
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, SHORT_S)
    in_other_sessions = (PunctualDevice(device, deadlines), PunctualDevice(Hanging(), deadlines))
    for again in (wrapped, *in_other_sessions):  # after a pause, and with an object of its own, too
        with pytest.raises(DeviceError, match="could still fire"):
            again.stage()
    released.set()
    PunctualDevice(device, Deadlines()).stage()
    assert staged == [False, True]


def test_a_device_that_stays_armed_after_a_verb_that_was_given_up_is_told(
    reports: list[str], released: threading.Event
) -> None:
    told, said = [], threading.Event()

    class ArmedLate(ScriptedDevice):
        late = False

        def stage(self) -> None:
            released.wait(60)
            self.late = True

        def stop(self) -> None:
            if self.late:
                raise OSError("port busy")

    def still_armed(error: StillArmedError) -> None:
        told.append(str(error))
        said.set()

    deadlines = Deadlines(stage_s=SHORT_S, stop_s=5.0)
    wrapped = PunctualDevice(ArmedLate(), deadlines, report=reports.append, still_armed=still_armed)
    with pytest.raises(DeviceTimeoutError):
        wrapped.stage()
    released.set()
    assert said.wait(30)
    assert "port busy" in told[0]
    assert len(reports) == 3


def test_a_device_that_was_never_armed_ends_no_process_where_it_cannot_be_stopped(
    reports: list[str], released: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    device, still_armed = ScriptedDevice(), list[StillArmedError]()

    def describe() -> Never:
        released.wait(60)
        raise OSError("no port")

    def stop() -> Never:
        raise OSError("no port")

    monkeypatch.setattr(device, "describe", describe)
    monkeypatch.setattr(device, "stop", stop)
    with pytest.raises(DeviceTimeoutError):
        PunctualDevice(device, Deadlines(describe_s=SHORT_S), report=reports.append, still_armed=still_armed.append)
    released.set()
    until(lambda: len(reports) == 3, 30.0)
    monkeypatch.undo()
    PunctualDevice(device).stage()  # waits until the verb that was given up has been dealt with
    assert len(reports) == 3
    assert not still_armed


def test_a_device_that_is_stopped_while_it_is_being_staged_is_stopped_again(punctual: MakePunctual) -> None:
    class Armable(ScriptedDevice):
        armed = False

        def stage(self) -> None:
            self.armed = True

        def stop(self) -> None:
            self.armed = False

    for _ in range(200):
        device = Armable()
        wrapped = punctual(device)
        meanwhile = threading.Thread(target=wrapped.stop)
        meanwhile.start()
        wrapped.stage()
        meanwhile.join()
        wrapped.stop()
        assert not device.armed


def test_what_was_stopped_delivers_nothing_before_it_is_staged_anew(punctual: MakePunctual) -> None:
    device = ScriptedDevice()
    wrapped = punctual(device)
    wrapped.stage()
    wrapped.stop()
    with pytest.raises(NotDelivered, match="not staged"):
        wrapped.deliver(STIMULUS, 1.0)
    assert device.delivered == []
    wrapped.stage()
    wrapped.deliver(STIMULUS, 1.0)
    assert len(device.delivered) == 1


def test_a_stop_that_fails_is_tried_again_and_told(
    punctual: MakePunctual, reports: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    device, failures = ScriptedDevice(), [RuntimeError("port busy"), RuntimeError("port busy")]

    def stop() -> None:
        if failures:
            raise failures.pop()
        device.calls.append("stop")

    monkeypatch.setattr(device, "stop", stop)
    punctual(device).stop()
    assert device.calls == ["stop"]
    assert [text for text in reports if "RuntimeError: port busy" in text] == reports
    assert len(reports) == 2


def test_a_stop_that_hangs_is_tried_again_from_outside(
    punctual: MakePunctual, released: threading.Event, reports: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    device, attempts = ScriptedDevice(), list[int]()

    def stop() -> None:
        attempts.append(threading.get_ident())
        if len(attempts) == 1:
            released.wait(60)

    monkeypatch.setattr(device, "stop", stop)
    wrapped = punctual(device, stop_s=0.5)
    wrapped.stage()
    wrapped.stop()
    assert len(set(attempts)) == 2
    assert "no return within 0.5 s" in reports[0]


def test_a_device_that_cannot_be_stopped_is_still_armed(
    punctual: MakePunctual, released: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = ScriptedDevice()
    monkeypatch.setattr(device, "stop", hanging(released))
    with pytest.raises(StillArmedError, match=r"cannot be disarmed.*interlock"):
        punctual(device, stop_s=SHORT_S, stop_attempts=2).stop()


def test_a_delivery_that_nobody_waits_for_any_more_is_given_up(released: threading.Event) -> None:
    insisted = threading.Event()

    def answer(_: Stimulus) -> None:
        insisted.set()
        released.wait(60)

    wrapped = PunctualDevice(ScriptedDevice(answer), given_up=insisted.is_set)
    with pytest.raises(DeviceTimeoutError):
        wrapped.deliver(STIMULUS, 60.0)


@pytest.mark.parametrize("values", [{"stop_s": 0.0}, {"stage_s": -1.0}, {"stop_attempts": 0}])
def test_deadlines_that_nobody_can_keep_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Deadlines(**values)


@pytest.mark.parametrize("verb", ["describe_s", "stage_s", "readiness_s", "stop_s", "unstage_s"])
@pytest.mark.parametrize("wrong", [1e9, 5000, True])
def test_a_deadline_that_nobody_waits_for_is_refused(verb: str, wrong: Any) -> None:
    with pytest.raises(InvalidValueError, match=f"Deadlines.{verb}"):
        Deadlines(**{verb: wrong})
