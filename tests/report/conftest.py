"""What the tests of reports are handed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NoReturn

import pytest

from isiw.errors import InvalidValueError

PICTURES = ("timeline", "session", "sweeps", "course")


def _stand_ins(_record: object, _truth: object) -> Mapping[str, str]:
    return dict.fromkeys(PICTURES, "<svg></svg>")


def _none_fits(*_: object) -> NoReturn:
    raise InvalidValueError("no form was fitted")


@pytest.fixture(autouse=True)
def _frames_alone(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Most tests of pages are about their words, and not about the form of a profile, which is fitted for long."""
    request.getfixturevalue("frames_alone")
    if not request.node.path.name.startswith("test_methods"):
        monkeypatch.setattr("isiw.report.answers.profile_fits", _none_fits)
    if request.node.get_closest_marker("needs_pictures") is None:
        monkeypatch.setattr("isiw.report.page._pictures", _stand_ins)
