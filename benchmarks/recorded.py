"""Strategies on people whose MEPs were recorded.

    python -m benchmarks.recorded --out benchmarks/results/recorded

What facilitation does to recorded amplitudes is put together in five ways, and non-responders have theirs as well
(`recorded_people.py`). What it writes is told as in `benchmarks/acquisition.py`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from rich.progress import Progress

from benchmarks.acquisition import MARKS, write
from benchmarks.before_and_now import prior_of_1bbe107
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.recorded_people import FOLDER, PEOPLE, RecordedSession
from isiw.studies import Failure, Processes, SimulatedSession
from isiw.studies.sessions import simulate_batch


def batches(
    strategies: list[str], people: int, size: int, plan: tuple[int, int, tuple[int, ...]]
) -> list[list[SimulatedSession]]:
    """Sessions of each strategy with each kind of people, so many side by side; the rig states its hit delay."""
    numbers = [range(first, min(first + size, people)) for first in range(0, people, size)]
    return [
        [RecordedSession(strategy, kind, person, *plan, stopping="noted").as_the_rig_states() for person in some]
        for strategy in strategies
        for kind in PEOPLE
        for some in numbers
    ]


def main(
    strategies: Annotated[str, typer.Option(help="Comma-separated.")] = "default,particles-mi,gp-straddle,nr,gpr,pf",
    people: Annotated[int, typer.Option(help="People of each kind.")] = 100,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 40,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 10_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("recorded"),
    *,
    earlier_prior: Annotated[bool, typer.Option(help="The default with the prior of 1bbe107.")] = False,
) -> None:
    """Compare strategies on recorded MEPs."""
    if not FOLDER.is_dir():
        raise SystemExit(f"the recorded sweeps are not at hand: {FOLDER} is no folder")
    plan = seed, trials, tuple(mark for mark in MARKS if mark <= trials)
    units, tables = batches(strategies.split(","), people, 50, plan), []
    if earlier_prior:
        prior = tuple(prior_of_1bbe107().items())
        units = [[replace(session, settings=(*session.settings, *prior)) for session in some] for some in units]
    with Progress() as progress:
        bar = progress.add_task("batches", total=len(units))
        for _, result in Processes(workers).results(simulate_batch, units):
            if isinstance(result, Failure):
                raise SystemExit(f"a batch failed: {result.error}\n{result.details}")
            tables.append(result)
            progress.advance(bar)
    write(pd.concat(tables, ignore_index=True), facts_of("recorded", "torch", "numpy", seed=seed, people=people), out)
    print(out.with_suffix(".md").read_text())


if __name__ == "__main__":
    understood("recorded")
    typer.run(main)
