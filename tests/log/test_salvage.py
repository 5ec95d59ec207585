from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.errors import DamagedLogError, LogError
from isiw.log.headers import Header
from isiw.log.record import SessionRecord, read_session
from isiw.log.salvage import current_file, holds, only_in, salvage
from isiw.log.schema import Intent, Waveform
from isiw.log.writer import LogWriter
from isiw.sweeps import Channel
from isiw.trials import Status, Trial
from log.written import write_trials
from logs import blocks_of, damage


def sample(below: int, size: int) -> list[int]:
    return [int(place) for place in np.random.default_rng(20).choice(below, size, replace=False)]


def record_starts(data: bytes | bytearray) -> Iterator[int]:
    """Where the records of a whole file begin."""
    at, magic = 8, 8
    while at < len(data) - magic:
        yield at
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")


def content(record: SessionRecord) -> tuple[object, ...]:
    waveforms = {key: (channel.values.tolist(), channel.rate_hz) for key, channel in record.waveforms.items()}
    return record.header, record.history, waveforms


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["finished_log", "broken_log"])
def test_no_flipped_bit_changes_what_is_read_unnoticed(kind: str, request: pytest.FixtureRequest) -> None:
    log = request.getfixturevalue(kind)
    whole, original = log.read_bytes(), content(read_session(log))
    noticed = 0
    for position in sample(8 * len(whole), 100):
        flipped = bytearray(whole)
        flipped[position // 8] ^= 1 << (position % 8)
        log.write_bytes(flipped)
        try:
            record = read_session(log)
        except DamagedLogError:
            noticed += 1
            continue
        assert record.losses or content(record) == original
        noticed += bool(record.losses)
    # A finished log has a checksum over every byte; an unfinished one over every record, not over what lies between.
    assert noticed == 100 if kind == "finished_log" else noticed > 50


@pytest.mark.slow
def test_a_flipped_bit_costs_no_more_than_its_own_block(finished_log: Path) -> None:
    whole, all_trials = finished_log.read_bytes(), set(range(8))
    for position in sample(8 * len(whole), 100):
        flipped = bytearray(whole)
        flipped[position // 8] ^= 1 << (position % 8)
        finished_log.write_bytes(flipped)
        kept = {trial.index for trial in read_session(finished_log).table}
        assert len(all_trials - kept) <= 1


@pytest.mark.slow
def test_a_record_taken_for_another_kind_costs_no_more_than_itself(finished_log: Path) -> None:
    whole, all_trials = finished_log.read_bytes(), set(range(8))
    for start in record_starts(whole):
        for bit in range(8):
            flipped = bytearray(whole)
            flipped[start] ^= 1 << bit
            finished_log.write_bytes(flipped)
            record = read_session(finished_log)
            assert record.losses
            assert len(all_trials - {trial.index for trial in record.table}) <= 1


def test_a_wrong_length_of_the_mark_behind_the_records_is_told(finished_log: Path) -> None:
    whole = bytearray(finished_log.read_bytes())
    (mark,) = (start for start in record_starts(whole) if whole[start] == 15)
    whole[mark + 1] ^= 4  # a length of none, where the checksum follows nonetheless
    finished_log.write_bytes(whole)
    record = read_session(finished_log)
    assert record.losses == ("The mark behind the last record is damaged. No record is affected.",)
    assert len(record.table) == 8


def test_a_length_that_swallows_other_blocks_costs_none_of_them(finished_log: Path) -> None:
    whole = bytearray(finished_log.read_bytes())
    (first, _), (other, _) = blocks_of(finished_log)[4], blocks_of(finished_log)[12]
    whole[first + 1 : first + 9] = (other - first - 9).to_bytes(8, "little")
    finished_log.write_bytes(whole)
    record = read_session(finished_log)
    assert [trial.index for trial in record.table] == list(range(8))
    assert record.losses


def test_a_log_torn_anywhere_keeps_every_trial_before_the_tear(broken_log: Path) -> None:
    whole = broken_log.read_bytes()
    starts = [start for start, _ in blocks_of(broken_log)]
    for cut in sample(len(whole) - starts[0] - 2000, 60):
        size = starts[0] + 2000 + cut
        broken_log.write_bytes(whole[:size])
        record = read_session(broken_log)
        complete = sum(start < size for start in starts) - 1  # the last block that began may be torn
        assert len(record.table) >= (complete - 1) // 2
        assert [trial.index for trial in record.table] == list(range(len(record.table)))
        assert record.losses or record.unknown or len(record.table) == (complete + 1) // 2


def test_a_session_that_was_killed_between_records_has_lost_nothing(broken_log: Path) -> None:
    record = read_session(broken_log)
    assert (len(record.table), record.losses, record.finished) == (8, (), False)


def test_what_is_lost_is_said_in_words(finished_log: Path) -> None:
    damage(finished_log, 5)
    record = read_session(finished_log)
    assert re.search(r"A block of \d+ bytes at byte \d+ fails its checksum and is lost", " ".join(record.losses))
    assert re.search(r"Records? \d+", " ".join(record.losses))
    assert len(record.table) + len(record.unknown) == 8


def test_without_its_first_block_a_log_still_has_its_header(finished_log: Path) -> None:
    original = read_session(finished_log)
    damage(finished_log, 0)
    record = read_session(finished_log)
    assert record.header == original.header
    assert len(record.table) == 8
    assert record.losses


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89MCAP0\r\n", bytes(5000)])
def test_what_is_not_a_log_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "s.mcap").write_bytes(content)
    with pytest.raises(DamagedLogError):
        read_session(tmp_path / "s.mcap")


def test_a_log_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"no such log.*nowhere"):
        salvage(tmp_path / "nowhere.mcap")


