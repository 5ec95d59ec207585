"""The picture of a session: profile with band, trials, window with intervals, and how the edges developed.

Everything is drawn with matplotlib's object interface, so no display is needed and no global state is touched.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from isiw.log.reader import SessionRecord
from isiw.log.schema import EstimateRecord
from isiw.plots.style import (
    BLUE,
    EDGES,
    FAINT,
    INK,
    RED,
    TRIAL_AXIS,
    edge_intervals,
    explain,
    save_figure,
    saying,
    tidied,
)
from isiw.sentences import titled
from isiw.trials import Trial
from isiw.types import FloatArray
from isiw.window import Window

SMALLEST_UV = 1.0


def save_session_plot(
    record: SessionRecord, path: str | Path, *, truth: Window | None = None, overwrite: bool = False
) -> Path:
    """Draw a session into a file; its suffix chooses the format.

    Args:
        record: the session.
        path: where to, such as `session.png` or `session.pdf`.
        truth: the true window, where the person is simulated.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: a format that matplotlib does not know, or a file that is not to be replaced.
    """
    return save_figure(session_figure(record, truth=truth), path, overwrite=overwrite)


def session_figure(record: SessionRecord, *, truth: Window | None = None) -> Figure:
    """A session as a figure.

    Args:
        record: the session.
        truth: the true window, where the person is simulated.
    """
    figure = Figure(figsize=(7.2, 6.8), layout="constrained")
    profile, edges, chance = figure.subplots(3, 1, height_ratios=(3.2, 1.5, 0.9))
    tidied(profile, edges, chance)
    edges.sharex(chance)
    edges.tick_params(labelbottom=False)
    last = record.found
    _draw_window(profile, last, truth)
    _draw_profile(profile, last)
    _draw_trials(profile, record)
    _finish_profile(profile, record)
    _draw_edges(edges, record, truth)
    _draw_probability(chance, record)
    if last is None:
        _say_what_is_missing(profile, edges, chance, record)
    explain(figure, ncols=3)
    figure.align_ylabels((profile, edges, chance))
    return figure


def _say_what_is_missing(profile: Axes, edges: Axes, chance: Axes, record: SessionRecord) -> None:
    told = len(record.table.told)
    saying(profile, f"too few trials count ({told}): no belief is drawn" if told else "no trial counts")
    for axes in (edges, chance):
        saying(axes, "no estimate that rests on trials")


def _draw_window(axes: Axes, estimate: EstimateRecord | None, truth: Window | None) -> None:
    segments = estimate.window.segments if estimate and estimate.window else ()
    for number, (start, end) in enumerate(segments):
        axes.axvspan(start, end, color=BLUE, alpha=0.10, lw=0, label="window" if number == 0 else None)
    if estimate and segments:
        space = (min(estimate.grid_ms, default=segments[0][0]), max(estimate.grid_ms, default=segments[-1][1]))
        for height, (_, colour, pair) in zip((1.02, 1.0), edge_intervals(estimate, *space), strict=False):
            axes.plot(
                pair, (height, height), color=colour, lw=4, solid_capstyle="butt",
                transform=axes.get_xaxis_transform(), clip_on=False, in_layout=False,
            )  # fmt: skip
    for number, edge in enumerate(itertools.chain(*(truth.segments if truth else ()))):
        axes.axvline(edge, color=INK, lw=1, ls=(0, (4, 3)), label="true window (simulated)" if number == 0 else None)


def _draw_profile(axes: Axes, estimate: EstimateRecord | None) -> None:
    if estimate is None or not estimate.grid_ms:
        return
    low_mv, high_mv = estimate.predicted_low_mv, estimate.predicted_high_mv
    if len(low_mv) == len(high_mv) == len(estimate.grid_ms):
        label = "prediction: 90 % of trials lie here"
        axes.fill_between(estimate.grid_ms, _uv(low_mv), _uv(high_mv), color=FAINT, alpha=0.18, lw=0, label=label)
    low_uv, high_uv, label = _uv(estimate.band_low_mv), _uv(estimate.band_high_mv), "90 % band of the expected MEP"
    axes.fill_between(estimate.grid_ms, low_uv, high_uv, color=BLUE, alpha=0.3, lw=0, label=label)
    axes.plot(estimate.grid_ms, _uv(estimate.profile_mv), color=BLUE, lw=1.8, label="expected MEP")


def _draw_trials(axes: Axes, record: SessionRecord) -> None:
    told = [trial for trial in record.table if trial.told]
    excluded = [trial for trial in record.table if trial.excluded]
    mistrials = [trial for trial in record.table if trial.reason is not None]
    if told:
        axes.plot(*_points(told), "o", ms=4.5, color=INK, mec="white", mew=0.5, label="trial", zorder=3)
    if excluded:
        axes.plot(*_points(excluded), "o", ms=4.5, mfc="none", mec=FAINT, label="excluded", zorder=3)
    if mistrials:
        _draw_mistrials(axes, mistrials)


def _draw_mistrials(axes: Axes, mistrials: Sequence[Trial]) -> None:
    """Where they happened; at the lower edge where no MEP was measured, at the ISI asked where none was realised."""
    places = [(trial.commanded_isi_ms if trial.isi_ms is None else trial.isi_ms, trial.mep_mv) for trial in mistrials]
    measured = [(isi_ms, mep_mv) for isi_ms, mep_mv in places if isi_ms is not None and mep_mv is not None]
    isis_ms, meps_uv = [isi_ms for isi_ms, _ in measured], _uv([mep_mv for _, mep_mv in measured])
    axes.plot(isis_ms, meps_uv, "x", ms=5, color=RED, label="mistrial", zorder=3)
    lost = [isi_ms for isi_ms, mep_mv in places if isi_ms is not None and mep_mv is None]
    axes.plot(lost, [0.02] * len(lost), "x", ms=5, color=RED, transform=axes.get_xaxis_transform(), zorder=3)


def _finish_profile(axes: Axes, record: SessionRecord) -> None:
    space = record.header.space
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(space.low_ms, space.high_ms)
    axes.set_xlabel(record.header.stimulus.isi_axis(space.reference), fontsize=9)
    axes.set_ylabel("MEP [µV]", fontsize=9)
    axes.set_title(f"{_title(record)} after {len(record.table)} trials", fontsize=11, loc="left", color=INK, pad=12)


def _title(record: SessionRecord) -> str:
    if record.is_silent:
        return "No MEP was seen"
    if not record.rests_on_data:
        return f"Too little was measured (pairs that count: {record.pairs})"
    if record.found is None:
        return "No estimate"
    since = ", before trials were judged anew," if record.is_judged_since else ""
    return f"{titled(record.found)}{since}"


def _draw_edges(axes: Axes, record: SessionRecord, truth: Window | None) -> None:
    estimates, space = record.estimates if record.rests_on_data else (), record.header.space
    trials = [estimate.trial for estimate in estimates]
    for name, colour in EDGES.items():
        low, middle, high = (
            np.clip(_column(estimates, f"{name}_{part}ms"), space.low_ms, space.high_ms)
            for part in ("low_", "", "high_")
        )
        if trials:
            axes.fill_between(trials, low, high, color=colour, alpha=0.22, lw=0)
            axes.plot(trials, middle, color=colour, lw=1.6, label=f"{name} of the window, with 90 % interval")
    for edge in (truth.start_ms, truth.end_ms) if truth else ():
        axes.axhline(edge, color=INK, lw=0.8, ls=(0, (4, 3)))
    axes.set_ylim(space.low_ms, space.high_ms)
    axes.set_ylabel("edges [ms]", fontsize=9)


def _draw_probability(axes: Axes, record: SessionRecord) -> None:
    estimates = record.estimates if record.rests_on_data else ()
    axes.axhline(0.5, color=FAINT, lw=0.8, ls=":")
    axes.plot([e.trial for e in estimates], _column(estimates, "probability"), color=INK, lw=1.6)
    lost = [trial.index for trial in record.table if trial.reason is not None]
    axes.plot(lost, [0.08] * len(lost), "x", ms=4, color=RED)
    numbers = [trial.index for trial in record.table] + [estimate.trial for estimate in record.estimates]
    axes.set_xlim(-0.5, max(numbers, default=0) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(0, 1.03)
    axes.set_yticks((0, 0.5, 1))
    axes.set_ylabel("P(window)", fontsize=9)
    axes.set_xlabel(TRIAL_AXIS, fontsize=9)


def _column(estimates: Sequence[EstimateRecord], name: str) -> FloatArray:
    """One figure by trial; NaN where a method does not have it."""
    return np.asarray([np.nan if (v := getattr(e, name)) is None else v for e in estimates], dtype=np.float64)


def _points(trials: Sequence[Trial]) -> tuple[list[float], FloatArray]:
    placed = [t for t in trials if t.isi_ms is not None and t.mep_mv is not None]
    return [t.isi_ms or 0.0 for t in placed], _uv([t.mep_mv or 0.0 for t in placed])


def _uv(amplitude_mv: Sequence[float]) -> FloatArray:
    """Amplitudes for the logarithmic axis [µV], shape as given; what is below the smallest is drawn there."""
    return np.maximum(1e3 * np.asarray(amplitude_mv, dtype=np.float64), SMALLEST_UV)
