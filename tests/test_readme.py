"""What the README shows works as it stands there."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
NAMES: dict[str, Any] = {"__name__": "readme"}
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def test_the_python_examples_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for block in blocks("python"):
        exec(compile(block, "README.md", "exec"), NAMES)  # noqa: S102 - the point of the test
    printed = capsys.readouterr().out
    assert "The budget of 6 stimuli is used up." in printed
    assert re.search(r"^Window: \d+–\d+ ms", printed, flags=re.MULTILINE)


def test_it_is_short() -> None:
    assert len(TEXT.splitlines()) <= 150


def test_a_labs_own_loop_takes_ten_lines() -> None:
    assert len([line for line in blocks("python")[0].splitlines() if line.strip()]) <= 10


def test_the_first_screen_says_what_and_how() -> None:
    screen = TEXT[: TEXT.index("## You have data already")]
    for part in ("**window**", "evenly spaced ISIs", "results.svg", "pip install -e .", "whl/cpu", "session.tell("):
        assert part in screen


def test_f1_is_explained_before_it_is_used() -> None:
    assert TEXT.index("F1") == TEXT.index("**F1** is the overlap") + 2


def test_the_results_are_those_of_the_files() -> None:
    (shown,) = re.findall(r"<!-- results: begin.*?-->\n(.*?)\n<!-- results: end -->", TEXT, flags=re.DOTALL)
    results = ROOT / "benchmarks" / "results" / "compare.json"
    assert shown == json.loads(results.read_text(encoding="utf-8"))["readme"]


def test_one_command_sets_up_one_spares_the_gpu_libraries_one_builds_the_site_and_one_tests() -> None:
    commands = [
        line.split("  #")[0].rstrip() for block in blocks("sh") for line in block.splitlines() if line.startswith("pip")
    ]
    torch = "pip install torch --index-url https://download.pytorch.org/whl/cpu"
    assert commands == [
        torch,
        "pip install -e . && isiw run",
        'pip install -e ".[docs]" && sphinx-build -W --keep-going docs dist/site',
        'pip install -e ".[test]" && pytest -n auto',
    ]
