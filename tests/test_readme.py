"""What the README shows works as it stands there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from isiw.config.run import load_config

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def test_the_python_examples_run_one_after_the_other(tmp_path, monkeypatch, capsys) -> None:
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


def test_the_examples_are_as_short_as_promised() -> None:
    for block in blocks("python")[:1]:
        assert len([line for line in block.splitlines() if line.strip()]) <= 20


def test_the_configuration_is_valid(tmp_path) -> None:
    (block,) = blocks("toml")
    (tmp_path / "session.toml").write_text(block)
    config = load_config(tmp_path / "session.toml")
    assert config.strategy.settings["max_trials"] == tomllib.loads(block)["strategy"]["settings"]["max_trials"]


def test_there_are_exactly_two_commands_to_set_up() -> None:
    commands = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("pip")]
    assert commands == ["pip install -e . && isiw run", 'pip install -e ".[test]" && pytest']


def test_every_linked_file_exists() -> None:
    for target in re.findall(r"\]\((?!http)([^)]+)\)", TEXT):
        assert (ROOT / target).is_file(), target
