"""What the tests of sessions are handed."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from isiw.session import pausing


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Where the log of a session comes to."""
    return tmp_path / "s.mcap"


@pytest.fixture
def terminal() -> Iterator[None]:
    """A terminal whose closing is heard, also where the tests themselves run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.fixture(autouse=True)
def no_second_between_presses(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Continue counts at once, but for tests that are about the second that it needs."""
    if request.node.get_closest_marker("needs_a_second") is None:
        monkeypatch.setattr(pausing, "SEPARATE_S", 0.0)
