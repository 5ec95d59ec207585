"""Files are read by the process of the tests here, since one of its own for each takes a second to start."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from isiw.existing import Layout, ReadingLimits, looking, reading
from isiw.existing.apart import Answer


def _read_here(
    path: Path,
    layout: Layout,
    subject: str,
    limits: ReadingLimits,
    also: Sequence[str | Path] = (),
    *,
    look: bool = False,
) -> Answer:
    assert not also
    contents = reading.contents_in(path, layout, limits)
    if look:
        seen: Answer = looking.seen_in(contents, path, layout, limits)
        return seen
    return Answer(reading.people_of_contents(contents, path, layout, subject, limits), {})


def reads_here(patch: pytest.MonkeyPatch) -> None:
    """Put the process of the tests in the place of `read_apart`."""
    for module in (reading, looking):
        patch.setattr(module, "read_apart", _read_here)


@pytest.fixture(autouse=True)
def read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """For all tests but those of that process, which have a fixture of this name that does nothing."""
    reads_here(monkeypatch)
