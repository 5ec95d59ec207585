"""Peers and devices for the tests of the line."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator

import pytest
from benchmarks.pulse_peer import PulsePeer

import isiw
from devices.transports.line.parts import HASTY, made, over, staged


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
        device = staged(made(at, line=HASTY))
        yield device
        device.unstage()


@pytest.fixture
def warned() -> Iterator[io.StringIO]:
    """What the line says of what it throws away."""
    texts, logger = io.StringIO(), logging.getLogger("isiw.devices.transports")
    handler = logging.StreamHandler(texts)
    logger.addHandler(handler)
    yield texts
    logger.removeHandler(handler)
