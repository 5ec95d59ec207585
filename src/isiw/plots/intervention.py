"""Pictures of an intervention: TMS alone before and after it, and the pairs in between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from isiw.pairing.agenda import FollowedPair
from isiw.pairing.effect import AfterEffect, BlockChange
from isiw.pairing.pulses import Delivered, TestPulse, meps_mv
from isiw.plots.style import BLUE, FAINT, GREEN, INK, ORANGE, RED, explain, saying, tidied
from isiw.types import FloatArray

_COLOURS: Final = (BLUE, GREEN, ORANGE, RED)
_LEAST_UV: Final = 1.0
"""Where an MEP of 0 is drawn [µV]; the axis is logarithmic."""


def change_figure(effect: AfterEffect, pulses: Sequence[TestPulse]) -> Figure:
    """TMS alone before and after: each pulse, the mean of each block, and where it would be without an effect."""
    blocks = _by_block(effect, pulses)
    figure = Figure(figsize=(8.4, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0 + 0.35 * len(blocks), 1.8))
    tidied(left, right)
    _draw_pulses(left, effect, blocks)
    _draw_changes(right, effect)
    explain(figure, ncols=3)
    return figure


def _by_block(effect: AfterEffect, pulses: Sequence[TestPulse]) -> dict[str, list[TestPulse]]:
    before = [pulse for pulse in pulses if pulse.after_last_pair_s < 0]
    after = [pulse for pulse in pulses if pulse.after_last_pair_s >= 0]
    return {"before": before} | {
        change.block: [pulse for pulse in after if pulse.block == change.block] for change in effect.blocks
    }


def _draw_pulses(axes: Axes, effect: AfterEffect, blocks: Mapping[str, Sequence[TestPulse]]) -> None:
    levels = sorted({pulse.intensity_pct_rmt for those in blocks.values() for pulse in those})
    for number, pct in enumerate(levels):
        colour = _COLOURS[number % len(_COLOURS)]
        beside = 0.0 if len(levels) == 1 else 0.5 * (number / (len(levels) - 1) - 0.5)
        before_uv = 1e3 * meps_mv(blocks["before"], pct)
        for place, those in enumerate(blocks.values()):
            meps_uv = 1e3 * meps_mv(those, pct)
            if not len(meps_uv):
                continue
            at = place + beside + 0.09 * _spread(len(meps_uv))
            axes.plot(at, np.maximum(meps_uv, _LEAST_UV), "o", ms=3, color=colour, alpha=0.45, mew=0)
            if place and len(before_uv) > 1:
                _draw_unchanged(axes, place + beside, before_uv.mean(), effect.blocks[place - 1])
            label = "mean of a block" if len(levels) == 1 else f"mean of a block at {pct:g} % RMT"
            width = 0.16 if len(levels) > 1 else 0.3
            ends = place + beside - width, place + beside + width
            axes.plot(ends, [max(meps_uv.mean(), _LEAST_UV)] * 2, color=colour, lw=2.5, label=label)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks(range(len(blocks)), [name.replace("after ", "after\n") for name in blocks])
    axes.set(xlim=(-0.6, len(blocks) - 0.4), ylabel="MEP of TMS alone [µV]")
    axes.axvline(0.5, color=FAINT, lw=0.8, ls=":")
    axes.set_title("Each pulse", fontsize=10, loc="left", color=INK)


def _draw_unchanged(axes: Axes, at: float, before_uv: float, change: BlockChange) -> None:
    if change.unchanged is not None:
        low, high = (before_uv * end for end in change.unchanged)
        label = "mean without an effect (90 %)"
        axes.fill_between((at - 0.22, at + 0.22), low, high, color=FAINT, alpha=0.3, lw=0, label=label)


def _draw_changes(axes: Axes, effect: AfterEffect) -> None:
    changes = [*effect.blocks, effect.pooled]
    axes.axvline(1.0, color=FAINT, lw=1.0, ls=":")
    for row, change in enumerate(changes):
        pooled = change is effect.pooled
        colour = INK if pooled else BLUE
        axes.plot((change.factor.low, change.factor.high), (row, row), color=colour, lw=1.4, label="90 % interval")
        steady = change.steady.low, change.steady.high
        axes.plot(steady, (row, row), color=colour, lw=4, solid_capstyle="butt", label="the same without a drift")
        axes.plot(change.factor.median, row, "D" if pooled else "o", ms=6, color=colour, mec="#ffffff", mew=0.8)
    axes.set_xscale("log")
    ends = [end for change in changes for end in (change.factor.low, change.factor.high)]
    low, high = min(0.8, *ends) / 1.08, max(1.25, *ends) * 1.08
    ticks = [tick for tick in (0.1, 0.2, 0.33, 0.5, 0.67, 1, 1.5, 2, 3, 5, 10) if low <= tick <= high]
    axes.set_xticks(ticks, [f"× {tick:g}" for tick in ticks])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yticks(range(len(changes)), [change.block for change in changes])
    axes.set(xlim=(low, high), ylim=(len(changes) - 0.4, -0.6), xlabel="change of what is evoked")
    axes.set_title("Change from before", fontsize=10, loc="left", color=INK)


def dose_figure(delivered: Sequence[Delivered], window: Sequence[tuple[float, float, float]] = ()) -> Figure:
    """The pairs of an intervention: at which ISIs, and when; and where the window was.

    The window is where it starts and ends [ms] at some times [s from the first pair].
    """
    figure = Figure(figsize=(8.4, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.7), sharey=True)
    tidied(left, right)
    if not delivered:
        saying(left, "no pairs")
        saying(right, "no pairs")
        return figure
    isi_ms = np.array([pair.isi_ms for pair in delivered])
    at_min = np.array([pair.at_s for pair in delivered]) / 60.0
    probe = np.array([pair.probe for pair in delivered])
    if window:
        times_s, start, end = np.array(window).T
        right.fill_between(times_s / 60.0, start, end, step="post", color=BLUE, alpha=0.15, lw=0, label="window")
    groups = ((~probe, BLUE, "o", "pair"), (probe, ORANGE, "^", "probe of the window"))
    width = max(1.0, float(np.ptp(isi_ms)) / 30.0)
    edges = np.arange(isi_ms.min() - width / 2, isi_ms.max() + width, width)
    left.hist([isi_ms[which] for which, *_ in groups], edges.tolist(), orientation="horizontal", stacked=True,
              color=[colour for _, colour, *_ in groups])  # fmt: skip
    for which, colour, mark, label in groups:
        if which.any():
            right.plot(at_min[which], isi_ms[which], mark, ms=3.5, color=colour, mew=0, alpha=0.8, label=label)
    middle, reach = float(isi_ms.max() + isi_ms.min()) / 2, max(10.0, 0.6 * float(np.ptp(isi_ms)))
    left.set(xlabel="pairs", ylabel="ISI [ms]", ylim=(middle - reach, middle + reach))
    right.set(xlabel="time from the first pair [min]")
    explain(figure, ncols=3)
    return figure


def course_figure(course: Sequence[FollowedPair]) -> Figure:
    """The window that was followed: the best ISI with its interval, each pair, and how many of a block were inside."""
    figure = Figure(figsize=(8.4, 3.4), layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=(2.4, 1.0), sharex=True)
    tidied(above, below)
    number = np.array([pair.number for pair in course])
    best, low, high, isi_ms = (
        np.array([getattr(pair, name) for pair in course]) for name in ("best_ms", "low_ms", "high_ms", "isi_ms")
    )
    above.fill_between(number, low, high, color=BLUE, alpha=0.15, lw=0, label="90 % interval of the best ISI")
    above.plot(number, best, color=BLUE, lw=1.4, label="best ISI")
    for probe, colour, mark, label in ((False, INK, "o", "pair"), (True, ORANGE, "^", "probe of the window")):
        which = np.array([pair.probe is probe for pair in course])
        if which.any():
            above.plot(number[which], isi_ms[which], mark, ms=3, color=colour, mew=0, alpha=0.8, label=label)
    above.set(ylabel="ISI [ms]")
    for block in dict.fromkeys(pair.block for pair in course):
        those = [pair for pair in course if pair.block == block]
        inside = sum(pair.p_inside for pair in those)
        middle, width = (those[0].number + those[-1].number) / 2.0, 0.94 * len(those)
        below.bar(middle, inside, width, color=GREEN, label="inside the window (expected)")
        below.bar(middle, len(those) - inside, width, inside, color=FAINT, label="outside")
        if block:
            above.axvline(those[0].number - 0.5, color=FAINT, lw=0.8, ls=":")
    below.set(xlabel="pair", ylabel="pairs")
    explain(figure, ncols=3)
    return figure


def _spread(number: int) -> FloatArray:
    """Places beside each other, -1 to 1, so that pulses do not hide each other and the order shows."""
    return np.linspace(-1.0, 1.0, number) if number > 1 else np.zeros(1)
