"""What the README shows works as it stands there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from benchmarks.readme_results import reproduction, table
from typer.main import get_command

import isiw
from isiw.cli.main import app
from isiw.config import load_config

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def test_the_python_examples_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(blocks("python")) == 4
    for block in blocks("python"):
        exec(compile(block, "README.md", "exec"), {"__name__": "readme"})  # noqa: S102 - the point of the test
    printed = capsys.readouterr().out
    assert "The budget of 6 stimuli is used up." in printed
    assert "nothing is missing" in printed


def test_every_device_of_the_examples_says_that_it_is_simulated_and_what_a_real_one_leaves_out() -> None:
    examples = "".join(blocks("python"))
    infos = re.findall(r"isiw\.DeviceInfo\(.*", examples)
    assert len(infos) == 2
    assert all("simulated=True)  # leave simulated out for a real rig" in info for info in infos)
    assert "VirtualClock" not in examples


def test_a_labs_own_loop_takes_ten_lines() -> None:
    assert len([line for line in blocks("python")[0].splitlines() if line.strip()]) <= 10


def test_the_examples_log_to_different_files() -> None:
    logs = re.findall(r"(?:--log |log=\")([\w.]+)", TEXT)
    assert len(logs) == len(set(logs)) == 3


def test_the_first_screen_says_what_and_how() -> None:
    screen = TEXT[: TEXT.index("## ")]
    for part in ("**window**", "**F1**", "pip install -e .", "whl/cpu", "session.tell("):
        assert part in screen


def test_the_results_are_those_of_the_files() -> None:
    (shown,) = re.findall(r"<!-- results: begin.*?-->\n(.*?)\n<!-- results: end -->", TEXT, flags=re.DOTALL)
    assert shown == table()


def test_the_readme_says_of_the_reproduction_what_its_report_says_first() -> None:
    (shown,) = re.findall(r"<!-- reproduction: begin.*?-->\n(.*?)\n<!-- reproduction: end -->", TEXT, flags=re.DOTALL)
    assert shown == reproduction()


def test_the_configuration_is_valid(tmp_path: Path) -> None:
    (block,) = blocks("toml")
    (tmp_path / "session.toml").write_text(block)
    config = load_config(tmp_path / "session.toml")
    assert config.strategy.settings["max_trials"] == tomllib.loads(block)["strategy"]["settings"]["max_trials"]


def test_every_strategy_is_in_the_table() -> None:
    rows = "".join(line for line in TEXT.splitlines() if line.startswith("| `"))
    assert [name for name in isiw.list_strategies() if f"`{name}`" not in rows] == []


def command_names(group: Any) -> list[str]:
    parts = {name: getattr(inner, "commands", {}) for name, inner in group.commands.items()}
    return [f"isiw {name} {part}".strip() for name, inner in parts.items() for part in inner or [""]]


def test_every_command_is_shown() -> None:
    names = command_names(get_command(app))
    assert {"isiw run", "isiw new rig"} <= set(names)
    assert [name for name in names if name not in TEXT] == []


def test_one_command_sets_up_one_spares_the_gpu_libraries_and_one_tests() -> None:
    commands = [
        line.split("  #")[0].rstrip() for block in blocks("sh") for line in block.splitlines() if line.startswith("pip")
    ]
    torch = "pip install torch --index-url https://download.pytorch.org/whl/cpu"
    assert commands == [torch, "pip install -e . && isiw run", 'pip install -e ".[test]" && pytest -n auto']
