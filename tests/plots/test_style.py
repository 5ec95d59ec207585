"""How pictures are written."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from isiw.errors import InvalidValueError
from isiw.plots.comparison import comparison_figure
from isiw.plots.session import save_session_plot, session_figure
from isiw.plots.style import STRATEGY_COLOURS, explain, save_figure, strategy_colours
from isiw.types import FloatArray

COLOUR_BLINDNESS = {
    "protan": np.array([[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]),
    "deutan": np.array([[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]),
    "tritan": np.array([[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]]),
}
"""What linear RGB looks like without one kind of cone (Machado, Oliveira, Fernandes 2009)."""

NOTICED = 10.0


@pytest.mark.parametrize(("name", "begin"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("a.SVG", b"<?xml")])
def test_the_suffix_chooses_the_format_and_folders_are_made(tmp_path: Path, name: str, begin: bytes) -> None:
    written = save_figure(Figure(), tmp_path / "new" / "folder" / name)
    assert written.read_bytes().startswith(begin)


def test_an_unknown_format_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"got 'a\.docx'; expected .*png"):
        save_figure(Figure(), tmp_path / "new" / "a.docx")
    assert list(tmp_path.iterdir()) == []


def test_strategies_without_a_colour_of_their_own_take_one_that_no_other_in_the_picture_has() -> None:
    names = ["mine", "default", "yours", "gpr"]
    colours = strategy_colours(names)
    assert colours["default"] == STRATEGY_COLOURS["default"]
    assert len(set(colours.values())) == 4
    many = strategy_colours([f"s{k}" for k in range(30)])
    assert len(many) == 30
    assert len(set(many.values())) == len(STRATEGY_COLOURS)


@pytest.mark.parametrize("kind", ["protan", "deutan", "tritan"])
def test_colours_of_strategies_differ_for_colour_blind_readers(kind: str) -> None:
    seen = {name: lab(COLOUR_BLINDNESS[kind] @ linear(colour)) for name, colour in STRATEGY_COLOURS.items()}
    shown_together = ("default", "oracle", "gpr", "nr", "svmr", "pf")
    distances = {
        pair: float(np.linalg.norm(seen[pair[0]] - seen[pair[1]])) for pair in itertools.combinations(shown_together, 2)
    }
    assert min(distances.values()) > NOTICED, min(distances, key=lambda pair: distances[pair])


def test_a_picture_without_labels_has_no_legend_and_one_with_labels_has_each_once() -> None:
    figure = Figure()
    for axes in figure.subplots(1, 2):
        axes.plot([0, 1], label="same")
    explain(figure, ncols=1)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["same"]
    explain(empty := Figure(), ncols=1)
    assert empty.legends == []


@pytest.mark.parametrize(
    "draw",
    [session_figure, lambda log: save_session_plot(log, "s.png"), lambda log: comparison_figure([log, log])],
    ids=["session", "saved", "comparison"],
)
def test_the_path_of_a_log_is_no_record_to_draw(draw: Callable[[Any], object]) -> None:
    with pytest.raises(InvalidValueError, match=r"Read the log first: isiw\.read_session"):
        draw("P01.mcap")


def linear(colour: str) -> FloatArray:
    parts = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def lab(rgb: FloatArray) -> FloatArray:
    """CIELAB of linear sRGB, in which a distance of 2 is just noticed side by side."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    ratio = to_xyz @ np.clip(rgb, 0, 1) / np.array([0.9505, 1.0, 1.089])
    x, y, z = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])