def test_the_part_is_read_where_there_are_both(tmp_path: Path) -> None:
    for name in ("s.mcap", "s.mcap.part"):
        (tmp_path / name).write_bytes(b"x")
    for name in ("s.mcap", "s.mcap.part"):
        assert current_file(tmp_path / name).name == "s.mcap.part"


@pytest.mark.parametrize("path", ["", ".", "/", 300 * "s"])
def test_a_name_that_cannot_be_a_file_is_an_error_of_its_own(path: str) -> None:
    with pytest.raises(LogError):
        salvage(path)


def test_a_channel_of_the_devices_own_is_known_without_the_block_that_defines_it(
    tmp_path: Path, header: Header
) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        for trial in range(3):
            log.append(Intent(trial=trial, isi_ms=5.0))
            log.sync()
            log.append(Waveform.of(trial, Channel(np.arange(4.0), 1000.0, "N")), "grip")
            log.append(Trial(trial, Status.ACCEPTED, 5.0, isi_ms=5.0, mep_mv=0.1))
            log.sync()
    damage(tmp_path / "s.mcap", 2)  # the first with a grip: behind the header and the first intent
    record = read_session(tmp_path / "s.mcap")
    assert "fails its checksum" in record.losses[0]
    assert [sorted(record.sweep(trial)) for trial in range(3)] == [[], ["grip"], ["grip"]]


@pytest.mark.parametrize("block", [1, 5, 12])
def test_a_closed_log_that_was_cut_at_a_records_end_is_damaged(finished_log: Path, block: Any) -> None:
    finished_log.write_bytes(finished_log.read_bytes()[: blocks_of(finished_log)[block][1]])
    record = read_session(finished_log)
    assert re.fullmatch(
        r"The log ends at byte \d+ without the mark that closes it: it was cut off, .*", record.losses[0]
    )
    assert record.end_lost
    assert not record.finished


def test_the_index_tells_how_many_stimuli_a_lost_block_told_of(finished_log: Path) -> None:
    for block in (-2, -1):  # the last intent, and its trial
        damage(finished_log, block)
    record = read_session(finished_log)
    assert len(record.table) == 7
    assert [(intent.trial, intent.isi_ms) for intent in record.unknown] == [(7, None)]
    assert not record.end_lost
    assert any("Records" in loss and "lost" in loss for loss in record.losses)


def test_what_a_closed_log_lost_with_its_index_nobody_knows(finished_log: Path) -> None:
    damage(finished_log)
    finished_log.write_bytes(finished_log.read_bytes()[:-60])
    assert read_session(finished_log).end_lost


@pytest.mark.parametrize("kind", ["finished_log", "broken_log"])
@pytest.mark.parametrize("block", [0, 3, 16])
def test_a_block_that_is_there_twice_counts_once_and_is_reported(
    kind: Any, block: Any, request: pytest.FixtureRequest
) -> None:
    log = request.getfixturevalue(kind)
    original, whole = content(read_session(log)), log.read_bytes()
    start, end = blocks_of(log)[block]
    log.write_bytes(whole[:end] + whole[start:end] + whole[end:])
    record = read_session(log)
    assert content(record) == original
    assert len(record.table) == 8
    assert any("in the file twice" in loss for loss in record.losses)


def test_blocks_that_changed_places_are_read_in_their_order_and_reported(broken_log: Any) -> None:
    original, whole = content(read_session(broken_log)), broken_log.read_bytes()
    (first, middle), (again, last) = blocks_of(broken_log)[4:6]
    broken_log.write_bytes(whole[:first] + whole[again:last] + whole[middle:again] + whole[first:middle] + whole[last:])
    record = read_session(broken_log)
    assert content(record) == original
    assert any("out of order" in loss for loss in record.losses)


def test_a_second_record_of_a_trial_is_left_out_and_reported(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, [0, 1])
        log.append(Trial(1, Status.ACCEPTED, 5.0, isi_ms=5.0, mep_mv=9.0))
    record = read_session(tmp_path / "s.mcap")
    assert [trial.mep_mv for trial in record.table] == [0.0, 0.01]
    assert record.losses == ("A second record of trial 1 is left out.",)


def test_what_one_log_alone_has_is_counted(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, range(2))
    earlier = salvage(tmp_path / "s.mcap")
    with LogWriter.continuing(tmp_path / "s.mcap", earlier, header) as log:
        write_trials(log, [2])
    later = salvage(tmp_path / "s.mcap")
    assert (only_in(earlier, later), only_in(later, earlier)) == (0, 3)
    assert holds(later, earlier)
    assert not holds(earlier, later)
