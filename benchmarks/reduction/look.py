"""The one look of all figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.plots.style import BLUE, STRATEGY_COLOURS, tidied

__all__ = ["COLOURS", "NAMES", "OURS", "THEIRS", "beside", "panels"]

OURS: Final = BLUE
THEIRS: Final = "#c9c3b8"

COLOURS: Final = STRATEGY_COLOURS
"""The colour of each method, as in every picture of isiw."""

NAMES: Final = {
    "nr": "NR",
    "svmr": "SVMR",
    "gpr": "GPR",
    "pf": "PF",
    "default": "default",
    "incremental": "conventional",
}


def panels(lines: int, columns: int, width: float = 3.6, height: float = 2.7, **options: Any) -> tuple[Figure, Any]:
    """A figure and its axes, shape (lines, columns).

    Args:
        lines: how many rows of panels.
        columns: how many columns.
        width: of one panel [inch].
        height: of one panel [inch].
        **options: of `Figure.subplots`.
    """
    figure = Figure(figsize=(width * columns, height * lines), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False, **options)
    tidied(*axes.flat)
    return figure, axes


def beside(
    axes: Axes, labels: Sequence[str], theirs: Sequence[float], ours: Sequence[float], error: Sequence[float]
) -> None:
    """Pairs of bars: the dissertation's beside ours.

    Args:
        axes: where to draw.
        labels: of the pairs.
        theirs: the dissertation's numbers; NaN draws none.
        ours: ours,
        error: and half the length of their error bars.
    """
    x = np.arange(len(labels))
    axes.bar(x - 0.2, theirs, 0.38, color=THEIRS, label="dissertation")
    axes.bar(x + 0.2, ours, 0.38, yerr=error, color=OURS, label="here", error_kw={"lw": 0.8})
    axes.set_xticks(x, labels, fontsize=8)
