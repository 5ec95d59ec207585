"""When a person was stimulated, by the logs."""

from __future__ import annotations

import dataclasses
import os
import shutil
import time
from collections.abc import Container
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from isiw.errors import DamagedLogError, LogError
from isiw.log import moments, writer
from isiw.log.headers import Block, Header, Production, ProductionHeader
from isiw.log.moments import Moment
from isiw.log.pulses import earlier_pulse_ages, pulse_ages
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Intent, Message
from isiw.log.writer import LogWriter
from isiw.trials import Status, Stimulus, Trial
from log.written import make_header

HOUR_S = 3600.0


def make_log(path: Path, header: Header, intents: int = 3, refused: Container[int] = ()) -> Path:
    with LogWriter.create(path, header) as log:
        for trial in range(intents):
            log.append(Intent(trial=trial, isi_ms=50.0))
            if trial in refused:
                log.append(Event(kind="refused", trial=trial))
    return path


def earlier(folder: Path, subject: str = "P07") -> list[float]:
    return [*earlier_pulse_ages(folder, subject, HOUR_S, but=folder / "mine.mcap").ages_s]


def test_a_log_of_any_name_counts_and_the_own_one_never(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_log(tmp_path / "P07 day 1", header)
    make_log(tmp_path / "mine.mcap", header)
    (tmp_path / "notes.txt").write_text("the coil at 5 mm")
    assert len(earlier(tmp_path)) == 3
    monkeypatch.chdir(tmp_path)
    assert len(earlier_pulse_ages(tmp_path, "P07", HOUR_S, but=Path("mine.mcap")).ages_s) == 3


def test_every_intent_counts_by_its_time_unless_it_was_refused(tmp_path: Path, header: Header) -> None:
    found = salvage(make_log(tmp_path / "a.mcap", header, intents=3, refused=[1]))
    times_ns = [message.log_time_ns for message in found.messages if message.topic == "/intent"]
    now_ns = times_ns[-1] + 10_000_000_000
    assert pulse_ages(found, Moment(now_ns)).ages_s == ((now_ns - times_ns[0]) / 1e9, 10.0)


def test_a_stimulus_whose_intent_is_lost_counts_by_the_record_of_its_trial(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "a.mcap", header) as log:
        log.append(Intent(trial=0, isi_ms=50.0))
        for trial in range(2):
            log.append(Trial(trial, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=0.1))
    assert len(pulse_ages(salvage(tmp_path / "a.mcap")).ages_s) == 2


def test_a_record_that_makes_no_sense_is_no_stimulus(tmp_path: Path, header: Header) -> None:
    found = salvage(make_log(tmp_path / "a.mcap", header, intents=2))
    found.messages.append(Message("/intent", b'{"trial": "none"}', 0))
    assert len(pulse_ages(found).ages_s) == 2


def test_a_stimulus_is_never_in_the_future(tmp_path: Path, header: Header) -> None:
    assert pulse_ages(salvage(make_log(tmp_path / "a.mcap", header, intents=1)), Moment(0)).ages_s == (0.0,)


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
    left = len(pulse_ages(salvage(tmp_path / "a.mcap.damaged")).ages_s)
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


def test_a_space_behind_a_code_makes_nobody_else_of_the_person(tmp_path: Path) -> None:
    header = make_header(subject="P07 ")
    assert header.subject == "P07"
    make_log(tmp_path / "old.mcap", header.model_copy(update={"subject": " P07 "}))  # as it was written before
    assert len(earlier(tmp_path)) == 3


def test_logs_in_folders_of_the_folder_count_and_the_own_one_never(tmp_path: Path, header: Header) -> None:
    day = tmp_path / "P07" / "day 1"
    day.mkdir(parents=True)
    make_log(day / "a.mcap", header, intents=3)
    make_log(day.parent / "b.mcap", header, intents=2)
    own = make_log(day / "mine.mcap", header)
    assert len(earlier_pulse_ages(tmp_path, "P07", HOUR_S, but=own).ages_s) == 5
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


class Computer:
    """A computer whose clock can be set, and which can be started again."""

    def __init__(self, patched: pytest.MonkeyPatch) -> None:
        self.now_s, self.set_by_s, self.started_s = 1_800_000_000.0, 0.0, 1_799_990_000.0
        patched.setattr(time, "time_ns", lambda: round((self.now_s + self.set_by_s) * 1e9))
        patched.setattr(moments, "boot_s", lambda: self.now_s - self.started_s)
        for module in (moments, writer):
            patched.setattr(module, "boot_id", lambda: f"start at {self.started_s}")

    def log(self, path: Path, header: Header, pulses: int = 3) -> Path:
        """A log of a stimulus every ten seconds."""
        with LogWriter.create(path, header) as log:
            for trial in range(pulses):
                log.append(Intent.of(Stimulus(trial, 50.0), 0.0))
                self.now_s += 10.0
        return path


@pytest.fixture
def computer(monkeypatch: pytest.MonkeyPatch) -> Computer:
    return Computer(monkeypatch)


@pytest.mark.parametrize(("hours", "says"), [(5, "set forward by 5:00:00"), (-5, "set back by 5:00:00"), (0, "")])
def test_a_clock_that_is_set_after_stimuli_makes_them_no_older_and_no_younger(
    tmp_path: Path, header: Header, computer: Computer, hours: int, says: str
) -> None:
    found = salvage(computer.log(tmp_path / "a.mcap", header))
    computer.now_s += 600.0
    computer.set_by_s = hours * HOUR_S
    ages = pulse_ages(found)
    assert ages.ages_s == (630.0, 620.0, 610.0)
    assert len(ages.doubts) == bool(says)
    assert says in " ".join(ages.doubts)


def test_a_clock_that_was_set_between_stimuli_makes_the_first_no_older_after_another_start(
    tmp_path: Path, header: Header, computer: Computer
) -> None:
    with LogWriter.create(tmp_path / "a.mcap", header) as log:
        for trial in range(2):
            log.append(Intent.of(Stimulus(trial, 50.0), 0.0))
            computer.now_s += 10.0
            computer.set_by_s = 2 * HOUR_S
    computer.started_s = computer.now_s
    assert pulse_ages(salvage(tmp_path / "a.mcap")).ages_s == (20.0, 10.0)


def test_stimuli_that_are_still_to_come_by_the_clock_of_another_start_count_as_given_now_and_that_is_said(
    tmp_path: Path, header: Header, computer: Computer
) -> None:
    found = salvage(computer.log(tmp_path / "a.mcap", header))
    computer.started_s, computer.set_by_s = computer.now_s, -24 * HOUR_S  # its battery is empty
    ages = pulse_ages(found)
    assert ages.ages_s == (0.0, 0.0, 0.0)
    assert "3 earlier stimuli are still to come" in "".join(ages.doubts)


def test_a_log_of_this_start_counts_however_old_its_file_looks(
    tmp_path: Path, header: Header, computer: Computer
) -> None:
    log = computer.log(tmp_path / "a.mcap", header)
    os.utime(log, (computer.now_s, computer.now_s))
    computer.set_by_s = 24 * HOUR_S
    ages = earlier_pulse_ages(tmp_path, "P07", HOUR_S, but=tmp_path / "mine.mcap")
    assert ages.ages_s == (30.0, 20.0, 10.0)
    assert "set forward by 1 day" in "".join(ages.doubts)
    computer.started_s = computer.now_s
    assert earlier(tmp_path) == []  # of another start, whose clock nothing contradicts


@pytest.mark.parametrize(("given_by", "count"), [("2020-01-01T00:00:00Z", 0), ("", 3), ("2100-01-01T00:00:00Z", 3)])
def test_imported_trials_count_as_of_their_own_dates_and_without_these_as_of_their_import(
    tmp_path: Path, header: Header, given_by: str, count: int
) -> None:
    imported = header.model_copy(update={"kind": "imported", "source": "table.csv", "given_by": given_by})
    with LogWriter.create(tmp_path / "a.mcap", imported) as log:
        for trial in range(3):
            log.append(Trial(trial, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=0.1))
    assert len(earlier(tmp_path)) == count


def test_tables_of_one_date_count_each_and_one_that_was_imported_twice_once(tmp_path: Path, header: Header) -> None:
    then = datetime.fromtimestamp(time.time() - 100.0, UTC).isoformat()
    imported = header.model_copy(update={"kind": "imported", "source": "table.csv", "given_by": then})
    for name, isi_ms in {"morning": 50.0, "noon": 60.0, "noon again": 60.0}.items():
        with LogWriter.create(tmp_path / f"{name}.mcap", imported) as log:
            for trial in range(3):
                log.append(Trial(trial, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=0.1))
    assert len(earlier(tmp_path)) == 6
