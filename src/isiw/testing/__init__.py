"""Conformance suites: what every implementation of one of isiw's protocols must pass. And a device that fails.

Run them from your own tests, and `check_device` for hardware with the coil on a phantom. `FaultyDevice` tries what runs
sessions; `check_ledger` compares what it fired with the log. `PulsePeer` is an instrument on a line that lies.
"""

from __future__ import annotations

from isiw.testing.devices import check_device
from isiw.testing.faults import Fault, FaultyDevice, Fired, check_ledger
from isiw.testing.line_peer import PEER_COMMANDS, Lie, PulsePeer
from isiw.testing.models import check_model
from isiw.testing.strategies import check_acquisition, check_strategy

__all__ = [
    "PEER_COMMANDS",
    "Fault",
    "FaultyDevice",
    "Fired",
    "Lie",
    "PulsePeer",
    "check_acquisition",
    "check_device",
    "check_ledger",
    "check_model",
    "check_strategy",
]
