"""The process that disarms a device if isiw dies: by itself, beside a line, in `isiw check`, and in whole sessions."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from benchmarks.deaths import MEMORY, MOMENTS, SIGNALS, die
from benchmarks.dying_rigs import RIGS
from benchmarks.pulse_peer import PEER_COMMANDS, PulsePeer
from benchmarks.recording_device import RecordingDevice

import isiw
from isiw.devices.protocol import NOT_PROTECTED
from isiw.errors import DeviceError, InvalidValueError
from isiw.log.headers import ANY_HEADER, Header
from isiw.report.tables import first_facts
from isiw.testing import check_device
from scripted import SPACE, FakeRealClock, ScriptedDevice, scripted_strategy
from waiting import until

pytestmark = pytest.mark.skipif(os.name == "nt", reason="there a process inherits no connection")

PAIR = isiw.Stimulus(0, 50.0)
INFO = {"name": "peer", "reference": "valve"}

KILLED = """
import os, sys
from isiw.devices.watchdog import Watchdog
handle = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
watchdog = Watchdog(handle, b"disarm\\n")
{more}
print("watched", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def record(tmp_path: Path) -> Path:
    return tmp_path / "record"


def killed(record: Path, more: str = "") -> None:
    """Kill a process that has a watchdog."""
    command = [sys.executable, "-c", KILLED.format(more=more), str(record)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:  # noqa: S603 - our own
        assert process.stdout is not None
        assert process.stdout.readline() == b"watched\n"
        process.kill()


def test_a_killed_process_has_its_device_disarmed(record: Path) -> None:
    killed(record)
    until(lambda: b"disarm\n" in record.read_bytes(), 2.0)


def test_a_process_that_it_forked_and_that_lives_on_does_not_hide_its_death(record: Path) -> None:
    killed(record, "if os.fork() == 0: import time; time.sleep(1.5); os._exit(0)")
    until(lambda: b"disarm\n" in record.read_bytes(), 1.0)


def test_a_watchdog_that_is_ended_disarms_nothing_and_leaves_no_process(record: Path) -> None:
    handle = os.open(record, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    watchdog = isiw.Watchdog(handle, b"disarm\n")
    assert watchdog.watches
    watchdog.end()
    watchdog.end()
    os.close(handle)
    assert not watchdog.watches
    assert record.read_bytes() == b""


def test_a_watchdog_that_cannot_start_is_said_so_that_nothing_is_armed(
    record: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    handle = os.open(record, os.O_WRONLY | os.O_CREAT)
    for program in ("/no such program", "/bin/true"):
        monkeypatch.setattr(sys, "executable", program)
        with pytest.raises(DeviceError, match="nothing is armed"):
            isiw.Watchdog(handle, b"disarm\n")
    os.close(handle)


def test_a_line_without_its_watchdog_gets_another_before_it_is_armed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[isiw.Watchdog] = []

    def start(handle: int, disarm: bytes) -> isiw.Watchdog:
        started.append(isiw.Watchdog(handle, disarm))
        return started[-1]

    monkeypatch.setattr("isiw.devices.transports.line_exchange.Watchdog", start)
    with PulsePeer().over_tcp() as address:
        device = isiw.LineDevice(address, INFO, PEER_COMMANDS)
        device.stage()
        os.kill(started[0].process, signal.SIGKILL)
        until(lambda: not started[0].watches)
        device.deliver(PAIR, 2.0)
        assert [each.watches for each in started] == [False, True]
        device.unstage()
        assert not started[1].watches


def test_a_line_says_whether_it_has_a_watchdog(monkeypatch: pytest.MonkeyPatch) -> None:
    def said(address: str, **line: Any) -> str | None:
        return isiw.LineDevice(address, INFO, PEER_COMMANDS, line).describe().if_isiw_dies

    assert said("socket://127.0.0.1:5000") == said("/dev/ttyUSB0") == "watchdog"
    assert said("rfc2217://127.0.0.1:5000") is None
    assert said("/dev/ttyUSB0", watchdog=False) is None
    monkeypatch.setattr("isiw.devices.transports.line_table.SUPPORTED", False)
    assert said("COM3") is None


def test_what_disarms_a_device_is_one_of_the_known_or_nothing() -> None:
    assert isiw.DeviceInfo("own", "valve").if_isiw_dies is None
    assert isiw.DeviceInfo("own", "valve", if_isiw_dies="heartbeat").if_isiw_dies == "heartbeat"
    with pytest.raises(InvalidValueError, match="if_isiw_dies"):
        isiw.DeviceInfo("own", "valve", if_isiw_dies="luck")  # type: ignore[arg-type]


def checked(make: Callable[[], Any]) -> list[str]:
    said: list[str] = []
    check_device(make, SPACE, iti_s=0.0, clock=isiw.VirtualClock(), say=said.append)
    return said


def test_a_check_kills_a_process_that_has_armed_and_says_how_long_the_device_stayed_armed(record: Path) -> None:
    device = RecordingDevice(record, isiw.DeviceInfo("rec", "valve", simulated=True, if_isiw_dies="watchdog"))
    assert any("that had armed rec was killed: disarmed after" in line for line in checked(lambda: device))


@pytest.mark.slow
def test_a_check_of_a_line_kills_a_process_that_has_armed() -> None:
    with PulsePeer().over_tcp() as address:
        info = INFO | {"simulated": True}
        said = checked(lambda: isiw.LineDevice(address, info, PEER_COMMANDS))
    assert any("that had armed peer was killed: disarmed after" in line for line in said)


def test_a_check_fails_where_a_device_stays_armed_although_it_says_otherwise(
    record: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("isiw.testing.devices._DISARMED_S", 0.3)
    monkeypatch.setattr(
        "benchmarks.recording_device.armed_by_another",
        lambda handle, arm, _: isiw.devices.dying.armed_by_another(handle, arm, b"nonsense\n"),
    )
    device = RecordingDevice(record, isiw.DeviceInfo("rec", "valve", simulated=True, if_isiw_dies="watchdog"))
    with pytest.raises(AssertionError, match="still armed"):
        checked(lambda: device)
    assert not device.is_armed


def test_a_check_says_what_it_did_not_try() -> None:
    info = INFO | {"simulated": True, "if_isiw_dies": "heartbeat"}
    with PulsePeer().over_tcp() as address:
        said = checked(lambda: isiw.LineDevice(address, info, PEER_COMMANDS, {"watchdog": False}))
    assert "peer says that it is disarmed if isiw dies, by a heartbeat. That was not tried." in said


def unprotected_session(log: Path) -> isiw.Session:
    return isiw.Session(
        ScriptedDevice(simulated=False), scripted_strategy(2), log=log, clock=FakeRealClock(), timeout_s=1.0
    )


def test_a_device_that_nothing_disarms_is_said_to_be_so_before_it_is_armed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unprotected_session(tmp_path / "log.mcap").run(progress=True, keys=False)
    assert capsys.readouterr().out.startswith(f"scripted is {NOT_PROTECTED}")
    device = next(fact.value for fact in first_facts(isiw.read_session(tmp_path / "log.mcap")) if fact.name == "device")
    assert device.endswith(NOT_PROTECTED)


def test_a_check_says_so_of_a_real_device_before_it_arms_it() -> None:
    said: list[str] = []
    device = ScriptedDevice(simulated=False)
    with pytest.raises(AssertionError):  # it delivers whenever it is asked
        check_device(lambda: device, SPACE, iti_s=0.0, clock=FakeRealClock(), say=said.append)
    assert NOT_PROTECTED in said[0]


def test_the_live_page_says_so_while_the_session_runs(tmp_path: Path) -> None:
    view = pytest.importorskip("isiw.server.live.view")
    session = unprotected_session(tmp_path / "log.mcap")
    assert NOT_PROTECTED in view.View(session).shown().json


def test_a_simulated_device_and_one_with_a_watchdog_are_not_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for device in (ScriptedDevice(), ScriptedDevice(simulated=False)):
        if not device.info.simulated:
            device.info = isiw.DeviceInfo("watched", "valve", if_isiw_dies="watchdog")
        log = tmp_path / f"{device.info.name}.mcap"
        isiw.Session(device, scripted_strategy(2), log=log, clock=FakeRealClock()).run(progress=True, keys=False)
    assert NOT_PROTECTED not in capsys.readouterr().out


def test_a_header_of_an_older_log_has_a_device_that_nothing_disarms(tmp_path: Path) -> None:
    header = unprotected_session(tmp_path / "log.mcap").header
    values = ANY_HEADER.dump_python(header, mode="json")
    del values["device"]["if_isiw_dies"]
    read = ANY_HEADER.validate_python(values)
    assert isinstance(read, Header)
    assert read.device.if_isiw_dies is None


@pytest.mark.slow
@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("how", SIGNALS)
def test_a_session_that_is_killed_leaves_the_device_disarmed_loses_no_trial_and_resumes(
    name: str, how: signal.Signals, tmp_path: Path
) -> None:
    if "Arduino" in name and shutil.which("g++") is None:
        pytest.skip("needs g++")
    folder = tmp_path / "death"
    folder.mkdir()
    assert die(name, how, MOMENTS[how % 2], seed=how, folder=folder).disarmed_s < 2.0


@pytest.mark.slow
def test_a_session_whose_memory_is_full_and_that_aborts_leaves_the_device_disarmed(tmp_path: Path) -> None:
    assert die("recording device", signal.SIGABRT, MEMORY, seed=0, folder=tmp_path).disarmed_s < 2.0
