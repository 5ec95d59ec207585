"""The same person another day: what a first session is worth for the second.

    python -m benchmarks.another_day --people 200 --seed 100000 --out benchmarks/results/another_day

People of `another-day` are measured on the first day with the default, and on the second day with what that session
taught and, as a yardstick, with the built-in prior.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pandas as pd
import torch
import typer

import isiw
from benchmarks.earlier import logged_session, measured
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_table
from isiw.models.particles.prior import Prior
from isiw.studies import SimulatedSession, simulate
from isiw.subjects import cohort

MARKS = (1, 5, 10, 20, 25, 40)
COHORT = "another-day"


@dataclass(frozen=True)
class Unit:
    """One person.

    Args:
        person: number of the person.
        seed: of the cohort.
        earlier_trials: of the first day.
        trials: of the second day.
    """

    person: int
    seed: int
    earlier_trials: int
    trials: int


def examine(unit: Unit) -> pd.DataFrame:
    """Both days of one person; columns as in `isiw.studies.simulate`, `day`, `stayed`, and the first day's alone."""
    torch.set_num_threads(1)
    first, second = cohort(COHORT, 2 * unit.person + 2, unit.seed)[-2:]
    marks = tuple(mark for mark in MARKS if mark <= unit.earlier_trials)
    number = 2 * unit.person
    rows = [simulate(SimulatedSession("default", COHORT, number, unit.seed, marks[-1], marks)).assign(day=1)]
    with tempfile.TemporaryDirectory() as folder:
        log = logged_session(first, "P", unit.seed + number, unit.earlier_trials, Path(folder))
        known = isiw.priors.after(isiw.read_session(log))
    marks = tuple(mark for mark in MARKS if mark <= unit.trials)
    for label, prior in {"after": known, "fresh": Prior()}.items():
        settings = (("prior", prior),)
        session = SimulatedSession(
            "default", COHORT, number + 1, unit.seed, unit.trials, marks, settings=settings, label=label
        )
        rows.append(simulate(session).assign(day=2))
    return pd.concat(rows, ignore_index=True).assign(stayed=first.profile.width_ms == second.profile.width_ms)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 with its standard error, and coverage, by day, strategy, trial and whether the window stayed."""
    either = pd.concat(
        [rows.assign(window=rows["stayed"].map({True: "stayed", False: "anew"})), rows.assign(window="all")]
    )
    groups = either.groupby(["day", "strategy", "window", "trial"])
    f1 = groups["f1"].agg(f1="mean", se="sem", people="count")
    return f1.join(groups[["start_covered", "end_covered"]].mean()).reset_index()


def main(
    people: Annotated[int, typer.Option(help="People.")] = 200,
    earlier_trials: Annotated[int, typer.Option(help="Trials of the first day.")] = 40,
    trials: Annotated[int, typer.Option(help="Trials of the second day.")] = 40,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 100_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("another_day"),
) -> None:
    """Measure the same people on another day."""
    units = [Unit(person, seed, earlier_trials, trials) for person in range(people)]
    rows = measured(examine, units, workers, out)
    write_table(summary(rows), facts_of("another_day", "torch", "numpy", seed=seed, people=people), out)


if __name__ == "__main__":
    understood("another_day")
    typer.run(main)
