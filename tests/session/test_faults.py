"""Faults of the device: what is not the end, what is, and that all of it is told."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Never

import numpy as np
import pytest

from forked import Forked
from isiw.devices.deadlines import Deadlines
from isiw.devices.limits import Limits
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, LogError, NotDelivered
from isiw.findings import Kind
from isiw.log.pulses import pulse_ages
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.session.loop import Session
from isiw.session.resuming import resume
from isiw.session.rig import STILL_ARMED, Safeguards
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Stimulus
from known import known
from scripted import ScriptedDevice, scripted_strategy, told_to

TESTS = Path(__file__).parents[1]


def refusing(refusals: int, error: Exception | None = None) -> Callable[[Stimulus], Measurement]:
    """Answers after so many refusals of each trial."""
    left: dict[int, int] = {}

    def answer(stimulus: Stimulus) -> Measurement:
        left[stimulus.trial] = left.get(stimulus.trial, refusals) - 1
        if left[stimulus.trial] >= 0:
            raise error or NotDelivered("the stimulator is charging")
        return Measurement(0.01 + known(stimulus.isi_ms) / 1e4, stimulus.isi_ms)

    return answer


@pytest.mark.parametrize("error", [LogError("my own log cannot be written"), OSError("the disk"), ValueError("eh")])
def test_whatever_a_device_fails_with_the_stimulus_may_have_been_given(log: Path, error: Exception) -> None:
    limits = Limits(0, 200, min_iti_s=5.0, max_pulses=4)
    device = ScriptedDevice(refusing(1, error))
    with pytest.raises(type(error)):
        Session(device, scripted_strategy(9), log=log, limits=limits).run()
    assert [trial.reason for trial in read_session(log).table] == [Kind.OUTCOME_UNKNOWN]
    assert not [event for event in read_session(log).events if event.kind == "refused"]


def test_what_the_device_refused_before_firing_is_tried_again_and_does_not_count(log: Path, tmp_path: Path) -> None:
    undisturbed = Session(ScriptedDevice(), scripted_strategy(4), log=tmp_path / "undisturbed.mcap").run()
    limits = Limits(0, 200, min_iti_s=5.0, max_pulses=4)
    result = Session(ScriptedDevice(refusing(2)), scripted_strategy(4), log=log, limits=limits).run()
    assert result.trials == undisturbed.trials
    record = read_session(log)
    assert [event.kind for event in record.events] == ["refused"] * 8
    assert [event.trial for event in record.events] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert len(record.intents) == 12
    assert record.unknown == ()


def test_each_retry_waits_twice_as_long(log: Path) -> None:
    guards = Safeguards(retries=3, backoff_s=2.0)
    Session(ScriptedDevice(refusing(3)), scripted_strategy(1), log=log, safeguards=guards).run()
    assert [intent.t_s for intent in read_session(log).intents] == [5.0, 7.0, 11.0, 19.0]


def test_a_device_that_goes_on_refusing_ends_the_session_and_it_can_be_resumed(log: Path) -> None:
    with pytest.raises(NotDelivered, match="charging"):
        Session(ScriptedDevice(refusing(99)), scripted_strategy(4), log=log).run()
    record = read_session(log)
    assert len(record.intents) == 4
    assert record.unknown == ()
    assert len(record.table) == 0
    assert pulse_ages(salvage(log)).ages_s == ()
    assert [event.kind for event in record.events] == ["refused"] * 4, "the last one is not stated again as a fault"
    resumed = resume(log, ScriptedDevice(), scripted_strategy(4)).run()
    assert [trial.told for trial in resumed.trials] == [True] * 4


class Airless(ScriptedDevice):
    """Cannot be staged."""

    def stage(self) -> Never:
        raise DeviceError("no air pressure")


def test_a_device_that_cannot_be_staged_is_stopped_and_leaves_no_log_in_the_way(log: Path) -> None:
    device = Airless()
    with pytest.raises(DeviceError, match="no air pressure"):
        Session(device, scripted_strategy(), log=log).run()
    assert device.calls == ["stop", "unstage"]
    assert list(log.parent.iterdir()) == []
    assert len(Session(ScriptedDevice(), scripted_strategy(3), log=log).run().trials) == 3


def test_a_resumption_that_cannot_be_staged_leaves_its_log(log: Path) -> None:
    with pytest.raises(NotDelivered):
        Session(ScriptedDevice(refusing(99)), scripted_strategy(4), log=log).run()
    with pytest.raises(DeviceError, match="no air pressure"):
        resume(log, Airless(), scripted_strategy(4)).run()
    assert "no air pressure" in read_session(log).events[-1].text


def test_a_delivery_past_its_deadline_ends_the_session_disarmed(log: Path, released: threading.Event) -> None:
    device = ScriptedDevice(lambda stimulus: released.wait(60) and Measurement(0.1, stimulus.isi_ms))
    guards = Safeguards(deadlines=Deadlines(stop_s=0.2))
    with pytest.raises(DeviceTimeoutError, match="in time: deliver"):
        Session(device, scripted_strategy(), log=log, timeout_s=0.05, safeguards=guards).run()
    assert device.calls[:2] == ["stage", "stop"]
    record = read_session(log)
    assert record.table[0].reason is Kind.OUTCOME_UNKNOWN
    assert "DeviceTimeoutError" in record.events[-1].text


def test_an_answer_past_its_deadline_is_logged_as_late_with_its_waveforms_and_not_told(
    log: Path, released: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answer(stimulus: Stimulus) -> Sweep:
        released.wait(60)
        emg = Channel(np.zeros(300), 3000.0, "mV", -50.0)
        return Sweep({"emg": emg}, t_valve_ms=-known(stimulus.isi_ms), t_tms_ms=0.0)

    device = ScriptedDevice(answer)
    monkeypatch.setattr(device, "stop", released.set)
    strategy = scripted_strategy()
    with pytest.raises(DeviceTimeoutError):
        Session(device, strategy, log=log, timeout_s=0.05).run()
    record = read_session(log)
    assert [(event.kind, event.trial) for event in record.events] == [("late", 0), ("fault", 0)]
    assert record.sweep(0)["emg"].values.shape == (300,)
    assert record.table[0].reason is Kind.OUTCOME_UNKNOWN
    assert told_to(strategy) == ()


def test_where_delivering_and_disarming_and_letting_go_fail_all_of_it_is_logged(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answer(_: Stimulus) -> Never:
        raise DeviceError("coil too hot")

    device = ScriptedDevice(answer)
    failures = [OSError("port busy")]

    def stop() -> None:
        if failures:
            raise failures.pop()

    def unstage() -> Never:
        raise OSError("port gone")

    monkeypatch.setattr(device, "stop", stop)
    monkeypatch.setattr(device, "unstage", unstage)
    with pytest.raises(DeviceError, match="coil too hot") as caught:
        Session(device, scripted_strategy(), log=log).run()
    assert "port gone" in caught.value.__notes__[0]
    texts = [event.text for event in read_session(log).events]
    assert sum("port busy" in text for text in texts) == 1
    assert sum("port gone" in text for text in texts) == 1
    assert sum("coil too hot" in text for text in texts) == 1


class SpeechlessError(Exception):
    def __str__(self) -> str:
        raise UnicodeDecodeError("utf-8", b"\xff", 0, 1, "no text")


@pytest.mark.parametrize(
    "error", [SpeechlessError(), DeviceError("half a sign: \ud83d"), RuntimeError("\x00 " + "x" * 10**6)]
)
def test_a_fault_is_told_whatever_its_text(log: Path, error: BaseException) -> None:
    def answer(_: Stimulus) -> Never:
        raise error

    with pytest.raises(type(error)):
        Session(ScriptedDevice(answer), scripted_strategy(), log=log).run()
    record = read_session(log)
    assert record.losses == ()
    assert type(error).__name__ in record.events[-1].text
    assert len(record.table) == 1


@pytest.mark.parametrize(
    ("name", "unit"), [("left\ud800", "mV"), ("a\nb", "mV"), ("force", "N\udfff"), ("event", "mV")]
)
def test_a_channel_that_json_cannot_hold_is_an_error_and_the_log_stays_whole(log: Path, name: str, unit: str) -> None:
    def answer(stimulus: Stimulus) -> Sweep:
        channels = {"emg": Channel(np.zeros(300), 3000.0, "mV", -50.0), name: Channel(np.zeros(3), 100.0, unit)}
        return Sweep(channels, t_valve_ms=-known(stimulus.isi_ms), t_tms_ms=0.0)

    with pytest.raises(InvalidValueError, match=r"this name|as JSON"):
        Session(ScriptedDevice(answer), scripted_strategy(), log=log).run()
    record = read_session(log)
    assert record.losses == ()
    assert record.finished
    assert record.table[0].reason is Kind.OUTCOME_UNKNOWN


def test_two_sessions_do_not_drive_one_device_at_once(tmp_path: Path) -> None:
    second: list[int] = []

    def answer(stimulus: Stimulus) -> Measurement:
        if stimulus.trial == 1:
            with pytest.raises(DeviceError, match="driven by another session"):
                Session(device, scripted_strategy(3), log=tmp_path / "b.mcap").run()
            second.append(device.calls.count("stage"))
        return Measurement(0.1, stimulus.isi_ms)

    device = ScriptedDevice(answer)
    assert len(Session(device, scripted_strategy(3), log=tmp_path / "a.mcap").run().trials) == 3
    assert second == [1]
    assert not list(tmp_path.glob("b.mcap*"))


LOST = """
import sys, threading
sys.path.insert(0, {tests!r})
from scripted import ScriptedDevice, scripted_strategy
from isiw.devices.deadlines import Deadlines
from isiw.session.loop import Session
from isiw.session.rig import Safeguards

