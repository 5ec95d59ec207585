"""Pictures that compare: strategies in a study or a replay, the windows of sessions, and a lab's people with others."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from isiw.checks import choice
from isiw.errors import InvalidValueError
from isiw.lazy import pd
from isiw.log.record import SessionRecord, require_records
from isiw.plots.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    ORANGE,
    RED,
    edge_intervals,
    explain,
    saying,
    session_name,
    strategy_colours,
    tidied,
)
from isiw.sentences import TOO_LITTLE
from isiw.summary import in_short, words_of
from isiw.types import FloatArray

StudyPicture: TypeAlias = Literal["f1", "frontier", "coverage", "latency"]

_MARKERS = "osD^vPX"
_COLUMNS = 4
_SE_OF_BAND = 1.96
_MOST_IN_A_PANEL = 3
"""More strategies than these have panels of their own, or their bands hide each other."""
_DASHED = (0, (4, 2))


def study_figure(table: pd.DataFrame, picture: StudyPicture = "f1") -> Figure:
    """A study as a figure, a panel a cohort; of F1 with many strategies a panel for each of them.

    Args:
        table: as `isiw.studies.summarise` returns it.
        picture: one of `STUDY_PICTURES`.

    Raises:
        InvalidValueError: no such picture.
    """
    draw_panel = STUDY_PICTURES[choice("the picture of a study", picture, STUDY_PICTURES)]
    played = table[table["people"] > 0]
    colours = strategy_colours(sorted(played["strategy"].unique()))
    cohorts = played["cohort"].unique()
    apart = picture == "f1" and len(colours) > _MOST_IN_A_PANEL
    columns = len(colours) if apart else min(_COLUMNS, max(1, len(cohorts)))
    lines = max(1, len(cohorts) if apart else -(-len(cohorts) // columns))
    width, height = (1.8, 1.8) if apart else (3.2, 2.7)
    figure = Figure(figsize=(0.8 + width * columns, 1.2 + height * lines), layout="constrained")
    panels = figure.subplots(lines, columns, squeeze=False, sharey=True)
    for axes in panels.flat[len(cohorts) * (len(colours) if apart else 1) :]:
        axes.set_visible(False)
    for number, cohort in enumerate(cohorts):
        of_cohort = played[played["cohort"] == cohort].sort_values("trial")
        curves = {name: of_cohort[of_cohort["strategy"] == name] for name in colours}
        if apart:
            _draw_apart(panels[number], cohort, curves, colours)
        else:
            axes = panels.flat[number]
            draw_panel(axes, curves, colours)
            _title(axes, cohort)
    explain(figure, ncols=2 * columns)
    return figure


def _title(axes: Axes, title: str) -> None:
    tidied(axes)
    axes.set_title(title, fontsize=10, loc="left", color=INK)
    axes.set_xlim(left=0)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))


_Curves: TypeAlias = Mapping[str, pd.DataFrame]
_Colours: TypeAlias = Mapping[str, str]


def _draw_f1(axes: Axes, curves: _Curves, colours: _Colours) -> None:
    markers = itertools.cycle(_MARKERS)
    for name, curve in curves.items():
        draw_curve(axes, curve, name, colours[name], next(markers))
    _name_f1_axes(axes)


def _draw_apart(row: Sequence[Axes], cohort: str, curves: _Curves, colours: _Colours) -> None:
    """A panel a strategy: its mean with its band, before the means of the others."""
    for axes, name in zip(row, curves, strict=True):
        for curve in (_from_first_estimate(curve) for other, curve in curves.items() if other != name):
            axes.plot(curve["trial"], curve["f1"], color=FAINT, lw=0.8, label="the other strategies")
        draw_curve(axes, curves[name], name, colours[name])
        _name_f1_axes(axes)
        _title(axes, f"{cohort}: {name}" if axes is row[0] else name)
        axes.label_outer()


def _name_f1_axes(axes: Axes) -> None:
    axes.set(ylim=(0, 1), xlabel="trials", ylabel="mean F1, 95 % band")


def draw_curve(axes: Axes, curve: pd.DataFrame, name: str, colour: str, marker: str = "o") -> None:
    """Mean F1 by trial with its 95 % band, drawn from a method's first answer on, and dotted what it has before."""
    curve = _from_first_estimate(curve)
    axes.fill_between(curve["trial"], *_band(curve), color=colour, alpha=0.15, lw=0)
    axes.plot(curve["trial"], curve["f1"], color=colour, marker=marker, ms=4, lw=1.5, label=name)
    for at_start in curve.loc[curve["trial"] == 0, "f1"]:
        axes.axhline(at_start, color=colour, lw=0.8, ls=":")


