"""What the tests of the line share: devices at the other end of a peer."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any

import pytest
from benchmarks.pulse_peer import PEER_COMMANDS, PulsePeer

import isiw
from isiw.trials import Stimulus

INFO = {"name": "peer", "reference": "valve"}
HASTY = {"timeout_s": 0.2, "connect_s": 1.0}
"""For what never comes."""

PAIR = Stimulus(0, 50.0)
TIMEOUT_S = 0.5
ENOUGH_S = 5.0
"""For what comes, however busy the computer is."""


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


def made(
    address: str, commands: Mapping[str, Any] = PEER_COMMANDS, line: Mapping[str, Any] | None = None, **arguments: Any
) -> isiw.LineDevice:
    return isiw.LineDevice(address, INFO, commands, line, **arguments)


def staged(device: isiw.LineDevice) -> isiw.LineDevice:
    device.stage()
    return device
