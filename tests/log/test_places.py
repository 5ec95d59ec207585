"""Whose file is where: no session takes the place of another's."""

from __future__ import annotations

import errno
import os
import shutil
import threading
from pathlib import Path
from typing import Any, Never

import pytest

from isiw.errors import LogError
from isiw.log.amending import exclude
from isiw.log.durable import Fingerprint, take_free_place
from isiw.log.reader import read_session
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import Event, Header
from isiw.log.writer import LogWriter
from log.written import write_trials


@pytest.fixture
def another(tmp_path: Path, header: Header) -> Any:
    """The bytes of another person's finished log."""
    with LogWriter.create(tmp_path / "elsewhere" / "s.mcap", header.model_copy(update={"subject": "P02"})) as log:
        write_trials(log, range(3))
    content = (tmp_path / "elsewhere" / "s.mcap").read_bytes()
    shutil.rmtree(tmp_path / "elsewhere")
    return content


def go_on(path: Path) -> Any:
    salvaged = salvage(path)
    return LogWriter.continuing(path, salvaged, read_session(path).header)


@pytest.mark.parametrize("name", ["s.mcap", "s.mcap.part"])
def test_a_session_does_not_go_on_where_another_ones_log_has_its_name(broken_log: Any, another: Any, name: str) -> None:
    finished = broken_log.with_suffix("")
    finished.write_bytes(another)
    before = broken_log.read_bytes()
    with pytest.raises(LogError, match=r"another session's file.*never replaced.*another name"):
        go_on(broken_log.with_name(name))
    assert (finished.read_bytes(), broken_log.read_bytes()) == (another, before)
    assert sorted(path.name for path in broken_log.parent.iterdir()) == ["s.mcap", "s.mcap.part"]


@pytest.mark.parametrize("name", ["s.mcap", "s.mcap.part"])
def test_a_trial_is_not_excluded_where_that_would_replace_another_ones_log(
    broken_log: Any, another: Any, name: str
) -> None:
    broken_log.with_suffix("").write_bytes(another)
    with pytest.raises(LogError, match="another session's file"):
        exclude(broken_log.with_name(name), 1, "sneezed")
    assert broken_log.with_suffix("").read_bytes() == another


def test_each_of_two_sessions_files_is_read_by_its_name(broken_log: Any, another: Any) -> None:
    broken_log.with_suffix("").write_bytes(another)
    assert read_session(broken_log).header.subject == "P07"
    assert read_session(broken_log.with_suffix("")).header.subject == "P02"


@pytest.mark.parametrize("name", ["s.mcap", "s.mcap.part"])
def test_where_only_one_of_the_two_files_can_be_read_it_is(finished_log: Path, broken_log: Any, name: str) -> None:
    (finished_log.parent / name).write_bytes(b"no log")
    other = broken_log if name == "s.mcap" else finished_log
    assert salvage(finished_log).path == other


def test_where_neither_of_the_two_files_can_be_read_that_is_an_error(tmp_path: Path) -> None:
    for name in ("s.mcap", "s.mcap.part"):
        (tmp_path / name).write_bytes(b"no log")
    with pytest.raises(LogError, match="nothing can be read"):
        salvage(tmp_path / "s.mcap")


def test_what_takes_the_logs_place_while_it_goes_on_is_not_replaced(finished_log: Path, another: Any) -> None:
    log = go_on(finished_log)
    finished_log.unlink()
    finished_log.write_bytes(another)
    with pytest.raises(LogError, match=r"another file has taken the log's place.*complete and stays at .*part"):
        log.close()
    assert finished_log.read_bytes() == another
    with pytest.raises(LogError, match="another session's file"):
        go_on(finished_log)
    assert finished_log.read_bytes() == another
    assert read_session(f"{finished_log}.part").finished


def test_a_log_that_was_taken_away_while_it_goes_on_is_made_anew(finished_log: Path) -> None:
    log = go_on(finished_log)
    finished_log.unlink()
    log.close()
    assert len(read_session(finished_log).table) == 8


