from __future__ import annotations

import errno
import os
import time
from pathlib import Path
from typing import Any, Never

import numpy as np
import pytest
from mcap.reader import make_reader

from disks import no_room
from isiw.errors import LogError
from isiw.log.headers import Header
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Waveform
from isiw.log.writer import LogWriter
from isiw.session.resuming import open_session
from isiw.sweeps import Channel
from log.written import write_trials
from logs import blocks_of, damage
from scripted import scripted_strategy


def test_a_log_is_a_part_until_it_is_closed(tmp_path: Path, header: Header) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    assert [path.name for path in tmp_path.iterdir()] == ["s.mcap.part"]
    log.close()
    assert [path.name for path in tmp_path.iterdir()] == ["s.mcap"]


def test_the_header_is_on_disk_at_once(tmp_path: Path, header: Header) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    assert read_session(tmp_path / "s.mcap").header == header
    log.close()


def test_what_was_synced_can_be_read_while_the_session_runs(tmp_path: Path, header: Header) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    for k in range(3):
        write_trials(log, [k])
        record = read_session(tmp_path / "s.mcap")
        assert [trial.index for trial in record.table] == list(range(k + 1))
        assert record.losses == ()
        assert not record.finished
    log.close()


@pytest.mark.parametrize("name", ["s.mcap", "s.mcap.part"])
def test_an_existing_log_is_never_overwritten(tmp_path: Path, header: Header, name: str) -> None:
    (tmp_path / name).write_bytes(b"precious")
    with pytest.raises(LogError, match=r"never overwritten.*not a log"):
        LogWriter.create(tmp_path / "s.mcap", header)
    assert (tmp_path / name).read_bytes() == b"precious"


def test_a_log_in_the_way_can_be_continued_and_the_message_says_how(finished_log: Path, header: Header) -> None:
    with pytest.raises(LogError, match=r"never overwritten.*isiw resume"):
        LogWriter.create(finished_log, header)


def test_a_file_that_appears_meanwhile_is_not_overwritten_at_the_end(tmp_path: Path, header: Header) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    write_trials(log, range(2))
    (tmp_path / "s.mcap").write_bytes(b"precious")
    with pytest.raises(LogError, match="another file"):
        log.close()
    assert (tmp_path / "s.mcap").read_bytes() == b"precious"
    assert len(read_session(tmp_path / "s.mcap.part").table) == 2


def test_a_session_that_began_a_moment_earlier_has_the_name_and_the_message_says_so(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, begins, others = tmp_path / "s.mcap", LogWriter.begin, []

    def slowly(own: LogWriter, *args: Any) -> None:
        monkeypatch.undo()
        others.append(LogWriter.create(log, header))
        begins(own, *args)

    monkeypatch.setattr(LogWriter, "begin", slowly)
    with pytest.raises(LogError, match=r"there is a log already.*Choose another path"):
        LogWriter.create(log, header)
    assert [file.name for file in tmp_path.iterdir()] == ["s.mcap.part"]
    others.pop().close()


def test_a_folder_that_cannot_be_created_is_named(tmp_path: Path, header: Header) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match="cannot be created"):
        LogWriter.create(tmp_path / "file" / "s.mcap", header)


def test_a_full_disk_is_an_error_and_what_was_synced_is_safe(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    write_trials(log, range(3))
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", no_room)
        with pytest.raises(LogError, match="No space left"):
            write_trials(log, [3])
    assert len(read_session(tmp_path / "s.mcap").table) >= 3
    log.close()


@pytest.mark.parametrize("config", [{"operator": None}, {"rig": object()}, {"name": "\ud800"}])
def test_a_header_that_cannot_be_written_leaves_no_file(
    tmp_path: Path, header: Header, config: dict[str, object]
) -> None:
    unwritable = header.model_copy(update={"config": config})
    with pytest.raises(LogError, match=r"header.*TOML values"):
        LogWriter.create(tmp_path / "s.mcap", unwritable)
    assert list(tmp_path.iterdir()) == []
    LogWriter.create(tmp_path / "s.mcap", header).close()


def test_a_log_that_is_gone_when_the_disk_fails_is_not_called_safe(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    (tmp_path / "s.mcap.part").unlink()
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", no_room)
        with pytest.raises(LogError, match=r"No space left.*file is gone"):
            write_trials(log, [0])
    with pytest.raises(LogError, match="rescued"):
        log.close()


@pytest.mark.parametrize("now_ns", [-1, -(10**18), 2**64, 10**20])
def test_no_log_begins_by_a_clock_that_shows_a_time_no_log_can_hold(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch, now_ns: int
) -> None:
    monkeypatch.setattr(time, "time_ns", lambda: now_ns)
    with pytest.raises(LogError, match=r"clock is wrong.*1970 to 2554"):
        LogWriter.create(tmp_path / "s.mcap", header)
    with pytest.raises(LogError, match="clock is wrong"):
        open_session(scripted_strategy(3), tmp_path / "s.mcap")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("now_ns", [-1, 2**64])
def test_a_clock_that_is_set_wrong_while_a_log_is_written_loses_no_trial(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch, now_ns: int
) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, [0])
        monkeypatch.setattr(time, "time_ns", lambda: now_ns)
        write_trials(log, [1, 2])
    record = read_session(tmp_path / "s.mcap")
    assert (len(record.table), record.losses) == (3, ())


@pytest.mark.parametrize("trouble", ["header", "disk"])
def test_a_log_that_cannot_go_on_stays_as_it_was(
    finished_log: Path, header: Header, monkeypatch: pytest.MonkeyPatch, trouble: str
) -> None:
    before, found = finished_log.read_bytes(), salvage(finished_log)
    unwritable = header.model_copy(update={"config": {"operator": None}})
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", no_room if trouble == "disk" else os.fsync)
        with pytest.raises(LogError):
            LogWriter.continuing(finished_log, found, header, unwritable if trouble == "header" else header)
    assert list(finished_log.parent.iterdir()) == [finished_log]
    assert finished_log.read_bytes() == before
    LogWriter.continuing(finished_log, found, header).close()


def test_any_mcap_reader_reads_a_finished_log(finished_log: Path) -> None:
    with finished_log.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        topics = [channel.topic for _, channel, _ in reader.iter_messages()]
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
    assert topics[0] == "/header"
    assert topics[1:4] == ["/intent", "/emg", "/trial"]
    assert metadata["session"]["subject"] == "P07"
    assert metadata["session"]["seed"] == "4"
    assert b"answer = 42" in attachments["configuration.toml"]


def test_the_times_of_the_records_never_run_backwards(finished_log: Path) -> None:
    with finished_log.open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)


