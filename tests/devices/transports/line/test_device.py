"""An instrument that is told what to do in lines of text, over TCP and a pseudo-terminal."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from benchmarks.faulty_device import check_ledger
from benchmarks.pulse_peer import PEER_COMMANDS, Lie, PulsePeer

import isiw
from devices.transports.line.parts import HASTY, PAIR, TIMEOUT_S, made, staged, unnumbered
from isiw.errors import ConfigError, DeviceError, InvalidValueError, LogError, NotDelivered
from isiw.sweeps import Measurement, Sweep
from isiw.testing import check_device
from isiw.trials import Stimulus
from scripted import SPACE, scripted_strategy

BOTH = pytest.mark.parametrize("commands", [PEER_COMMANDS, unnumbered(PEER_COMMANDS)], ids=["numbered", "unnumbered"])


@pytest.mark.slow
@BOTH
def test_it_conforms_over_tcp_and_over_a_serial_port(
    address: str, peer: PulsePeer, commands: Mapping[str, Any]
) -> None:
    check_device(lambda: made(address, commands), SPACE, iti_s=0.0, say=lambda _: None)
    assert [fired.isi_ms for fired in peer.ledger] == [0.0, None, 66.0, 200.0, None]
    assert not peer.armed


@BOTH
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


def test_tms_alone_and_a_tap_alone_set_no_isi(device: isiw.LineDevice, peer: PulsePeer) -> None:
    assert device.deliver(Stimulus(0, None), 5.0) == Measurement(0.01, None)
    assert device.deliver(Stimulus(1, None, tap_alone=True), 5.0) == Measurement(0.01, None)
    assert [fired.isi_ms for fired in peer.ledger] == [None, None]
    assert not any("SET" in line for line in peer.heard)


def test_readiness_has_what_the_status_says(device: isiw.LineDevice, peer: PulsePeer) -> None:
    assert device.readiness() == isiw.Readiness(coil_c=25.0)
    peer.lie("STATUS", Lie.REFUSES)
    with pytest.raises(NotDelivered, match="does not want to"):
        device.readiness()


def without_mep() -> dict[str, Any]:
    return {name: each for name, each in PEER_COMMANDS.items() if name != "result"}


def test_a_function_of_the_lab_measures_where_the_instrument_does_not(peer: PulsePeer) -> None:
    def measure(stimulus: Stimulus, isi_ms: float | None, timeout_s: float) -> Measurement:
        assert 0 < timeout_s < 5.0
        return Measurement(0.2 + stimulus.trial, isi_ms)

    with peer.over_tcp() as at:
        device = staged(made(at, without_mep(), measure=measure))
        assert device.deliver(Stimulus(3, 50.0), 5.0) == Measurement(3.2, 50.0)
        device.unstage()


def test_the_realised_isi_may_come_with_the_result(peer: PulsePeer) -> None:
    silent = {"send": "{sequence} FIRE {trial}", "reply": r"(?P<sequence>\d+) FIRED .*"}
    commands = {**PEER_COMMANDS, "fire": silent, "result": PEER_COMMANDS["read_back"]}
    with peer.over_tcp() as at:
        device = staged(made(at, commands, measure=lambda _, isi_ms, __: Measurement(0.2, isi_ms)))
        assert device.deliver(PAIR, 5.0) == Measurement(0.2, 50.0)
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
            device.deliver(PAIR, 5.0)
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


def test_the_library_of_serial_ports_is_loaded_only_where_one_is_opened() -> None:
    used = "import sys, isiw; isiw.LineDevice; assert 'serial' not in sys.modules"
    subprocess.run([sys.executable, "-c", used], check=True)  # noqa: S603


def test_without_pyserial_a_serial_port_names_the_extra_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(ConfigError, match=r"isiw\[serial\]"):
        made("COM3").stage()


def greeting(said: str) -> dict[str, Any]:
    return {**PEER_COMMANDS, "hello": {"send": "{sequence} STATUS", "reply": said}}


def test_an_instrument_of_another_version_or_with_other_limits_is_not_staged(peer: PulsePeer) -> None:
    with peer.over_tcp() as address:  # it says READY 25.0
        with pytest.raises(DeviceError, match="does not answer"):
            made(address, greeting(r"(?P<sequence>\d+) TIMER 2"), HASTY).stage()
        with pytest.raises(DeviceError, match="another most_pulses"):
            made(address, greeting(r"(?P<sequence>\d+) READY (?P<most_pulses>\d+).0"), HASTY).stage()
        right = isiw.LineDevice(
            address,
            {"name": "peer", "reference": "valve", "most_pulses": 25},
            greeting(r"(?P<sequence>\d+) READY (?P<most_pulses>\d+).0"),
        )
        right.stage()
        right.unstage()


def test_what_made_an_instrument_refuse_is_acknowledged_by_staging_and_by_nothing_else(peer: PulsePeer) -> None:
    commands = {**PEER_COMMANDS, "acknowledge": {"send": "{sequence} STATUS", "reply": r"(?P<sequence>\d+) READY \S+"}}
    with peer.over_tcp() as address:
        device = staged(made(address, {key: value for key, value in commands.items() if key != "status"}))
        device.deliver(PAIR, TIMEOUT_S)
        device.stage()
        device.unstage()
    assert sum("STATUS" in line for line in peer.heard) == 2
