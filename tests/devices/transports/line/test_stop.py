"""Stopping and connecting again, whatever the connection does."""

from __future__ import annotations

import socket
import threading
import time
from typing import Any
from urllib.parse import urlsplit

import pytest
from benchmarks.pulse_peer import PEER_COMMANDS, Lie, PulsePeer

import isiw
from devices.transports.line.parts import ENOUGH_S, HASTY, PAIR, TIMEOUT_S, made, over, staged, unnumbered
from isiw.devices.transports.line_exchange import Line
from isiw.devices.transports.line_table import LineExchange
from isiw.errors import DeviceError, NotDelivered
from isiw.sweeps import Measurement
from isiw.trials import Stimulus

NOT_POSITIVE = [
    Lie.SILENT_BEFORE, Lie.SILENT_AFTER, Lie.LATE, Lie.OTHER_NUMBER, Lie.CORRUPTS, Lie.ENDLESS, Lie.REFUSES,
    Lie.DROPS_BEFORE, Lie.DROPS_AFTER,
]  # fmt: skip


def test_stop_from_another_thread_interrupts_a_delivery_and_nothing_is_fired_afterwards(
    device: isiw.LineDevice, peer: PulsePeer
) -> None:
    peer.lie("ARM", Lie.SILENT_AFTER)
    commands = {**PEER_COMMANDS, "arm": {**PEER_COMMANDS["arm"], "timeout_s": 5.0}}
    slow = staged(made(device.describe().address, commands))
    thread, failed = delivering(slow)
    while not peer.armed:
        time.sleep(0.01)
    began_s = time.monotonic()
    slow.stop()
    thread.join(1.0)
    assert time.monotonic() - began_s < 1.0
    assert isinstance(failed[0], NotDelivered)
    assert (peer.armed, peer.ledger) == (False, [])
    slow.unstage()


def test_a_stop_between_arming_and_firing_lets_nothing_be_fired(
    device: isiw.LineDevice, peer: PulsePeer, monkeypatch: pytest.MonkeyPatch
) -> None:
    ask = Line.ask

    def ask_and_stop(line: Line, exchange: LineExchange, *args: Any, **keywords: Any) -> dict[str, str]:
        said = ask(line, exchange, *args, **keywords)
        if "ARM" in exchange.send.split():
            device.stop()
        return said

    monkeypatch.setattr(Line, "ask", ask_and_stop)
    with pytest.raises(NotDelivered, match="was stopped"):
        device.deliver(PAIR, TIMEOUT_S)
    assert not any("FIRE" in line for line in peer.heard)
    assert not peer.armed


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


@pytest.mark.slow
@pytest.mark.parametrize("lie", NOT_POSITIVE)
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
    with pytest.raises(DeviceError, match="does not confirm"):
        device.stop()
    peer.lie("DISARM", Lie.SPLITS)
    device.stop()
    assert not peer.armed


def test_stop_raises_where_an_instrument_that_may_be_armed_cannot_be_reached(peer: PulsePeer) -> None:
    with peer.over_tcp() as at:
        device = staged(made(at, line=HASTY))
        arm_only(device, peer)
    with pytest.raises(DeviceError, match="cannot be reached"):
        device.stop()


def test_without_numbers_a_missing_answer_is_not_taken_from_what_comes_next(peer: PulsePeer) -> None:
    with peer.over_tcp() as at:
        device = staged(made(at, unnumbered(PEER_COMMANDS), HASTY))
        arm_only(device, peer)
        device.stop()
        assert not peer.armed
        assert isinstance(staged(device).deliver(PAIR, ENOUGH_S), Measurement)
        device.unstage()


def test_without_numbers_a_late_answer_is_not_believed_to_be_the_one_to_disarm(peer: PulsePeer) -> None:
    commands = {**unnumbered(PEER_COMMANDS), "disarm": {"send": "DISARM", "reply": "DISARMED|ARMED"}}
    with peer.over_tcp() as at:
        device = staged(made(at, commands, HASTY))
        peer.lie("ARM", Lie.LATE)
        with pytest.raises(NotDelivered):
            device.deliver(PAIR, TIMEOUT_S)
        peer.lie("DISARM", Lie.SILENT_BEFORE)
        device.stop()
        assert not peer.armed
        device.unstage()


def test_a_connection_that_broke_between_two_trials_is_opened_again(device: isiw.LineDevice, peer: PulsePeer) -> None:
    device.deliver(PAIR, ENOUGH_S)
    break_connection(device.describe().address)
    assert isinstance(device.deliver(Stimulus(1, 70.0), ENOUGH_S), Measurement)
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
