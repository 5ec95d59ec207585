from __future__ import annotations

from pathlib import Path

import pytest

import isiw
from isiw.log.headers import Header
from isiw.log.record import SessionRecord, read_session
from isiw.log.salvage import salvage
from isiw.log.writer import LogWriter
from isiw.priors.days import require_whole
from logs import blocks_of, damage


def touched(path: Path, header: Header) -> SessionRecord:
    LogWriter.continuing(path, salvage(path), header).close()
    return read_session(path)


@pytest.mark.parametrize("touch", ["exclude", "include", "continue"])
def test_a_log_that_lost_a_record_says_so_however_often_it_was_continued(
    finished_log: Path, header: Header, touch: str
) -> None:
    if touch == "include":
        isiw.exclude(finished_log, 1, "cough")
    damage(finished_log, 5)
    before = read_session(finished_log)
    assert before.losses
    if touch == "exclude":
        isiw.exclude(finished_log, 1, "cough")
    elif touch == "include":
        isiw.include(finished_log, 1)
    for _ in range(2):
        after = touched(finished_log, header)
        assert after.losses == (" ".join(before.losses),)
        assert sum(event.kind == "loss" for event in after.events) == 1
        assert after.given == before.given
    with pytest.raises(isiw.errors.DamagedLogError):
        require_whole(after)


def test_stimuli_that_only_the_index_of_a_damaged_log_counts_are_counted_ever_after(
    finished_log: Path, header: Header
) -> None:
    blocks = len(blocks_of(finished_log))
    for block in range(blocks - 2, blocks):  # intent and outcome of the last trial
        damage(finished_log, block)
    before = read_session(finished_log)
    assert (len(before.table), [intent.trial for intent in before.unknown]) == (7, [7])
    after = touched(finished_log, header)
    assert (len(after.table), [intent.trial for intent in after.unknown]) == (7, [7])


@pytest.mark.parametrize("end", [b"", b"\0" * 600])
def test_a_record_that_was_not_finished_when_the_power_went_is_no_loss(
    broken_log: Path, header: Header, end: bytes
) -> None:
    whole = broken_log.read_bytes()
    cut = len(whole) - (0 if end else 30)
    broken_log.write_bytes(whole[:cut] + end)
    before = read_session(broken_log)
    assert any("was not finished" in loss for loss in before.losses)
    after = touched(broken_log, header)
    assert after.losses == ()
    assert [event.kind for event in after.events] == ["note"]
    assert after.table == before.table


def test_damage_before_the_last_record_of_an_unfinished_log_is_a_loss(broken_log: Path, header: Header) -> None:
    damage(broken_log, 5)
    broken_log.write_bytes(broken_log.read_bytes()[:-30])
    assert touched(broken_log, header).losses


def test_damage_to_the_index_alone_is_no_loss(finished_log: Path, header: Header) -> None:
    whole = bytearray(finished_log.read_bytes())
    whole[-40] ^= 1
    finished_log.write_bytes(whole)
    before = read_session(finished_log)
    assert before.losses
    after = touched(finished_log, header)
    assert (after.losses, after.table) == ((), before.table)
