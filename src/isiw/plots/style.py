"""The common parts of all pictures: colours, axes, and how they are written, also into a page.

Everything is drawn with matplotlib's object interface, so no display is needed and no global state is touched.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.errors import InvalidValueError
from isiw.figures import Estimate
from isiw.files import write_output
from isiw.log.record import SessionRecord
from isiw.text.sanitize import one_line
from isiw.window import Interval

INK, FAINT, BLUE, ORANGE, GREEN, RED = "#222222", "#8a8a8a", "#0072b2", "#e69f00", "#009e73", "#d55e00"
_PINK, _SKY, _OLIVE, _BROWN = "#cc79a7", "#56b4e9", "#8f8a00", "#7a4a1f"
"""Colours that remain distinct for colour-blind readers; all but the last two are those of Okabe and Ito."""

STRATEGY_COLOURS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "default": BLUE,
        "oracle": INK,
        "gpr": ORANGE,
        "nr": GREEN,
        "svmr": RED,
        "pf": _PINK,
        "particles-mi": _SKY,
        "incremental": FAINT,
        "even": _OLIVE,
        "random": _BROWN,
    }
)
"""The colour that a strategy has in every picture."""

EDGES: Final[Mapping[str, str]] = MappingProxyType({"start": GREEN, "end": ORANGE})
"""The colours of a window's edges."""

_LONGEST_CODE: Final = 24

TRIAL_AXIS: Final = "trial (from 0, as in the log)"

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

_DARK_PAPER, _DARK_INK = "#15181b", "#e6e8ea"
_DARK = {
    "#ffffff": _DARK_PAPER,
    INK: _DARK_INK,
    "#000000": _DARK_INK,
    FAINT: "#9ba3aa",
    BLUE: "#2a8ad4",
    _BROWN: "#b98352",
}
_DARK_RULES = [
    f'[style*="{part}: {light}"] {{ {part}: {dark} !important }}'
    for light, dark in _DARK.items()
    for part in ("fill", "stroke")
]
_DARK_STYLE = (
    f"<style>@media (prefers-color-scheme: dark) {{ svg {{ fill: {_DARK_INK} }} {' '.join(_DARK_RULES)} }}</style>"
)
"""Gives an SVG file a dark scheme, which viewers choose by themselves; a page has colours of its own."""


def strategy_colours(names: Sequence[str]) -> dict[str, str]:
    """A colour for each strategy: its own where it has one, otherwise one that no other of them has."""
    free = [colour for name, colour in STRATEGY_COLOURS.items() if name not in names] or list(STRATEGY_COLOURS.values())
    others = [name for name in names if name not in STRATEGY_COLOURS]
    given = {name: free[number % len(free)] for number, name in enumerate(others)}
    return {name: STRATEGY_COLOURS.get(name) or given[name] for name in names}


def edge_intervals(estimate: Estimate, low_ms: float, high_ms: float) -> list[tuple[str, str, Interval]]:
    """The 90 % intervals of a window's edges, clipped to a range: name, colour and ends [ms] of each that is known."""
    ends = zip(EDGES.items(), (estimate.start, estimate.end), strict=True)
    return [(name, colour, edge.within(low_ms, high_ms)) for (name, colour), edge in ends if edge.is_known]


def session_name(record: SessionRecord) -> str:
    """Whose session it is and of which day, as matplotlib writes it whatever is in it."""
    code = one_line(record.header.subject) or "unnamed"
    code = code if len(code) <= _LONGEST_CODE else f"{code[: _LONGEST_CODE - 1]}…"
    day = f", {record.begun[:10]} (UTC)" if record.begun else ""
    return f"{code}{day}".replace("$", r"\$")


def tidied(*panels: Axes) -> None:
    """Give panels the look that all have."""
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8, color=FAINT)
        for axis in (axes.xaxis, axes.yaxis):
            axis.label.set_fontsize(9)


def explain(figure: Figure, ncols: int, *, above: bool = False, note: str | None = None) -> None:
    """Give a figure one legend, outside its panels, that has each label once, and a note; none without a label."""
    labelled = [axes.get_legend_handles_labels() for axes in figure.axes]
    once = {label: handle for handles, labels in labelled for handle, label in zip(handles, labels, strict=True)}
    if once:
        loc: Literal["outside upper left", "outside lower center"] = (
            "outside upper left" if above else "outside lower center"
        )
        figure.legend(
            list(once.values()), list(once), loc=loc, ncols=ncols, fontsize=7.5, frameon=False,
            title=note, title_fontsize=7.5, alignment="left",
        )  # fmt: skip


def saying(axes: Axes, text: str) -> None:
    """Say in the middle of a panel why nothing is drawn there."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=9, color=FAINT)


def save_figure(figure: Figure, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a figure into a file, whose folder is made if it is missing; the suffix chooses the format.

    Args:
        figure: the figure.
        path: where to, such as `session.png` or `session.pdf`.
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
    with mpl.rc_context({"svg.hashsalt": "isiw"}):  # so that the same picture is the same file
        figure.savefig(picture, dpi=200, format=suffix, metadata={"Date": None} if suffix == "svg" else None)
    data = picture.getvalue()
    if suffix == "svg":
        data = data.replace(b"</metadata>", f"</metadata>{_DARK_STYLE}".encode(), 1)
    return write_output(target, data, overwrite=overwrite)


def inline_svg(figure: Figure, name: str) -> str:
    """A figure as an SVG element: text stays text, the background is the page's, and no name clashes with another's."""
    picture = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(picture, format="svg", transparent=True, metadata={"Date": None})
    text = picture.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"(<(?:g|svg|defs)\b[^>]*?) id=\"[^\"]*\"", r"\1", text)
    text = re.sub(r"(<text style=\")font: ([\d.]+)px [^;\"]*", r"\1font-size: \2px", text)
    for drawn, named in PAGE_COLOURS.items():
        text = text.replace(drawn, f"var(--{named})")
    return text
