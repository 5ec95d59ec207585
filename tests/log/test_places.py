"""Whose file is where: no session takes the place of another's."""

from __future__ import annotations

import os
import shutil
import threading
from pathlib import Path
from typing import Any

import pytest

from hostile import IN_THE_WAY, at_once
from isiw.devices.clock import VirtualClock
from isiw.errors import LogError
from isiw.log.headers import Header
from isiw.log.places import Fingerprint
from isiw.log.record import read_session
from isiw.log.salvage import Salvage, salvage, salvage_file
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from log.written import write_trials
from scripted import ScriptedDevice, scripted_strategy


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
    with pytest.raises(LogError, match=r"another session's.*never replaced"):
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
    with pytest.raises(LogError, match=r"the log's place.*stays at .*part"):
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


@pytest.mark.parametrize("kind", IN_THE_WAY)
@pytest.mark.parametrize("name", ["s.mcap", "s.mcap.part"])
def test_no_session_begins_where_something_else_than_a_file_has_its_logs_name(
    tmp_path: Path, header: Header, kind: str, name: str
) -> None:
    IN_THE_WAY[kind](tmp_path / name)
    with pytest.raises(LogError, match=f"there is {kind}; got .*{name}"):
        at_once(lambda: LogWriter.create(tmp_path / "s.mcap", header))
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_log_that_is_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "s.mcap")
    with pytest.raises(LogError, match="no regular file"):
        at_once(lambda: salvage_file(tmp_path / "s.mcap"))


@pytest.mark.parametrize("name", ["CON", "nul.mcap", "aux.tar.mcap", "s.mcap.", "s.mcap "])
def test_no_log_gets_a_name_that_windows_keeps_for_itself(tmp_path: Path, header: Header, name: str) -> None:
    with pytest.raises(LogError, match="which Windows keeps for itself"):
        LogWriter.create(tmp_path / name, header)
    assert list(tmp_path.iterdir()) == []


def test_what_is_in_a_logs_way_is_told_before_the_device_is_armed(tmp_path: Path) -> None:
    device = ScriptedDevice()
    os.mkfifo(tmp_path / "s.mcap")
    session = Session(device, scripted_strategy(3), log=tmp_path / "s.mcap", clock=VirtualClock())
    with pytest.raises(LogError, match="a pipe"):
        at_once(session.run)
    assert device.calls == []


def test_a_log_that_a_session_went_on_with_while_its_names_were_looked_at_does_not_go_on_twice(
    finished_log: Path, another: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    longer = finished_log.with_name("longer")
    longer.write_bytes(another)

    def meanwhile(target: Path, found: Salvage) -> Fingerprint | None:
        longer.replace(target)
        return found.fingerprint

    monkeypatch.setattr("isiw.log.writer.own_file", meanwhile)
    with pytest.raises(LogError, match="has changed since"):
        go_on(finished_log)
    assert finished_log.read_bytes() == another
    assert [path.name for path in finished_log.parent.iterdir()] == ["s.mcap"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["finished_log", "broken_log"])
def test_of_two_that_go_on_at_once_one_does_and_the_other_is_told_why(
    kind: Any, request: pytest.FixtureRequest
) -> None:
    log, start = request.getfixturevalue(kind), threading.Barrier(2)
    header = read_session(log).header
    whole, finished = log.read_bytes(), log.parent / "s.mcap"
    won: list[str] = []
    told: list[str] = []

    def resume(name: str) -> None:
        salvaged = salvage(log)
        start.wait()
        try:
            with LogWriter.continuing(log, salvaged, header) as writer:
                writer.append(Event(kind="resume", trial=8, text=name))
        except LogError as error:
            told.append(str(error))
        else:
            won.append(name)

    for _ in range(40):
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
