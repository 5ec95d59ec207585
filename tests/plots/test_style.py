"""How pictures are written."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from isiw.errors import InvalidValueError
from isiw.plots.style import save_figure


@pytest.mark.parametrize(("name", "begin"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("a.SVG", b"<?xml")])
def test_the_suffix_chooses_the_format_and_folders_are_made(tmp_path: Path, name: str, begin: bytes) -> None:
    written = save_figure(Figure(), tmp_path / "new" / "folder" / name)
    assert written.read_bytes().startswith(begin)


def test_an_unknown_format_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"got 'a\.docx'; expected .*png"):
        save_figure(Figure(), tmp_path / "new" / "a.docx")
    assert list(tmp_path.iterdir()) == []
