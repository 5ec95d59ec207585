from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cli.conftest import Command
from isiw import __version__
from isiw.cli import app
from isiw.config import true_window
from isiw.log.reader import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.loop import Session
from isiw.strategy.catalogue import list_strategies
from known import known
from scripted import ScriptedDevice, scripted_strategy

SHORT = "[strategy.settings]\nmax_trials = 3\nparticles = 100\n"


@pytest.fixture
def short(tmp_path: Path) -> Path:
    """A configuration of few trials."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a short session."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "short.toml").write_text(SHORT)
    result = CliRunner().invoke(app, ["run", str(folder / "short.toml"), "--log", str(folder / "s.mcap")])
    assert result.exit_code == 0, result.output
    return folder / "s.mcap"


@pytest.fixture
def log(finished: Path, tmp_path: Path) -> Path:
    """A copy of that log."""
    return Path(shutil.copy(finished, tmp_path))


def test_run_ends_with_a_statement_a_log_and_a_picture(isiw: Command, short: Path, tmp_path: Path) -> None:
    result = isiw("run", short, "--seed", 3)
    assert result.exit_code == 0, result.output
    (log,) = (tmp_path / "isiw-sessions").glob("*.mcap")
    assert log.with_suffix(".png").stat().st_size > 5000
    for part in (
        "probability of a window",
        "3 pairs of stimuli were delivered",
        "in fact",
        log.name,
        log.stem + ".png",
    ):
        assert part in result.output
    assert read_session(log).header.seed == 3


def test_run_shows_every_trial_as_it_comes(isiw: Command, short: Path) -> None:
    lines = isiw("run", short).output.splitlines()
    headings = next(number for number, line in enumerate(lines) if line.startswith("trial"))
    assert [line.split()[0] for line in lines[headings + 1 : headings + 4]] == ["0", "1", "2"]


def test_run_with_recorded_emg_logs_the_raw_sweeps(isiw: Command, short: Path, recordings_folder: Path) -> None:
    result = isiw("run", short, "--subject", "recorded", "--data", recordings_folder, "--log", "r.mcap")
    assert result.exit_code == 0, result.output
    record = read_session("r.mcap")
    assert [len(record.sweep(trial)["emg"].values) for trial in range(3)] == [451] * 3
    assert len(record.table.told) == 3


def test_the_version_is_shown(isiw: Command) -> None:
    result = isiw("--version")
    assert (result.exit_code, result.output) == (0, f"isiw {__version__}\n")


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


def test_run_never_overwrites_a_log(isiw: Command, short: Path, log: Path) -> None:
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
def test_an_error_is_a_message_and_exit_code_1(isiw: Command, arguments: list[str], message: str) -> None:
    result = isiw(*arguments)
    assert result.exit_code == 1
    assert result.output.startswith("error: ")
    assert message in result.output
    assert "Traceback" not in result.output


def test_show_lists_trials_and_repeats_the_statement(isiw: Command, log: Path) -> None:
    result = isiw("show", log)
    assert result.exit_code == 0
    assert len([line for line in result.output.splitlines() if line[:1].isdigit() and "ms" in line]) >= 3
    assert "The budget of 3 stimuli is used up." in result.output


def test_show_says_first_who_when_with_what_and_within_which_limits(isiw: Command, log: Path) -> None:
    lines = isiw("show", log).output.splitlines()
    assert [line.split(":")[0] for line in lines[:6]] == [
        "subject", "date", "device", "limits", "strategy", "version",
    ]  # fmt: skip
    assert "default, seed 0" in lines[4]
    assert f"isiw {__version__}" in lines[5]


def test_report_writes_a_page_beside_the_log_or_where_it_is_told(isiw: Command, log: Path, tmp_path: Path) -> None:
    assert isiw("report", log).output.endswith(f"{log.stem}.html\n")
    assert "<title>Session of" in log.with_suffix(".html").read_text("utf-8")
    assert isiw("report", log).output.endswith(f"{log.stem}_2.html\n")
    (tmp_path / "r.html").write_bytes(b"precious")
    refused = isiw("report", log, "-o", "r.html")
    assert refused.exit_code == 1
    assert "--overwrite" in refused.output
    assert (tmp_path / "r.html").read_bytes() == b"precious"
    assert isiw("report", log, "-o", log, "--overwrite").exit_code == 1
    assert isiw("report", log, "-o", "r.html", "--overwrite").exit_code == 0
    assert (tmp_path / "r.html").stat().st_size > 1_000_000


def test_report_of_a_damaged_log_shows_what_is_left_and_exits_3(isiw: Command, log: Path) -> None:
    whole = bytearray(log.read_bytes())
    blocks = [at for at in range(len(whole)) if whole.startswith(b"\x04\x00\x00\x00zstd", at)]
    whole[blocks[4] + 60] ^= 0xFF
    log.write_bytes(whole)
    assert isiw("report", log, "-o", "r.html").exit_code == 3
    assert "The log is damaged." in Path("r.html").read_text("utf-8")


def test_show_of_a_damaged_log_says_what_was_lost_and_exits_3(isiw: Command, log: Path) -> None:
    whole = bytearray(log.read_bytes())
    blocks = [at for at in range(len(whole)) if whole.startswith(b"\x04\x00\x00\x00zstd", at)]
    whole[blocks[4] + 60] ^= 0xFF
    log.write_bytes(whole)
    result = isiw("show", log)
    assert result.exit_code == 3
    assert "fails its checksum and is lost" in result.output
    assert "trial" in result.output


def test_show_of_an_unreadable_log_exits_3(isiw: Command, tmp_path: Path) -> None:
    (tmp_path / "s.mcap").write_bytes(b"")
    assert isiw("show", "s.mcap").exit_code == 3


def test_plot_draws_beside_the_log_where_no_file_is_given(isiw: Command, log: Path) -> None:
    assert not log.with_suffix(".png").exists()
    assert isiw("plot", log).exit_code == 0
    assert log.with_suffix(".png").exists()


def test_plot_draws_into_the_file(isiw: Command, log: Path, tmp_path: Path) -> None:
    result = isiw("plot", log, "-o", "picture.pdf")
    assert result.exit_code == 0
    assert (tmp_path / "picture.pdf").stat().st_size > 5000


def test_a_session_of_lab_software_with_its_own_configuration_is_drawn_without_a_truth(
    isiw: Command,
    tmp_path: Path,
) -> None:
    Session(ScriptedDevice(), scripted_strategy(2), log=tmp_path / "lab.mcap", config={"rig": "A", "seed": 3}).run()
    result = isiw("plot", "lab.mcap", "-o", "picture.png")
    assert result.exit_code == 0, result.output
    assert true_window(read_session("lab.mcap")) is None
    assert isiw("show", "lab.mcap").exit_code == 0


def test_exclude_appends_and_resume_learns_without_it(isiw: Command, log: Path) -> None:
    assert isiw("exclude", log, 1, "--reason", "sneezed").exit_code == 0
    shown = isiw("show", log).output
    assert "exclusion (trial 1): sneezed" in shown
    assert "(excluded)" in shown
    result = isiw("resume", log)
    assert result.exit_code == 0, result.output
    assert "2 count; 1 excluded" in result.output


def test_resume_of_another_softwares_log_says_how(isiw: Command, tmp_path: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(1), log=tmp_path / "s.mcap").run()
    result = isiw("resume", "s.mcap")
    assert result.exit_code == 1
    assert "isiw.resume(path, device)" in result.output


COMMAND = [sys.executable, "-c", "from isiw.cli import app; app()"]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_ctrl_c_closes_the_log_and_the_exit_code_says_so(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text("[strategy.settings]\nmax_trials = 190\nstop_width_ms = 0.001\n")
    command = [*COMMAND, "run", "long.toml", "--log", "s.mcap"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:  # noqa: S603
        lines = [known(process.stdout).readline() for _ in range(7)]  # the log, two of a legend, headings, trials
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
    assert lines[3].startswith("trial")
    assert process.returncode == 130
    assert "isiw resume s.mcap" in output
    assert "Interrupted" in errors
    assert "Traceback" not in errors
    record = read_session(tmp_path / "s.mcap")
    assert record.finished
    assert record.losses == ()
    assert len(record.table) >= 3


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_run_is_resumed_to_where_it_would_have_come(tmp_path: Path, isiw: Command) -> None:
    text = "[strategy.settings]\nmax_trials = 12\nstop_width_ms = 0.001\nstop_expected_f1 = 1.0\n"
    (tmp_path / "twelve.toml").write_text(text)
    with subprocess.Popen(  # noqa: S603
        [*COMMAND, "run", "twelve.toml", "--log", "killed.mcap"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    ) as process:
        reported = [known(process.stdout).readline() for _ in range(8)][4:]
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


def test_a_log_is_not_overwritten_by_its_picture(isiw: Command, short: Path, tmp_path: Path) -> None:
    result = isiw("run", short, "--log", "s.png")
    assert result.exit_code == 1
    assert "overwritten by its picture" in result.output
    assert not (tmp_path / "s.png").exists()


def test_what_the_operating_system_refuses_is_a_message(isiw: Command, log: Path, tmp_path: Path) -> None:
    (tmp_path / "picture.png").mkdir()
    result = isiw("plot", log, "-o", "picture.png")
    assert result.exit_code == 1
    assert "error: " in result.output
    assert "picture.png" in result.output


def test_a_picture_that_finds_no_room_takes_nothing_from_the_session(
    isiw: Command, short: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_room(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("isiw.plots.save_session_plot", no_room)
    result = isiw("run", short, "--log", "s.mcap")
    assert result.exit_code == 0
    assert "No space left on device" in result.output
    assert "The log is complete; draw it later with: isiw plot s.mcap" in result.output
    assert read_session("s.mcap").finished


def test_a_picture_replaces_no_log_and_nothing_else_unasked(isiw: Any, log: Path, tmp_path: Path) -> None:
    for name in ("log.pdf", "picture.png"):
        (tmp_path / name).write_bytes(log.read_bytes() if name == "log.pdf" else b"precious")
        before = (tmp_path / name).read_bytes()
        result = isiw("plot", log, "-o", name)
        assert (result.exit_code, (tmp_path / name).read_bytes()) == (1, before)
        assert "--overwrite" in result.output
    assert isiw("plot", "log.pdf", "-o", "log.pdf", "--overwrite").exit_code == 1
    assert (tmp_path / "log.pdf").read_bytes() == log.read_bytes()
    assert isiw("plot", log, "-o", "picture.png", "--overwrite").exit_code == 0
    assert (tmp_path / "picture.png").stat().st_size > 5000


def test_the_picture_that_run_draws_takes_a_free_name(isiw: Any, short: Any, tmp_path: Path) -> None:
    (tmp_path / "new.png").write_bytes(b"precious")
    result = isiw("run", short, "--log", "new.mcap")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "new.png").read_bytes() == b"precious"
    assert "new_2.png" in result.output
    assert (tmp_path / "new_2.png").stat().st_size > 5000


def test_show_obeys_nothing_that_a_log_says_to_the_terminal(isiw: Any, log: Path) -> None:
    record = read_session(log)
    text = "\x1b]8;;https://elsewhere.example\x1b\\sneezed\x1b]8;;\x1b\\ \x1b[2J\u202egnp.exe\r:warning:"
    with LogWriter.continuing(log, salvage(log), record.header) as writer:
        writer.append(Event(kind="fault", trial=1, text=text))
    result = isiw("show", log)
    assert "fault (trial 1): sneezed gnp.exe:warning:" in result.output
    assert not set(result.output) & set("\x1b\r\u202e")


def test_show_of_a_log_without_its_end_asks_for_the_stimulators_count_and_exits_3(isiw: Any, log: Path) -> None:
    whole = log.read_bytes()
    blocks = [at - 37 for at in range(len(whole)) if whole.startswith(b"\x04\x00\x00\x00zstd", at)]
    log.write_bytes(whole[: blocks[4]])
    result = isiw("show", log)
    assert result.exit_code == 3
    assert "was cut off" in result.output
    assert "isiw resume --lost-pulses N" in result.output
    assert isiw("resume", log).exit_code == 3
    result = isiw("resume", log, "--lost-pulses", 1)
    assert result.exit_code == 0, result.output
    assert "outcome unknown" in isiw("show", log).output


@pytest.mark.parametrize(
    "text",
    [
        "[strategy.settings]\nparticles = 1_000_000_000\n",
        "[strategy.settings]\ninitial_trials = 1_000_000_000\n",
        "[strategy.settings]\nmax_trials = 1e9\n",
        "[space]\nhigh_ms = 1e9\n",
        "[space]\nstep_ms = 1e-6\n",
        "[space]\nlow_ms = -1.7e308\nhigh_ms = 1.7e308\n",
        "[subject]\nnumber = 1_000_000_000\n",
        "seed = " + "[" * 100_000 + "\n",
    ],
)
def test_a_configuration_that_asks_for_too_much_is_an_error_at_once(isiw: Any, tmp_path: Path, text: str) -> None:
    (tmp_path / "hostile.toml").write_text(text)
    begin = time.process_time()
    result = isiw("run", "hostile.toml")
    assert time.process_time() - begin < 2
    assert result.exit_code == 1
    assert result.output.startswith("error: ")


def test_an_excluded_trial_is_included_again(isiw: Command, log: Path) -> None:
    assert isiw("exclude", log, 1, "--reason", "cough").exit_code == 0
    assert isiw("include", log, 1).output == "Trial 1 counts again.\n"
    assert all(trial.told for trial in read_session(log).table)


def test_day_and_operator_are_noted_in_the_log(isiw: Command, short: Path) -> None:
    result = isiw("run", short, "--log", "v.mcap", "--day", 2, "--operator", "MK")
    assert result.exit_code == 0, result.output
    visit = read_session("v.mcap").header.visit
    assert (visit.day, visit.operator) == (2, "MK")


def test_a_protocol_is_kept_and_its_controls_are_told_from_pairs(isiw: Command, short: Path) -> None:
    short.write_text(SHORT + "[protocol]\niti_s = [5.0, 6.0]\ntms_alone = 0.3\ntap_alone = 0.3\n")
    result = isiw("run", short, "--log", "p.mcap")
    assert result.exit_code == 0, result.output
    record = read_session("p.mcap")
    assert record.header.protocol.iti_s == (5.0, 6.0)
    shown = isiw("show", "p.mcap").output
    for kind in ("tap alone", "TMS alone"):
        assert kind in result.output
        assert kind in shown
    assert "stimuli were delivered, " in result.output
    assert sum(trial.commanded_isi_ms is not None for trial in record.table) == 3


@pytest.mark.skipif(os.name == "nt", reason="POSIX pipes")
def test_a_reader_who_has_enough_of_the_output_is_no_fault(tmp_path: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(6), log=tmp_path / "s.mcap").run()
    read, write = os.pipe()
    os.close(read)
    ended = subprocess.run(  # noqa: S603
        [*COMMAND, "show", "s.mcap"], cwd=tmp_path, stdout=write, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(write)
    assert "Traceback" not in ended.stderr
    assert "SystemExit" not in ended.stderr
