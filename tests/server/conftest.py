"""What the tests of servers are handed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from isiw.session import pausing
from server.serving import client_of


@pytest.fixture
def client(tmp_path: Path) -> Iterator[httpx.Client]:
    """A client of a server whose logs come to the test's folder."""
    with client_of(tmp_path) as client:
        yield client


@pytest.fixture(autouse=True)
def no_second_between_presses(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Continue counts at once, but for tests that are about the second that it needs."""
    if request.node.get_closest_marker("needs_a_second") is None:
        monkeypatch.setattr(pausing, "SEPARATE_S", 0.0)
