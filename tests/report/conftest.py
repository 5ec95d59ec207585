"""What the tests of reports are handed."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

PICTURES = ("timeline", "session", "sweeps", "course")


def _stand_ins(_record: object, _truth: object) -> Mapping[str, str]:
    return dict.fromkeys(PICTURES, "<svg></svg>")


@pytest.fixture(autouse=True)
def _frames_alone(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Most tests of pages are about their words."""
    request.getfixturevalue("frames_alone")
    if request.node.get_closest_marker("needs_pictures") is None:
        monkeypatch.setattr("isiw.report.page._pictures", _stand_ins)
