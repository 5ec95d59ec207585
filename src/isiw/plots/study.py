"""The picture of a study: F1 by trial, a panel a cohort."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.plots.style import BLUE, GREEN, INK, ORANGE, RED, save_figure, tidied

__all__ = ["save_study_plot", "study_figure"]

_COLOURS = (BLUE, ORANGE, GREEN, RED, INK, "#cc79a7", "#56b4e9", "#b8a000")
_MARKERS = "osD^vPX"
_COLUMNS = 4


def save_study_plot(table: pd.DataFrame, path: str | Path, *, overwrite: bool = False) -> Path:
    """Draw a study into a file; its suffix chooses the format.

    Args:
        table: as `isiw.studies.summarise` returns it.
        path: where to.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: a format that matplotlib does not know, or a file that is not to be replaced.
    """
    return save_figure(study_figure(table), path, overwrite=overwrite)


def study_figure(table: pd.DataFrame) -> Figure:
    """A study as a figure: mean F1 and its standard error by trial, a panel a cohort."""
    played = table[table["people"] > 0]
    cohorts, strategies = list(played["cohort"].unique()), sorted(played["strategy"].unique())
    columns = min(_COLUMNS, max(1, len(cohorts)))
    lines = max(1, -(-len(cohorts) // columns))
    figure = Figure(figsize=(0.8 + 3.2 * columns, 0.6 + 2.7 * lines), layout="constrained")
    panels = list(figure.subplots(lines, columns, squeeze=False, sharey=True).flat)
    for axes, cohort in zip(panels, cohorts, strict=False):
        _draw_cohort(axes, played[played["cohort"] == cohort], strategies)
        axes.set_title(cohort, fontsize=10, loc="left", color=INK)
    for axes in panels[len(cohorts) :]:
        axes.set_visible(False)
    if strategies:
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8, frameon=False)
    return figure


def _draw_cohort(axes: Axes, table: pd.DataFrame, strategies: list[str]) -> None:
    for number, strategy in enumerate(strategies):
        curve = table[table["strategy"] == strategy]
        colour, marker = _COLOURS[number % len(_COLOURS)], _MARKERS[number % len(_MARKERS)]
        axes.errorbar(
            curve["trial"], curve["f1"], curve["f1_se"], label=strategy, color=colour, marker=marker, ms=4, lw=1.5
        )
    tidied(axes)
    axes.set_xlim(left=0)
    axes.set_ylim(0, 1)
    axes.set_xlabel("trials", fontsize=9)
    axes.set_ylabel("mean F1 ± SE", fontsize=9)
