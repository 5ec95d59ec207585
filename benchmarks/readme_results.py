"""The results table of the README, its picture, and the paragraph on the reproduction, from the results beside this.

    python -m benchmarks.readme_results

prints the table, to be put between the `results` marks of the README, and the paragraph, to be put between the
`reproduction` marks of `docs/performance.md`, and draws `docs/images/results.svg`.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from textwrap import fill
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from matplotlib.figure import Figure

from benchmarks.quick import understood
from benchmarks.reduction.look import NAMES
from isiw.plots.comparison import draw_curve
from isiw.plots.style import INK, explain, save_figure, strategy_colours, tidied

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
MARKS = (10, 20, 40)
COHORTS = {"recruitment": "noise as near threshold (`recruitment`)", "gaussian": "constant-CV noise (`gaussian`)"}
METHODS = {
    "nr": "the dissertation's nonlinear regression",
    "gpr": "the dissertation's Gaussian process",
    "default": "**isiw's default**",
    "second": "oracle that must also find whether there is a window",
    "oracle": "oracle",
}
PICTURED = {
    "default": "isiw's default",
    "second": "second oracle",
    "oracle": "oracle",
    "gpr": "dissertation: Gaussian process (gpr)",
    "nr": "dissertation: nonlinear regression (nr)",
    "svmr": "dissertation: support vectors (svmr)",
    "pf": "dissertation: particle filter (pf)",
}
LAST = 60
GUESS = "guess without any trial"


def f1_by_trial(cohort: str) -> pd.DataFrame:
    """Mean F1 after each marked trial (rows) of each method (columns)."""
    return curves_of(cohort).pivot_table(index="trial", columns="strategy", values="f1")[list(METHODS)]


def guess(cohort: str) -> float:
    """Mean F1 of the best fixed window on 1,000 people."""
    return _zero_trials(cohort)[1]


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


def curves_of(cohort: str) -> pd.DataFrame:
    """What the picture shows of a cohort: trial, F1 and its standard error of each method, a row a marked trial.

    The oracles have no standard error of their own: they are there to be compared on the same people.
    """
    own = _table("people.json", "By trial")
    default = own.assign(strategy="default").rename(columns={"start_covered": "start_coverage"})
    oracles = pd.concat(
        own[["cohort", "trial"]].assign(f1=own["f1"] + own[f"behind_{name}"], f1_se=0.0, strategy=name)
        for name in ("oracle", "second")
    )
    rows = pd.concat([default, oracles, opponents()])
    return rows[(rows["cohort"] == cohort) & (rows["trial"] <= LAST)]


def opponents() -> pd.DataFrame:
    """The dissertation's methods without TMS alone: a row a marked trial."""
    sections = json.loads((RESULTS / "headline.json").read_text(encoding="utf-8"))["sections"]
    tables = [table for section in sections for table in section["tables"]]
    equal = pd.DataFrame(next(table["rows"] for table in tables if table["caption"].startswith("Equal trials")))
    names = {NAMES[method]: method for method in ("nr", "svmr", "gpr", "pf")}
    own = equal[(equal["TMS alone"] == 0) & equal["method"].isin(names)]
    marks = [column for column in own if column.isdigit()]
    long = own.melt(["cohort", "method"], marks, var_name="trial", value_name="f1")
    errors = own.melt(["cohort", "method"], [f"SE {mark}" for mark in marks], value_name="f1_se")
    # Before its first generation of particles ends, the filter has no answer.
    answered = long["f1"] > 0
    long, errors = long[answered], errors[answered]
    return long.assign(f1_se=errors["f1_se"], trial=long["trial"].astype(int), strategy=long["method"].map(names))


def before_any_trial(cohort: str) -> float:
    """Mean F1 of what the default believes beforehand, on 1,000 people."""
    return _zero_trials(cohort)[0]


def picture() -> Figure:
    """Mean F1 by trial, a panel a kind of noise."""
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    colours = strategy_colours(list(PICTURED))
    panels = figure.subplots(1, 2, sharey=True)
    for axes, (cohort, people) in zip(panels, COHORTS.items(), strict=True):
        tidied(axes)
        rows = curves_of(cohort)
        for (method, name), marker in zip(PICTURED.items(), "oXPsD^v", strict=True):
            curve = rows[rows["strategy"] == method].sort_values("trial")
            draw_curve(axes, curve, name, colours[method], marker)
        axes.plot(0, before_any_trial(cohort), "o", color=colours["default"], mfc="none", ms=6, clip_on=False,
                  label="the default before any trial")  # fmt: skip
        axes.axhline(guess(cohort), color=INK, lw=1, ls=(0, (4, 3)), label=GUESS)
        axes.set(xlim=(0, LAST + 2), ylim=(0, 1), yticks=np.linspace(0, 1, 6))
        axes.set_xlabel("stimuli delivered", fontsize=9)
        axes.set_title(people.replace("`", ""), fontsize=10, loc="left", color=INK)
    panels[0].set_ylabel("mean F1 of the reported window, 95 % band", fontsize=9)
    explain(figure, ncols=4)
    return figure


def _table(name: str, title: str) -> pd.DataFrame:
    return pd.DataFrame(json.loads((RESULTS / name).read_text(encoding="utf-8"))[title])


def _zero_trials(cohort: str) -> tuple[float, float]:
    """Mean F1 of the default before any trial, and of the best fixed window."""
    text = (RESULTS / "zero_trials.md").read_text(encoding="utf-8")
    ((default, fixed),) = re.findall(rf"^\| {cohort} +\| +([\d.]+) \| +([\d.]+) \|", text, re.MULTILINE)
    return float(default), float(fixed)


def _short(value: float) -> str:
    return f"{value:.2f}".removeprefix("0")


def main(
    out: Annotated[Path, typer.Option(help="Path of the picture, without suffix.")] = ROOT / "docs/images/results",
) -> None:
    """Print the table and the paragraph, and draw the picture."""
    print(table(), reproduction(), sep="\n\n")
    save_figure(picture(), out.with_suffix(".svg"), overwrite=True)


if __name__ == "__main__":
    understood("readme_results")
    typer.run(main)