def _band(curve: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    """The ends of the 95 % band, within 0 and 1: as they are given, or by the standard error of many people."""
    if "f1_low" in curve:
        return curve["f1_low"], curve["f1_high"]
    reach = _SE_OF_BAND * curve["f1_se"].fillna(0.0)
    return (curve["f1"] - reach).clip(lower=0.0), (curve["f1"] + reach).clip(upper=1.0)


def _from_first_estimate(curve: pd.DataFrame) -> pd.DataFrame:
    if "called_none" not in curve or curve["start_coverage"].notna().any():
        return curve
    found = curve["called_none"] < 1.0
    return curve[found.cummax()] if found.any() else curve


def _draw_frontier(axes: Axes, curves: _Curves, colours: _Colours) -> None:
    """Draw the stimuli that an F1 takes, if it is kept from then on, and that at which a strategy's rule stops it."""
    for name, whole in curves.items():
        curve = _from_first_estimate(whole)
        kept = np.minimum.accumulate(curve["f1"].to_numpy()[::-1])[::-1]
        axes.step(curve["delivered"], kept, where="post", color=colours[name], lw=1.5, label=name)
        last = curve.tail(1)
        axes.plot(last["end_delivered"], last["end_f1"], "o", ms=6, color=colours[name], mec=INK, clip_on=False)
    axes.plot([], [], "o", ms=6, color="none", mec=INK, label="where its rule stops it, or else at the end, on average")
    axes.set(ylim=(0, 1), xlabel="stimuli delivered", ylabel="mean F1 from there on")


def _draw_coverage(axes: Axes, curves: _Curves, colours: _Colours) -> None:
    axes.axhline(0.9, color=FAINT, lw=1.2, label="what 90 % intervals should have")
    if not any(curve["start_coverage"].notna().any() for curve in curves.values()):
        saying(axes, "no true edges, or no intervals")
    _draw_pair(axes, curves, colours, {"start_coverage": "start", "end_coverage": "end"})
    axes.set(ylim=(0, 1.02), xlabel="trials", ylabel="share of true edges inside")


def _draw_latency(axes: Axes, curves: _Curves, colours: _Colours) -> None:
    _draw_pair(axes, curves, colours, {"ask_ms": "ask", "tell_ms": "tell"})
    axes.set(yscale="log", xlabel="trials", ylabel="median time [ms]")


def _draw_pair(axes: Axes, curves: _Curves, colours: _Colours, columns: Mapping[str, str]) -> None:
    """Two columns of each strategy, the second dashed; if a method has neither, nothing."""
    for (column, meaning), style in zip(columns.items(), ("-", _DASHED), strict=True):
        axes.plot([], [], color=INK, ls=style, lw=1.5, label=meaning)
        for name, curve in curves.items():
            known = curve[curve[column].notna()]
            axes.plot(known["trial"], known[column], color=colours[name], ls=style, lw=1.5)
    for name, curve in curves.items():
        if curve[list(columns)].notna().any(axis=None):
            axes.plot([], [], color=colours[name], lw=4, label=name)


STUDY_PICTURES: Final[Mapping[StudyPicture, Callable[[Axes, _Curves, _Colours], None]]] = MappingProxyType(
    {"f1": _draw_f1, "frontier": _draw_frontier, "coverage": _draw_coverage, "latency": _draw_latency}
)
"""The pictures of a study by name, and what draws a panel of each."""


def replay_figure(curves: Mapping[str, FloatArray]) -> Figure:
    """F1 of each strategy by the number of stimuli: the median, and from the least to the largest over its seeds."""
    figure = Figure(figsize=(7.2, 3.8), layout="constrained")
    axes = figure.subplots()
    tidied(axes)
    colours = (BLUE, ORANGE, GREEN, RED, INK)
    for number, (name, scores) in enumerate(curves.items()):
        colour, trials = colours[number % len(colours)], np.arange(1, scores.shape[1] + 1)
        axes.fill_between(trials, scores.min(axis=0), scores.max(axis=0), color=colour, alpha=0.15, lw=0)
        axes.plot(trials, np.median(scores, axis=0), color=colour, lw=1.8, label=name)
    axes.set(ylim=(0, 1.02), xlabel="stimuli", ylabel="F1 against all trials")
    explain(figure, ncols=3)
    return figure


def comparison_figure(records: Sequence[SessionRecord], names: Sequence[str] | None = None) -> Figure:
    """Sessions below each other as a figure.

    Args:
        records: the sessions.
        names: what to call them; by default person and date.

    Raises:
        InvalidValueError: no sessions, no records of them, or ISIs that count from different events.
    """
    require_records(records)
    references = {record.header.space.reference for record in records}
    if len(references) != 1:
        raise InvalidValueError("a picture needs sessions whose ISIs count from one event", got=sorted(references))
    figure = Figure(figsize=(7.2, 1.5 + 0.45 * len(records)), layout="constrained")
    axes = figure.subplots()
    tidied(axes)
    for line, record in enumerate(records):
        _draw_session(axes, line, record)
    axes.set_yticks(range(len(records)), names or [session_name(record) for record in records])
    spaces = [record.header.space for record in records]
    isis_ms = (min(space.low_ms for space in spaces), max(space.high_ms for space in spaces))
    first = words_of(record.header.conditioning for record in records)
    axes.set(ylim=(len(records) - 0.4, -0.6), xlim=isis_ms, xlabel=first.isi_axis(spaces[0].reference))
    explain(figure, ncols=3, above=True)
    return figure


def _draw_session(axes: Axes, line: int, record: SessionRecord) -> None:
    last = record.found
    chance = "" if last is None or last.probability is None else f"P(window) = {last.probability:.2f}"
    if last is None or last.window is None:
        said = TOO_LITTLE if last is None else f"{in_short(last)} ({chance})" if chance else in_short(last)
        axes.annotate(said, (0.02, line), xycoords=("axes fraction", "data"), va="center", fontsize=8, color=FAINT)
        return
    for start_ms, end_ms in last.window.segments:
        axes.barh(line, end_ms - start_ms, left=start_ms, height=0.5, color=BLUE, alpha=0.3, label="window")
    space = record.header.space
    for edge, colour, pair in edge_intervals(last, space.low_ms, space.high_ms):
        label = f"90 % interval of its {edge}"
        axes.plot(pair, (line, line), color=colour, lw=4, solid_capstyle="butt", label=label)
    axes.annotate(
        chance, (1.01, line), xycoords=("axes fraction", "data"), va="center", fontsize=8, color=INK,
        annotation_clip=False,
    )  # fmt: skip


def prior_figure(table: pd.DataFrame) -> Figure:
    """A lab's prior as a figure: a panel a quantity."""
    groups = list(table.groupby("quantity", sort=False))
    lines = -(-len(groups) // _COLUMNS)
    figure = Figure(figsize=(2.8 * _COLUMNS, 0.5 + 1.9 * lines), layout="constrained")
    panels = list(figure.subplots(lines, _COLUMNS, squeeze=False).flat)
    for axes, (name, curve) in zip(panels, groups, strict=False):
        axes.fill_between(curve["value"], curve["built_in"], color=FAINT, alpha=0.4, lw=0, label="built-in")
        axes.plot(curve["value"], curve["lab"], color=BLUE, lw=1.5, label="this lab")
        if curve["logarithmic"].iloc[0]:
            axes.set_xscale("log")
        axes.set(ylim=(0, None), yticks=[])
        tidied(axes)
        axes.set_title(str(name), fontsize=9, loc="left", color=INK)
    for axes in panels[len(groups) :]:
        axes.set_visible(False)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8, frameon=False
    )
    return figure
