"""Exported tables: they read back to the same numbers, and say what they lack."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from export.recorded import note, sweep, write_sweeps
from isiw.devices.info import DeviceInfo
from isiw.errors import InvalidValueError, LogError
from isiw.export import export_logs
from isiw.export.tables import session_facts
from isiw.log.frames import TRIAL_COLUMNS
from isiw.log.headers import StrategyRecipe
from isiw.log.record import read_session
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.session.resuming import open_session
from isiw.visit import Visit
from logs import cut_after
from scripted import ScriptedDevice, scripted_strategy

READERS: dict[str, Callable[[Path], pd.DataFrame]] = {"csv": pd.read_csv, "parquet": pd.read_parquet}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A session of six trials."""
    Session(ScriptedDevice(), scripted_strategy(6), log=tmp_path / "logs" / "s.mcap", subject="P07").run()
    return tmp_path / "logs" / "s.mcap"


@pytest.mark.parametrize("to", READERS)
def test_what_is_read_back_is_what_was_logged(log: Path, tmp_path: Path, to: str) -> None:
    export_logs(log, tmp_path / "out", to)
    back, trials = READERS[to](tmp_path / "out" / f"trials.{to}"), read_session(log).trials
    assert list(back.columns) == ["subject", "session", "trial", *TRIAL_COLUMNS]
    for name in TRIAL_COLUMNS:
        expected = trials[name]
        if expected.dtype.kind == "f":
            assert back[name].to_numpy(float) == pytest.approx(expected.to_numpy(), abs=0, rel=0, nan_ok=True), name
    assert pd.to_datetime(back.intent_utc).tolist() == trials.intent_utc.tolist()
    assert back.status.tolist() == trials.status.tolist()


def test_booleans_of_csv_are_spelt_as_r_reads_them(log: Path, tmp_path: Path) -> None:
    exclude(log, 2, "cough")
    export_logs(log, tmp_path / "out")
    trials = pd.read_csv(tmp_path / "out" / "trials.csv", dtype=str)
    assert trials.excluded.tolist() == ["FALSE", "FALSE", "TRUE", "FALSE", "FALSE", "FALSE"]
    assert pd.read_csv(tmp_path / "out" / "sessions.csv", dtype=str).simulated.tolist() == ["TRUE"]


@pytest.mark.parametrize("to", READERS)
def test_a_session_is_a_row_that_says_what_it_is_and_found(log: Path, tmp_path: Path, to: str) -> None:
    export_logs(log, tmp_path / "out", to)
    (row,) = READERS[to](tmp_path / "out" / f"sessions.{to}").to_dict("records")
    assert (row["subject"], row["log"], row["device"], bool(row["simulated"])) == ("P07", "s.mcap", "scripted", True)
    assert (row["delivered"], row["told"], row["p_window"], row["window"]) == (6, 6, 0.9, "36–96 ms")
    assert (row["start_ms"], row["end_ms"], row["start_low_ms"]) == (36.0, 96.0, 31.0)
    assert math.isinf(row["end_high_ms"])
    assert row["counts_threshold_mv"] == 0.05
    assert row["why"] == "The budget of 6 stimuli is used up."


def test_stimuli_before_a_session_stand_beside_its_own(log: Path) -> None:
    record = read_session(log)
    after = replace(record, header=record.header.model_copy(update={"earlier_given": 16}))
    assert [session_facts(one)["given_before"] for one in (record, after)] == [0, 16]
    assert session_facts(after)["delivered"] == 6


def test_every_column_is_explained(log: Path, tmp_path: Path) -> None:
    export_logs(log, tmp_path / "out")
    explained = pd.read_csv(tmp_path / "out" / "columns.csv")
    for table in ("sessions", "trials", "events"):
        columns = list(pd.read_csv(tmp_path / "out" / f"{table}.csv").columns)
        assert explained.column[explained.table == table].tolist() == columns
    assert explained.meaning.notna().all()


@pytest.mark.parametrize("to", READERS)
def test_after_electrical_pulses_columns_speak_of_these_and_sessions_say_so(tmp_path: Path, to: str) -> None:
    device = DeviceInfo("stimulator", "impact", conditioning="electrical")
    write_sweeps(tmp_path / "s.mcap", {0: {}}, device=device)
    export_logs(tmp_path / "s.mcap", tmp_path / "out", to)
    meanings = READERS[to](tmp_path / "out" / f"columns.{to}").set_index("column").meaning.to_dict()
    assert meanings["t_hit_ms"] == "the electrical pulse, on the sweep's clock"
    assert meanings["tap_alone"] == "whether it was an electrical pulse without the magnetic pulse"
    assert meanings["reference"].startswith("the event that ISIs count from: the electrical pulse, or")
    assert READERS[to](tmp_path / "out" / f"sessions.{to}").conditioning.tolist() == ["electrical"]


def test_a_stimulus_that_the_strategy_alone_was_told_of_counts(tmp_path: Path) -> None:
    recipe = StrategyRecipe(name="default", seed=4, settings={"conditioning": "electrical"})
    write_sweeps(tmp_path / "s.mcap", {0: {}}, strategy=recipe)
    export_logs(tmp_path / "s.mcap", tmp_path / "out")
    assert pd.read_csv(tmp_path / "out" / "sessions.csv").conditioning.tolist() == ["electrical"]


