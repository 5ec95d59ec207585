"""Commands in messages: they can be pasted into a shell as they are."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from isiw.text.sanitize import command


def test_a_path_with_a_space_is_one_word() -> None:
    path = Path("Tuesday's logs/P 07.mcap")
    assert shlex.split(command("resume", "--lost-pulses", 3, path)) == [
        "isiw",
        "resume",
        "--lost-pulses",
        "3",
        str(path),
    ]


def test_what_needs_no_quotes_has_none() -> None:
    assert command("threshold", Path("t.mcap"), "--resume") == "isiw threshold t.mcap --resume"


def test_windows_takes_double_quotes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.text.sanitize.os.name", "nt")
    assert command("show", "P 07.mcap") == 'isiw show "P 07.mcap"'
