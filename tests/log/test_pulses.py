"""When a person was stimulated, by the logs."""

from __future__ import annotations

import dataclasses
import os
import shutil
from collections.abc import Container
from pathlib import Path
from typing import Any

import pytest

from isiw.errors import DamagedLogError, LogError
from isiw.log.headers import Block, Header, Production, ProductionHeader
from isiw.log.pulses import earlier_pulses_s, pulses_s
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Intent, Message
from isiw.log.writer import LogWriter
from isiw.trials import Status, Trial

HOUR_S = 3600.0


def make_log(path: Path, header: Header, intents: int = 3, refused: Container[int] = ()) -> Path:
    with LogWriter.create(path, header) as log:
        for trial in range(intents):
            log.append(Intent(trial=trial, isi_ms=50.0))
            if trial in refused:
                log.append(Event(kind="refused", trial=trial))
    return path


def earlier(folder: Path, subject: str = "P07") -> list[float]:
    return earlier_pulses_s(folder, subject, HOUR_S, but=folder / "mine.mcap")


def test_a_log_of_any_name_counts_and_the_own_one_never(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_log(tmp_path / "P07 day 1", header)
    make_log(tmp_path / "mine.mcap", header)
    (tmp_path / "notes.txt").write_text("the coil at 5 mm")
    assert len(earlier(tmp_path)) == 3
    monkeypatch.chdir(tmp_path)
    assert len(earlier_pulses_s(tmp_path, "P07", HOUR_S, but=Path("mine.mcap"))) == 3


def test_every_intent_counts_by_its_time_unless_it_was_refused(tmp_path: Path, header: Header) -> None:
    found = salvage(make_log(tmp_path / "a.mcap", header, intents=3, refused=[1]))
    times_ns = [message.log_time_ns for message in found.messages if message.topic == "/intent"]
    now_ns = times_ns[-1] + 10_000_000_000
    assert pulses_s(found, now_ns) == [(now_ns - times_ns[0]) / 1e9, 10.0]


def test_a_stimulus_whose_intent_is_lost_counts_by_the_record_of_its_trial(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "a.mcap", header) as log:
        log.append(Intent(trial=0, isi_ms=50.0))
        for trial in range(2):
            log.append(Trial(trial, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=0.1))
    assert len(pulses_s(salvage(tmp_path / "a.mcap"))) == 2


def test_a_record_that_makes_no_sense_is_no_stimulus(tmp_path: Path, header: Header) -> None:
    found = salvage(make_log(tmp_path / "a.mcap", header, intents=2))
    found.messages.append(Message("/intent", b'{"trial": "none"}', 0))
    assert len(pulses_s(found)) == 2


def test_a_stimulus_is_never_in_the_future(tmp_path: Path, header: Header) -> None:
    assert pulses_s(salvage(make_log(tmp_path / "a.mcap", header, intents=1)), now_ns=0) == [0.0]


def without_its_end(log: Path) -> Path:
    whole = log.read_bytes()
    log.write_bytes(whole[: whole.rindex(b"\x04\x00\x00\x00zstd", 0, whole.rindex(b"/trial")) - 37])
    return log


def test_an_earlier_log_without_its_end_is_an_error_with_the_way_out(tmp_path: Path, header: Header) -> None:
    without_its_end(make_log(tmp_path / "a.mcap", header))
    with pytest.raises(DamagedLogError, match=r"earlier log.*Resume that session"):
        earlier(tmp_path)


def test_a_damaged_file_is_no_error_where_its_log_went_on_with_what_was_left(tmp_path: Path, header: Header) -> None:
    log = without_its_end(make_log(tmp_path / "a.mcap", header, intents=3))
    with LogWriter.continuing(log, salvage(log), header):
        pass
    with pytest.raises(DamagedLogError):  # what was lost is not told yet
        earlier(tmp_path)
    with LogWriter.continuing(log, salvage(log), header) as going_on:
        going_on.append(Event(kind="resume"))
        going_on.append(Intent(trial=3, isi_ms=50.0))
    left = len(pulses_s(salvage(tmp_path / "a.mcap.damaged")))
    assert len(earlier(tmp_path)) == left + 1
    log.rename(tmp_path / "renamed.mcap")
    with pytest.raises(DamagedLogError):
        earlier(tmp_path)


def test_the_subjects_logs_of_a_folder_count_and_no_others(tmp_path: Path, header: Header) -> None:
    make_log(tmp_path / "a.mcap", header, intents=3)
    make_log(tmp_path / "b.mcap", header, intents=2)
    make_log(tmp_path / "other.mcap", header.model_copy(update={"subject": "P08"}))
    simulated = dataclasses.replace(header.device, simulated=True)
    make_log(tmp_path / "simulated.mcap", header.model_copy(update={"device": simulated}))
    make_log(tmp_path / "mine.mcap", header)
    ages_s = earlier(tmp_path)
    assert len(ages_s) == 5
    assert ages_s == sorted(ages_s, reverse=True)
    assert len(earlier(tmp_path, "P08")) == 3


def test_logs_in_folders_of_the_folder_count_and_the_own_one_never(tmp_path: Path, header: Header) -> None:
    day = tmp_path / "P07" / "day 1"
    day.mkdir(parents=True)
    make_log(day / "a.mcap", header, intents=3)
    make_log(day.parent / "b.mcap", header, intents=2)
    own = make_log(day / "mine.mcap", header)
    assert len(earlier_pulses_s(tmp_path, "P07", HOUR_S, but=own)) == 5
    (day / "c.mcap").write_bytes(b"no log")
    with pytest.raises(DamagedLogError):
        earlier(tmp_path)


def test_a_linked_folder_is_looked_into_and_a_circle_of_links_ends(tmp_path: Path, header: Header) -> None:
    archive, folder = tmp_path / "archive", tmp_path / "logs"
    archive.mkdir()
    folder.mkdir()
    make_log(archive / "a.mcap", header, intents=3)
    (folder / "old").symlink_to(archive)
    (archive / "back").symlink_to(folder)
    assert len(earlier(folder)) == 3


def test_a_folder_that_may_not_be_read_is_an_error_as_nobody_knows_what_it_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    locked, scandir = tmp_path / "locked", os.scandir
    locked.mkdir()

    def refused(path: Any) -> Any:
        if Path(path) == locked:
            raise PermissionError(13, "Permission denied", str(locked))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refused)
    with pytest.raises(LogError, match=r"Permission denied"):
        earlier(tmp_path)


