from __future__ import annotations

from pathlib import Path

import pytest

from cli.conftest import Command
from isiw.log.record import read_session

SEARCH = """
seed = 5
[subject]
number = 3
[strategy]
settings = { max_trials = 20, particles = 200 }
[limits]
max_pulses = 400
"""

INTERVENTION = """
[intervention]
changes_the_person = true
protocol_code = "2026-17"
arms = ["window", "outside"]
pairs = 50
before = 4
after = 4
after_min = [0, 1]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "pair.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (SEARCH, "the configuration has no intervention"),
        (SEARCH + INTERVENTION, "needs the log of the search for the window"),
        (SEARCH + INTERVENTION.replace("pairs = 50", "pairs = 20"), "pairs"),
        (SEARCH + INTERVENTION.replace("before = 4", "befor = 4"), "befor"),
    ],
)
def test_without_a_plan_or_a_window_nothing_is_paired(isiw: Command, tmp_path: Path, text: str, says: str) -> None:
    result = isiw("pair", written(tmp_path, text))
    assert result.exit_code == 1
    assert says in " ".join(result.output.split())


@pytest.mark.slow
def test_an_intervention_needs_its_statement_and_ends_concealed_until_it_is_opened(
    isiw: Command, tmp_path: Path
) -> None:
    config = written(tmp_path, SEARCH + INTERVENTION)
    assert isiw("run", config, "--log", "w.mcap").exit_code == 0
    unstated = written(tmp_path, SEARCH + INTERVENTION.replace("changes_the_person = true", ""))
    assert "does not state that the intervention is meant to change the person" in " ".join(
        isiw("pair", unstated, "--after", "w.mcap").output.split()
    )
    config = written(tmp_path, SEARCH + INTERVENTION)
    result = isiw("pair", config, "--after", "w.mcap", "--log", "p.mcap")
    assert result.exit_code == 0, result.output
    assert "Delivered: 4 before, 50 of the intervention, 8 after." in result.output
    assert "The arm is concealed." in result.output
    assert not list(tmp_path.glob("p*.png"))
    arm = read_session("p.mcap").header.intervention
    assert arm is not None
    for command in ("show", "plot"):
        assert "concealed" in isiw(command, "p.mcap").output
    assert isiw("report", "p.mcap").exit_code == 0
    page = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert "concealed" in page
    assert arm.arm.words not in page
    assert arm.arm.words in isiw("pair", "--open", "p.mcap").output
    assert "opening" in isiw("show", "p.mcap").output
    taught = isiw("run", config, "--after", "p.mcap")
    assert taught.exit_code == 1
    assert "teaches no window" in " ".join(taught.output.split())
