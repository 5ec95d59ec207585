from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from isiw.cli import app
from isiw.config.run import true_window
from isiw.log.reader import read_session
from isiw.session.loop import Session
from isiw.strategy.catalogue import list_strategies


@pytest.fixture
def isiw(tmp_path, monkeypatch):
    """Runs isiw in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])

    return run


@pytest.fixture
def short(tmp_path):
    """A configuration of few trials."""
    path = tmp_path / "short.toml"
    path.write_text("[strategy.settings]\nmax_trials = 3\n")
    return path


@pytest.fixture
def log(isiw, short, tmp_path):
    assert isiw("run", short, "--log", "s.mcap").exit_code == 0
    return tmp_path / "s.mcap"


def test_run_ends_with_a_statement_a_log_and_a_picture(isiw, short, tmp_path) -> None:
    result = isiw("run", short, "--seed", 3)
    assert result.exit_code == 0, result.output
    (log,) = (tmp_path / "isiw-sessions").glob("*.mcap")
    assert log.with_suffix(".png").stat().st_size > 5000
    for part in ("probability of a window", "3 pairs of stimuli were given", "In truth", log.name, log.stem + ".png"):
        assert part in result.output
    assert read_session(log).header.seed == 3


def test_run_shows_every_trial_as_it_comes(isiw, short) -> None:
    lines = isiw("run", short).output.splitlines()
    headings = next(number for number, line in enumerate(lines) if line.startswith("trial"))
    assert [line.split()[0] for line in lines[headings + 1 : headings + 4]] == ["0", "1", "2"]


def test_run_with_recorded_emg_logs_the_raw_sweeps(isiw, short, recordings_folder) -> None:
    result = isiw("run", short, "--subject", "recorded", "--data", recordings_folder, "--log", "r.mcap")
    assert result.exit_code == 0, result.output
    record = read_session("r.mcap")
    assert [len(record.sweep(trial)["emg"].values) for trial in range(3)] == [451] * 3
    assert len(record.table.told) == 3


def test_strategies_are_listed_and_can_be_named(isiw, short) -> None:
    listed = isiw("strategies").output
    for name, summary in list_strategies().items():
        assert name in listed
        assert summary in listed
    result = isiw("run", short, "--strategy", "particles-mi", "--log", "n.mcap")
    assert result.exit_code == 0, result.output
    assert read_session("n.mcap").header.strategy.name == "particles-mi"
    settings = read_session("n.mcap").header.strategy.settings
    assert (settings["acquisition"], settings["max_trials"]) == ("mutual-information", 3)


def test_run_never_overwrites_a_log(isiw, short, log) -> None:
    before = log.read_bytes()
    result = isiw("run", short, "--log", log)
    assert result.exit_code == 1
    assert "never overwritten" in result.output
    assert log.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "nowhere.toml"], "cannot be read"),
        (["run", "--subject", "recorded"], "--data"),
        (["run", "--subject", "reel"], "subject.kind"),
        (["show", "nowhere.mcap"], "no such log"),
        (["resume", "nowhere.mcap"], "no such log"),
    ],
)
def test_an_error_is_a_message_and_exit_code_1(isiw, arguments, message) -> None:
    result = isiw(*arguments)
    assert result.exit_code == 1
    assert result.output.startswith("error: ")
    assert message in result.output
    assert "Traceback" not in result.output


def test_show_lists_trials_and_repeats_the_statement(isiw, log) -> None:
    result = isiw("show", log)
    assert result.exit_code == 0
    assert len([line for line in result.output.splitlines() if line[:1].isdigit() and "ms" in line]) >= 3
    assert "The budget of 3 stimuli is used up." in result.output


def test_show_of_a_damaged_log_says_what_was_lost_and_exits_3(isiw, log) -> None:
    whole = bytearray(log.read_bytes())
    blocks = [at for at in range(len(whole)) if whole.startswith(b"\x04\x00\x00\x00zstd", at)]
    whole[blocks[4] + 60] ^= 0xFF
    log.write_bytes(whole)
    result = isiw("show", log)
    assert result.exit_code == 3
    assert "fails its checksum and is lost" in result.output
    assert "trial" in result.output


def test_show_of_an_unreadable_log_exits_3(isiw, tmp_path) -> None:
    (tmp_path / "s.mcap").write_bytes(b"")
    assert isiw("show", "s.mcap").exit_code == 3


def test_plot_draws_beside_the_log_where_no_file_is_given(isiw, log) -> None:
    log.with_suffix(".png").unlink()
    assert isiw("plot", log).exit_code == 0
    assert log.with_suffix(".png").exists()


def test_plot_draws_into_the_file(isiw, log, tmp_path) -> None:
    result = isiw("plot", log, "-o", "picture.pdf")
    assert result.exit_code == 0
    assert (tmp_path / "picture.pdf").stat().st_size > 5000


def test_a_session_of_lab_software_with_its_own_configuration_is_drawn_without_a_truth(
    isiw, tmp_path, scripted_strategy, scripted_device
) -> None:
    Session(scripted_device(), scripted_strategy(2), log=tmp_path / "lab.mcap", config={"rig": "A", "seed": 3}).run()
    result = isiw("plot", "lab.mcap", "-o", "picture.png")
    assert result.exit_code == 0, result.output
    assert true_window(read_session("lab.mcap")) is None
    assert isiw("show", "lab.mcap").exit_code == 0


def test_exclude_appends_and_resume_learns_without_it(isiw, log) -> None:
    assert isiw("exclude", log, 1, "--reason", "sneezed").exit_code == 0
    shown = isiw("show", log).output
    assert "exclusion (trial 1): sneezed" in shown
    assert "(excluded)" in shown
    result = isiw("resume", log)
    assert result.exit_code == 0, result.output
    assert "2 count; 1 excluded" in result.output


def test_resume_of_another_softwares_log_says_how(isiw, tmp_path, scripted_strategy, scripted_device) -> None:
    Session(scripted_device(), scripted_strategy(1), log=tmp_path / "s.mcap").run()
    result = isiw("resume", "s.mcap")
    assert result.exit_code == 1
    assert "isiw.resume(path, device)" in result.output


COMMAND = [sys.executable, "-c", "from isiw.cli import app; app()"]


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_ctrl_c_closes_the_log_and_the_exit_code_says_so(tmp_path) -> None:
    (tmp_path / "long.toml").write_text("[strategy.settings]\nmax_trials = 190\nstop_width_ms = 0.01\n")
    command = [*COMMAND, "run", "long.toml", "--log", "s.mcap"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:  # noqa: S603
        lines = [process.stdout.readline() for _ in range(5)]
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
    assert lines[1].startswith("trial")
    assert process.returncode == 130
    assert "isiw resume s.mcap" in output
    assert "Interrupted" in errors
    assert "Traceback" not in errors
    record = read_session(tmp_path / "s.mcap")
    assert record.finished
    assert record.losses == ()
    assert len(record.table) >= 3


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_run_is_resumed_to_where_it_would_have_come(tmp_path, isiw) -> None:
    text = "[strategy.settings]\nmax_trials = 12\nstop_width_ms = 0.01\n"
    (tmp_path / "twelve.toml").write_text(text)
    with subprocess.Popen(  # noqa: S603
        [*COMMAND, "run", "twelve.toml", "--log", "killed.mcap"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    ) as process:
        reported = [process.stdout.readline() for _ in range(6)][2:]
        process.send_signal(signal.SIGKILL)
    assert len(read_session("killed.mcap").table) >= len(reported)
    assert isiw("resume", "killed.mcap").exit_code == 0
    assert isiw("run", "twelve.toml", "--log", "whole.mcap").exit_code == 0
    killed, whole = read_session("killed.mcap"), read_session("whole.mcap")
    first_unknown = next((t.index for t in killed.table if t.reason), len(killed.table))
    assert killed.table.trials[:first_unknown] == whole.table.trials[:first_unknown]
    assert len(killed.table) == len(whole.table)
    if first_unknown == len(killed.table):
        assert killed.table == whole.table


def test_help_and_import_load_no_torch_and_are_fast() -> None:
    check = "import sys, isiw.cli; assert not {'torch', 'matplotlib', 'pandas', 'pydantic'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", check], check=True)  # noqa: S603
    begin = os.times()
    done = subprocess.run([*COMMAND, "--help"], check=True, capture_output=True, text=True)  # noqa: S603
    end = os.times()
    assert "resume" in done.stdout
    # Time on the processor, which does not depend on what else the machine is doing.
    assert (end.children_user - begin.children_user) + (end.children_system - begin.children_system) < 0.5


def test_a_log_is_not_overwritten_by_its_picture(isiw, short, tmp_path) -> None:
    result = isiw("run", short, "--log", "s.png")
    assert result.exit_code == 1
    assert "overwritten by its picture" in result.output
    assert not (tmp_path / "s.png").exists()


def test_what_the_operating_system_refuses_is_a_message(isiw, log, tmp_path) -> None:
    (tmp_path / "picture.png").mkdir()
    result = isiw("plot", log, "-o", "picture.png")
    assert result.exit_code == 1
    assert "error: " in result.output
    assert "picture.png" in result.output
