"""The picture of a session: profile with band, trials, window with intervals, and how the edges developed."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from isiw.log.record import SessionRecord, require_records
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
    session_name,
    tidied,
)
from isiw.summary import in_short, is_guess
from isiw.text.sanitize import counted
from isiw.trials import Trial
from isiw.types import FloatArray
from isiw.window import Window

SMALLEST_UV = 1.0

BELOW_THE_MEAN = "The expected MEP is a mean, which few large MEPs raise: most trials lie below it."

_EDGE, _ALONE = 0.02, 0.06
"""Shares of the range: the room beside it, so that points at its ends are whole, and the distance to TMS alone."""

_STYLES: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "trial": {"marker": "o", "ms": 4.5, "color": INK, "mec": "white", "mew": 0.5},
        "trial at another intensity": {"marker": "^", "ms": 5, "color": FAINT, "mec": "white", "mew": 0.5},
        "excluded": {"marker": "o", "ms": 4.5, "mfc": "none", "mec": FAINT},
        "mistrial": {"marker": "x", "ms": 5, "color": RED},
    }
)


def save_session_plot(
    record: SessionRecord, path: str | Path, *, truth: Window | None = None, overwrite: bool = False
) -> Path:
    """Draw a session into a file; its suffix chooses the format.

    Args:
        record: the session.
        path: where to, such as `session.png` or `session.pdf`.
        truth: the true window, if the person is simulated.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: no record of a session, a format that matplotlib does not know, or a file that is not to be
            replaced.
    """
    return save_figure(session_figure(record, truth=truth), path, overwrite=overwrite)


def session_figure(record: SessionRecord, *, truth: Window | None = None) -> Figure:
    """A session as a figure.

    Args:
        record: the session.
        truth: the true window, if the person is simulated.

    Raises:
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    record.require_open()
    figure = Figure(figsize=(7.2, 6.8), layout="constrained")
    profile, edges, chance = figure.subplots(3, 1, height_ratios=(3.2, 1.5, 0.9))
    tidied(profile, edges, chance)
    edges.sharex(chance)
    edges.tick_params(labelbottom=False)
    last = record.found
    figure.suptitle(session_name(record), x=0.01, ha="left", fontsize=9, color=INK)
    _draw_window(profile, last, truth)
    _draw_profile(profile, last)
    _draw_trials(profile, record)
    _finish_profile(profile, record)
    _draw_edges(edges, record, truth)
    _draw_probability(chance, record)
    if last is None:
        told = len(record.table.told)
        lacking = "realised ISIs are in doubt" if record.in_doubt else f"too few trials count ({told})"
        saying(profile, f"{lacking}: no estimate is drawn" if told else "no trial counts")
        for axes in (edges, chance):
            saying(axes, "no estimate that rests on trials")
    explain(figure, ncols=3, note=BELOW_THE_MEAN if last and last.grid_ms else None)
    figure.align_ylabels((profile, edges, chance))
    return figure


def _draw_window(axes: Axes, estimate: EstimateRecord | None, truth: Window | None) -> None:
    segments = estimate.window.segments if estimate and estimate.window else ()
    for start, end in segments:
        axes.axvspan(start, end, color=BLUE, alpha=0.10, lw=0, label="window")
    if estimate and segments:
        space = (min(estimate.grid_ms, default=segments[0][0]), max(estimate.grid_ms, default=segments[-1][1]))
        for height, (_, colour, pair) in zip((1.02, 1.0), edge_intervals(estimate, *space), strict=False):
            axes.plot(
                pair, (height, height), color=colour, lw=4, solid_capstyle="butt",
                transform=axes.get_xaxis_transform(), clip_on=False, in_layout=False,
            )  # fmt: skip
    for edge in itertools.chain(*(truth.segments if truth else ())):
        axes.axvline(edge, color=INK, lw=1, ls=(0, (4, 3)), label="true window (simulated)")


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
    """Where they happened; at the lower edge where no MEP was measured, at the ISI asked where none was realised."""
    alone_ms = _alone_ms(record)
    for kind, style in _STYLES.items():
        of_kind = [trial for trial in record.table if _kind(trial) == kind]
        trials = [(trial, ms) for trial in of_kind if (ms := _place_ms(trial, alone_ms)) is not None]
        seen = [(place_ms, trial.mep_mv) for trial, place_ms in trials if trial.mep_mv is not None]
        if seen:
            places_ms, meps_mv = zip(*seen, strict=True)
            axes.plot(places_ms, _uv(meps_mv), label=kind, zorder=3, ls="", **style)
        lost = [place_ms for trial, place_ms in trials if trial.mep_mv is None]
        if lost:
            axes.plot(lost, [0.02] * len(lost), label=None if seen else kind, zorder=3, ls="",
                      transform=axes.get_xaxis_transform(), **style)  # fmt: skip


def _kind(trial: Trial) -> str:
    """Of the styles; the profile is that at the usual intensity, which pulses at others need not fit."""
    if trial.reason is not None or trial.excluded:
        return "mistrial" if trial.reason is not None else "excluded"
    return "trial" if trial.intensity_pct_rmt is None else "trial at another intensity"