device = ScriptedDevice()
def stop():
    {screen}
    if {how!r} == "hangs":
        threading.Event().wait()
    raise OSError("port gone")
device.stop = stop
guards = Safeguards(deadlines=Deadlines(stop_s=0.3, stop_attempts=2))
Session(device, scripted_strategy(3), log={log!r}, safeguards=guards).run()
print("went on")
"""


@pytest.mark.parametrize("how", ["hangs", "fails"])
def test_where_a_device_cannot_be_disarmed_the_process_ends_with_the_reason_on_screen_and_in_the_log(
    log: Path, how: str
) -> None:
    script = LOST.format(tests=str(TESTS), how=how, screen="", log=str(log))
    with Forked(script) as child:
        printed, said = child.stdout.read(), child.stderr.read()
    assert child.returncode == STILL_ARMED
    assert "went on" not in printed
    assert "cannot be disarmed" in said
    assert "interlock" in said
    record = read_session(log)
    assert record.losses == ()
    assert len(record.table) == 3
    assert "cannot be disarmed" in record.events[-1].text
    assert resume(log, ScriptedDevice(), scripted_strategy(3)).run().decision.stop


FULL = """import os
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    try:
        while True:
            os.write(writing, bytes(4096))
    except BlockingIOError:
        os.set_blocking(writing, True)
    os.dup2(writing, 2)"""
GONE = """import os
    reading, writing = os.pipe()
    os.close(reading)
    os.dup2(writing, 2)"""


@pytest.mark.slow
@pytest.mark.parametrize("screen", [FULL, GONE], ids=["takes nothing", "is gone"])
def test_a_process_that_must_end_does_so_where_the_screen_takes_nothing_or_is_gone(log: Path, screen: str) -> None:
    with Forked(LOST.format(tests=str(TESTS), how="fails", screen=screen, log=str(log))) as child:
        assert "went on" not in child.stdout.read()
    assert child.returncode == STILL_ARMED
    assert "cannot be disarmed" in read_session(log).events[-1].text


def test_only_what_can_be_resumed_is_suggested_to_be_resumed(log: Path) -> None:
    log.write_bytes(b"no log at all")
    with pytest.raises(LogError) as caught:
        Session(ScriptedDevice(), scripted_strategy(3), log=log).run()
    assert "resume" not in known(caught.value.remedy)
    log.unlink()
    Session(ScriptedDevice(), scripted_strategy(3), log=log).run()
    with pytest.raises(LogError, match=r"isiw\.resume"):
        Session(ScriptedDevice(), scripted_strategy(3), log=log).run()
    resume(log, ScriptedDevice(), scripted_strategy(3)).run()
