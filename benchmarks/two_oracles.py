"""What it is worth to know that there is a window: the oracle, and a second one that is not told it.

    python -m benchmarks.two_oracles --cohorts recruitment,gaussian --people 200 --out benchmarks/results/two_oracles

writes a table (Markdown, JSON) of both on the same people, paired. What is behind the second oracle can still be
gained; the first knows more than anybody can before a person's first MEP.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from rich.progress import Progress

from benchmarks.oracle import P_WINDOW, simulate_oracle, simulate_second_oracle
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_tables
from isiw.design import VALVE_SPACE
from isiw.studies import paired_sessions, run_study

MARKS = (5, 10, 15, 20, 30, 40)
TITLE = "Both oracles"
KEYS = ["cohort", "person", "trial"]


def both(cohorts: list[str], people: int, seed: int, trials: int, workers: int, progress: Progress) -> pd.DataFrame:
    """F1 of both, a row a person and marked trial.

    Args:
        cohorts: whose windows the oracle knows.
        people: of each.
        seed: of the people.
        trials: of a session.
        workers: processes.
        progress: where to show how far it is.
    """
    marks = tuple(mark for mark in MARKS if mark <= trials)
    sessions = paired_sessions(["oracle"], cohorts, people, seed=seed, trials=trials, marks=marks, space=VALVE_SPACE)
    found = {}
    for name, simulate in (("oracle", simulate_oracle), ("second", simulate_second_oracle)):
        bar = progress.add_task(name, total=len(sessions))
        rows = run_study(sessions, workers=workers, run=simulate, on_done=lambda _s, _r, bar=bar: progress.advance(bar))
        found[name] = rows.set_index(KEYS)["f1"]
    return pd.DataFrame(found).reset_index()


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Means by cohort and trial, and what the knowledge is worth with its standard error; rows as `both` gives them."""
    groups = rows.assign(knowledge=rows["oracle"] - rows["second"]).groupby(["cohort", "trial"], sort=False)
    means = groups[["oracle", "second", "knowledge"]].mean().assign(knowledge_se=groups["knowledge"].sem())
    means.insert(0, "n", groups.size())
    return means.reset_index()


def main(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = "recruitment,gaussian",
    people: Annotated[int, typer.Option(help="People a cohort.")] = 200,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 40,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 100_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("two_oracles"),
) -> None:
    """Run both oracles on the same people."""
    with Progress() as progress:
        rows = both(cohorts.split(","), people, seed, trials, workers, progress)
    facts = facts_of("two_oracles", "numpy", seed=seed, people=people, p_window=P_WINDOW)
    write_tables({TITLE: table(rows)}, facts, out)
    print(out.with_suffix(".md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    understood("two_oracles")
    typer.run(main)
