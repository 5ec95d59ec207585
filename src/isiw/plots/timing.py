"""The pictures of a repeatability study: when the events come, and how far the ISIs are off."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.plots.style import BLUE, FAINT, GREEN, INK, ORANGE, RED, save_figure, tidied
from isiw.signals.impact import VALVE_MS
from isiw.text import plain

if TYPE_CHECKING:
    from isiw.dissertation.repeatability import TimingStudy

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


def save_timing_plot(study: TimingStudy, path: str | Path, *, overwrite: bool = False) -> Path:
    """Draw a study into a file; its suffix chooses the format.

    Args:
        study: the study.
        path: where to, such as `timing.png` or `timing.pdf`.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: a format that matplotlib does not know, or a file that is not to be replaced.
    """
    return save_figure(timing_figure(study), path, overwrite=overwrite)


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
    axes.set_yscale("log")
    axes.set_xlabel("time after the valve command [ms]", fontsize=9)
    axes.set_ylabel(f"{study.kind} per ms", fontsize=9)
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
    axes.set_xlabel("commanded ISI [ms]", fontsize=9)
    axes.set_ylabel("ISI error [ms]", fontsize=9)
    pooled = "not known" if np.isnan(study.pooled_sd_ms) else f"{study.pooled_sd_ms:.2f} ms"
    found = f"pooled SD {pooled}, mistrials: {study.mistrials} of {np.isfinite(study.commanded_ms).sum()}"
    axes.set_title(found, fontsize=9, loc="left", color=INK)
    axes.legend(fontsize=7.5, frameon=False)
