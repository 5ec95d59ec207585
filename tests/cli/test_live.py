"""A session with its live page, from the command line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import isiw
from isiw.cli import app
from isiw.errors import ConfigError
from isiw.log.record import read_session


def test_where_the_page_cannot_be_opened_nothing_else_is_said_than_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def watch(_: object, **_more: object) -> None:
        raise ConfigError("the libraries are not installed")

    monkeypatch.setattr(isiw, "watch", watch, raising=False)
    result = CliRunner().invoke(app, ["run", "--log", str(tmp_path / "s.mcap"), "--live"])
    assert result.exit_code != 0
    assert "the libraries are not installed" in result.output
    assert "log:" not in result.output


@pytest.mark.slow
def test_run_and_resume_print_the_address_of_the_live_page_on_this_computer(tmp_path: Path) -> None:
    log, config = tmp_path / "s.mcap", tmp_path / "short.toml"
    config.write_text("[strategy.settings]\nmax_trials = 2\nparticles = 100\n")
    for command in (["run", str(config), "--log", str(log)], ["resume", str(log)]):
        result = CliRunner().invoke(app, [*command, "--live"])
        assert result.exit_code == 0, result.output
        assert re.search(r"^live page: http://127\.0\.0\.1:\d+/#[\w-]{43}$", result.output, re.MULTILINE)
    assert len(read_session(log).table) == 2
