"""The picture of a session's sweeps: the EMG around the pulse, stacked by ISI, with MEP window and first stimulus."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from isiw.log.reader import SessionRecord
from isiw.plots.style import BLUE, FAINT, GREEN, INK, ORANGE, tidied
from isiw.signals.limits import EMG_UNITS_MV
from isiw.trials import Channel, Trial
from isiw.types import BoolArray, FloatArray

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


def sweeps_figure(record: SessionRecord) -> Figure | None:
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
