"""A log of a stranger: nothing that it names is run, imported or opened, and what is not needed stops nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import isiw as library
from cli.conftest import Command

SPACE = library.DesignSpace(0, 500, reference="valve")


def write_log(path: Path, run: Any) -> Path:
    """A log of four trials whose header has this run section."""
    strategy = library.make_strategy("random", space=SPACE, seed=0, max_trials=10, particles=60)
    config = {"isiw_run": run}
    with library.open_session(strategy, log=path, config=config, clock=library.VirtualClock()) as session:
        for trial in range(4):
            session.tell(session.ask(), 0.1 + 0.01 * trial)
    return path


def test_resuming_a_log_runs_no_function_that_it_names(isiw: Command, tmp_path: Path) -> None:
    command = {"cmd": f"touch {tmp_path}/RUN"}
    write_log(tmp_path / "evil.mcap", {"device": {"factory": "subprocess:getoutput", "settings": command}})
    result = isiw("resume", "evil.mcap")
    assert result.exit_code == 1
    assert "the session's device is not known here" in result.output
    assert "isiw resume" in result.output
    assert "Traceback" not in result.output
    assert not (tmp_path / "RUN").exists()


def test_resuming_a_log_imports_no_module_from_a_folder_that_it_names(isiw: Command, tmp_path: Path) -> None:
    folder = tmp_path / "mod"
    folder.mkdir()
    (folder / "planted_rig.py").write_text(f"open({str(tmp_path / 'IMPORTED')!r}, 'w')\n")
    write_log(tmp_path / "evil.mcap", {"device": {"factory": "planted_rig:make", "folder": str(folder)}})
    assert isiw("resume", "evil.mcap").exit_code == 1
    assert not (tmp_path / "IMPORTED").exists()


@pytest.mark.parametrize("person", [{"cohort": "of-an-older-version"}, {"number": -1}, {"kind": "cloned"}, "nobody"])
@pytest.mark.parametrize("command", ["plot", "report"])
def test_a_log_of_an_unknown_person_is_drawn_without_the_truth(
    isiw: Command, tmp_path: Path, command: str, person: Any
) -> None:
    write_log(tmp_path / "odd.mcap", {"subject": person})
    result = isiw(command, "odd.mcap")
    assert result.exit_code == 0, result.output
    assert "The true window of the simulated person is not known" in result.output


def test_a_word_of_another_version_in_the_run_section_stops_nothing(isiw: Command, tmp_path: Path) -> None:
    write_log(tmp_path / "odd.mcap", {"subject": {"cohort": "gaussian", "age": 7}, "limits": 3, "robot": {"arm": 1}})
    result = isiw("plot", "odd.mcap")
    assert result.exit_code == 0
    assert "not known" not in result.output


def test_recordings_are_opened_only_where_the_operator_names_them(
    isiw: Command, short: Path, recordings_folder: Path
) -> None:
    arguments = ("--subject", "recorded", "--data", recordings_folder, "--log", "r.mcap")
    assert isiw("run", short, *arguments).exit_code == 0
    refused = isiw("resume", "r.mcap")
    assert refused.exit_code == 1
    assert "nor taken from a log" in refused.output
    assert "--data DIR" in refused.output
    assert isiw("resume", "r.mcap", "--data", recordings_folder).exit_code == 0
