"""Pictures inside a page: SVG whose colours are the page's, so that they turn with it from light to dark."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import matplotlib as mpl
from matplotlib.figure import Figure

from isiw.plots.style import BLUE, FAINT, GREEN, INK, ORANGE, RED

PAGE_COLOURS: Final[Mapping[str, str]] = MappingProxyType(
    {
        INK: "ink",
        FAINT: "faint",
        BLUE: "blue",
        ORANGE: "orange",
        GREEN: "green",
        RED: "red",
        "#ffffff": "paper",
        "#000000": "ink",
    }
)
"""By what is drawn, the name of the page's own colour (the CSS variable `--ink` and so on)."""


def inline_svg(figure: Figure, name: str) -> str:
    """A figure as an SVG element: text stays text, the background is the page's, and no name clashes with another's."""
    picture = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(picture, format="svg", transparent=True, metadata={"Date": None})
    text = picture.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"(<(?:g|svg|defs)\b[^>]*?) id=\"[^\"]*\"", r"\1", text)
    text = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", text)
    for drawn, named in PAGE_COLOURS.items():
        text = text.replace(drawn, f"var(--{named})")
    return text
