"""Pictures over time: a window within a pair, how well trials went, their sweeps, and a study of repeatability."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from isiw.figures import Estimate
from isiw.log.record import SessionRecord
from isiw.plots.style import BLUE, FAINT, GREEN, INK, ORANGE, RED, TRIAL_AXIS, edge_intervals, explain, saying, tidied
from isiw.signals.impact import VALVE_MS
from isiw.signals.limits import EMG_UNITS_MV
from isiw.sweeps import Channel
from isiw.text.sanitize import plain
from isiw.trials import Trial
from isiw.types import BoolArray, FloatArray

if TYPE_CHECKING:
    from isiw.dissertation.repeatability import TimingStudy


def timeline_figure(record: SessionRecord) -> Figure:
    """When, within a pair of stimuli, the pulse enhances the MEP."""
    record.require_open()
    space = record.header.space
    origin = record.header.stimulus.shown(space.reference)
    figure = Figure(figsize=(7.2, 2.2), layout="constrained")
    axes = figure.subplots()
    tidied(axes)
    axes.spines["left"].set_visible(False)
    events = {origin: 0.0} | _other_event(record)
    for name, place_ms in events.items():
        axes.axvline(place_ms, ymax=0.72, color=INK, lw=1.6)
        axes.text(place_ms, 0.76, name, ha="center", va="bottom", fontsize=8, color=INK)
    if record.found is not None:
        _draw_window(axes, record.found, (space.low_ms, space.high_ms))
    low, high = min(space.low_ms, *events.values()), max(space.high_ms, *events.values())
    margin = 0.06 * (high - low)
    axes.axvspan(
        space.low_ms, space.high_ms, ymin=0, ymax=0.05, color=FAINT, alpha=0.5, lw=0, label="ISIs that may be delivered"
    )
    axes.set(xlim=(low - margin, high + margin), yticks=[], ylim=(0, 1), xlabel=f"time after the {origin} [ms]")
    explain(figure, ncols=3)
    return figure


def _other_event(record: SessionRecord) -> dict[str, float]:
    """The event that ISIs do not count from, where it usually came; empty if it was not measured."""
    delays_ms = [t.t_hit_ms - t.t_valve_ms for t in record.table if t.t_hit_ms is not None and t.t_valve_ms is not None]
    if not delays_ms:
        return {}
    median_ms = statistics.median(delays_ms)
    if record.header.space.reference == "valve":
        return {f"{record.header.stimulus.mark}\n{median_ms:.0f} ms (median)": median_ms}
    return {f"valve command\n−{median_ms:.0f} ms (median)": -median_ms}


def _draw_window(axes: Axes, estimate: Estimate, span_ms: tuple[float, float]) -> None:
    segments = estimate.window.segments if estimate.window else ()
    for start, end in segments:
        axes.axvspan(start, end, ymin=0.1, ymax=0.62, color=BLUE, alpha=0.3, lw=0, label="window")
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
    timing.set(ylabel="realised − wanted ISI [ms]")
    if math.isfinite(limit_uv := header.signals.most_background_uv):
        background.axhline(limit_uv, color=ORANGE, lw=1.2, ls=(0, (4, 3)), label=f"limit, {limit_uv:g} µV")
    _draw(background, record.table.trials, lambda trial: trial.background_rms_uv)
    background.set(ylim=(0, None), ylabel="background EMG [µV RMS]", xlabel=TRIAL_AXIS)
    background.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axes in (one for one in (timing, background) if one.get_legend_handles_labels()[0]):
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


_COLOURS = {"fill": FAINT, "descent": GREEN, "hit": BLUE, "away": ORANGE, "memg": RED, "motion": GREEN, "end": BLUE}
_NAMES = {
    "fill": "chamber fills",
    "descent": "descent",
    "hit": "hit",
    "away": "rebound",
    "memg": "artefact in the EMG",
    "motion": "rotation begins",
    "end": "full range",
}


def timing_figure(study: TimingStudy) -> Figure:
    """A study as a figure: its events, and below them the ISI errors where ISIs were commanded."""
    errors = study.error_table
    figure = Figure(figsize=(7.2, 5.2 if len(errors) else 2.8), layout="constrained")
    panels = figure.subplots(2 if len(errors) else 1, 1, squeeze=False)[:, 0]
    tidied(*panels)
    _draw_events(panels[0], study)
    if len(errors):
        _draw_errors(panels[1], study)
    return figure


def _draw_events(axes: Axes, study: TimingStudy) -> None:
    table = study.event_table
    for name, times in study.events.columns().items():
        if name in table.index:
            found = times[~np.isnan(times)] - VALVE_MS
            label = f"{_NAMES[name]}  {found.mean():.0f} ± {table['sd_ms'][name]:.1f} ms"
            bins = np.arange(np.floor(found.min()), np.ceil(found.max()) + 1).tolist()
            axes.hist(found, bins=bins, color=_COLOURS[name], alpha=0.8, label=label)
    axes.set(yscale="log", xlabel="time after the valve command [ms]", ylabel=f"{study.kind} per ms")
    title = plain(f"{study.name}: {len(study.commanded_ms)} {study.kind}")
    axes.set_title(title, fontsize=11, loc="left", color=INK, parse_math=False)
    axes.legend(fontsize=7.5, frameon=False, loc="upper left", bbox_to_anchor=(0.1, 1.0))


def _draw_errors(axes: Axes, study: TimingStudy) -> None:
    table = study.error_table
    place = np.arange(len(table))
    order = np.searchsorted(table.index.to_numpy(), study.commanded_ms)
    accepted = study.realised_ms >= 0
    beside = order + 0.3 * np.linspace(-1, 1, 17)[np.arange(len(order)) % 17]  # so that trials do not hide each other
    errors = study.realised_ms - study.commanded_ms
    axes.axhline(0, color=FAINT, lw=0.8, ls=":")
    axes.plot(beside[accepted], errors[accepted], ".", ms=3, color=FAINT, alpha=0.5)
    if study.mistrials:
        axes.plot(beside[~accepted], errors[~accepted], "x", ms=5, color=RED, label="mistrial")
    axes.errorbar(place, table["mean_ms"], table["sd_ms"], fmt="o", ms=4, color=BLUE, capsize=3, label="mean ± SD")
    axes.set_xticks(place, [f"{isi:g}" for isi in table.index])
    axes.set(xlabel="commanded ISI [ms]", ylabel="ISI error [ms]")
    pooled = "not known" if np.isnan(study.pooled_sd_ms) else f"{study.pooled_sd_ms:.2f} ms"
    found = f"pooled SD {pooled}, mistrials: {study.mistrials} of {np.isfinite(study.commanded_ms).sum()}"
    axes.set_title(found, fontsize=9, loc="left", color=INK)
    axes.legend(fontsize=7.5, frameon=False)


BEFORE_MS, AFTER_MS = 50.0, 80.0
MOST_LABELS, MOST_POINTS = 30, 100_000
ROWS_OF_LARGEST = 2.0
"""As many rows the largest deflection is high; with many trials a sixteenth of them, so that it remains visible."""
AT_REST_ROWS = 0.25
"""A deflection ends where the trace is back within so many rows of its own."""


class _Trace(NamedTuple):
    trial: Trial
    times_ms: FloatArray
    emg_mv: FloatArray


def all_sweeps_figure(record: SessionRecord) -> Figure | None:
    """The EMG of all trials that count, a row a trial, ISIs ascending, TMS alone lowest."""
    found = (_trace(trial, record.waveforms.get((trial.index, "emg"))) for trial in record.table.told)
    placed = [(trace.trial.isi_ms, trace) for trace in found if trace is not None]
    traces = [trace for _, trace in sorted(placed, key=lambda x: -math.inf if x[0] is None else x[0])]
    if not traces:
        return None
    figure = Figure(figsize=(7.2, 1.6 + min(7.4, 0.26 * len(traces))), layout="constrained")
    axes = figure.subplots()
    first_ms, last_ms = record.header.signals.mep_window_ms
    deflections = (np.abs(t.emg_mv[(t.times_ms >= first_ms) & (t.times_ms <= last_ms)]) for t in traces)
    largest_mv = max([1e-3, *(float(size_mv.max(initial=0.0)) for size_mv in deflections)])
    axes.axvspan(first_ms, last_ms, color=GREEN, alpha=0.13, lw=0, label="MEP window")
    axes.axvline(0, color=FAINT, lw=0.8, label="TMS pulse")
    isis_ms = [np.nan if trace.trial.isi_ms is None else trace.trial.isi_ms for trace in traces]
    window = None if record.found is None else record.found.window
    inside = np.zeros(len(traces), dtype=bool) if window is None else window.mask(isis_ms)
    rows_per_mv = _rows_of_largest(traces) / largest_mv
    _draw_traces(axes, traces, inside, rows_per_mv, BLUE, "EMG, ISI inside the window")
    _draw_traces(axes, traces, ~inside, rows_per_mv, INK, "EMG, other trials")
    _draw_hits(axes, traces, record.header.stimulus.mark)
    _draw_scale(axes, (len(traces) - 1) / 2, largest_mv, rows_per_mv)
    _finish(axes, traces)
    figure.legend(loc="outside upper left", ncols=3, fontsize=7.5, frameon=False)
    return figure


def _trace(trial: Trial, emg: Channel | None) -> _Trace | None:
    if emg is None or trial.t_tms_ms is None or emg.unit not in EMG_UNITS_MV:
        return None
    times_ms = emg.t0_ms + 1e3 * np.arange(len(emg.values), dtype=np.float64) / emg.rate_hz - trial.t_tms_ms
    near = (times_ms >= -BEFORE_MS) & (times_ms <= AFTER_MS) & np.isfinite(emg.values)
    if not near.any():
        return None
    emg_mv = emg.values[near] * EMG_UNITS_MV[emg.unit]
    return _Trace(trial, times_ms[near], emg_mv - np.median(emg_mv))  # an amplifier's offset is no deflection


def _rows_of_largest(traces: Sequence[_Trace]) -> float:
    return max(ROWS_OF_LARGEST, len(traces) / 16)


def _draw_traces(
    axes: Axes, traces: Sequence[_Trace], chosen: BoolArray, rows_per_mv: float, colour: str, label: str
) -> None:
    most, width = _rows_of_largest(traces), 0.6 if len(traces) < 100 else 0.35
    kept = slice(None, None, -(-sum(len(trace.times_ms) for trace in traces) // MOST_POINTS))
    lines = [
        np.column_stack([trace.times_ms, row + _within(rows_per_mv * trace.emg_mv, most)])[kept]
        for row, trace in enumerate(traces)
        if chosen[row]
    ]
    if lines:
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=width, label=label), autolim=False)


def _within(rows: FloatArray, most: float) -> FloatArray:
    """A trace without the deflections that are higher than this, such as artefacts: they would hide other rows."""
    is_away = np.abs(rows) > AT_REST_ROWS
    runs = np.cumsum(np.diff(is_away, prepend=False))
    return np.where(is_away & np.isin(runs, runs[np.abs(rows) > most]), np.nan, rows)


def _draw_hits(axes: Axes, traces: Sequence[_Trace], label: str) -> None:
    hits = [(t.trial.t_hit_ms - t.trial.t_tms_ms, row) for row, t in enumerate(traces)
            if t.trial.t_hit_ms is not None and t.trial.t_tms_ms is not None]  # fmt: skip
    near = [(hit_ms, row) for hit_ms, row in hits if -BEFORE_MS <= hit_ms <= AFTER_MS]
    if near:
        size = 7 if len(near) < 100 else 4
        axes.plot(*zip(*near, strict=True), "|", ms=size, mew=1.6, color=ORANGE, label=label)


def _draw_scale(axes: Axes, middle: float, largest_mv: float, rows_per_mv: float) -> None:
    """A bar of the largest of 1, 2, 5, 10 … mV that is no larger than the largest deflection."""
    power = 10.0 ** math.floor(math.log10(largest_mv))
    bar_mv = max(power * step for step in (1, 2, 5) if power * step <= largest_mv)
    half = rows_per_mv * bar_mv / 2
    axes.plot((AFTER_MS - 3,) * 2, (middle - half, middle + half), color=INK, lw=2, solid_capstyle="butt")
    axes.text(AFTER_MS - 4.5, middle, f"{1e3 * bar_mv:g} µV", ha="right", va="center", fontsize=8, color=INK)


def _finish(axes: Axes, traces: Sequence[_Trace]) -> None:
    tidied(axes)
    rows = range(0, len(traces), max(1, -(-len(traces) // MOST_LABELS)))
    isis_ms = [traces[row].trial.isi_ms for row in rows]
    axes.set_yticks(list(rows), ["TMS alone" if isi_ms is None else f"{isi_ms:.0f}" for isi_ms in isis_ms])
    room = _rows_of_largest(traces)
    axes.set(xlim=(-BEFORE_MS, AFTER_MS), ylim=(-room, len(traces) - 1 + room))
    axes.set(xlabel="time after the TMS pulse [ms]", ylabel="ISI [ms]")


def sweeps_figure(
    trials: Iterable[Trial], sweeps: Mapping[int, Mapping[str, Channel]], mep_window_ms: tuple[float, float], most: int
) -> Figure | None:
    """Draw the EMG of the first trials that have any, about the pulse.

    Args:
        trials: the trials.
        sweeps: their waveforms, by trial and channel; the EMG is in mV.
        mep_window_ms: where the MEP is sought [ms after the pulse].
        most: how many are drawn.
    """
    chosen = list(islice((one for one in trials if "emg" in sweeps.get(one.index, {})), most))
    chosen = [one for one in chosen if one.t_tms_ms is not None]
    if not chosen:
        return None
    figure = Figure(figsize=(7.5, 2.0 * len(chosen) + 0.6), layout="constrained")
    panels = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
    for axes, trial in zip(panels, chosen, strict=True):
        _draw_sweep(axes, trial, sweeps[trial.index]["emg"], mep_window_ms)
    panels[-1].set_xlabel("time after the pulse [ms]")
    tidied(*panels)
    return figure


def _draw_sweep(axes: Axes, trial: Trial, emg: Channel, window_ms: tuple[float, float]) -> None:
    pulse_ms = trial.t_tms_ms or 0.0
    times_ms = emg.t0_ms - pulse_ms + 1e3 * np.arange(len(emg.values)) / emg.rate_hz
    axes.axvspan(*window_ms, color=BLUE, alpha=0.15, lw=0)
    axes.axvline(0.0, color=RED, lw=1)
    if (tap_ms := trial.t_hit_ms if trial.t_hit_ms is not None else trial.t_valve_ms) is not None:
        axes.axvline(tap_ms - pulse_ms, color=FAINT, lw=1)
    axes.plot(times_ms, emg.values, color=INK, lw=0.8)
    inside = np.flatnonzero((times_ms >= window_ms[0]) & (times_ms <= window_ms[1]))
    if len(inside):
        ends = inside[[emg.values[inside].argmin(), emg.values[inside].argmax()]]
        axes.plot(times_ms[ends], emg.values[ends], "o", color=BLUE, ms=4)
    isi = "TMS alone" if trial.isi_ms is None else f"ISI {trial.isi_ms:.4g} ms"
    mep = "no MEP" if trial.mep_mv is None else f"MEP {1e3 * trial.mep_mv:.3g} µV"
    lost = "" if trial.told else f"; does not count: {trial.reason or 'excluded'}"
    axes.set_title(f"trial {trial.index}: {isi}, {mep}{lost}", fontsize="small", loc="left")
    axes.set_ylabel("EMG [mV]")
