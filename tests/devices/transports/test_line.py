"""An instrument that is told what to do in lines of text, over TCP and a pseudo-terminal, with a peer that lies."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

import isiw
from isiw.errors import ConfigError, DeviceError, DeviceTimeoutError, InvalidValueError, LogError, NotDelivered
from isiw.session.safeguards import Safeguards
from isiw.signals.judgement import judge_measurement
from isiw.testing import PEER_COMMANDS, Lie, PulsePeer, check_device, check_ledger
from isiw.trials import Measurement, MistrialReason, Status, Stimulus, Sweep
from scripted import SPACE, scripted_strategy

INFO = {"name": "peer", "reference": "valve"}
LINE = {"timeout_s": 0.15, "connect_s": 0.6}
TIMEOUT_S = 0.3
PAIR = Stimulus(0, 50.0)


def unnumbered(commands: Mapping[str, Any]) -> dict[str, Any]:
    """The same commands without sequence numbers."""

    def without(text: str) -> str:
        return text.removeprefix("{sequence} ").removeprefix(r"(?P<sequence>\d+) ")

    return {
        name: without(each) if isinstance(each, str) else {key: without(text) for key, text in each.items()}
        for name, each in commands.items()
    }


def over(how: str, peer: PulsePeer) -> AbstractContextManager[str]:
    if how == "pty" and sys.platform == "win32":
        pytest.skip("there are no pseudo-terminals on Windows")
    return peer.over_tcp() if how == "TCP" else peer.over_pty()


def made(address: str, commands: Mapping[str, Any] = PEER_COMMANDS, **arguments: Any) -> isiw.LineDevice:
    return isiw.LineDevice(address, INFO, commands, LINE, **arguments)


@pytest.fixture
def peer() -> PulsePeer:
    return PulsePeer()


@pytest.fixture(params=["TCP", "pty"])
def address(request: pytest.FixtureRequest, peer: PulsePeer) -> Iterator[str]:
    with over(request.param, peer) as at:
        yield at


@pytest.fixture
def device(peer: PulsePeer) -> Iterator[isiw.LineDevice]:
    """One over TCP, staged."""
    with peer.over_tcp() as at:
        device = made(at)
        device.stage()
        yield device
        device.unstage()


@pytest.mark.parametrize("commands", [PEER_COMMANDS, unnumbered(PEER_COMMANDS)], ids=["numbered", "unnumbered"])
def test_it_conforms_over_tcp_and_over_a_serial_port(
    address: str, peer: PulsePeer, commands: Mapping[str, Any]
) -> None:
    check_device(lambda: made(address, commands), SPACE, iti_s=0.0, say=lambda _: None)
    assert [fired.isi_ms for fired in peer.ledger] == [0.0, None, 66.0, 200.0, None]
    assert not peer.armed


@pytest.mark.parametrize("commands", [PEER_COMMANDS, unnumbered(PEER_COMMANDS)], ids=["numbered", "unnumbered"])
def test_a_whole_session_gives_what_its_log_says(
    address: str, peer: PulsePeer, commands: Mapping[str, Any], tmp_path: Path
) -> None:
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0.0)
    isiw.Session(made(address, commands), scripted_strategy(6), log=tmp_path / "log.mcap", limits=limits).run()
    record = isiw.read_session(tmp_path / "log.mcap")
    check_ledger(peer.ledger, record, limits)
    assert len(record.table.told) == len(peer.ledger) == 6
    assert record.header.device.address == address
    assert not peer.armed


@pytest.mark.parametrize("verb", ["SET", "GET", "ARM", "FIRE", "RESULT"])
@pytest.mark.parametrize("lie", [Lie.SPLITS, Lie.REPEATS, Lie.GARBAGE])
def test_what_only_looks_odd_does_no_harm(address: str, peer: PulsePeer, verb: str, lie: Lie) -> None:
    device = made(address)
    device.stage()
    peer.lie(verb, lie)
    assert device.deliver(PAIR, TIMEOUT_S) == Measurement(0.015, 50.0)
    assert peer.happened[lie] == 1
    device.unstage()


FATAL = [Lie.SILENT_BEFORE, Lie.SILENT_AFTER, Lie.LATE, Lie.OTHER_NUMBER, Lie.CORRUPTS, Lie.ENDLESS, Lie.REFUSES]
DROPS = [Lie.DROPS_BEFORE, Lie.DROPS_AFTER]
BEFORE_FIRING = [("SET", Lie.SETS_ANOTHER), ("GET", Lie.NAN), ("GET", Lie.SILENT_BEFORE), ("GET", Lie.CORRUPTS)]
BEFORE_FIRING += [(verb, lie) for verb in ("SET", "ARM") for lie in FATAL + DROPS]


@pytest.mark.parametrize(("verb", "lie"), BEFORE_FIRING)
def test_what_fails_before_firing_gave_nothing_and_the_next_trial_goes_well(
    device: isiw.LineDevice, peer: PulsePeer, verb: str, lie: Lie
) -> None:
    peer.lie(verb, lie)
    with pytest.raises(NotDelivered):
        device.deliver(PAIR, TIMEOUT_S)
    assert peer.ledger == []
    assert isinstance(device.deliver(PAIR, TIMEOUT_S), Measurement)
    assert len(peer.ledger) == 1


AFTER_FIRING = [(verb, lie) for verb in ("FIRE", "RESULT") for lie in [*FATAL, *DROPS, Lie.NAN]]


@pytest.mark.parametrize(("verb", "lie"), AFTER_FIRING)
def test_what_fails_once_the_command_to_fire_is_sent_has_an_unknown_outcome_and_is_sent_once(
    device: isiw.LineDevice, peer: PulsePeer, verb: str, lie: Lie
) -> None:
    peer.lie(verb, lie)
    with pytest.raises(DeviceError) as raised:
        device.deliver(PAIR, TIMEOUT_S)
    assert not isinstance(raised.value, NotDelivered)
    silent = {Lie.SILENT_BEFORE, Lie.SILENT_AFTER, Lie.LATE, Lie.OTHER_NUMBER, Lie.CORRUPTS, Lie.ENDLESS}
    assert isinstance(raised.value, DeviceTimeoutError) == (lie in silent)
    assert sum("FIRE" in line for line in peer.heard) == 1


def test_the_next_trial_gets_its_own_answer_after_one_that_came_too_late(
    device: isiw.LineDevice, peer: PulsePeer
) -> None:
    peer.lie("RESULT", Lie.LATE)
    with pytest.raises(DeviceTimeoutError):
        device.deliver(Stimulus(0, 50.0), TIMEOUT_S)
    assert device.deliver(Stimulus(1, 150.0), TIMEOUT_S) == Measurement(0.025, 150.0)


@pytest.mark.parametrize("lie", [Lie.GIVES_ANOTHER, Lie.REPORTS_ANOTHER])
def test_another_isi_than_the_one_read_back_is_a_mistrial(device: isiw.LineDevice, peer: PulsePeer, lie: Lie) -> None:
    peer.lie("FIRE", lie)
    answer = device.deliver(PAIR, TIMEOUT_S)
    assert isinstance(answer, Measurement)
    assert answer.isi_ms == pytest.approx(90.0)
    assert judge_measurement(answer, PAIR, SPACE).reason is MistrialReason.ISI_OFF


def test_a_session_tries_again_what_was_refused_before_firing(peer: PulsePeer, tmp_path: Path) -> None:
    peer.lie("SET", Lie.SETS_ANOTHER)
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0.0)
    with peer.over_tcp() as at:
        guards = Safeguards(backoff_s=0.0)
        log = tmp_path / "log.mcap"
        isiw.Session(made(at), scripted_strategy(3), log=log, limits=limits, safeguards=guards).run()
    record = isiw.read_session(log)
    check_ledger(peer.ledger, record, limits)
    (refused,) = (event for event in record.events if event.kind == "refused")
    assert "another ISI than it was set to" in refused.text
    assert len(record.table.told) == 3


def test_a_session_that_hears_nothing_after_firing_ends_disarmed_with_an_unknown_outcome(
    peer: PulsePeer, tmp_path: Path
) -> None:
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0.0)
    peer.lie("FIRE", Lie.SILENT_AFTER)
    with peer.over_tcp() as at, pytest.raises(DeviceTimeoutError):
        isiw.Session(made(at), scripted_strategy(3), log=tmp_path / "log.mcap", limits=limits, timeout_s=0.3).run()
    record = isiw.read_session(tmp_path / "log.mcap")
    (trial,) = record.table
    assert (trial.status, trial.reason) == (Status.MISTRIAL, MistrialReason.OUTCOME_UNKNOWN)
    assert len(peer.ledger) == 1
    assert peer.heard[-1].endswith("DISARM")
    assert not peer.armed


def test_tms_alone_and_a_tap_alone_set_no_isi(device: isiw.LineDevice, peer: PulsePeer) -> None:
    assert device.deliver(Stimulus(0, None), TIMEOUT_S) == Measurement(0.01, None)
    assert device.deliver(Stimulus(1, None, tap_alone=True), TIMEOUT_S) == Measurement(0.01, None)
    assert [fired.isi_ms for fired in peer.ledger] == [None, None]
    assert not any("SET" in line for line in peer.heard)


def test_stop_from_another_thread_interrupts_a_delivery_and_nothing_is_fired_afterwards(
    device: isiw.LineDevice, peer: PulsePeer
) -> None:
    peer.lie("ARM", Lie.SILENT_AFTER)
    commands = {**PEER_COMMANDS, "arm": {**PEER_COMMANDS["arm"], "timeout_s": 5.0}}
    slow = made(device.describe().address, commands)
    slow.stage()
    thread, failed = delivering(slow)
    while not peer.armed:
        time.sleep(0.01)
    began_s = time.monotonic()
    slow.stop()
    thread.join(1.0)
    assert time.monotonic() - began_s < 0.5
    assert isinstance(failed[0], NotDelivered)
    assert (peer.armed, peer.ledger) == (False, [])
    slow.unstage()


def delivering(device: isiw.LineDevice) -> tuple[threading.Thread, list[BaseException]]:
    """A thread that delivers, and what it raises."""
    failed: list[BaseException] = []

    def deliver() -> None:
        try:
            device.deliver(PAIR, 10.0)
        except DeviceError as error:
            failed.append(error)

    thread = threading.Thread(target=deliver, daemon=True)
    thread.start()
    return thread, failed


def arm_only(device: isiw.LineDevice, peer: PulsePeer) -> None:
    """Leave the peer armed."""
    peer.lie("ARM", Lie.SILENT_AFTER)
    with pytest.raises(NotDelivered):
        device.deliver(PAIR, TIMEOUT_S)
    assert peer.armed


@pytest.mark.parametrize("lie", [*FATAL, *DROPS])
def test_stop_disarms_over_a_fresh_connection_where_the_first_answer_is_not_positive(
    device: isiw.LineDevice, peer: PulsePeer, lie: Lie
) -> None:
    arm_only(device, peer)
    peer.lie("DISARM", lie)
    device.stop()
    assert not peer.armed
    assert sum("DISARM" in line for line in peer.heard) >= 3  # at stage, the one that failed, and the last


def test_stop_raises_where_the_instrument_never_confirms(device: isiw.LineDevice, peer: PulsePeer) -> None:
    arm_only(device, peer)
    peer.lie("DISARM", Lie.REFUSES, times=1000)
    with pytest.raises(DeviceError, match="does not confirm that it is disarmed"):
        device.stop()
    peer.lie("DISARM", Lie.SPLITS)
    device.stop()
    assert not peer.armed


def test_stop_raises_where_an_instrument_that_may_be_armed_cannot_be_reached(peer: PulsePeer) -> None:
    with peer.over_tcp() as at:
        device = made(at)
        device.stage()
        arm_only(device, peer)
    with pytest.raises(DeviceError, match="cannot be reached"):
        device.stop()


def test_without_numbers_a_missing_answer_is_not_taken_from_what_comes_next(peer: PulsePeer) -> None:
    with peer.over_tcp() as at:
        device = made(at, unnumbered(PEER_COMMANDS))
        device.stage()
        arm_only(device, peer)
        device.stop()
        assert not peer.armed
        assert isinstance(staged(device).deliver(PAIR, TIMEOUT_S), Measurement)
        device.unstage()


def staged(device: isiw.LineDevice) -> isiw.LineDevice:
    device.stage()
    return device


def test_what_is_thrown_away_is_said(
    device: isiw.LineDevice, peer: PulsePeer, caplog: pytest.LogCaptureFixture
) -> None:
    peer.lie("GET", Lie.REPEATS)
    device.deliver(PAIR, TIMEOUT_S)
    assert "thrown away while" in caplog.text
    assert "OK" in caplog.text


def test_a_connection_that_broke_between_two_trials_is_opened_again(device: isiw.LineDevice, peer: PulsePeer) -> None:
    device.deliver(PAIR, TIMEOUT_S)
    break_connection(device.describe().address)
    assert isinstance(device.deliver(Stimulus(1, 70.0), TIMEOUT_S), Measurement)
    assert [fired.trial for fired in peer.ledger] == [0, 1]


def break_connection(address: str) -> None:
    """The peer has one connection at a time, so another one ends the first."""
    parts = urlsplit(address)
    socket.create_connection((parts.hostname or "", parts.port or 0)).close()
    time.sleep(0.1)


def test_an_instrument_that_is_not_there_is_said_at_once_and_is_not_armed() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    device = made(f"socket://127.0.0.1:{port}")
    with pytest.raises(DeviceError, match="cannot be reached"):
        device.stage()
    device.stop()
    device.unstage()


def test_a_serial_port_that_is_not_there_is_said() -> None:
    with pytest.raises(DeviceError, match="cannot be reached"):
        made("/dev/ttyNone").stage()


def test_a_serial_port_belongs_to_one_at_a_time(peer: PulsePeer) -> None:
    with over("pty", peer) as at:
        first = staged(made(at))
        with pytest.raises(DeviceError, match="lock"):
            made(at).stage()
        first.unstage()


def test_the_library_of_serial_ports_is_loaded_only_where_one_is_opened() -> None:
    used = "import sys, isiw; isiw.LineDevice, isiw.testing.PulsePeer; assert 'serial' not in sys.modules"
    subprocess.run([sys.executable, "-c", used], check=True)  # noqa: S603


def test_without_pyserial_a_serial_port_names_the_extra_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(ConfigError, match=r"isiw\[serial\]"):
        made("COM3").stage()


def test_readiness_has_what_the_status_says(device: isiw.LineDevice, peer: PulsePeer) -> None:
    assert device.readiness() == isiw.Readiness(coil_c=25.0)
    peer.lie("STATUS", Lie.REFUSES)
    state = device.readiness()
    assert not state.ready
    assert "does not want to" in state.reason


@pytest.mark.parametrize("lie", [Lie.SILENT_BEFORE, Lie.NAN, Lie.DROPS_BEFORE])
def test_a_status_that_cannot_be_had_refuses_the_stimulus(device: isiw.LineDevice, peer: PulsePeer, lie: Lie) -> None:
    peer.lie("STATUS", lie)
    with pytest.raises(NotDelivered):
        device.readiness()


def without_mep() -> dict[str, Any]:
    return {name: each for name, each in PEER_COMMANDS.items() if name != "result"}


def test_a_function_of_the_lab_measures_where_the_instrument_does_not(peer: PulsePeer) -> None:
    def measure(stimulus: Stimulus, isi_ms: float | None, timeout_s: float) -> Measurement:
        assert 0 < timeout_s < TIMEOUT_S
        return Measurement(0.2 + stimulus.trial, isi_ms)

    with peer.over_tcp() as at:
        device = staged(made(at, without_mep(), measure=measure))
        assert device.deliver(Stimulus(3, 50.0), TIMEOUT_S) == Measurement(3.2, 50.0)
        device.unstage()


@pytest.mark.parametrize(
    "error", [NotDelivered("no"), isiw.errors.LimitExceededError("no"), LogError("no"), KeyError()]
)
def test_whatever_fails_while_measuring_never_says_that_nothing_was_given(peer: PulsePeer, error: Exception) -> None:
    def measure(*_: object) -> Sweep:
        raise error

    with peer.over_tcp() as at:
        device = staged(made(at, without_mep(), measure=measure))
        with pytest.raises(DeviceError) as raised:
            device.deliver(PAIR, TIMEOUT_S)
        assert type(raised.value) is DeviceError
        device.unstage()


def _measure(*_: object) -> Measurement:
    raise NotImplementedError


@pytest.mark.parametrize(
    "make",
    [
        lambda: made("socket://127.0.0.1:1", without_mep()),
        lambda: made("socket://127.0.0.1:1", PEER_COMMANDS, measure=_measure),
    ],
    ids=["nobody", "both"],
)
def test_the_mep_is_measured_by_one_and_one_only(make: Callable[[], object]) -> None:
    with pytest.raises(InvalidValueError, match="each MEP must be measured"):
        make()


@pytest.mark.parametrize("address", ["", "socket://", "socket://host", "socket://:5000", "socket://host:many"])
def test_an_address_that_is_incomplete_is_refused(address: str) -> None:
    with pytest.raises(InvalidValueError, match="address"):
        made(address)
