"""The command line, as tests call it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from typer.testing import CliRunner, Result

from isiw.cli import app

Command: TypeAlias = Callable[..., Result]


@pytest.fixture
def isiw(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs isiw in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object, **given: Any) -> Result:
        return CliRunner().invoke(app, [str(argument) for argument in arguments], **given)

    return run
