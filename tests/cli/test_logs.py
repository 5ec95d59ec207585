from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from cli.conftest import Command
from export.recorded import note, sweep, write_sweeps
from logs import cut_after
from priors.logged import gaussian_person, write_log


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_sweeps(tmp_path / "s.mcap", {trial: {"emg": sweep(trial)["emg"]} for trial in range(3)}, note("cough"))


@pytest.mark.parametrize(
    ("to", "file"),
    [("csv", "trials.csv"), ("parquet", "trials.parquet"), ("bids", "sub-P07/sub-P07_sessions.tsv")],
)
def test_export_writes_each_format(isiw: Command, log: Path, to: str, file: str) -> None:
    result = isiw("export", log, "--to", to, "out")
    assert result.exit_code == 0, result.output
    assert "1 session with 3 trials: out" in result.output
    assert (Path("out") / file).is_file()


def test_export_replaces_nothing(isiw: Command, log: Path) -> None:
    assert isiw("export", log, "out").exit_code == 0
    before = Path("out/trials.csv").read_bytes()
    result = isiw("export", log, "out")
    assert result.exit_code == 1
    assert "replaces nothing" in result.output
    assert Path("out/trials.csv").read_bytes() == before


def test_export_says_who_is_who_once(isiw: Command, log: Path) -> None:
    result = isiw("export", log, "out", "--pseudonymise")
    assert "P07 is now 001\nKeep this list if you need it: it is stored nowhere.\n" in result.output
    assert "P07" not in Path("out/sessions.csv").read_text("utf-8")


def test_export_of_a_damaged_log_says_what_is_lacking_and_exits_3(isiw: Command, log: Path) -> None:
    log.write_bytes(log.read_bytes()[:-200])
    result = isiw("export", log, "out")
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
    assert "P1 (second.mcap) against P1 (first.mcap), the same person: with probability" in result.output
    assert Path("c.png").stat().st_size > 3000
    assert "--overwrite" in isiw("compare", "first.mcap", "second.mcap", "-o", "c.png").output


@pytest.mark.slow
def test_compare_writes_a_page_where_the_suffix_asks_for_one(isiw: Command, tmp_path: Path) -> None:
    for number, name in enumerate(("first", "second")):
        write_log(tmp_path / f"{name}.mcap", gaussian_person(), trials=4, seed=number)
    result = isiw("compare", "first.mcap", "second.mcap", "-o", "c.html")
    assert "page: c.html" in result.output
    assert "the same person: with probability" in Path("c.html").read_text()


def test_compare_needs_two_sessions(isiw: Command, log: Path) -> None:
    result = isiw("compare", log)
    assert result.exit_code == 1
    assert "at least two" in result.output


def test_compare_of_a_damaged_log_says_what_was_lost_and_exits_3(isiw: Command, tmp_path: Path, log: Path) -> None:
    cut_after(write_sweeps(tmp_path / "t.mcap", {trial: {} for trial in range(6)}), 1)
    result = isiw("compare", log, "t.mcap")
    assert result.exit_code == 3
    assert "t.mcap: " in result.output
