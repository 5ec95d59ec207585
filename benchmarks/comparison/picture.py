"""The picture of the comparison: F1 by stimulus of the rows that matter, and what each needs against even ISIs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.comparison.rows import EVEN, GUESS
from benchmarks.comparison.words import CRITERION, MAIN, NAMES, PEOPLE
from isiw.plots.comparison import draw_curve
from isiw.plots.style import INK, explain, strategy_colours, tidied
from isiw.studies import summarise

MARKERS: Final = "osD^vPX"


def picture(rows: Mapping[str, pd.DataFrame], tables: Mapping[str, pd.DataFrame]) -> Figure:
    """A panel of F1 a cohort, and one of the ratios with `MAIN`.

    Args:
        rows: by cohort, as `words.compared_rows` gives them.
        tables: by cohort the table of these rows.
    """
    figure = Figure(figsize=(3.6 * (len(rows) + 1), 4.4), layout="constrained")
    panels = list(np.atleast_1d(figure.subplots(1, len(rows) + 1)))
    names = [name for name in NAMES if name != GUESS and any(name in set(each["strategy"]) for each in rows.values())]
    colours = strategy_colours(names)
    for axes, (cohort, own) in zip(panels, rows.items(), strict=False):
        _draw_f1(axes, own, colours)
        axes.set_title(
            f"{own['person'].nunique()}: {PEOPLE[cohort]}".replace("`", ""), fontsize=9, loc="left", color=INK
        )
    panels[0].set_ylabel("mean F1 of the reported window, 95 % band", fontsize=9)
    _draw_ratios(panels[-1], tables[MAIN], colours)
    explain(figure, ncols=4)
    return figure


def _plain(name: str) -> str:
    return NAMES[name].replace("*", "")


def _draw_f1(axes: Axes, rows: pd.DataFrame, colours: Mapping[str, str]) -> None:
    tidied(axes)
    means = summarise(rows)
    for (name, colour), marker in zip(colours.items(), MARKERS, strict=False):
        curve = means[(means["strategy"] == name) & (means["trial"] > 0)]
        if len(curve):
            draw_curve(axes, curve[curve["f1"] > 0], _plain(name), colour, marker)
    guess = means.loc[means["strategy"] == GUESS, "f1"]
    if len(guess):
        axes.axhline(guess.iloc[0], color=INK, lw=1, ls=(0, (4, 3)), label=_plain(GUESS))
    axes.set(xlim=(0, None), ylim=(0, 1), yticks=np.linspace(0, 1, 6))
    axes.set_xlabel("stimuli delivered", fontsize=9)


def _draw_ratios(axes: Axes, table: pd.DataFrame, colours: Mapping[str, str]) -> None:
    """Stimuli to a lasting F1, those of even ISIs being 1; an arrow where one of both does not reach it."""
    tidied(axes)
    lines = table.set_index("strategy")
    shown = [name for name in reversed(list(colours)) if name in lines.index and name != EVEN]
    for place, name in enumerate(shown):
        line, colour = lines.loc[name], colours[name]
        ratio, bound = line[f"ratio_{CRITERION}"], line[f"bound_{CRITERION}"]
        if bound == "unknown":
            axes.annotate("not reached", (0.05, place), fontsize=8, color=INK, va="center")
            continue
        ends = [min(line[f"{end}_{CRITERION}"], 3.0) for end in ("low", "high")]
        if not bound:
            axes.plot(ends, (place, place), color=colour, lw=2)
        axes.plot(ratio, place, {"": "o", "below": "<", "above": ">"}[bound], color=colour, ms=7)
    axes.axvline(1.0, color=INK, lw=1, ls=(0, (4, 3)))
    axes.set_yticks(range(len(shown)), shown, fontsize=8)
    axes.set(xlim=(0, 3), ylim=(-0.6, len(shown) - 0.4))
    axes.set_xlabel(f"stimuli to a lasting F1 of {CRITERION}, even ISIs = 1", fontsize=9)
    axes.set_title(MAIN, fontsize=9, loc="left", color=INK)
