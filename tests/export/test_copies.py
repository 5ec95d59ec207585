"""Copies of a session's log in one folder: it is exported once, from the log that tells of most; the rest is said."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from export.recorded import sweep, write_sweeps
from isiw.existing.batch import Way, analyse_person, read_files
from isiw.existing.layout import Layout
from isiw.export import Exported, export_logs
from isiw.log.record import read_session
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.session.resuming import open_session, resume
from logs import cut_after, damage
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A whole session of six trials."""
    Session(ScriptedDevice(), scripted_strategy(6), log=tmp_path / "logs" / "s.mcap", subject="P07").run()
    return tmp_path / "logs" / "s.mcap"


def copied(log: Path, name: str) -> Path:
    copy = log.parent / name
    copy.parent.mkdir(exist_ok=True)
    return Path(shutil.copy(log, copy))


def lose_a_trial(log: Path) -> None:
    damage(log, 5)


def lose_the_end(log: Path) -> None:
    cut_after(log, 4)


def cut(log: Path) -> None:
    log.write_bytes(log.read_bytes()[: -len(log.read_bytes()) // 3])


def exported(log: Path, tmp_path: Path, **options: Any) -> tuple[Exported, pd.DataFrame]:
    """What an export of the log's folder says, and its table of sessions."""
    told = export_logs(log.parent, tmp_path / "out", **options)
    return told, pd.read_csv(tmp_path / "out" / "sessions.csv")


@pytest.mark.parametrize(
    ("name", "harm"),
    [
        *[(name, lose_a_trial) for name in ("a.mcap", "z.mcap", "backup/s.mcap", "s.mcap.damaged", "s.mcap.damaged1")],
        *[(name, harm) for name in ("a.mcap", "z.mcap") for harm in (lose_the_end, cut)],
    ],
)
def test_a_session_that_is_there_whole_and_damaged_is_exported_once_from_the_whole_log(
    log: Path, tmp_path: Path, name: str, harm: Callable[[Path], None]
) -> None:
    harm(copied(log, name))
    told, sessions = exported(log, tmp_path)
    assert (told.sessions, told.trials) == (1, 6)
    assert (sessions.log[0], sessions.delivered[0]) == ("s.mcap", 6)
    assert sessions.lacks.isna().all()
    copy, whole = ("backup/s.mcap", "logs/s.mcap") if name == "backup/s.mcap" else (name, "s.mcap")
    assert told.lacking == (
        f"{copy} is left out: it is a damaged copy of {whole}, which has all that can be read of it.",
    )


@pytest.mark.parametrize("name", ["a.mcap", "z.mcap"])
def test_a_copy_that_has_lost_a_sweep_or_its_index_alone_takes_not_the_place_of_the_whole_log(
    tmp_path: Path, name: str
) -> None:
    whole = write_sweeps(tmp_path / "logs" / "s.mcap", {trial: sweep(trial) for trial in range(3)})
    damage(copied(whole, name), 2)
    no_index = copied(whole, f"{name[0]}{name}")
    content = bytearray(no_index.read_bytes())
    content[-20] ^= 0x10
    no_index.write_bytes(content)
    assert read_session(no_index).losses
    told, sessions = exported(whole, tmp_path)
    assert sessions.log.tolist() == ["s.mcap"]
    assert sessions.lacks.isna().all()
    assert len(told.lacking) == 2


def test_the_log_under_sourcedata_is_the_whole_one(log: Path, tmp_path: Path) -> None:
    damage(copied(log, "a.mcap"), 5)
    assert export_logs(log.parent, tmp_path / "out", "bids").sessions == 1
    (source,) = (tmp_path / "out" / "sourcedata").rglob("*.mcap*")
    assert source.read_bytes() == log.read_bytes()


def test_a_damaged_log_that_was_kept_when_its_session_went_on_is_said_to_be_passed_over(
    log: Path, tmp_path: Path
) -> None:
    damage(log, 5)
    exclude(log, 4, "cough")
    assert (log.parent / "s.mcap.damaged").exists()
    told, sessions = exported(log, tmp_path)
    assert sessions.log.tolist() == ["s.mcap"]
    assert told.lacking[0].startswith("s.mcap.damaged is left out: it is a damaged copy of s.mcap")


def test_a_damaged_log_alone_is_exported_with_what_it_lacks_whatever_it_is_called(log: Path, tmp_path: Path) -> None:
    damage(log, 5)
    log.rename(log.parent / "s.mcap.damaged")
    told, sessions = exported(log, tmp_path)
    assert (told.sessions, sessions.log[0]) == (1, "s.mcap.damaged")
    assert "fails its checksum and is lost" in told.lacking[0]


def test_of_two_damaged_copies_that_which_tells_of_more_is_exported_and_the_other_said_to_have_more(
    log: Path, tmp_path: Path
) -> None:
    damage(copied(log, "b.mcap"), 2)
    damage(log, 5)
    cut_after(log, 4)
    told, sessions = exported(log, tmp_path)
    assert sessions[["log", "delivered"]].to_numpy().tolist() == [["b.mcap", 6]]
    assert told.lacking[0] == (
        "s.mcap is left out: it is of the same session as b.mcap, which holds more; 1 record is in s.mcap alone."
    )
    assert any("fails its checksum" in loss for loss in told.lacking[1:])


def test_a_whole_copy_of_an_earlier_day_stands_behind_the_damaged_log_that_went_on(tmp_path: Path) -> None:
    path = tmp_path / "logs" / "s.mcap"
    for trials in (3, 4):
        with open_session(scripted_strategy(9), path, subject="P07", resume=True) as session:
            for trial in range(trials):
                session.tell(session.ask(), 0.05 + 0.01 * trial)
        copied(path, f"after {trials}.mcap")
    (path.parent / "after 4.mcap").unlink()
    damage(path, 3)
    told, sessions = exported(path, tmp_path)
    assert sessions.log.tolist() == ["s.mcap"]
    assert told.lacking[0] == (
        "after 3.mcap is left out: it is of the same session as s.mcap, which holds more; "
        "1 record is in after 3.mcap alone."
    )


def test_a_damaged_log_that_was_resumed_stands_for_its_whole_copy_too(log: Path, tmp_path: Path) -> None:
    copied(log, "backup/s.mcap")
    damage(log, 12)  # the estimate after trial 3
    resume(log, ScriptedDevice(), scripted_strategy(8), verify=False).run()
    told, _ = exported(log, tmp_path)
    assert (told.sessions, told.trials) == (1, 8)
    left_out = sorted(said.partition(" is left out")[0] for said in told.lacking if " is left out" in said)
    assert left_out == ["backup/s.mcap", "s.mcap.damaged"]
    assert "1 record is in backup/s.mcap alone." in "".join(told.lacking)
    assert "fails its checksum" in "".join(told.lacking)


def test_a_damaged_log_that_was_resumed_without_another_trial_does_not_stand_for_its_whole_copy(
    log: Path, tmp_path: Path
) -> None:
    whole = copied(log, "backup/whole.mcap")
    damage(log, 12)
    resume(log, ScriptedDevice(), scripted_strategy(6), verify=False).run()
    told, sessions = exported(log, tmp_path)
    assert sessions.log.tolist() == [whole.name]
    assert told.lacking[0].startswith("s.mcap is left out: it is of the same session as whole.mcap")


def test_copies_that_went_on_differently_are_both_exported_and_said_to_have_trials_in_common(tmp_path: Path) -> None:
    path = tmp_path / "logs" / "s.mcap"
    with open_session(scripted_strategy(9), path, subject="P07") as session:
        session.tell(session.ask(), 0.05)
        session.tell(session.ask(), 0.06)
    copied(path, "b.mcap")
    for log, mep_mv in ((path, 0.1), (path.parent / "b.mcap", 0.2)):
        with open_session(scripted_strategy(9), log, resume=True) as session:
            session.tell(session.ask(), mep_mv)
    told, sessions = exported(path, tmp_path)
    assert sorted(sessions.log) == ["b.mcap", "s.mcap"]
    (said,) = told.lacking
    assert said == (
        "P07, session 02: 2 of its trials are in P07, session 01 as well, as copies of a log went on differently; "
        "export one of them."
    )


def test_verdicts_on_two_whole_copies_keep_both(log: Path, tmp_path: Path) -> None:
    exclude(copied(log, "b.mcap"), 1, "cough")
    exclude(log, 2, "sneeze")
    told, sessions = exported(log, tmp_path)
    assert sorted(sessions.log) == ["b.mcap", "s.mcap"]
    assert "6 of its trials are in P07, session 01 as well" in told.lacking[0]


def test_sessions_that_were_begun_in_the_same_second_are_not_taken_for_copies(tmp_path: Path) -> None:
    for number, name in enumerate(("a", "b", "c")):
        write_sweeps(tmp_path / "logs" / f"{name}.mcap", {0: sweep(10 * number), 1: sweep(10 * number + 1)})
    damage(tmp_path / "logs" / "b.mcap")
    told, sessions = exported(tmp_path / "logs" / "a.mcap", tmp_path)
    assert sorted(sessions.log) == ["a.mcap", "b.mcap", "c.mcap"]
    assert all("session" in loss and "left out" not in loss for loss in told.lacking)


def test_two_blocks_of_one_person_and_day_that_were_delivered_without_isiw_are_both_exported(tmp_path: Path) -> None:
    for block in (1, 2):
        table = tmp_path / f"{block}.csv"
        rows = "".join(f"P02,2026-03-04,{isi_ms},{0.01 * block}\n" for isi_ms in range(20, 300, 40))
        table.write_text("subject,date,isi_ms,mep_mv\n" + rows)
        way = Way(Layout(reference="impact"), settings={"particles": 20})
        (person,) = read_files([table], way, tmp_path / "logs" / f"{block}.mcap")
        analyse_person(person, way)
    one = tmp_path / "logs" / "1.mcap"
    copied(one, "of-1.mcap")
    told, sessions = exported(one, tmp_path)
    assert sorted(sessions.log) == ["1.mcap", "2.mcap"]
    assert [loss.partition(" is left out")[0] for loss in told.lacking] == ["of-1.mcap"]


def test_a_log_beside_the_file_that_goes_on_from_it_needs_no_word(log: Path, tmp_path: Path) -> None:
    whole = log.read_bytes()
    with open_session(scripted_strategy(9), tmp_path / "logs" / "t.mcap", subject="P08") as session:
        session.tell(session.ask(), 0.05)
    before = (tmp_path / "logs" / "t.mcap").read_bytes()
    with open_session(scripted_strategy(9), tmp_path / "logs" / "t.mcap", resume=True) as session:
        session.tell(session.ask(), 0.05)
    (tmp_path / "logs" / "t.mcap").rename(tmp_path / "logs" / "t.mcap.part")
    (tmp_path / "logs" / "t.mcap").write_bytes(before)
    assert log.read_bytes() == whole
    told, sessions = exported(log, tmp_path)
    assert sessions.log.tolist() == ["s.mcap", "t.mcap.part"]
    assert told.lacking == ()


def test_an_unfinished_file_that_does_not_go_on_from_its_log_is_passed_over_with_a_word(
    log: Path, tmp_path: Path
) -> None:
    damage(copied(log, "s.mcap.part"), 5)
    told, sessions = exported(log, tmp_path)
    assert sessions.log.tolist() == ["s.mcap"]
    assert told.lacking[0].startswith("s.mcap.part is left out: it is a damaged copy of s.mcap")


def test_a_pseudonymised_export_counts_the_copies_and_names_none(log: Path, tmp_path: Path) -> None:
    damage(copied(log, "meier.mcap"), 5)
    told, sessions = exported(log, tmp_path, pseudonymise=True)
    assert len(sessions) == 1
    assert told.lacking == ("Logs that are left out, as they cannot be read or are copies: 1.",)
