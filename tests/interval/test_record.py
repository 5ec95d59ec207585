from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from isiw.devices.info import DeviceInfo
from isiw.dissertation.interval.task import answer, begin_log, continue_log, read_productions, session_blocks
from isiw.errors import DamagedLogError, InvalidValueError, LogError
from isiw.log.headers import AnyHeader, Block, StrategyRecipe, ThresholdHeader
from isiw.log.record import read_session
from isiw.log.writer import LogWriter
from isiw.session import read_threshold
from isiw.strategy.threshold import IntensityRange
from log.written import make_header

BLOCKS = session_blocks(3, trials=4)


def written(path: Path, trials: int, *, closed: bool = True) -> Path:
    """The log of so many trials, as somebody leaves it, or as a killed process does."""
    record, log = begin_log(path, BLOCKS, "P07", 5)
    for trial, block in record.left[:trials]:
        log.append(answer(BLOCKS[block], block, trial, 290.0 + trial, record.header.seed))
        log.sync()
    if closed:
        log.close()
        return path
    part = path.with_name(f"{path.name}.part")
    shutil.copy(part, path.with_name("copy"))
    log.close()
    path.unlink()
    path.with_name("copy").rename(part)
    return part


def test_a_task_survives_being_written_and_read(tmp_path: Path) -> None:
    record = read_productions(written(tmp_path / "a.mcap", 6))
    assert (record.header.subject, record.header.seed, record.header.blocks) == ("P07", 5, BLOCKS)
    assert [production.produced_ms for production in record.productions] == [290.0 + trial for trial in range(6)]
    assert record.losses == ()
    assert record.left == ((6, 1), (7, 1))


def test_the_table_has_mean_sd_and_share_of_each_block_that_was_begun(tmp_path: Path) -> None:
    table = read_productions(written(tmp_path / "a.mcap", 4)).table
    (row,) = table.to_dict("records")
    assert row == {
        "mode": 1, "target_ms": 300.0, "scale_pct": 50.0, "n": 4, "mean_ms": 291.5, "sd_ms": 1.25**0.5, "near": 1.0
    }  # fmt: skip


@pytest.mark.parametrize("closed", [True, False])
def test_a_task_that_was_left_or_killed_goes_on_where_it_stood(tmp_path: Path, *, closed: bool) -> None:
    written(tmp_path / "a.mcap", 3, closed=closed)
    record, log = continue_log(tmp_path / "a.mcap")
    assert record.left[0] == (3, 0)
    with log:
        log.append(answer(BLOCKS[0], 0, 3, 333.0, record.header.seed))
    again = read_productions(tmp_path / "a.mcap")
    assert [production.trial for production in again.productions] == [0, 1, 2, 3]
    assert [event.kind for event in again.events] == ["resume"]
    assert again.losses == ()


def test_a_torn_log_keeps_what_was_synced_and_goes_on(tmp_path: Path) -> None:
    part = written(tmp_path / "a.mcap", 5, closed=False)
    part.write_bytes(part.read_bytes()[:-150])
    assert len(read_productions(part).productions) == 4
    record, log = continue_log(part)
    log.close()
    assert record.left[0] == (4, 1)


def test_a_second_record_of_a_trial_is_left_out_of_the_table_and_told(tmp_path: Path) -> None:
    record, log = begin_log(tmp_path / "a.mcap", BLOCKS, "P07", 5)
    with log:
        for produced_ms in (300.0, 400.0):
            log.append(answer(BLOCKS[0], 0, 0, produced_ms, record.header.seed))
    again = read_productions(tmp_path / "a.mcap")
    assert [production.produced_ms for production in again.productions] == [300.0]
    assert again.losses == ("A second record of trial 0 is left out.",)


def test_a_complete_task_is_not_resumed(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 8)
    with pytest.raises(InvalidValueError, match=r"complete.*--show"):
        continue_log(tmp_path / "a.mcap")


def test_a_log_is_never_overwritten_and_the_way_on_is_named(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 2)
    with pytest.raises(LogError, match=r"never overwritten.*a\.mcap --resume"):
        begin_log(tmp_path / "a.mcap", BLOCKS, "P07", 5)


def test_readers_of_sessions_refuse_it_and_say_what_reads_it(tmp_path: Path) -> None:
    log = written(tmp_path / "a.mcap", 1)
    with pytest.raises(LogError, match=r"not .* window(.|\n)*interval .* --show"):
        read_session(log)
    with pytest.raises(LogError, match=r"not .* threshold(.|\n)*interval .* --show"):
        read_threshold(log)


THRESHOLD = ThresholdHeader(
    isiw_version="0.1.0",
    created="2026-11-21T10:00:00+00:00",
    seed=0,
    search=StrategyRecipe(name="bayes", seed=0),
    intensities=IntensityRange(20, 90),
    min_iti_s=5.0,
    max_pulses=100,
    device=DeviceInfo("bench", "impact"),
)


@pytest.mark.parametrize(
    ("header", "match"),
    [
        (make_header(), r"search for a window, not (.|\n)*isiw show \S*s\.mcap"),
        (THRESHOLD, r"search for a motor threshold, not (.|\n)*isiw threshold \S*s\.mcap --show"),
    ],
)
def test_a_log_with_stimuli_is_refused_with_what_shows_it(tmp_path: Path, header: AnyHeader, match: str) -> None:
    LogWriter.create(tmp_path / "s.mcap", header).close()
    with pytest.raises(LogError, match=match):
        read_productions(tmp_path / "s.mcap")


def test_a_log_of_a_newer_version_is_refused(tmp_path: Path) -> None:
    record, log = begin_log(tmp_path / "a.mcap", BLOCKS, "", 0)
    log.close()
    newer = record.header.model_copy(update={"schema_version": 99})
    LogWriter.create(tmp_path / "b.mcap", newer).close()
    with pytest.raises(LogError, match="newer isiw"):
        read_productions(tmp_path / "b.mcap")


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"no log")
    with pytest.raises(DamagedLogError):
        read_productions(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("blocks", "seed", "match"), [((), 0, "at least one block"), ((Block(1, 300.0),), -1, "seed must be")]
)
def test_a_task_without_blocks_or_seed_leaves_no_file(
    tmp_path: Path, blocks: tuple[Block, ...], seed: int, match: str
) -> None:
    with pytest.raises(InvalidValueError, match=match):
        begin_log(tmp_path / "a.mcap", blocks, "", seed)
    assert list(tmp_path.iterdir()) == []
