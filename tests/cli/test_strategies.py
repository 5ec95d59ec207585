from __future__ import annotations

from pathlib import Path

import pytest

from cli.conftest import Command
from isiw.log.record import read_session
from isiw.strategy.catalogue import list_strategies

pytestmark = pytest.mark.usefixtures("blank_pictures")


def test_a_strategys_settings_are_listed_as_a_configuration_has_them_with_unit_and_meaning(isiw: Command) -> None:
    output = isiw("strategies", "default").output
    assert "\nmax_trials = 60\n    stop after this many stimuli; mistrials count, control trials do not." in output
    assert "\nstop_width_ms = 30.0  # ms\n" in output
    assert "\nprior.switch.reliability = [0.2, 0.7, 0.0]  # median, sd, tail\n" in output
    assert "\nprior.profile\n" in output
    assert "\nfixed  # not set\n" in isiw("strategies", "gp-variance").output


def test_what_is_listed_can_be_set(isiw: Command, tmp_path: Path) -> None:
    listed = isiw("strategies", "default").output.splitlines()
    lines = [line for line in listed if " = " in line and not line.startswith(" ")]
    (tmp_path / "all.toml").write_text(
        "\n".join(["[strategy.settings]", *lines]).replace("max_trials = 60", "max_trials = 2")
    )
    result = isiw("run", "all.toml")
    assert result.exit_code == 0, result.output
    assert "The budget of 2 stimuli is used up." in result.output


def test_the_settings_of_an_unknown_strategy_name_the_known_ones(isiw: Command) -> None:
    result = isiw("strategies", "defualt")
    assert result.exit_code == 1
    assert "expected default, particles-window" in result.stderr


def test_strategies_are_listed_and_can_be_named(isiw: Command, short: Path) -> None:
    listed = isiw("strategies").output
    for name, summary in list_strategies().items():
        assert name in listed
        assert summary in listed
    result = isiw("run", short, "--strategy", "particles-mi", "--log", "n.mcap")
    assert result.exit_code == 0, result.output
    assert read_session("n.mcap").header.strategy.name == "particles-mi"
    settings = read_session("n.mcap").header.strategy.settings
    assert (settings["acquisition"], settings["max_trials"]) == ("mutual-information", 3)
