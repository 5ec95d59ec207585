from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from cli.conftest import COMMAND, Command
from export.recorded import note, sweep, write_sweeps
from isiw import __version__
from isiw.config.resume import Truth, truth_of
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.loop import Session
from logs import cut_after, damage
from priors.logged import gaussian_person, write_log
from scripted import ScriptedDevice, scripted_strategy


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


@pytest.mark.slow
def test_report_writes_a_page_beside_the_log_or_where_it_is_told(isiw: Command, log: Path, tmp_path: Path) -> None:
    assert isiw("report", log).output.endswith(f"{log.stem}.html\n")
    assert "<title>Session of" in log.with_suffix(".html").read_text("utf-8")
    assert isiw("report", log).output.endswith(f"{log.stem}_2.html\n")
    log.with_suffix(".html").write_text("old")
    assert isiw("report", log, "--overwrite").output.endswith(f"{log.stem}.html\n")
    assert "<title>Session of" in log.with_suffix(".html").read_text("utf-8")
    (tmp_path / "r.html").write_bytes(b"precious")
    refused = isiw("report", log, "-o", "r.html")
    assert refused.exit_code == 1
    assert "--overwrite" in refused.output
    assert (tmp_path / "r.html").read_bytes() == b"precious"
    assert isiw("report", log, "-o", log, "--overwrite").exit_code == 1
    assert isiw("report", log, "-o", "r.html", "--overwrite").exit_code == 0
    assert (tmp_path / "r.html").stat().st_size > 1_000_000


def test_report_of_a_damaged_log_shows_what_is_left_and_exits_3(isiw: Command, log: Path) -> None:
    damage(log, 4)
    assert isiw("report", log, "-o", "r.html").exit_code == 3
    assert "The log is damaged." in Path("r.html").read_text("utf-8")


def test_show_of_a_damaged_log_says_what_was_lost_and_exits_3(isiw: Command, log: Path) -> None:
    damage(log, 4)
    result = isiw("show", log)
    assert result.exit_code == 3
    assert "fails its checksum and is lost" in result.output
    assert "trial" in result.output


def test_show_of_an_unreadable_log_exits_3(isiw: Command, tmp_path: Path) -> None:
    (tmp_path / "s.mcap").write_bytes(b"")
    assert isiw("show", "s.mcap").exit_code == 3


def test_plot_draws_beside_the_log_or_into_the_file_that_is_given(isiw: Command, log: Path) -> None:
    assert not log.with_suffix(".png").exists()
    assert isiw("plot", log).exit_code == 0
    assert log.with_suffix(".png").exists()
    assert isiw("plot", log, "-o", "picture.pdf").exit_code == 0
    assert Path("picture.pdf").exists()


def test_a_session_of_lab_software_with_its_own_configuration_is_drawn_without_a_truth(
    isiw: Command,
    tmp_path: Path,
) -> None:
    Session(ScriptedDevice(), scripted_strategy(2), log=tmp_path / "lab.mcap", config={"rig": "A", "seed": 3}).run()
    result = isiw("plot", "lab.mcap", "-o", "picture.png")
    assert result.exit_code == 0, result.output
    assert truth_of(read_session("lab.mcap")) == Truth()
    assert isiw("show", "lab.mcap").exit_code == 0


@pytest.mark.slow
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
    assert (tmp_path / "picture.png").read_bytes() != b"precious"


def test_show_obeys_nothing_that_a_log_says_to_the_terminal(isiw: Any, log: Path) -> None:
    record = read_session(log)
    text = "\x1b]8;;https://elsewhere.example\x1b\\sneezed\x1b]8;;\x1b\\ \x1b[2J\u202egnp.exe\r:warning:"
    with LogWriter.continuing(log, salvage(log), record.header) as writer:
        writer.append(Event(kind="fault", trial=1, text=text))
    result = isiw("show", log)
    assert "fault (trial 1): sneezed gnp.exe:warning:" in result.output
    assert not set(result.output) & set("\x1b\r\u202e")


def test_show_of_a_log_without_its_end_asks_for_the_stimulators_count_and_exits_3(isiw: Any, log: Path) -> None:
    cut_after(log, 1)
    result = isiw("show", log)
    assert result.exit_code == 3
    assert "was cut off" in result.output
    assert "isiw resume --lost-pulses N" in result.output
    assert isiw("resume", log).exit_code == 3
    result = isiw("resume", log, "--lost-pulses", 1)
    assert result.exit_code == 0, result.output
    assert "outcome unknown" in isiw("show", log).output


def test_an_excluded_trial_is_included_again(isiw: Command, log: Path) -> None:
    assert isiw("exclude", log, 1, "--reason", "cough").exit_code == 0
    assert isiw("include", log, 1).output.startswith("Trial 1 counts again.\nEstimate with it: isiw estimate ")
    assert all(trial.told for trial in read_session(log).table)


@pytest.mark.slow
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


@pytest.fixture
def sweeps(tmp_path: Path) -> Path:
    return write_sweeps(tmp_path / "s.mcap", {trial: {"emg": sweep(trial)["emg"]} for trial in range(3)}, note("cough"))


