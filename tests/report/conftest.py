"""What the tests of reports are handed."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _frames_alone(frames_alone: None) -> None:
    """Most tests of pages are about their words."""
