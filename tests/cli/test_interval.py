from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from isiw.cli import app
from isiw.dissertation.interval.task import answer, begin_log, session_blocks


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["interval", *map(str, arguments)])


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """The log of a task of two trials."""
    blocks = session_blocks(1, [3], trials=2)
    record, log = begin_log(tmp_path / "a.mcap", blocks, "P07", 0)
    with log:
        for trial, block in record.left:
            log.append(answer(blocks[block], block, trial, 290.0 + 20 * trial, 0))
    return tmp_path / "a.mcap"


def test_a_log_is_shown_as_a_table(log: Path) -> None:
    result = run(log, "--show")
    assert result.exit_code == 0, result.output
    assert "P07" in result.output
    assert "2 trials, 0 left" in result.output
    (row,) = [line.split() for line in result.output.splitlines() if line.split()[:2] == ["3", "300"]]
    assert row == ["3", "300", "100", "2", "300", "10", "1"]


def test_without_a_terminal_it_is_a_message(tmp_path: Path) -> None:
    result = run(tmp_path / "a.mcap")
    assert result.exit_code == 1
    assert "terminal window" in result.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--session", 4], "session is unknown"),
        (["--session", 0], "session is unknown"),
        (["--session", 3, "--mode", 4], "a mode of session 3 is unknown"),
        (["--trials", 0], "Block.trials"),
    ],
)
def test_a_wrong_option_is_a_message(tmp_path: Path, arguments: list[object], said: str) -> None:
    result = run(tmp_path / "a.mcap", *arguments)
    assert result.exit_code == 1
    assert said in result.output


@pytest.mark.parametrize("how", ["--resume", "--show"])
def test_a_task_keeps_what_its_log_says(log: Path, how: str) -> None:
    result = run(log, how, "--session", 2)
    assert result.exit_code == 1
    assert "Leave these options out" in result.output


def test_a_log_that_there_is_not_is_a_message(tmp_path: Path) -> None:
    result = run(tmp_path / "nothing.mcap", "--show")
    assert result.exit_code == 1
    assert "there is no such log" in result.output
