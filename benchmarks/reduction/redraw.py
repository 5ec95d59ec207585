"""Draws the figures of the reproduction again from its committed tables, without running a session.

    python -m benchmarks.reduction.redraw

It prints the paragraph, too, that stands between the `reproduction` marks of `docs/performance.md`. The figure of the
online experiment needs what the tables leave out, single trials; it is drawn when the whole reproduction is run.
"""

from __future__ import annotations

import json
from pathlib import Path
from textwrap import fill
from typing import Annotated

import pandas as pd
import typer
from matplotlib.figure import Figure

from benchmarks.quick import understood
from benchmarks.reduction import comparison, headline, initial, particles
from benchmarks.reduction.document import DPI

RESULTS = Path(__file__).parents[1] / "results"


def redrawn(results: Path = RESULTS) -> dict[str, Figure]:
    """The figures by name.

    Args:
        results: folder of the tables, as `document.write` writes them.
    """
    tables = {
        section["title"].partition(" (")[0]: [pd.DataFrame(table["rows"]) for table in section["tables"]]
        for name in ("trial_reduction", "headline")
        for section in json.loads((results / f"{name}.json").read_text(encoding="utf-8"))["sections"]
    }
    told = tables["Equal trials, equal F1"]
    duels, equal = dict(zip(headline.NOISE, told, strict=False)), told[2 * len(headline.NOISE)]
    return {
        "headline_by_trial": headline.figure(equal[equal["TMS alone"] == 0], duels),
        "trial_reduction_methods": comparison.figure(tables["The methods side by side"][0]),
        "trial_reduction_initial": initial.figure(tables["How many initial observations"][0]),
        "trial_reduction_particles": particles.figure(*tables["How many particles"]),
    }


def reproduction(results: Path = RESULTS) -> str:
    """What the reproduction of the dissertation says first.

    Args:
        results: folder of the tables.
    """
    return fill(json.loads((results / "trial_reduction.json").read_text(encoding="utf-8"))["opening"], 120)


def main(out: Annotated[Path, typer.Option(help="Folder of the figures.")] = RESULTS) -> None:
    """Draw the figures again."""
    out.mkdir(parents=True, exist_ok=True)
    for name, figure in redrawn().items():
        for axes in figure.axes:
            axes.title.set_fontsize(9)
        figure.savefig(out / f"{name}.png", dpi=DPI)
    print(reproduction())


if __name__ == "__main__":
    understood("reduction.redraw")
    typer.run(main)
