"""What all pictures have in common: colours, axes, and how they are written.

Everything is drawn with matplotlib's object interface, so no display is needed and no global state is touched.
"""

from __future__ import annotations

import io
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.errors import InvalidValueError
from isiw.log.outputs import write_output

__all__ = ["BLUE", "FAINT", "GREEN", "INK", "ORANGE", "RED", "save_figure", "tidied"]

INK, FAINT, BLUE, ORANGE, GREEN, RED = "#222222", "#8a8a8a", "#0072b2", "#e69f00", "#009e73", "#d55e00"
"""Colours that remain distinct for colour-blind readers (Okabe and Ito)."""


def tidied(*panels: Axes) -> None:
    """Give panels the look that all have."""
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8, color=FAINT)


def save_figure(figure: Figure, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a figure into a file, whose folder is made where it is missing; the suffix chooses the format.

    Args:
        figure: the figure.
        path: the file.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: a format that matplotlib does not know, or a file that is not to be replaced.
    """
    target = Path(path)
    known = figure.canvas.get_supported_filetypes()
    suffix = target.suffix.removeprefix(".").lower()
    if suffix not in known:
        raise InvalidValueError("the picture's format is unknown", got=target.name, expected=", ".join(sorted(known)))
    picture = io.BytesIO()
    figure.savefig(picture, dpi=200, format=suffix)
    return write_output(target, picture.getvalue(), overwrite=overwrite)
