"""The complete examples of the pages for labs run as they stand there, their rigs in processes of their own."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest
from docs.draw_wiring import IMAGES, PICTURES

import lsl_network
from isiw.config import device_for, load_config, session_for
from isiw.testing import check_device

PAGES = Path(__file__).parents[1] / "docs" / "lab"
assert lsl_network


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (PAGES / page).read_text("utf-8"), flags=re.DOTALL)


@contextmanager
def example(page: str, place: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The files of a page, and its rig running beside."""
    (rig,), (config,) = blocks(page, "python"), blocks(page, "toml")
    (place / "rig.py").write_text(rig, encoding="utf-8")
    (place / "session.toml").write_text(f'log = "log.mcap"\n{config}', encoding="utf-8")
    with subprocess.Popen([sys.executable, "rig.py"], cwd=place) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
def test_the_example_of_the_folder_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with example("folder.md", tmp_path) as rig:
        while not (tmp_path / "shared").exists():
            assert rig.poll() is None, "the rig has ended"
            time.sleep(0.01)
        config = load_config("session.toml")
        check_device(partial(device_for, config), config.space)
        result = session_for(config).run()
    assert len(result.trials.told) == 6


@pytest.mark.slow
def test_the_example_of_lsl_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pylsl", reason="the extra lsl is not installed")
    monkeypatch.chdir(tmp_path)
    with example("lsl.md", tmp_path):
        config = load_config("session.toml")
        check_device(partial(device_for, config), config.space)
        result = session_for(config).run()
    assert len(result.trials.told) == 6
    assert all(trial.mep_mv is not None and 0.25 < trial.mep_mv < 0.35 for trial in result.trials.told)


@pytest.mark.slow
def test_the_example_of_functions_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (block,) = blocks("callback.md", "python")
    exec(compile(block, "callback.md", "exec"), {"__name__": "page"})  # noqa: S102 - the point of the test
    assert "The budget of 6 stimuli is used up." in capsys.readouterr().out


def test_what_has_not_run_on_hardware_says_so() -> None:
    sketch = (PAGES / "callback.md").read_text("utf-8").partition("## With a DAQ card: an untested sketch")[2]
    assert "untested: it has not been run on\nhardware" in sketch
    assert "```python" not in sketch


@pytest.mark.parametrize("name", PICTURES)
def test_every_wiring_is_drawn(name: str) -> None:
    assert (IMAGES / f"wiring_{name}.svg").read_text("utf-8").count("<!--") > 5


def test_the_figures_of_the_arduinos_page_are_those_of_its_result() -> None:
    result = (PAGES.parents[1] / "benchmarks" / "results" / "arduino.md").read_text("utf-8")
    rows = re.findall(r"^\|.*\|$", result, flags=re.MULTILINE)
    page = (PAGES / "arduino.md").read_text("utf-8")
    assert len(rows) > 15
    assert [row for row in rows if row not in page] == []