def _place_ms(trial: Trial, alone_ms: float) -> float | None:
    """Its ISI, or the strip of TMS alone; nowhere for a tap alone, and for an excluded trial without an MEP."""
    if trial.tap_alone or (trial.reason is None and trial.mep_mv is None):
        return None
    if trial.is_control and trial.isi_ms is None:
        return alone_ms
    return trial.commanded_isi_ms if trial.isi_ms is None else trial.isi_ms


def _finish_profile(axes: Axes, record: SessionRecord) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    _finish_isis(axes, record)
    axes.set(xlabel=record.header.stimulus.isi_axis(record.header.space.reference), ylabel="MEP [µV]")
    since = "; outdated: trials were judged since" if record.found and record.is_judged_since else ""
    title = f"{_found(record)} ({counted(len(record.table), 'trial')}{since})"
    axes.set_title(title, fontsize=11, loc="left", color=INK, pad=12)


def _finish_isis(axes: Axes, record: SessionRecord) -> None:
    """Room for whole points at the ends of the range, and beside it for TMS alone with its mean."""
    space = record.header.space
    low_ms, high_ms = _ends_ms(record)
    room_ms = _EDGE * (space.high_ms - space.low_ms)
    alone = [t for t in record.table.told if t.isi_ms is None and t.intensity_pct_rmt is None]
    meps_mv = [trial.mep_mv for trial in alone if trial.mep_mv is not None]
    if not any(trial.is_control and not trial.tap_alone for trial in record.table):
        axes.set_xlim(low_ms - room_ms, high_ms + room_ms)
        return
    alone_ms = _alone_ms(record)
    axes.set_xlim(2 * alone_ms - low_ms + room_ms, high_ms + room_ms)
    axes.axvline((alone_ms + low_ms) / 2, color=FAINT, lw=0.8)
    candidates_ms = MaxNLocator(8, steps=(1, 2, 5, 10)).tick_values(space.low_ms, space.high_ms)
    ticks_ms = [tick_ms for tick_ms in candidates_ms if low_ms <= tick_ms <= high_ms]
    axes.set_xticks([alone_ms, *ticks_ms], ["TMS\nalone", *(f"{tick_ms:g}" for tick_ms in ticks_ms)])
    if meps_mv:
        axes.axhline(_uv([float(np.mean(meps_mv))])[0], color=INK, lw=0.9, ls=":", label="mean of TMS alone")


def _ends_ms(record: SessionRecord) -> tuple[float, float]:
    """The range of ISIs, and what the trials that count add to it."""
    space = record.header.space
    isis_ms = [trial.isi_ms for trial in record.table.told if trial.isi_ms is not None]
    return min([space.low_ms, *isis_ms]), max([space.high_ms, *isis_ms])


def _alone_ms(record: SessionRecord) -> float:
    """Where on the axis of the ISIs TMS alone has its place."""
    space = record.header.space
    return _ends_ms(record)[0] - _ALONE * (space.high_ms - space.low_ms)


def _found(record: SessionRecord) -> str:
    if record.in_doubt:
        return "Realised ISIs are in doubt"
    if record.is_silent:
        return "No MEP was seen"
    if not record.rests_on_data:
        return f"Too little was measured: {counted(record.pairs, 'pair counts', 'pairs count')}"
    if (found := record.found) is None:
        return "No estimate"
    window = f"{'Undecided, perhaps' if is_guess(found) else 'Window'} {found.window}"
    return window if found.window else in_short(found).capitalize()


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
    axes.set(ylim=(space.low_ms, space.high_ms), ylabel="edges [ms]")


def _draw_probability(axes: Axes, record: SessionRecord) -> None:
    estimates = record.estimates if record.rests_on_data else ()
    axes.axhline(0.5, color=FAINT, lw=0.8, ls=":")
    axes.plot([e.trial for e in estimates], _column(estimates, "probability"), color=INK, lw=1.6)
    lost = [trial.index for trial in record.table if trial.reason is not None]
    axes.plot(lost, [0.08] * len(lost), "x", ms=4, color=RED)
    numbers = [trial.index for trial in record.table] + [estimate.trial for estimate in record.estimates]
    axes.set(xlim=(-0.5, max(numbers, default=0) + 0.5), xlabel=TRIAL_AXIS)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(yticks=(0, 0.5, 1), ylim=(0, 1.03), ylabel="P(window)")


def _column(estimates: Sequence[EstimateRecord], name: str) -> FloatArray:
    """One figure by trial; NaN if a method does not have it."""
    return np.asarray([np.nan if (v := getattr(e, name)) is None else v for e in estimates], dtype=np.float64)


def _uv(amplitude_mv: Sequence[float]) -> FloatArray:
    """Amplitudes for the logarithmic axis [µV], shape as given; what is below the smallest is drawn there."""
    return np.maximum(1e3 * np.asarray(amplitude_mv, dtype=np.float64), SMALLEST_UV)
