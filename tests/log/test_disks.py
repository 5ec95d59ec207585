"""Logs on disks that lack what local ones have, and names that are one file elsewhere."""

from __future__ import annotations

import errno
import os
import unicodedata
from pathlib import Path

import pytest

from disks import is_folder, over_a_file, refusing
from isiw.errors import DiskWarning, LogError
from isiw.files import folded, put, twin
from isiw.log.headers import Header
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.writer import LogWriter
from log.written import write_trials


def write_there(folder: Path, header: Header) -> None:
    with LogWriter.create(folder / "s.mcap", header) as log:
        write_trials(log, [0])
    with LogWriter.continuing(folder / "s.mcap", salvage(folder / "s.mcap"), header) as log:
        write_trials(log, [1])
    put(folder / "page.html", b"ours", replacing=True)


@pytest.mark.parametrize("code", [errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EIO])
def test_a_folder_that_cannot_be_synced_is_said_once_and_used(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    refusing(monkeypatch, "fsync", code, is_folder)
    with pytest.warns(DiskWarning, match=r"cannot sync a folder .*It is used") as said:
        write_there(tmp_path, header)
    assert len(said) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.html", "s.mcap"]
    assert len(read_session(tmp_path / "s.mcap").table) == 2


@pytest.mark.parametrize("only", [is_folder, lambda *_: True])
def test_a_log_that_cannot_be_begun_on_a_full_disk_leaves_nothing_in_the_way(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch, only: object
) -> None:
    with monkeypatch.context() as patched:
        refusing(patched, "fsync", errno.ENOSPC, only)  # type: ignore[arg-type]
        with pytest.raises(LogError, match=r"No space left.*s\.mcap.*another path\.$"):
            LogWriter.create(tmp_path / "s.mcap", header)
    assert list(tmp_path.iterdir()) == []
    LogWriter.create(tmp_path / "s.mcap", header).close()


def test_a_disk_that_locks_no_file_is_said_of_the_name_that_was_given(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl = pytest.importorskip("fcntl")

    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with pytest.raises(LogError, match=r"cannot be locked: No locks available; got .*s\.mcap'.*local disk"):
        LogWriter.create(tmp_path / "s.mcap", header)
    assert list(tmp_path.iterdir()) == []


def test_a_log_goes_on_and_closes_on_a_disk_that_renames_over_no_file(
    finished_log: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    for call in ("rename", "replace"):
        refusing(monkeypatch, call, errno.EEXIST, over_a_file)
    with LogWriter.continuing(finished_log, salvage(finished_log), header) as log:
        write_trials(log, [8])
    assert [path.name for path in finished_log.parent.iterdir()] == ["s.mcap"]
    assert len(read_session(finished_log).table) == 9


@pytest.mark.parametrize("size", [242, 247, 255, 3000])
def test_a_name_that_is_too_long_also_to_be_resumed_is_reported_as_it_was_given(
    tmp_path: Path, header: Header, size: int
) -> None:
    name = "s" * size + ".mcap"
    with pytest.raises(LogError, match=rf"name is too long; got '{size + 5} bytes: .*sss\.mcap'; expected at most"):
        LogWriter.create(tmp_path / name, header)
    assert list(tmp_path.iterdir()) == []


def test_the_longest_name_can_be_resumed(tmp_path: Path, header: Header) -> None:
    log = tmp_path / ("s" * 241 + ".mcap")
    LogWriter.create(log, header).close()
    LogWriter.continuing(log, salvage(log), header).close()
    assert [path.name for path in tmp_path.iterdir()] == [log.name]


@pytest.mark.parametrize("other", ["p07\u00e9.mcap", unicodedata.normalize("NFD", "P07\u00e9.mcap"), "P07\u00c9.mcap"])
@pytest.mark.parametrize("ending", ["", ".part"])
def test_a_log_that_is_another_one_on_other_systems_is_refused_before_it_begins(
    tmp_path: Path, header: Header, other: str, ending: str
) -> None:
    (tmp_path / f"{other}{ending}").write_bytes(b"theirs")
    if (tmp_path / f"P07\u00e9.mcap{ending}").exists():
        pytest.skip("the disk itself takes them for one file")
    with pytest.raises(LogError, match="on other systems the log would be the same file"):
        LogWriter.create(tmp_path / "P07\u00e9.mcap", header)
    assert [path.name for path in tmp_path.iterdir()] == [f"{other}{ending}"]


def test_names_that_are_one_file_elsewhere_are_known(tmp_path: Path) -> None:
    assert len({folded(name) for name in ("Straße", "STRASSE", "strasse.", "strasse ")}) == 1
    assert folded("P07.mcap") != folded("P08.mcap")
    (tmp_path / "a").write_text("")
    assert twin(tmp_path / "a") is None
    assert twin(tmp_path / "nowhere" / "a") is None
