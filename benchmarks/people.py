"""The default on people whom its prior was written for, and on unusual people.

    python -m benchmarks.people --cohorts recruitment,gaussian,late --people 200 --out benchmarks/results/people
    python -m benchmarks.people --cohorts electrical --space impact --out benchmarks/results/people_electrical

writes tables (Markdown) and their figures with versions, command and seeds (JSON): F1 and coverage by trial, what the
stopping rule comes to, and how well the expected F1 foretells the actual one. Sessions are kept in a folder beside the
tables as they finish: the same command goes on where it was interrupted. Reported people come from seed 100,000 on;
seeds below 1,000 are for work.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from rich.progress import Progress

from benchmarks.beside_oracle import run, run_oracle, space_of
from benchmarks.oracle import simulate_oracle, simulate_second_oracle
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import kept, write_tables
from benchmarks.zero_trials import without_any_trial
from isiw.decision import StopKind
from isiw.models.particles.prior import Prior
from isiw.studies import Study, StudyStrategy

MARKS = (5, 10, 15, 20, 25, 30, 40, 50, 60, 80)
TENTHS = 10
NONRESPONDER = "nonresponder"
ORACLES = {"oracle": simulate_oracle, "second": simulate_second_oracle}


def by_trial(rows: pd.DataFrame, *oracles: pd.DataFrame) -> pd.DataFrame:
    """F1, by how much that of oracles is larger on the same people, and coverage; with their standard errors.

    `knowledge` is by how much the first oracle's F1 is larger: what it is worth to know that there is a window.

    Args:
        rows: of the default.
        oracles: rows of those of `ORACLES`, in their order, as far as they were run.
    """
    keys = ["cohort", "person", "trial"]
    same = pd.MultiIndex.from_frame(rows[keys])
    found = rows.assign(called_none=~rows["reported_window"].astype(bool))
    behind = [f"behind_{name}" for name, _ in zip(ORACLES, oracles, strict=False)]
    for name, others in zip(behind, oracles, strict=True):
        found[name] = others.set_index(keys)["f1"].reindex(same).to_numpy() - rows["f1"]
    if len(behind) == len(ORACLES):
        found["knowledge"] = found["behind_oracle"] - found["behind_second"]
        behind.append("knowledge")
    grouped = found.groupby(["cohort", "trial"])
    names = ["f1", *behind, "expected_f1", "start_covered", "end_covered"]
    return _means(grouped, names).assign(called_none=grouped["called_none"].mean())


def at_stopping(rows: pd.DataFrame) -> pd.DataFrame:
    """Stimuli, F1 and coverage by cohort where the stopping rule fired, or at the last trial where it did not."""
    last = rows.sort_values("trial").groupby(["cohort", "person"]).tail(1)
    stopped = last["stop_trial"].notna()
    names = ["f1", "start_covered", "end_covered"]
    values = {name: last[f"stop_{name}"].where(stopped, last[name]) for name in names}
    ends = last.assign(**values, stimuli=last["stop_trial"].where(stopped, last["trial"]))
    grouped = ends.groupby("cohort")
    said_none = ends["stop_kind"] == StopKind.ABSENT
    return _means(grouped, ["stimuli", *names]).assign(stopped_on_none=said_none.groupby(ends["cohort"]).mean())


def foretold(rows: pd.DataFrame) -> pd.DataFrame:
    """Expected against actual F1, by tenths of the expected; non-responders weigh as much as the prior believes.

    What is called "no window" is right as often as there are non-responders, so that the share of them decides whether
    an expected F1 comes true.
    """
    tenth = (rows["expected_f1"] * TENTHS).astype(int).clip(0, TENTHS - 1) / TENTHS
    weighed = rows.assign(expected_from=tenth, weight=_weights(rows["cohort"]))
    means = [_weighted_mean(part).rename(start) for start, part in weighed.groupby("expected_from")]
    return pd.DataFrame(means).rename_axis("expected_from")


def _weights(cohorts: pd.Series) -> pd.Series:
    """Weights that give non-responders the share that the prior believes in, where there are any."""
    nobody = cohorts == NONRESPONDER
    if not nobody.any() or nobody.all():
        return pd.Series(1.0, cohorts.index)
    share = 1.0 - Prior().profile.p_window
    return nobody.map({True: share / nobody.mean(), False: (1.0 - share) / (1.0 - nobody.mean())})


def _weighted_mean(part: pd.DataFrame) -> pd.Series:
    """Expected and actual F1 of one tenth; the standard error is that between sessions."""
    sessions = part.groupby(["cohort", "person"])[["expected_f1", "f1", "weight"]].mean()
    marks = part.groupby(["cohort", "person"]).size()
    weights = (sessions["weight"] * marks / (sessions["weight"] * marks).sum()).to_numpy()
    means = weights @ sessions[["expected_f1", "f1"]].to_numpy()
    residuals = sessions["f1"].to_numpy() - means[1]
    error = float(np.sqrt((weights**2 * residuals**2).sum()))
    return pd.Series({"sessions": len(sessions), "expected_f1": means[0], "f1": means[1], "f1_se": error})


def _means(groups: pd.core.groupby.DataFrameGroupBy, names: list[str]) -> pd.DataFrame:
    means = groups[names].mean()
    errors = groups[names].sem().add_suffix("_se")
    both = pd.concat([groups.size().rename("n"), means, errors], axis=1)
    return both[["n", *(column for name in names for column in (name, f"{name}_se"))]]


def main(  # noqa: PLR0913, PLR0917 - an option each
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = "recruitment,gaussian,nonresponder",
    people: Annotated[int, typer.Option(help="People a cohort.")] = 100,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 100_000,
    hit_delay: Annotated[str, typer.Option(help="Whether what the rig knows is stated or unstated.")] = "stated",
    intensity: Annotated[str, typer.Option(help="Whether the intensity is stated or unstated.")] = "unstated",
    space: Annotated[str, typer.Option(help="valve or impact, or with another high end [ms]: impact:100.")] = "valve",
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("people"),
    *,
    oracles: Annotated[bool, typer.Option(help="Run both oracles on the same people.")] = True,
) -> None:
    """Run the default on simulated people."""
    study = Study(
        (StudyStrategy("default"),),
        tuple(cohorts.split(",")),
        people,
        seed,
        trials,
        tuple(sorted({*(mark for mark in MARKS if mark <= trials), trials})),
        engine="batched",
        batch=25,
        hit_delay=hit_delay,  # type: ignore[arg-type] # checked by the study
        intensity=intensity,  # type: ignore[arg-type] # likewise
        space=space_of(space),
    )
    with Progress() as progress:
        folder = out.with_suffix(".study")
        rows = run(study, folder, workers, progress)
        found = [
            kept(folder / f"{name}.parquet", partial(run_oracle, study, workers, progress, simulate))
            for name, simulate in ORACLES.items()
            if oracles
        ]
    tables = {
        "By trial": by_trial(rows, *found).reset_index(),
        "Without any trial": without_any_trial(study.cohorts, people, seed, study.space),
        "At the stopping rule": at_stopping(rows).reset_index(),
        "Expected F1": foretold(rows).reset_index(),
    }
    facts = facts_of("people", "torch", "numpy", seed=seed, people=people)
    write_tables(tables, facts, out)


if __name__ == "__main__":
    understood("people")
    np.seterr(all="raise", under="ignore")
    typer.run(main)
