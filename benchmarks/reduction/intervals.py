"""Interval production as Bayesian optimisation on a binary light (chapter 6, Tables 6.3 and 6.4).

The strategy sees the light only: `tell(interval, response=...)`. The particle posterior learns from responses, with the
kind of noise whose responses are missing with a probability; Thompson sampling asks for the best interval of one
posterior sample at a time, so that it searches first and produces the target then.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
import torch
from matplotlib.figure import Figure

import isiw
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import OURS, THEIRS, panels
from isiw.design import DesignSpace

TARGET_MS: Final = 300.0
VARIANCE_MS2: Final = 100.0
TRIALS: Final = 200
SPACE: Final = DesignSpace(200, 400, 2.0, reference="impact")
"""What the tables' search covered; on a grid finer than the light's width of 28 ms."""

SETTINGS: Final[dict[str, Any]] = {
    "acquisition": "thompson",
    "particles": 400,
    "prior": {
        "p_window": 1.0,
        "p_anywhere": 1.0,
        "p_shape": (1.0, 0.0, 0.0, 0.0),
        "p_noise": (0.0, 1.0, 0.0, 0.0),
        "width_ms": (40.0, 0.5, 0.0),
        "max_probability": (1.0, 1.5),
    },
}
"""A light whose width is expected about the text's 40 ms, anywhere in the range, and that may fail at the target."""

PROSE = """\
On/off feedback with probability A exp(−(t − M)²/100), M = 300 ms, 200 trials, 200–400 ms. The default's particle
posterior is told responses and no amplitudes, its prior widened to a light anywhere in the range; Thompson sampling
asks. Mean and SD are means over runs of each run's intervals, min and max are over all runs. The text says neither
which model nor which acquisition function its BO had; its BO goes on exploring (SD 30 ms over 200 trials), ours
settles."""


@dataclass(frozen=True)
class Run:
    """One run: the light's largest probability, and the seed of light and strategy."""

    scale: float
    seed: int


def light_probability(interval_ms: float, scale: float) -> float:
    """Probability that the light goes on (6.1).

    Args:
        interval_ms: the produced interval [ms].
        scale: probability at the target.
    """
    return float(scale * np.exp(-((interval_ms - TARGET_MS) ** 2) / VARIANCE_MS2))


def produce(run: Run) -> dict[str, Any]:
    """The asked intervals of one run [ms], and the target as estimated in the end."""
    torch.set_num_threads(1)
    strategy = isiw.make_strategy("default", SPACE, run.seed, max_trials=TRIALS, **SETTINGS)
    rng = np.random.default_rng([run.seed, round(100 * run.scale)])
    asked = []
    for _ in range(TRIALS):
        asked.append(strategy.ask())
        strategy.tell(asked[-1], response=bool(rng.random() < light_probability(asked[-1], run.scale)))
    profile_mv = strategy.estimate().profile(SPACE.grid_ms).median_mv
    return {"scale": run.scale, "asked_ms": asked, "target_ms": float(SPACE.grid_ms[profile_mv.argmax()])}


def runs(count: int, seed: int) -> list[Run]:
    """So many runs with each light."""
    return [Run(scale, seed + k) for scale in text.INTERVALS for k in range(count)]


def summary(results: list[dict[str, Any]]) -> pd.DataFrame:
    """The tables' rows and ours: mean, SD, least and largest asked interval; and the estimated target."""
    table = []
    for scale, rows in text.INTERVALS.items():
        table += [_row(scale, f"{who} (text)", *values) for who, values in rows.items()]
        own = [result for result in results if result["scale"] == scale]
        asked, targets = np.array([r["asked_ms"] for r in own]), np.array([r["target_ms"] for r in own])
        usual = [float(f(asked, axis=1).mean()) for f in (np.mean, np.std)]
        row = _row(scale, f"isiw, {len(own)} runs", *usual, float(asked.min()), float(asked.max()))
        within = float((abs(asked - TARGET_MS) <= 20).mean())
        table.append(row | {"within ± 20 ms": within, "estimate of M": targets.mean(), "SD of estimate": targets.std()})
        late = asked[:, TRIALS // 2 :]
        table.append(_row(scale, "isiw, second half", late.mean(), late.std(axis=1).mean(), late.min(), late.max()))
    return pd.DataFrame(table)


def _row(scale: float, who: str, mean: float, sd: float, least: float, largest: float) -> dict[str, Any]:
    return {"A": scale, "who": who, "mean": float(mean), "SD": float(sd), "min": float(least), "max": float(largest)}


def figure(results: list[dict[str, Any]]) -> Figure:
    """Fig. 6.9 and 6.10: intervals by trial."""
    picture, axes = panels(1, 2, width=4.2, sharey=True)
    for one, scale, number in zip(axes[0], text.INTERVALS, ("6.9", "6.10"), strict=True):
        own = [result["asked_ms"] for result in results if result["scale"] == scale]
        for asked in own[1:4]:
            one.plot(asked, color=THEIRS, lw=0.6)
        one.plot(own[0], color=OURS, lw=0.9)
        one.axhline(TARGET_MS, color="black", lw=0.6, ls=":")
        one.set(title=f"Fig. {number}: {scale:.0%} at the target", xlabel="trial", ylabel="asked interval [ms]")
    return picture


def section(results: list[dict[str, Any]]) -> Section:
    """This part of the report."""
    table = Table("Tables 6.3 and 6.4.", summary(results))
    return Section(
        "Interval production on a binary light (Tables 6.3, 6.4)", PROSE, [table], ("intervals", figure(results))
    )
