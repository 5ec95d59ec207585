"""What it is worth to know that there is a window: the oracle, and a second one that is not told it.

    python -m benchmarks.two_oracles --cohorts recruitment,gaussian --people 200 --out benchmarks/results/two_oracles

writes tables (Markdown, JSON) of both on the same people, paired, and of the default where `people.json` has it of as
many of the same people. What is behind the second oracle can still be gained; the first knows more than anybody can
before a person's first MEP.
"""

from __future__ import annotations

import json
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

PEOPLE = Path(__file__).parent / "results" / "people.json"
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


def table(rows: pd.DataFrame, default: pd.DataFrame) -> pd.DataFrame:
    """Means by cohort and trial, what the knowledge is worth with its standard error, and the default behind both.

    Args:
        rows: as `both` gives them.
        default: cohort, trial, n and f1 of the default on the same people; rows of another number are left out.
    """
    groups = rows.assign(knowledge=rows["oracle"] - rows["second"]).groupby(["cohort", "trial"], sort=False)
    means = groups[["oracle", "second", "knowledge"]].mean().assign(knowledge_se=groups["knowledge"].sem())
    means.insert(0, "n", groups.size())
    merged = means.reset_index().merge(default, on=["cohort", "trial", "n"], how="left")
    return merged.assign(behind_oracle=merged["oracle"] - merged["f1"], behind_second=merged["second"] - merged["f1"])


def of_the_default(seed: int) -> pd.DataFrame:
    """The committed F1 of the default on people of this seed; none of another."""
    content = json.loads(PEOPLE.read_text(encoding="utf-8"))
    rows = pd.DataFrame(content["By trial"])[["cohort", "trial", "n", "f1"]]
    return rows if content["facts"]["seed"] == seed else rows[:0]


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
    write_tables({TITLE: table(rows, of_the_default(seed))}, facts, out)
    print(out.with_suffix(".md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    understood("two_oracles")
    typer.run(main)
