"""A log whose file is taken away, replaced or shortened while it is written."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Never

import pytest

from disks import HAPPENINGS
from isiw.errors import LogError
from isiw.log.durable import DurableFile
from isiw.log.headers import Header
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.writer import LogWriter
from known import known
from log.written import write_trials

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows does not let an open file be moved or deleted")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "folder" / "s.mcap"


@pytest.fixture
def log(path: Path, header: Header) -> LogWriter:
    log = LogWriter.create(path, header)
    write_trials(log, range(5))
    return log


def kept(error: LogError) -> Path:
    """The copy that an error's message names."""
    place, _, _ = known(error.remedy).partition(". ")
    return Path(place.removeprefix("What the session still held of it is in ").removesuffix("."))


def test_a_log_in_its_place_is_accepted(log: LogWriter) -> None:
    log.require_in_place()
    log.close()


@pytest.mark.parametrize("happening", HAPPENINGS)
def test_a_log_that_is_not_as_it_was_written_is_an_error(log: LogWriter, path: Path, happening: str) -> None:
    HAPPENINGS[happening](path.with_name("s.mcap.part"))
    with pytest.raises(LogError, match="as it was written"):
        log.require_in_place()
    with pytest.raises(LogError, match="as it was written"):
        log.close()


@pytest.mark.parametrize("happening", sorted(HAPPENINGS.keys() - {"shortened"}))
def test_all_that_the_open_file_holds_is_saved_and_the_message_says_where(
    log: LogWriter, path: Path, happening: str
) -> None:
    HAPPENINGS[happening](path.with_name("s.mcap.part"))
    with pytest.raises(LogError) as caught:
        log.close()
    assert kept(caught.value).parent == path.parent
    assert len(read_session(kept(caught.value)).table) == 5


def test_a_log_that_was_shortened_before_more_was_written_is_an_error(log: LogWriter, path: Path) -> None:
    HAPPENINGS["shortened"](path.with_name("s.mcap.part"))
    write_trials(log, [5])
    with pytest.raises(LogError, match="bytes instead of"):
        log.require_in_place()
    with pytest.raises(LogError, match="bytes instead of"):
        log.close()


@pytest.mark.parametrize("left", [0, 100, 3000])
def test_of_a_log_that_was_shortened_header_trials_and_events_are_saved_from_memory(
    log: LogWriter, path: Path, header: Header, left: int
) -> None:
    os.truncate(path.with_name("s.mcap.part"), left)
    write_trials(log, [5])
    with pytest.raises(LogError, match="written from memory") as caught:
        log.close()
    saved = read_session(kept(caught.value))
    assert saved.header == header
    assert [trial.index for trial in saved.table] == list(range(6))
    assert [intent.trial for intent in saved.intents] == list(range(6))
    assert saved.losses
    assert not saved.end_lost
    assert "from memory" in saved.events[-1].text


def test_a_copy_replaces_no_other_copy(log: LogWriter, path: Path) -> None:
    path.with_name("s.rescued.mcap").write_bytes(b"precious")
    HAPPENINGS["deleted"](path.with_name("s.mcap.part"))
    with pytest.raises(LogError) as caught:
        log.close()
    assert kept(caught.value).name == "s.rescued1.mcap"
    assert path.with_name("s.rescued.mcap").read_bytes() == b"precious"


def test_where_the_folder_cannot_be_made_again_the_copy_is_among_the_temporary_files(
    log: LogWriter, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    HAPPENINGS["its folder deleted"](path.with_name("s.mcap.part"))
    path.parent.write_text("a file in the folder's place")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    with pytest.raises(LogError) as caught:
        log.close()
    assert kept(caught.value).parent == temporary
    assert len(read_session(kept(caught.value)).table) == 5


def no_rename(path: Path, target: Path) -> Never:
    raise OSError(errno.EACCES, os.strerror(errno.EACCES), path, target)


def test_a_log_that_cannot_be_renamed_says_where_it_is(
    log: LogWriter, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for way in ("hardlink_to", "rename"):
        monkeypatch.setattr(Path, way, no_rename)
    with pytest.raises(LogError, match=r"cannot be renamed.*s\.mcap\.part"):
        log.close()
    assert read_session(path).finished
    assert len(read_session(path).table) == 5


def test_a_log_that_cannot_go_on_for_its_name_stays_as_it_was(
    finished_log: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = finished_log.read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", no_rename)
        with pytest.raises(LogError, match=r"cannot be continued.*as it was"):
            LogWriter.continuing(finished_log, salvage(finished_log), header)
    assert finished_log.read_bytes() == before
    assert list(finished_log.parent.iterdir()) == [finished_log]


def test_a_discarded_log_leaves_nothing_and_can_be_made_again(log: LogWriter, path: Path, header: Header) -> None:
    log.discard()
    assert list(path.parent.iterdir()) == []
    LogWriter.create(path, header).close()


def test_a_log_is_closed_once(log: LogWriter, path: Path) -> None:
    log.close()
    path.unlink()
    log.close()
    assert not path.exists()


def test_the_size_of_a_file_that_is_being_written_is_its_own(tmp_path: Path) -> None:
    file = DurableFile(tmp_path / "file")
    file.write(b"some")
    file.sync()
    assert file.displacement() is None
    file.close()
