"""Files are read by the process of the tests here, since one of its own for each takes a second to start."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from isiw.existing import Delivered, Layout, ReadingLimits, reading


def _read_here(
    path: Path, layout: Layout, subject: str, limits: ReadingLimits, also: Sequence[str | Path] = ()
) -> list[Delivered]:
    assert not also
    return reading.people_in(path, layout, subject, limits)


@pytest.fixture(autouse=True)
def read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the place of `read_apart`; tests of that process have a fixture of this name that does nothing."""
    monkeypatch.setattr(reading, "read_apart", _read_here)
