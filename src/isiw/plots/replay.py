"""The picture of a replay: F1 against the answer from all trials, by the number of stimuli, with a band over seeds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from isiw.plots.style import BLUE, GREEN, INK, ORANGE, RED, explain, save_figure, tidied
from isiw.types import FloatArray


def save_replay_plot(curves: Mapping[str, FloatArray], path: str | Path, *, overwrite: bool = False) -> Path:
    """Draw F1 by the number of stimuli into a file."""
    return save_figure(replay_figure(curves), path, overwrite=overwrite)


def replay_figure(curves: Mapping[str, FloatArray]) -> Figure:
    """F1 of each strategy by the number of stimuli: the median, and from the least to the largest over its seeds."""
    figure = Figure(figsize=(7.2, 3.8), layout="constrained")
    axes = figure.subplots()
    tidied(axes)
    colours = (BLUE, ORANGE, GREEN, RED, INK)
    for number, (name, scores) in enumerate(curves.items()):
        colour, trials = colours[number % len(colours)], np.arange(1, scores.shape[1] + 1)
        axes.fill_between(trials, scores.min(axis=0), scores.max(axis=0), color=colour, alpha=0.15, lw=0)
        axes.plot(trials, np.median(scores, axis=0), color=colour, lw=1.8, label=name)
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("stimuli", fontsize=9)
    axes.set_ylabel("F1 against all trials", fontsize=9)
    explain(figure, ncols=3)
    return figure
