from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from cli.conftest import COMMAND, Command
from isiw import __version__
from isiw.cli import console
from isiw.cli.console import INTERRUPTED, show_statement, working


def test_a_pipe_gets_lines_while_a_command_is_at_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console, "_SILENT_S", 0.001)
    said, show = threading.Event(), console.show

    def heard(text: str, *, stderr: bool = False) -> None:
        show(text, stderr=stderr)
        if text == "7 of 36":
            said.set()

    monkeypatch.setattr(console, "show", heard)
    with working("Drawing a.mcap") as note:
        note("7 of 36")
        assert said.wait(60)
    assert capsys.readouterr().err.startswith("Drawing a.mcap …\n")


def test_the_version_is_shown(isiw: Command) -> None:
    result = isiw("--version")
    assert (result.exit_code, result.output) == (0, f"isiw {__version__}\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "nowhere.toml"], "cannot be read"),
        (["run", "--subject", "recorded"], "--data"),
        (["run", "--subject", "reel"], "subject.kind"),
        (["show", "nowhere.mcap"], "no such log"),
        (["resume", "nowhere.mcap"], "no such log"),
        (["study", "run", "nowhere.toml"], "cannot be read"),
        (["study", "summary", "nowhere"], "cannot be read"),
    ],
)
def test_an_error_is_a_message_and_exit_code_1(isiw: Command, arguments: list[str], message: str) -> None:
    result = isiw(*arguments)
    assert result.exit_code == 1
    assert result.output.splitlines()[-1].startswith("error: ")
    assert message in result.output
    assert "Traceback" not in result.output


@pytest.mark.slow
def test_help_and_import_load_no_torch_and_are_fast() -> None:
    check = "import sys, isiw.cli; assert not {'torch', 'matplotlib', 'pandas', 'pydantic'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", check], check=True)  # noqa: S603
    one_command = [sys.executable, "-c", "import typer; typer.run(lambda: None)", "--help"]
    spent_s, least_s = (min(_processor_s(command) for _ in range(2)) for command in ([*COMMAND, "--help"], one_command))
    assert spent_s < 2.5 * least_s


def _processor_s(command: Sequence[str]) -> float:
    """The time that a command takes on the processor, which does not depend on what else the machine is doing [s]."""
    begin = os.times()
    done = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603
    end = os.times()
    assert "--help" in done.stdout
    return (end.children_user - begin.children_user) + (end.children_system - begin.children_system)


def test_what_the_operating_system_refuses_is_a_message(isiw: Command, log: Path, tmp_path: Path) -> None:
    (tmp_path / "picture.png").mkdir()
    result = isiw("plot", log, "-o", "picture.png")
    assert result.exit_code == 1
    assert "error: " in result.output
    assert "picture.png" in result.output


@pytest.mark.slow
def test_a_sign_that_the_output_lacks_ends_nothing(short: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    ended = subprocess.run(  # noqa: S603
        [sys.executable, "-m", "isiw", "run", short, "--log", "s.mcap"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert "picture: s.png" in ended.stdout


def test_a_paragraph_is_as_wide_as_the_terminal_and_its_command_is_in_one_piece(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said, way_on = (
        "The session is not over, as three trials in a row were lost; resume with:",
        "isiw resume P07.mcap a.toml",
    )
    show_statement(f"{said} {way_on}")
    assert capsys.readouterr().out == f"{said} {way_on}\n"  # of a pipe nobody knows how wide it is
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "24")
    show_statement(f"{said} {way_on}")
    *lines, last = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
    assert max(map(len, lines)) <= 24
    assert " ".join(line.strip() for line in lines) == said
    assert last == way_on


def test_an_interrupt_before_a_command_begins_ends_in_a_sentence() -> None:
    script = (
        "import signal, sys, types, isiw.__main__ as entry\n"
        "loaded = types.ModuleType('isiw.cli')\n"
        "loaded.app = lambda: signal.raise_signal(signal.SIGINT)\n"
        "sys.modules['isiw.cli'] = loaded\n"
        "entry.main()\n"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)  # noqa: S603
    assert (ended.returncode, ended.stdout, ended.stderr) == (INTERRUPTED, "", "Interrupted.\n")