def test_a_channel_that_isiw_does_not_know_is_kept(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        log.append(Waveform.of(0, Channel(np.arange(4.0), 100.0, "N")), "left_hand")
    assert read_session(tmp_path / "s.mcap").sweep(0)["left_hand"].values.tolist() == [0, 1, 2, 3]


def test_continuing_keeps_all_records_and_appends(finished_log: Path) -> None:
    before = read_session(finished_log)
    with LogWriter.continuing(finished_log, salvage(finished_log), before.header) as log:
        log.append(Event(kind="resume", trial=8))
    after = read_session(finished_log)
    assert after.history == (*before.history, Event(kind="resume", trial=8))
    assert after.header == before.header
    assert after.finished
    assert list(finished_log.parent.iterdir()) == [finished_log]


def test_a_damaged_bit_costs_a_log_that_went_on_one_trial(finished_log: Path, header: Header) -> None:
    before = blocks_of(finished_log)
    LogWriter.continuing(finished_log, salvage(finished_log), header).close()
    assert len(blocks_of(finished_log)) == len(before)
    whole, table = finished_log.read_bytes(), read_session(finished_log).table
    for block in range(len(before)):
        finished_log.write_bytes(whole)
        damage(finished_log, block)
        damaged = read_session(finished_log)
        assert damaged.losses
        assert len(damaged.table) >= len(table) - 1


def test_a_cut_copy_of_a_log_that_went_on_has_every_trial_before_the_cut(finished_log: Path, header: Header) -> None:
    LogWriter.continuing(finished_log, salvage(finished_log), header).close()
    start, _ = blocks_of(finished_log)[-1]
    finished_log.write_bytes(finished_log.read_bytes()[:start])
    assert len(read_session(finished_log).table) == 7


def test_continuing_twice_keeps_metadata_names_unique(broken_log: Path, header: Header) -> None:
    for _ in range(2):
        LogWriter.continuing(broken_log, salvage(broken_log), header).close()
    finished = broken_log.with_suffix("")
    with finished.open("rb") as file:
        reader = make_reader(file)
        assert [record.name for record in reader.iter_metadata()] == ["session"]
        assert [attachment.name for attachment in reader.iter_attachments()] == ["configuration.toml"]


def test_while_a_log_goes_on_it_holds_all_that_was_there_before(broken_log: Path, header: Header) -> None:
    log = LogWriter.continuing(broken_log, salvage(broken_log), header)
    assert len(read_session(broken_log).table) == 8
    assert [path.name for path in broken_log.parent.iterdir()] == ["s.mcap.part"]
    log.close()


def test_a_copy_left_by_a_killed_resumption_is_no_obstacle(broken_log: Path, header: Header) -> None:
    broken_log.with_name("s.mcap.resuming").write_bytes(b"half a copy")
    LogWriter.continuing(broken_log, salvage(broken_log), header).close()
    assert [path.name for path in broken_log.parent.iterdir()] == ["s.mcap"]
    assert len(read_session(broken_log).table) == 8


def _no_links(new: Path, old: Path) -> Never:
    raise OSError(errno.EPERM, f"no link from {new} to {old}")


@pytest.mark.parametrize("links", [True, False])
def test_a_damaged_file_is_kept_beside_what_was_salvaged(
    broken_log: Path, header: Header, monkeypatch: pytest.MonkeyPatch, *, links: bool
) -> None:
    if not links:  # as on a memory stick
        monkeypatch.setattr(Path, "hardlink_to", _no_links)
    damaged = broken_log.read_bytes()[:-40]
    for name in ("s.mcap.damaged", "s.mcap.damaged1"):
        broken_log.write_bytes(damaged)
        LogWriter.continuing(broken_log, salvage(broken_log), header).close()
        assert broken_log.with_name(name).read_bytes() == damaged
        broken_log.with_suffix("").rename(broken_log)


@pytest.mark.skipif(os.name == "nt", reason="Windows does not let an open file be replaced anyway")
def test_a_running_session_cannot_be_resumed_beside_itself(tmp_path: Path, header: Header) -> None:
    log = LogWriter.create(tmp_path / "s.mcap", header)
    write_trials(log, range(2))
    with pytest.raises(LogError, match="running session"):
        LogWriter.continuing(tmp_path / "s.mcap", salvage(tmp_path / "s.mcap"), header)
    write_trials(log, [2])
    log.close()
    assert len(read_session(tmp_path / "s.mcap").table) == 3


@pytest.mark.parametrize("name", ["s.mcap.part", "", "folder", 300 * "s"])
def test_an_invalid_name_of_a_log_is_refused_and_leaves_nothing(tmp_path: Path, header: Header, name: str) -> None:
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.iterdir())
    with pytest.raises(LogError):
        LogWriter.create(tmp_path / name, header)
    assert sorted(tmp_path.iterdir()) == before