def test_copies_of_a_log_count_once_and_those_of_the_own_one_never(tmp_path: Path, header: Header) -> None:
    export = tmp_path / "export"
    export.mkdir()
    shutil.copy(make_log(tmp_path / "a.mcap", header, intents=3), export)
    shutil.copy(make_log(tmp_path / "mine.mcap", header, intents=2), export)
    assert len(earlier(tmp_path)) == 3
    (tmp_path / "mine.mcap").rename(tmp_path / "mine.mcap.part")
    assert len(earlier(tmp_path)) == 3


def test_an_interval_production_log_holds_no_stimuli_and_blocks_nobody(tmp_path: Path, header: Header) -> None:
    make_log(tmp_path / "a.mcap", header)
    task = ProductionHeader(isiw_version="0", created="", subject="P07", seed=0, blocks=(Block(3, 300.0),))
    LogWriter.create(tmp_path / "task.mcap", task).close()
    assert len(earlier(tmp_path)) == 3


def test_a_log_that_holds_stimuli_is_never_passed_over_as_one_of_a_task(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "a.mcap", header) as log:
        log.append(Intent(trial=0, isi_ms=50.0))
        log.append(Production(trial=0, block=0, produced_ms=300.0, score_pct=100.0))
    with pytest.raises(LogError, match="interval production task"):
        earlier(tmp_path)


def test_a_session_that_never_closed_its_log_counts(tmp_path: Path, header: Header) -> None:
    make_log(tmp_path / "a.mcap", header).rename(tmp_path / "a.mcap.part")
    assert len(earlier(tmp_path)) == 3


def test_what_is_older_than_the_period_is_not_even_read(tmp_path: Path, header: Header) -> None:
    old = make_log(tmp_path / "a.mcap", header)
    old.write_bytes(b"no log any more")
    os.utime(old, (0, 0))
    assert earlier(tmp_path) == []


def test_a_log_that_cannot_be_read_is_an_error_as_nobody_knows_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"no log")
    with pytest.raises(DamagedLogError):
        earlier(tmp_path)


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such folder"):
        earlier(tmp_path / "nowhere")
