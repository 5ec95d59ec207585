"""Pictures that compare: the windows of several sessions, and a lab's people beside people in general."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.errors import InvalidValueError
from isiw.lazy import pd
from isiw.log.reader import SessionRecord
from isiw.plots.style import BLUE, FAINT, INK, edge_intervals, explain, session_name, tidied
from isiw.sentences import TOO_LITTLE, in_short
from isiw.text.stimuli import words_of


def comparison_figure(records: Sequence[SessionRecord], names: Sequence[str] | None = None) -> Figure:
    """Sessions below each other as a figure.

    Args:
        records: the sessions.
        names: what to call them; by default person and date.

    Raises:
        InvalidValueError: no sessions, or ISIs that count from different events.
    """
    references = {record.header.space.reference for record in records}
    if len(references) != 1:
        raise InvalidValueError("a picture needs sessions whose ISIs count from one event", got=sorted(references))
    figure = Figure(figsize=(7.2, 1.5 + 0.45 * len(records)), layout="constrained")
    axes = figure.subplots()
    tidied(axes)
    for line, record in enumerate(records):
        _draw(axes, line, record)
    axes.set_yticks(range(len(records)), names or [session_name(record) for record in records])
    spaces = [record.header.space for record in records]
    isis_ms = (min(space.low_ms for space in spaces), max(space.high_ms for space in spaces))
    first = words_of(record.header.conditioning for record in records)
    axes.set(ylim=(len(records) - 0.4, -0.6), xlim=isis_ms, xlabel=first.isi_axis(spaces[0].reference))
    explain(figure, ncols=3, above=True)
    return figure


def _draw(axes: Axes, line: int, record: SessionRecord) -> None:
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


_COLUMNS = 4


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