@pytest.mark.parametrize(
    ("to", "file"),
    [("csv", "trials.csv"), ("parquet", "trials.parquet"), ("bids", "sub-P07/sub-P07_sessions.tsv")],
)
def test_export_writes_each_format(isiw: Command, sweeps: Path, to: str, file: str) -> None:
    result = isiw("export", sweeps, "--to", to, "out")
    assert result.exit_code == 0, result.output
    assert "1 session with 3 trials: out" in result.output
    assert (Path("out") / file).is_file()


def test_export_replaces_nothing(isiw: Command, sweeps: Path) -> None:
    assert isiw("export", sweeps, "out").exit_code == 0
    before = Path("out/trials.csv").read_bytes()
    result = isiw("export", sweeps, "out")
    assert result.exit_code == 1
    assert "replaces nothing" in result.output
    assert Path("out/trials.csv").read_bytes() == before


def test_export_says_who_is_who_once(isiw: Command, sweeps: Path) -> None:
    result = isiw("export", sweeps, "out", "--pseudonymise")
    assert "P07 is now 001\nKeep this list if you need it: it is stored nowhere.\n" in result.output
    assert "P07" not in Path("out/sessions.csv").read_text("utf-8")


def test_export_of_a_damaged_log_says_what_is_lacking_and_exits_3(isiw: Command, sweeps: Path) -> None:
    sweeps.write_bytes(sweeps.read_bytes()[:-200])
    result = isiw("export", sweeps, "out")
    assert result.exit_code == 3
    assert "P07, session 01: " in result.output
    assert len(pd.read_csv("out/trials.csv")) == 3


def test_export_obeys_nothing_that_a_log_says_to_the_terminal(isiw: Command, tmp_path: Path) -> None:
    write_sweeps(tmp_path / "x.mcap", {0: {}}, subject="<script>\x1b[2J\u202e")
    result = isiw("export", "x.mcap", "out", "--pseudonymise")
    assert "<script> is now 001" in result.output
    assert not set(result.output) & set("\x1b\u202e")


def test_compare_prints_the_windows_and_draws_them(isiw: Command, tmp_path: Path) -> None:
    for number, name in enumerate(("first", "second")):
        write_log(tmp_path / f"{name}.mcap", gaussian_person(), trials=4, seed=number)
    result = isiw("compare", "first.mcap", "second.mcap", "-o", "c.png")
    assert result.exit_code == 0, result.output
    assert result.output.count("P1 ") >= 2
    assert "P1 (second.mcap) against P1 (first.mcap), the same person: the probability that" in result.output
    assert Path("c.png").exists()
    assert "--overwrite" in isiw("compare", "first.mcap", "second.mcap", "-o", "c.png").output


@pytest.mark.slow
def test_compare_writes_a_page_where_the_suffix_asks_for_one(isiw: Command, tmp_path: Path) -> None:
    for number, name in enumerate(("first", "second")):
        write_log(tmp_path / f"{name}.mcap", gaussian_person(), trials=4, seed=number)
    result = isiw("compare", "first.mcap", "second.mcap", "-o", "c.html")
    assert "page: c.html" in result.output
    assert "the same person: the probability that the window moved" in Path("c.html").read_text()


def test_compare_needs_two_sessions(isiw: Command, sweeps: Path) -> None:
    result = isiw("compare", sweeps)
    assert result.exit_code == 1
    assert "at least two" in result.output


def test_compare_of_a_damaged_log_says_what_was_lost_and_exits_3(isiw: Command, tmp_path: Path, sweeps: Path) -> None:
    cut_after(write_sweeps(tmp_path / "t.mcap", {trial: {} for trial in range(6)}), 1)
    result = isiw("compare", sweeps, "t.mcap")
    assert result.exit_code == 3
    assert "t.mcap: " in result.output


def test_the_profile_is_correlated_with_measured_means(isiw: Command, log: Path, tmp_path: Path) -> None:
    measured = write_log(tmp_path / "sweep.mcap", trials=40, space=read_session(log).header.space)
    result = isiw("correlate", log, measured)
    assert result.exit_code == 0, result.output
    assert "correlates with the mean MEPs of P1 (sweep.mcap) by" in " ".join(result.output.split())
    empty = write_log(tmp_path / "empty.mcap", trials=0, space=read_session(log).header.space)
    for words in (["correlate", log, empty], ["counts", empty]):
        refused = isiw(*words)
        assert refused.exit_code == 1
        assert "no pair of stimuli in the log counts" in " ".join(refused.output.split())


def test_responses_are_counted_by_a_threshold_of_ones_own(isiw: Command, tmp_path: Path) -> None:
    log = write_log(tmp_path / "sweep.mcap", trials=40)
    low, high = (isiw("counts", log, "--threshold-mv", mv).output for mv in ("0.001", "29"))
    assert "above 1 µV" in low
    assert "Effective: " in low
    assert "No ISI is effective: more than 40% of the trials above 2.9e+04 µV." in " ".join(high.split())
    refused = isiw("counts", log, "--share", "1.5")
    assert refused.exit_code == 1
    assert "share of responses" in " ".join(refused.output.split())
