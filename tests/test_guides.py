"""What the guides show works as it stands there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from benchmarks.reduction.redraw import reproduction

import isiw
from isiw.acquisition.registry import ACQUISITIONS
from isiw.config import load_config

DOCS = Path(__file__).parents[1] / "docs"


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text_of(page), flags=re.DOTALL)


@pytest.mark.slow
def test_the_python_examples_run_one_page_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for page in ("device.md", "log.md", "strategies.md", "after_effects.md", "own-model.md"):
        names: dict[str, Any] = {"__name__": "guide"}
        for block in blocks(page, "python"):
            exec(compile(block, page, "exec", dont_inherit=True), names)  # noqa: S102 - the point of the test
    printed = capsys.readouterr().out
    assert "The budget of 4 stimuli is used up." in printed
    assert "nothing is missing" in printed
    assert "60 pairs are left." in printed
    assert "conforms\n" in printed
    assert "is reported" in printed


@pytest.mark.parametrize("page", ["device.md", "log.md"])
def test_a_device_of_an_example_says_that_it_is_simulated_and_what_a_real_one_leaves_out(page: str) -> None:
    (info,) = re.findall(r"isiw\.DeviceInfo\(.*", "".join(blocks(page, "python")))
    assert "simulated=True)  # leave simulated out for a real rig" in info


def test_the_configuration_is_valid(tmp_path: Path) -> None:
    (block,) = blocks("running.md", "toml")
    (tmp_path / "session.toml").write_text(block)
    config = load_config(tmp_path / "session.toml")
    assert config.strategy.settings["max_trials"] == tomllib.loads(block)["strategy"]["settings"]["max_trials"]


def test_every_strategy_and_acquisition_function_is_in_the_tables() -> None:
    rows = "".join(line for line in text_of("strategies.md").splitlines() if line.startswith("| `"))
    assert [name for name in (*isiw.list_strategies(), *ACQUISITIONS) if f"`{name}`" not in rows] == []


def test_the_page_says_of_the_reproduction_what_its_report_says_first() -> None:
    (shown,) = re.findall(
        r"<!-- reproduction: begin.*?-->\n(.*?)\n<!-- reproduction: end -->", text_of("performance.md"), flags=re.DOTALL
    )
    assert shown == reproduction()
