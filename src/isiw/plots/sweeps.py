"""The picture of some sweeps, with the stimuli, the MEP window, and what is measured in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import islice

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.plots.style import BLUE, FAINT, INK, RED, tidied
from isiw.sweeps import Channel
from isiw.trials import Trial


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
        _draw(axes, trial, sweeps[trial.index]["emg"], mep_window_ms)
    panels[-1].set_xlabel("time after the pulse [ms]")
    tidied(*panels)
    return figure


def _draw(axes: Axes, trial: Trial, emg: Channel, window_ms: tuple[float, float]) -> None:
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
