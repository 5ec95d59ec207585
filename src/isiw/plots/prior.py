"""The picture of a lab's prior: what its people are like, beside people in general."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.lazy import pd
from isiw.plots.style import BLUE, FAINT, INK, save_figure, tidied

_COLUMNS = 4


def save_prior_plot(table: pd.DataFrame, path: str | Path, *, overwrite: bool = False) -> Path:
    """Draw a lab's prior into a file; its suffix chooses the format.

    Args:
        table: as `isiw.priors.densities` returns it.
        path: where to.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: a format that matplotlib does not know, or a file that is not to be replaced.
    """
    return save_figure(prior_figure(table), path, overwrite=overwrite)


def prior_figure(table: pd.DataFrame) -> Figure:
    """A lab's prior as a figure: a panel a quantity."""
    groups = list(table.groupby("quantity", sort=False))
    lines = -(-len(groups) // _COLUMNS)
    figure = Figure(figsize=(2.8 * _COLUMNS, 0.5 + 1.9 * lines), layout="constrained")
    panels = list(figure.subplots(lines, _COLUMNS, squeeze=False).flat)
    for axes, (name, curve) in zip(panels, groups, strict=False):
        _draw(axes, curve)
        axes.set_title(str(name), fontsize=9, loc="left", color=INK)
    for axes in panels[len(groups) :]:
        axes.set_visible(False)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8, frameon=False
    )
    return figure


def _draw(axes: Axes, curve: pd.DataFrame) -> None:
    axes.fill_between(curve["value"], curve["built_in"], color=FAINT, alpha=0.4, lw=0, label="built-in")
    axes.plot(curve["value"], curve["lab"], color=BLUE, lw=1.5, label="this lab")
    if curve["logarithmic"].iloc[0]:
        axes.set_xscale("log")
    axes.set_ylim(bottom=0)
    axes.set_yticks([])
    tidied(axes)
