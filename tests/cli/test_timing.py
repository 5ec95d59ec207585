from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from isiw.cli import app
from isiw.design import DesignSpace
from isiw.devices.robot.tapper import Tapper
from isiw.devices.simulated import SimulatedDevice
from isiw.session.loop import Session
from scripted import scripted_strategy


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["timing", *map(str, arguments)])


@pytest.mark.slow
def test_timing_of_a_preset_is_printed_and_drawn(tmp_path: Path) -> None:
    result = run("subject1", "--taps", 12, "--output", tmp_path / "timing.png")
    assert result.exit_code == 0
    assert "Simulating 108 taps …" in result.output
    assert "subject1: 108 taps" in result.output
    assert "Pooled SD of the ISI error" in result.output
    assert (tmp_path / "timing.png").exists()


@pytest.mark.slow
def test_timing_of_the_vane_actuator_is_printed_and_drawn(tmp_path: Path) -> None:
    result = run("vane", "--taps", 12, "--output", tmp_path / "vane.png")
    assert result.exit_code == 0, result.output
    assert "vane: 12 rotations" in result.output
    assert "t_motion" in result.output
    assert (tmp_path / "vane.png").exists()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_study() -> None:
    assert run("cushion", "--taps", 5, "--seed", 3).stdout == run("cushion", "--taps", 5, "--seed", 3).stdout
    assert run("cushion", "--taps", 5, "--seed", 3).stdout != run("cushion", "--taps", 5, "--seed", 4).stdout


def test_an_unknown_source_is_a_message_with_the_presets(tmp_path: Path) -> None:
    result = run("nothing")
    assert result.exit_code == 1
    assert "timing-fault" in result.output
    assert "there is no such log" in run(tmp_path / "nothing.mcap").output


def test_a_folder_of_the_name_of_a_preset_is_none_of_its_business(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cushion").mkdir()
    assert run("cushion", "--taps", 2).exit_code == 0


class NoResponse:
    mep_mv = 0.0


@pytest.mark.parametrize(("there", "asked"), [("s.mcap.part", "s.mcap"), ("s.mcap", "s.mcap.part")])
def test_timing_of_a_log_takes_either_of_its_names(tmp_path: Path, there: str, asked: str) -> None:
    strategy = scripted_strategy(4, space=DesignSpace(20, 200, reference="impact"))
    log = (
        Session(SimulatedDevice(Tapper(lambda _: NoResponse(), "subject4")), strategy, log=tmp_path / "s.mcap")
        .run()
        .log
    )
    log.rename(tmp_path / there)
    result = run(tmp_path / asked)
    assert result.exit_code == 0, result.output
    assert "4 taps" in result.output
