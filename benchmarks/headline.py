"""The default against the dissertation's methods at equal trials and equal F1, without TMS alone and with ten of it.

    python -m benchmarks.headline --quick
    python -m benchmarks.headline

writes a report (Markdown), its tables with versions, command and seed (JSON) and a figure (PNG). Apart from the
reproduction of the text's figures (`benchmarks.trial_reduction`), which does not depend on what the default believes.
Reported people come from seed 10,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Annotated

os.environ.setdefault("OMP_NUM_THREADS", "1")

import typer

from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.reduction import before, headline
from benchmarks.reduction.document import write
from benchmarks.reduction.parallel import Workers, frame, run_sessions

RESULTS = Path("benchmarks/results/headline")
TITLE = "The default and the dissertation's methods"
VERSIONS = ("numpy", "scipy", "torch", "scikit-learn")


def main(
    people: Annotated[int, typer.Option(help="People of each cohort.")] = 22,
    trials: Annotated[int, typer.Option(help="Trials of a session at least.")] = 40,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 10_000,
    processes: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = RESULTS,
    *,
    go_on: Annotated[bool, typer.Option(help="Go on with a run that was interrupted, with the same code.")] = False,
) -> None:
    """Compare the default with the dissertation's methods."""
    folder = out.with_suffix(".done.parts")
    if not go_on:
        shutil.rmtree(folder, ignore_errors=True)
    plan = headline.sessions(people, trials, seed)
    rows = frame(plan, run_sessions(plan, Workers(processes, folder)))
    zero = before.table(rows, seed)
    facts = {
        "command": f"`{command_of('headline')}`",
        "versions": made_with(*VERSIONS),
        "seed": seed,
        "people": f"{people} of each cohort",
    }
    write([before.section(zero), headline.section(rows)], facts, out, TITLE, before.in_words(zero))
    shutil.rmtree(folder)
    print(out.with_suffix(".md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    understood("headline")
    typer.run(main)
