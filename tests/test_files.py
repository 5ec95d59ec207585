"""Files that are made in folders that others can write to."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any, Never

import pytest

from disks import no_room
from hostile import IN_THE_WAY, at_once
from isiw.files import in_the_way, is_reserved, new_file, put, take_free_place
from isiw.opening import opened


def _no_links(new: Any, old: Any) -> Never:
    raise OSError(errno.EPERM, f"no link from {new} to {old}")


@pytest.mark.parametrize("links", [True, False])
def test_a_taken_name_is_left_alone_and_a_free_one_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: Any
) -> None:
    if not links:  # as on a memory stick
        monkeypatch.setattr(Path, "hardlink_to", _no_links)
    for name in ("ours", "theirs"):
        (tmp_path / name).write_text(name)
    with pytest.raises(FileExistsError):
        take_free_place(tmp_path / "ours", tmp_path / "theirs")
    assert (tmp_path / "theirs").read_text() == "theirs"
    take_free_place(tmp_path / "ours", tmp_path / "free")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["free", "theirs"]


def test_a_name_that_leads_nowhere_is_taken_too(tmp_path: Path) -> None:
    (tmp_path / "ours").write_text("ours")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(FileExistsError):
        take_free_place(tmp_path / "ours", tmp_path / "link")
    with pytest.raises(FileExistsError):
        new_file(tmp_path / "link")
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("replacing", [True, False])
def test_nothing_is_written_through_a_link(tmp_path: Path, replacing: Any) -> None:
    (tmp_path / "victim").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "victim")
    try:
        put(tmp_path / "link", b"ours", replacing=replacing)
    except FileExistsError:
        assert not replacing
    assert (tmp_path / "victim").read_text() == "precious"
    assert (tmp_path / "link").is_symlink() is not replacing
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("kind", IN_THE_WAY)
def test_what_is_no_file_is_named_and_never_waited_for(tmp_path: Path, kind: str) -> None:
    IN_THE_WAY[kind](tmp_path / "name")
    assert in_the_way(tmp_path / "name") == kind
    with pytest.raises(OSError, match=r"regular|directory|such"):
        at_once(lambda: opened(tmp_path / "name").read(10))


def test_a_file_a_link_to_one_and_nothing_are_not_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("ours")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    assert [in_the_way(tmp_path / name) for name in ("file", "link", "nothing", "file/below")] == [None] * 4
    with opened(tmp_path / "link") as file:
        assert file.read() == b"ours"
    with pytest.raises(OSError, match="symbolic links"):
        opened(tmp_path / "link", links=False)


def test_names_that_windows_keeps_for_itself_are_known() -> None:
    reserved = (
        "CON",
        "nul",
        "aux.mcap",
        "Com1.tar.gz",
        "lpt9",
        "COM¹.mcap",
        "nul .mcap",
        "conin$",
        "log.",
        "log ",
        "..",
    )
    assert [name for name in reserved if not is_reserved(name)] == []
    free = ("console", "aux1.mcap", "com.mcap", "com10", "P07.mcap", ".nul", "my nul.mcap", "")
    assert [name for name in free if is_reserved(name)] == []


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(OSError, match="No space left"):
        put(tmp_path / "file", b"ours", replacing=False)
    assert list(tmp_path.iterdir()) == []
