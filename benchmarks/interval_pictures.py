"""The figures of chapter 6 of the dissertation, of simulated people and of the text, for `benchmarks/interval.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

Times = NDArray[np.float64]


def draw(
    blocks: dict[tuple[float, int], Times],
    theirs: dict[tuple[float, int], tuple[float, float]],
    half: Times,
    runs: dict[float, Times],
    responses: pd.DataFrame,
) -> Figure:
    """Fig. 6.5 to 6.10 in one picture."""
    figure = Figure(figsize=(12, 9), layout="constrained")
    panels = figure.subplots(3, 3).ravel()
    for axes, (name, counts) in zip(panels, responses.items(), strict=False):
        axes.bar(counts.index, counts, width=8)
        axes.set(title=f"Fig. 6.5: simulated {name}", xlabel="ISI [ms]", ylabel="responses of 10", ylim=(0, 10))
    for axes, target_ms in zip(panels[2:], (300.0, 500.0), strict=False):
        bars(axes, {f"mode {mode}": (blocks[target_ms, mode], theirs[target_ms, mode]) for mode in (1, 2, 3, 4)})
        axes.set_title(f"Fig. 6.6: target {target_ms:.0f} ms")
    full = blocks[300.0, 2]
    bars(panels[4], {"A = 100": (full, theirs[300.0, 2]), "A = 50": (half, (312, 74))})
    panels[4].set_title("Fig. 6.7: mode 2, target 300 ms")
    for axes, times_ms, name in ((panels[5], half, "(a) A = 50"), (panels[6], full, "(b) A = 100")):
        axes.hist(times_ms.ravel(), bins=np.arange(0, 620, 20).tolist(), density=True)
        axes.set(title=f"Fig. 6.8 {name}", xlabel="produced interval [ms]", ylabel="density")
    for axes, times_ms, (scale_pct, run), name in zip(
        panels[7:], (full, half), runs.items(), ("Fig. 6.9", "Fig. 6.10"), strict=True
    ):
        axes.plot(times_ms[0], ".", ms=3, label="a simulated person")
        axes.plot(run[0], ".-", ms=4, lw=0.7, label="Bayesian optimisation")
        axes.set(title=f"{name}: A = {scale_pct:.0f}", xlabel="trial", ylabel="interval [ms]", ylim=(0, 700))
        axes.legend(fontsize=7)
    return figure


def bars(axes: Any, shown: dict[str, tuple[Times, tuple[float, float]]]) -> None:
    """Means and SDs of ours, and of the text beside them."""
    place = np.arange(len(shown))
    ours = [(float(times.mean()), float(times.std())) for times, _ in shown.values()]
    for shift, values, name in ((-0.12, ours, "simulated"), (0.12, [text for _, text in shown.values()], "text")):
        axes.errorbar(place + shift, *zip(*values, strict=True), fmt="o", capsize=3, label=name)
    axes.set_xticks(place, list(shown))
    axes.set_ylabel("interval, mean ± SD [ms]")
    axes.legend(fontsize=7)