def test_a_folder_of_logs_is_one_data_set(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    for name, subject, created in (
        ("second", "P07", "2026-11-22T10:00:00+00:00"),
        ("first", "P07", "2026-11-21T10:00:00+00:00"),
        ("nested/other", "P08", "2026-11-20T10:00:00+00:00"),
    ):
        write_sweeps(logs / f"{name}.mcap", {0: {}}, subject=subject, created=created)
    (logs / "picture.png").write_bytes(b"no log")
    assert export_logs(logs, tmp_path / "out").sessions == 3
    sessions = pd.read_csv(tmp_path / "out" / "sessions.csv")
    assert sessions[["subject", "session", "log"]].to_numpy().tolist() == [
        ["P07", 1, "first.mcap"], ["P07", 2, "second.mcap"], ["P08", 1, "other.mcap"],
    ]  # fmt: skip


def test_nothing_is_ever_replaced(log: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "trials.csv").write_text("precious")
    with pytest.raises(InvalidValueError, match="replaces nothing"):
        export_logs(log, tmp_path / "out")
    assert (tmp_path / "out" / "trials.csv").read_text() == "precious"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["trials.csv"]


def test_an_export_that_fails_leaves_nothing_behind(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise OSError("no room")

    monkeypatch.setattr("isiw.export.tables.write_output", fail)
    with pytest.raises(OSError, match="no room"):
        export_logs(log, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["logs"]


def test_a_damaged_log_exports_what_it_has_and_says_what_it_lacks(log: Path, tmp_path: Path) -> None:
    cut_after(log, 4)
    exported = export_logs(log, tmp_path / "out")
    assert exported.trials == 4
    assert any("The end of the log is missing" in loss for loss in exported.lacking)
    assert len(pd.read_csv(tmp_path / "out" / "trials.csv")) == 4
    assert "The end of the log is missing" in pd.read_csv(tmp_path / "out" / "sessions.csv").lacks[0]


def test_a_log_that_nobody_can_read_does_not_keep_the_others_from_being_exported(log: Path, tmp_path: Path) -> None:
    (log.parent / "empty.mcap").write_bytes(b"")
    exported = export_logs(log.parent, tmp_path / "out")
    assert (exported.sessions, exported.trials) == (1, 6)
    assert exported.lacking == ("empty.mcap is left out: the log is empty.",)
    log.unlink()
    with pytest.raises(LogError, match="can be read"):
        export_logs(log.parent, tmp_path / "again")


def test_a_copy_that_was_made_before_the_end_of_a_session_counts_once(tmp_path: Path) -> None:
    (tmp_path / "logs" / "backup").mkdir(parents=True)
    part = tmp_path / "logs" / "P07.mcap.part"
    with open_session(scripted_strategy(9), tmp_path / "logs" / "P07.mcap", subject="P07") as session:
        for trial in range(5):
            session.tell(session.ask(), 0.05 + 0.01 * trial)
            if trial == 3:
                shutil.copy(part, part.parent / "backup" / part.name)
    exported = export_logs(tmp_path / "logs", tmp_path / "out")
    assert (exported.sessions, exported.trials) == (1, 5)
    assert "is left out: it is a part of P07.mcap" in exported.lacking[0]


def test_a_copy_of_a_log_counts_once(log: Path, tmp_path: Path) -> None:
    export_logs(log, log.parent / "earlier", "bids")
    exported = export_logs(log.parent, tmp_path / "out")
    assert (exported.sessions, exported.trials) == (1, 6)
    (copy,) = (log.parent / "earlier").rglob("*.mcap")
    expected = f"{log.name} is left out: it is a copy of {copy.relative_to(log.parent)}."
    assert exported.lacking[0] == expected


def test_a_folder_without_logs_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    with pytest.raises(LogError, match="there is no log"):
        export_logs(tmp_path / "logs", tmp_path / "out")


def test_an_unknown_format_is_refused(log: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="csv or parquet or bids"):
        export_logs(log, tmp_path / "out", "xlsx")


def test_texts_are_on_one_line_and_hold_nothing_that_a_terminal_obeys(tmp_path: Path) -> None:
    write_sweeps(tmp_path / "s.mcap", {0: sweep(0)}, note('a cough\n\x1b[2Jthen,\ta "laugh"'))
    export_logs(tmp_path / "s.mcap", tmp_path / "out")
    (text,) = pd.read_csv(tmp_path / "out" / "events.csv").text
    assert text == 'a cough then, a "laugh"'


def test_where_little_was_told_nothing_is_given_as_found(tmp_path: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(2), log=tmp_path / "two.mcap").run()
    row = session_facts(read_session(tmp_path / "two.mcap"))
    assert not {"p_window", "window", "start_low_ms"} & set(row)
    assert (row["told"], row["stopped"]) == (2, True)


def test_what_was_judged_since_is_said_and_days_are_whole_numbers(log: Path, tmp_path: Path) -> None:
    write_sweeps(tmp_path / "logs" / "other.mcap", {0: {}}, subject="P08", visit=Visit(day=None))
    write_sweeps(tmp_path / "logs" / "third.mcap", {0: {}}, subject="P09", visit=Visit(day=3))
    exclude(log, 2, "cough")
    export_logs(tmp_path / "logs", tmp_path / "out")
    lines = pd.read_csv(tmp_path / "out" / "sessions.csv", dtype=str).set_index("subject")
    assert lines.judged_since.to_dict()["P07"] == "TRUE"
    assert lines.day.fillna("").to_dict() == {"P07": "", "P08": "", "P09": "3"}
