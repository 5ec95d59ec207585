from __future__ import annotations

import errno
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import COMMAND, SHORT, Command
from isiw.log.record import read_session
from isiw.session.loop import Session
from known import known
from scripted import ScriptedDevice, scripted_strategy

pytestmark = pytest.mark.usefixtures("blank_pictures")


@pytest.mark.needs_pictures
def test_run_ends_with_a_statement_a_log_and_a_picture(isiw: Command, short: Path, tmp_path: Path) -> None:
    result = isiw("run", short, "--seed", 3)
    assert result.exit_code == 0, result.output
    (log,) = (tmp_path / "isiw-sessions").glob("*.mcap")
    assert log.with_suffix(".png").stat().st_size > 5000
    for part in (
        "probability of a window",
        "3 pairs were delivered",
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


def test_run_never_overwrites_a_log(isiw: Command, short: Path, log: Path) -> None:
    before = log.read_bytes()
    result = isiw("run", short, "--log", log)
    assert result.exit_code == 1
    assert "never overwritten" in result.output
    assert log.read_bytes() == before


def test_a_plan_that_does_not_fit_into_the_limits_names_no_log(isiw: Command, tmp_path: Path) -> None:
    result = isiw("run", "--strategy", "pf", "--log", "pf.mcap")
    assert result.exit_code == 1
    assert "Write max_pulses = 600 under [limits]" in result.output
    assert "pf.mcap" not in result.output
    assert list(tmp_path.glob("pf*")) == []


def test_exclude_appends_and_resume_learns_without_it(isiw: Command, log: Path) -> None:
    assert isiw("exclude", log, 1, "--reason", "sneezed").exit_code == 0
    shown = isiw("show", log).output
    assert "exclusion (trial 1): sneezed" in shown
    assert "(excluded)" in shown
    result = isiw("resume", log)
    assert result.exit_code == 0, result.output
    assert "2 count; 1 excluded" in result.output


def test_estimate_learns_without_an_excluded_trial_as_resuming_does(isiw: Command, log: Path, tmp_path: Path) -> None:
    resumed = tmp_path / "resumed.mcap"
    assert "isiw estimate" in isiw("exclude", log, 1, "--reason", "sneezed").output
    resumed.write_bytes(log.read_bytes())
    assert isiw("resume", resumed).exit_code == 0
    result = isiw("estimate", log)
    assert result.exit_code == 0, result.output
    assert result.output.startswith("Learning 3 trials …")
    assert "2 count; 1 excluded" in result.output
    record, other = read_session(log), read_session(resumed)
    assert not record.is_judged_since
    assert record.estimates[-1] == other.estimates[-1].model_copy(update={"next_isi_ms": None})
    assert record.events[-1].text.startswith("Estimated again")
    before = log.read_bytes()
    assert "No trial was excluded or included since" in isiw("estimate", log).output
    assert log.read_bytes() == before


def test_resume_says_how_many_trials_it_replays_before_it_does(isiw: Command, log: Path, tmp_path: Path) -> None:
    more = tmp_path / "more.toml"
    more.write_text("[limits]\nmax_pulses = 100\n")
    for arguments in ((log,), (log, more)):
        assert "Replaying 3 trials …" in isiw("resume", *arguments).output.splitlines()[0]


def test_resume_of_another_softwares_log_says_how(isiw: Command, tmp_path: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(1), log=tmp_path / "s.mcap").run()
    result = isiw("resume", "s.mcap")
    assert result.exit_code == 1
    assert "isiw.resume(path, device)" in result.output


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_ctrl_c_closes_the_log_and_the_exit_code_says_so(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text("[strategy.settings]\nmax_trials = 190\nstop_width_ms = 0.001\n")
    command = [*COMMAND, "run", "long.toml", "--log", "s.mcap"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:  # noqa: S603
        lines = [known(process.stdout).readline() for _ in range(8)]  # space, log, legend, headings, trials
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
    assert lines[4].startswith("trial")
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
        reported = [known(process.stdout).readline() for _ in range(9)][5:]
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


def test_a_log_is_not_overwritten_by_its_picture(isiw: Command, short: Path, tmp_path: Path) -> None:
    result = isiw("run", short, "--log", "s.png")
    assert result.exit_code == 1
    assert "overwritten by its picture" in result.output
    assert not (tmp_path / "s.png").exists()


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


def test_the_picture_that_run_draws_takes_a_free_name(isiw: Any, short: Any, tmp_path: Path) -> None:
    (tmp_path / "new.png").write_bytes(b"precious")
    result = isiw("run", short, "--log", "new.mcap")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "new.png").read_bytes() == b"precious"
    assert "new_2.png" in result.output
    assert (tmp_path / "new_2.png").exists()


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


def test_day_and_operator_are_noted_in_the_log(isiw: Command, short: Path) -> None:
    result = isiw("run", short, "--log", "v.mcap", "--day", 2, "--operator", "MK")
    assert result.exit_code == 0, result.output
    visit = read_session("v.mcap").header.visit
    assert (visit.day, visit.operator) == (2, "MK")


@pytest.mark.parametrize("call", [("run", "--earlier", "none.csv"), ("pair", "--after", "none.mcap")])
def test_a_file_whose_place_an_option_takes_is_named(isiw: Command, tmp_path: Path, call: tuple[str, ...]) -> None:
    (tmp_path / "visit.toml").write_text('earlier = ["curve.csv"]\n' + SHORT)
    result = isiw(call[0], "visit.toml", *call[1:])
    assert f"in the place of {tmp_path / 'curve.csv'}: nothing is learnt of these" in result.output


def test_a_protocol_is_kept_and_its_controls_are_told_from_pairs(isiw: Command, short: Path) -> None:
    short.write_text(short.read_text() + "[protocol]\niti_s = [5.0, 6.0]\ntms_alone = 0.3\ntap_alone = 0.3\n")
    result = isiw("run", short, "--log", "p.mcap")
    assert result.exit_code == 0, result.output
    record = read_session("p.mcap")
    assert record.header.protocol.iti_s == (5.0, 6.0)
    shown = isiw("show", "p.mcap").output
    for kind in ("tap alone", "TMS alone"):
        assert kind in result.output
        assert kind in shown
    assert "stimuli were delivered: " in result.output
    assert sum(trial.commanded_isi_ms is not None for trial in record.table) == 3
