"""Files that survive a crash."""

from __future__ import annotations

from pathlib import Path

import pytest

from isiw.errors import LogError
from isiw.log.durable import DurableFile, begun
from isiw.log.places import log_of, part_of


def test_a_log_has_two_names_that_lead_to_each_other() -> None:
    log = Path("sessions/P07.mcap")
    assert part_of(log) == Path("sessions/P07.mcap.part")
    assert log_of(part_of(log)) == log_of(log) == log


def test_a_path_without_a_name_is_no_log() -> None:
    with pytest.raises(LogError, match="needs a file's name"):
        part_of(Path("/"))


def test_a_file_that_is_there_is_never_written_over(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    path.write_bytes(b"data")
    with pytest.raises(FileExistsError):
        DurableFile(path)
    assert path.read_bytes() == b"data"


def test_what_is_written_after_a_move_goes_to_the_end_of_the_new_place(tmp_path: Path) -> None:
    (tmp_path / "old").write_bytes(b"replaced")
    file = DurableFile(tmp_path / "folder" / "new")
    file.write(b"one ")
    file.move_to(tmp_path / "old", replacing=True)
    file.write(b"two")
    assert file.tell() == 7
    file.close()
    file.close()
    assert (tmp_path / "old").read_bytes() == b"one two"
    assert not (tmp_path / "folder" / "new").exists()


def begin_and_fail(path: Path, moved_to: Path | None = None) -> None:
    with begun(path) as file:
        file.write(b"half a header")
        if moved_to is not None:
            file.move_to(moved_to, replacing=False)
        raise ZeroDivisionError


def test_a_beginning_that_fails_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        begin_and_fail(tmp_path / "s")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_has_taken_its_place_stays_although_what_follows_fails(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        begin_and_fail(tmp_path / "s.part", tmp_path / "s")
    assert [path.name for path in tmp_path.iterdir()] == ["s"]
