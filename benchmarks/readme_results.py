"""The results table and picture of the README, and its paragraph on the reproduction, from the results beside this.

    python benchmarks/readme_results.py

prints the table and the paragraph, to be put between the `results` and the `reproduction` marks of the README, and
draws `docs/images/results.png`.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from textwrap import fill

import pandas as pd
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
MARKS = (10, 20, 40)
COHORTS = {"recruitment": "noise as near threshold (`recruitment`)", "gaussian": "constant-CV noise (`gaussian`)"}
METHODS = {"gpr": "the dissertation's Gaussian process", "default": "**isiw's default**", "oracle": "oracle"}
COLOURS = {"gpr": "#E69F00", "default": "#0072B2", "oracle": "#999999"}
GUESS = "guess without any trial"


def f1_by_trial(cohort: str) -> pd.DataFrame:
    """Mean F1 after each marked trial (rows) of each method (columns)."""
    default = _table("people.json", "By trial").assign(strategy="default")
    oracle = default.assign(strategy="oracle", f1=default["f1"] + default["behind_oracle"])
    others = _table("acquisition.json").query("strategy == 'gpr'")
    rows = pd.concat([default, oracle, others])
    return rows[rows["cohort"] == cohort].pivot_table(index="trial", columns="strategy", values="f1")[list(METHODS)]


def guess(cohort: str) -> float:
    """Mean F1 of the best fixed window on 1,000 people."""
    text = (RESULTS / "zero_trials.md").read_text(encoding="utf-8")
    (value,) = re.findall(rf"^\| {cohort} +\| +[\d.]+ \| +([\d.]+) \|", text, re.MULTILINE)
    return float(value)


def table() -> str:
    """Mean F1, a row a cohort and method."""
    lines = [
        "| people | method | " + " | ".join(f"{mark} trials" for mark in MARKS) + " |",
        "|---|---" + "|---" * 3 + "|",
    ]
    for cohort, people in COHORTS.items():
        lines.append(f"| {people} | {GUESS} |" + f" {_short(guess(cohort))} |" * len(MARKS))
        curves = f1_by_trial(cohort)
        for method, name in METHODS.items():
            lines.append(f"| | {name} |" + "".join(f" {_short(curves[method][mark])} |" for mark in MARKS))
    return "\n".join(lines)


def reproduction() -> str:
    """What the reproduction of the dissertation says first."""
    return fill(json.loads((RESULTS / "trial_reduction.json").read_text(encoding="utf-8"))["opening"], 120)


def picture() -> Figure:
    """Mean F1 by trial, a panel a cohort."""
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    for axes, (cohort, people) in zip(figure.subplots(1, 2, sharey=True), COHORTS.items(), strict=True):
        curves = f1_by_trial(cohort)
        for method, name in METHODS.items():
            axes.plot(curves[method].dropna(), "o-", color=COLOURS[method], label=name.replace("*", ""))
        axes.axhline(guess(cohort), color="black", linestyle="--", label=GUESS)
        axes.set(xlabel="stimuli delivered", xlim=(0, 42), ylim=(0.3, 1), title=people.replace("`", ""))
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("mean F1 of the reported window")
    figure.axes[1].legend(loc="lower right")
    return figure


def _table(name: str, title: str = "F1 by trial") -> pd.DataFrame:
    return pd.DataFrame(json.loads((RESULTS / name).read_text(encoding="utf-8"))[title])


def _short(value: float) -> str:
    return f"{value:.2f}".removeprefix("0")


if __name__ == "__main__":
    print(table(), reproduction(), sep="\n\n")
    picture().savefig(ROOT / "docs" / "images" / "results.png", dpi=110)
