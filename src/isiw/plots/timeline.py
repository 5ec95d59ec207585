"""Pictures of the times in a session: a window on the time line of a pair of stimuli, and how well the trials went."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from isiw.estimate import Estimate
from isiw.log.reader import SessionRecord
from isiw.plots.style import BLUE, FAINT, INK, ORANGE, RED, TRIAL_AXIS, edge_intervals, explain, saying, tidied
from isiw.trials import Trial


def timeline_figure(record: SessionRecord) -> Figure:
    """When, within a pair of stimuli, the pulse enhances the MEP."""
    space = record.header.space
    origin = record.header.stimulus.shown(space.reference)
    figure = Figure(figsize=(7.2, 2.2), layout="constrained")
    axes = figure.subplots()
    tidied(axes)
    axes.spines["left"].set_visible(False)
    axes.set_yticks([])
    events = {origin: 0.0} | _other_event(record)
    for name, place_ms in events.items():
        axes.axvline(place_ms, ymax=0.72, color=INK, lw=1.6)
        axes.text(place_ms, 0.76, name, ha="center", va="bottom", fontsize=8, color=INK)
    if record.found is not None:
        _draw_window(axes, record.found, (space.low_ms, space.high_ms))
    low, high = min(space.low_ms, *events.values()), max(space.high_ms, *events.values())
    margin = 0.06 * (high - low)
    axes.axvspan(
        space.low_ms, space.high_ms, ymin=0, ymax=0.05, color=FAINT, alpha=0.5, lw=0, label="ISIs that may be asked"
    )
    axes.set_xlim(low - margin, high + margin)
    axes.set_ylim(0, 1)
    axes.set_xlabel(f"time after the {origin} [ms]", fontsize=9)
    explain(figure, ncols=3)
    return figure


def _other_event(record: SessionRecord) -> dict[str, float]:
    """The event that ISIs do not count from, where it usually came; empty where it was not measured."""
    delays_ms = [t.t_hit_ms - t.t_valve_ms for t in record.table if t.t_hit_ms is not None and t.t_valve_ms is not None]
    if not delays_ms:
        return {}
    median_ms = statistics.median(delays_ms)
    if record.header.space.reference == "valve":
        return {f"{record.header.stimulus.mark}\n{median_ms:.0f} ms (median)": median_ms}
    return {f"valve command\n−{median_ms:.0f} ms (median)": -median_ms}


def _draw_window(axes: Axes, estimate: Estimate, span_ms: tuple[float, float]) -> None:
    segments = estimate.window.segments if estimate.window else ()
    for number, (start, end) in enumerate(segments):
        axes.axvspan(start, end, ymin=0.1, ymax=0.62, color=BLUE, alpha=0.3, lw=0, label=None if number else "window")
    for height, (name, colour, pair) in zip((0.47, 0.34), edge_intervals(estimate, *span_ms), strict=False):
        if segments:
            label = f"90 % interval of its {name}"
            axes.plot(pair, (height, height), color=colour, lw=5, solid_capstyle="butt", label=label)
    if segments and estimate.best_isi is not None:
        best, low, high = estimate.best_isi
        axes.plot((low, high), (0.2, 0.2), color=INK, lw=1.5)
        axes.plot(best, 0.2, "D", ms=5, color=INK, label="best ISI, 90 % interval")


def course_figure(record: SessionRecord) -> Figure:
    """Timing and background by trial, with what each may be at most."""
    header = record.header
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    timing, background = figure.subplots(2, 1, sharex=True)
    tidied(timing, background)
    tolerance_ms = header.signals.tolerance_ms(header.space)
    timing.axhline(0, color=FAINT, lw=0.8, ls=":")
    for limit_ms in (-tolerance_ms, tolerance_ms):
        timing.axhline(limit_ms, color=ORANGE, lw=1.2, ls=(0, (4, 3)), label="tolerance" if limit_ms > 0 else None)
    _draw(timing, record.table.trials, lambda trial: trial.isi_error_ms)
    timing.set_ylabel("realised − wanted ISI [ms]", fontsize=9)
    limit_uv = header.signals.background_uv
    background.axhline(limit_uv, color=ORANGE, lw=1.2, ls=(0, (4, 3)), label=f"limit, {limit_uv:g} µV")
    _draw(background, record.table.trials, lambda trial: trial.background_rms_uv)
    background.set_ylim(bottom=0)
    background.set_ylabel("background EMG [µV RMS]", fontsize=9)
    background.set_xlabel(TRIAL_AXIS, fontsize=9)
    background.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axes in (timing, background):
        axes.legend(fontsize=7.5, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _draw(axes: Axes, trials: Sequence[Trial], measured: Callable[[Trial], float | None]) -> None:
    for is_lost, mark, colour, name in ((False, "o", BLUE, "trial"), (True, "x", RED, "mistrial")):
        points = [(t.index, value) for t in trials
                  if (t.reason is not None) == is_lost and (value := measured(t)) is not None]  # fmt: skip
        if points:
            axes.plot(*zip(*points, strict=True), mark, ms=4 if mark == "o" else 5.5, color=colour, label=name)
    if not any(measured(trial) is not None for trial in trials):
        saying(axes, "not recorded")
