"""The command line, as tests call it."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Generator
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from matplotlib.figure import Figure
from typer import testing
from typer.main import get_command
from typer.testing import CliRunner, Result

from isiw.cli import app

Command: TypeAlias = Callable[..., Result]

COMMAND = [sys.executable, "-c", "from isiw.cli import app; app()"]
"""isiw as a process of its own."""

SHORT = "[strategy.settings]\nmax_trials = 3\nparticles = 100\n"


@pytest.fixture(scope="session", autouse=True)
def described_once() -> Generator[None, None, None]:
    """The command line is made of its functions once, as in a process, and not for each call."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(testing, "_get_command", cache(get_command))
        yield


@pytest.fixture(autouse=True)
def _frames_alone(frames_alone: None) -> None:
    """Most tests of commands are about something else than the picture that each of them makes."""


def _blank(*_: object, **__: object) -> Figure:
    return Figure()


@pytest.fixture
def blank_pictures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sessions are drawn as empty figures, for tests that run many; what is drawn is tested in other modules."""
    if request.node.get_closest_marker("needs_pictures") is None:
        monkeypatch.setattr("isiw.plots.session.session_figure", _blank)


@pytest.fixture
def isiw(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs isiw in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object, **given: Any) -> Result:
        return CliRunner().invoke(app, [str(argument) for argument in arguments], **given)

    return run


@pytest.fixture
def short(tmp_path: Path) -> Path:
    """A configuration of few trials."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a short session."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "short.toml").write_text(SHORT)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("isiw.plots.session.session_figure", _blank)
        result = CliRunner().invoke(app, ["run", str(folder / "short.toml"), "--log", str(folder / "s.mcap")])
    assert result.exit_code == 0, result.output
    return folder / "s.mcap"


@pytest.fixture
def log(finished: Path, tmp_path: Path) -> Path:
    """A copy of that log."""
    return Path(shutil.copy(finished, tmp_path))
