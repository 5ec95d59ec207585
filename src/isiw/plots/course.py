"""The picture of how well the trials went: realised ISIs against wanted ones, and the muscle's rest, by trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from isiw.log.reader import SessionRecord
from isiw.plots.style import BLUE, FAINT, ORANGE, RED, TRIAL_AXIS, saying, tidied
from isiw.trials import Trial


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
