from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from disks import no_room
from isiw.errors import InvalidValueError
from isiw.files import made_folder, write_output


def test_a_file_that_is_there_is_replaced_only_where_that_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "new" / "s.pdf"
    assert write_output(path, b"first") == path
    with pytest.raises(InvalidValueError, match=r"overwrite=True"):
        write_output(path, b"second")
    assert path.read_bytes() == b"first"
    write_output(path, b"second", overwrite=True)
    assert path.read_bytes() == b"second"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("overwrite", [True, False])
def test_a_log_is_never_overwritten(finished_log: Path, overwrite: Any) -> None:
    before = finished_log.read_bytes()
    with pytest.raises(InvalidValueError, match=r"never overwritten|already"):
        write_output(finished_log, b"a picture", overwrite=overwrite)
    assert finished_log.read_bytes() == before


def test_a_folder_is_no_place_for_a_file(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"a folder of this name"):
        write_output(tmp_path, b"a picture", overwrite=True)


def test_a_folder_that_cannot_be_made_is_told_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("a file")
    with pytest.raises(InvalidValueError, match=r"it is a file; got "):
        made_folder(file)
    with pytest.raises(InvalidValueError, match="Not a directory"):
        write_output(file / "in it" / "s.pdf", b"a picture")


def test_what_cannot_be_written_as_a_whole_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_output(tmp_path / "s.png", b"first")
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(OSError, match="No space left") as error:
        write_output(path, b"second", overwrite=True)
    assert error.value.filename == str(path)
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]