def test_a_log_and_its_own_continuation_are_one_log(finished_log: Path) -> None:
    log = go_on(finished_log)
    log.append(Event(kind="resume", trial=8))
    log.sync()
    shutil.copyfile(f"{finished_log}.part", f"{finished_log}.killed")
    log.close()
    before = read_session(finished_log)
    shutil.copyfile(f"{finished_log}.killed", f"{finished_log}.part")
    go_on(finished_log).close()
    assert read_session(finished_log).history == before.history
    assert not Path(f"{finished_log}.part").exists()


def _no_links(new: Any, old: Any) -> Never:
    raise OSError(errno.EPERM, f"no link from {new} to {old}")


@pytest.mark.parametrize("links", [True, False])
def test_a_taken_name_is_left_alone_and_a_free_one_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: Any
) -> None:
    if not links:  # as on a memory stick
        monkeypatch.setattr(Path, "hardlink_to", _no_links)
    for name in ("ours", "theirs"):
        (tmp_path / name).write_text(name)
    with pytest.raises(FileExistsError):
        take_free_place(tmp_path / "ours", tmp_path / "theirs")
    assert (tmp_path / "theirs").read_text() == "theirs"
    take_free_place(tmp_path / "ours", tmp_path / "free")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["free", "theirs"]


def test_a_name_that_leads_nowhere_is_taken_too(tmp_path: Path) -> None:
    (tmp_path / "ours").write_text("ours")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(FileExistsError):
        take_free_place(tmp_path / "ours", tmp_path / "link")


def test_a_log_that_a_session_went_on_with_while_its_names_were_looked_at_does_not_go_on_twice(
    finished_log: Path, another: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    longer = finished_log.with_name("longer")
    longer.write_bytes(another)

    def meanwhile(target: Path, found: Salvage) -> Fingerprint | None:
        longer.replace(target)
        return found.fingerprint

    monkeypatch.setattr("isiw.log.writer._own_file", meanwhile)
    with pytest.raises(LogError, match="has changed since"):
        go_on(finished_log)
    assert finished_log.read_bytes() == another
    assert [path.name for path in finished_log.parent.iterdir()] == ["s.mcap"]


def test_a_disk_that_knows_no_locks_is_refused_and_nothing_is_left_on_it(
    tmp_path: Path, header: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl = pytest.importorskip("fcntl")

    def no_locks(*_: Any) -> Never:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with pytest.raises(LogError, match=r"cannot be locked.*local disk"):
        LogWriter.create(tmp_path / "s.mcap", header)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", ["finished_log", "broken_log"])
def test_of_two_that_go_on_at_once_one_does_and_the_other_is_told_why(
    kind: Any, request: pytest.FixtureRequest
) -> None:
    log, start = request.getfixturevalue(kind), threading.Barrier(2)
    whole, finished = log.read_bytes(), log.parent / "s.mcap"
    won: list[str] = []
    told: list[str] = []

    def resume(name: str) -> None:
        salvaged, header = salvage(log), read_session(log).header
        start.wait()
        try:
            with LogWriter.continuing(log, salvaged, header) as writer:
                writer.append(Event(kind="resume", trial=8, text=name))
        except LogError as error:
            told.append(str(error))
        else:
            won.append(name)

    for _ in range(100):
        runners = [threading.Thread(target=resume, args=(name,)) for name in ("one", "other")]
        for runner in runners:
            runner.start()
        for runner in runners:
            runner.join()
        assert [event.text for event in read_session(finished).events] == won
        assert len(won) == len(told) == 1
        reasons = ("running session", "has changed since", "another session's file is where this log would be")
        assert any(words in told[0] for words in reasons), told
        assert [path.name for path in log.parent.iterdir()] == ["s.mcap"]
        won.clear()
        told.clear()
        finished.unlink()
        log.write_bytes(whole)
