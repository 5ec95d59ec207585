"""What the tests of sessions are handed."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Where the log of a session comes to."""
    return tmp_path / "s.mcap"
