"""What the commands that learn nothing do without."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

LOG = Path(__file__).parents[1] / "data" / "logs" / "f2fd174-default.mcap"

WITHOUT = """
import importlib.abc, sys
class Absent(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {absent}:
            raise ImportError(name + " is not installed")
sys.meta_path.insert(0, Absent())
from isiw.cli import app
for command in {commands}:
    app(command.split(), standalone_mode=False)
"""

LEARNING = {"torch", "gpytorch", "botorch", "pyro", "sklearn"}
TABLES = {"pandas", "pyarrow", "matplotlib"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("absent", "commands"),
    [
        (
            LEARNING | TABLES | {"scipy"},
            ["strategies", "strategies default", "strategies gp-ei", "strategies parametric-mi", f"show {LOG}"],
        ),
        (
            LEARNING,
            [
                f"plot {LOG} -o picture.png",
                f"report {LOG} -o page.html",
                f"export {LOG} tables",
                f"export {LOG} bids --to bids",
            ],
        ),
    ],
    ids=["read", "draw"],
)
def test_commands_that_learn_nothing_need_no_library_that_learns(
    tmp_path: Path, absent: set[str], commands: list[str]
) -> None:
    started = [sys.executable, "-c", WITHOUT.format(absent=absent, commands=commands)]
    ended = subprocess.run(started, cwd=tmp_path, capture_output=True, text=True, check=False)  # noqa: S603 - our own

    assert ended.returncode == 0, ended.stderr


@pytest.mark.slow
def test_a_file_is_refused_before_anything_that_analyses_it_is_loaded(tmp_path: Path) -> None:
    (tmp_path / "P01.csv").write_text("isi_ms,mep_mv\n10,.3\n20,x\n")
    absent = LEARNING | TABLES | {"scipy", "mne"}
    started = [sys.executable, "-c", WITHOUT.format(absent=absent, commands=["analyse P01.csv --reference impact"])]
    ended = subprocess.run(started, cwd=tmp_path, capture_output=True, text=True, check=False)  # noqa: S603 - our own

    assert "row 2 of the column 'mep_mv'" in ended.stderr


FIRST_SESSION = """
import sys, isiw
strategy = isiw.make_strategy()
for trial in range(6):
    isi_ms = strategy.ask()
    strategy.tell(isi_ms, 0.2 if 200 < isi_ms < 280 else 0.012)
strategy.estimate().probability, strategy.decision
loaded = {HEAVY} & set(sys.modules)
assert not loaded, loaded
"""

FIRST_COMMAND = """
import sys
from isiw.cli import app
try:
    app()
finally:
    loaded = {HEAVY} & set(sys.modules)
    assert not loaded, loaded
"""

HEAVY = {"torch", "gpytorch", "botorch", "pyro", "sklearn", "pandas"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "arguments"),
    [(FIRST_SESSION, ()), (FIRST_COMMAND, ("run",))],
    ids=["in Python", "the first command of README"],
)
def test_a_session_of_the_default_loads_neither_torch_nor_pandas(
    tmp_path: Path, script: str, arguments: tuple[str, ...]
) -> None:
    started = [sys.executable, "-c", script.replace("{HEAVY}", repr(HEAVY)), *arguments]
    ended = subprocess.run(started, cwd=tmp_path, capture_output=True, text=True, check=False)  # noqa: S603 - our own

    assert ended.returncode == 0, ended.stderr
