"""Strategies × cohorts × paired people → F1 by trial, coverage, false decisions and latency, the oracle beside them.

    python -m benchmarks.acquisition --out benchmarks/results/acquisition

writes a table (Markdown), its figures with versions, command and seeds (JSON), and a picture (PNG). Sessions run side
by side, and are kept in a folder as they finish: the same command goes on where it was interrupted. Reported people
come from seed 10,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from rich.progress import Progress

from benchmarks.oracle import SPANS, simulate_oracle
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_tables
from benchmarks.zero_trials import fixed_windows
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.metrics import trials_to_criterion
from isiw.plots.comparison import study_figure
from isiw.plots.style import save_figure
from isiw.studies import (
    Processes,
    SimulatedSession,
    Study,
    StudyStrategy,
    conduct,
    paired_sessions,
    run_study,
    summarise,
)
from isiw.subjects.cohorts import COHORTS

MARKS = (0, 5, 10, 12, 15, 20, 25, 30, 40, 60, 80)
CRITERIA = (0.8, 0.9, 0.95)
SPACES = {"valve": VALVE_SPACE, "impact": IMPACT_SPACE}
KEYS = ["cohort", "strategy", "trial"]
MEANS = (
    "delivered",
    "f1",
    "f1_se",
    "behind_oracle",
    "behind_se",
    "behind_where_found",
    "start_coverage",
    "end_coverage",
    "called_none",
    "ask_ms",
    "tell_ms",
)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a cohort, strategy and trial: that of the study, and how much mean F1 is below the oracle's, paired.

    Of all people, and of those only whom a window is reported for: the oracle is told that there is a window.
    """
    oracle = rows[rows["strategy"] == "oracle"].set_index(["cohort", "person", "trial"])["f1"]
    behind = oracle.reindex(pd.MultiIndex.from_frame(rows[["cohort", "person", "trial"]])).to_numpy() - rows["f1"]
    found = behind.where(rows["reported_window"].astype(bool))
    groups = rows.assign(behind=behind, found=found).groupby(KEYS)
    paired = pd.DataFrame(
        {
            "behind_oracle": groups["behind"].mean(),
            "behind_se": groups["behind"].sem(),
            "behind_where_found": groups["found"].mean(),
        }
    )
    table = summarise(rows, errors=pd.DataFrame()).merge(paired, on=KEYS)
    return table[[*KEYS, "people", *MEANS]]


def decisions(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a cohort, strategy and trial: share of the people without a window given one, and of those with, none."""
    keys = [*KEYS, "noise"]
    table = rows[rows["strategy"] != "oracle"].copy()
    # Every second non-responder has recruitment noise.
    kinds = np.where(table["person"] % 2 == 0, "constant CV", "recruitment")
    table["noise"] = np.where(table["cohort"] == "nonresponder", kinds, "")
    table["false_window"] = table["reported_window"].where(~table["true_window"]).astype(float)
    none = table["answered"] & ~table["reported_window"]
    table["false_none"] = none.where(table["true_window"]).astype(float)
    return table.groupby(keys)[["false_window", "false_none"]].mean().reset_index()


def at_stopping(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a cohort and strategy: how often, when and with what its stopping rule ended the session."""
    last = rows[(rows["trial"] == rows.groupby(KEYS[:2])["trial"].transform("max")) & rows["converged"].notna()]
    stopped = last[last["converged"] == 1.0]
    groups, sessions = stopped.groupby(KEYS[:2]), last.groupby(KEYS[:2]).size()
    table = groups[["stop_trial", "stop_f1", "stop_start_covered", "stop_end_covered"]].mean()
    table = table.reindex(sessions.index)
    return table.assign(stopped=groups.size().reindex(sessions.index, fill_value=0) / sessions).reset_index()


def reached(table: pd.DataFrame) -> pd.DataFrame:
    """One row a cohort and strategy: mean pairs delivered from which on mean F1 stays at or above each criterion."""

    def first(group: pd.DataFrame, criterion: float) -> float:
        mark = trials_to_criterion(group["f1"], criterion)
        return float("nan") if mark is None else float(group["delivered"].iloc[mark - 1])

    groups = table.sort_values(KEYS).groupby(KEYS[:2])
    return (
        pd.DataFrame({f"F1 {c}": {name: first(group, c) for name, group in groups} for c in CRITERIA})
        .rename_axis(KEYS[:2])
        .reset_index()
    )


def write(rows: pd.DataFrame, facts: dict[str, object], out: Path, fixed: pd.DataFrame | None = None) -> None:
    """Tables and picture; `fixed` is what is reached without any trial, where that was measured."""
    table = summary(rows)
    tables = {
        "F1 by trial": table,
        "The best fixed window: F1 without any trial": pd.DataFrame() if fixed is None else fixed,
        "Pairs delivered from which on mean F1 is kept (among the marked trials)": reached(table),
        "False decisions": decisions(rows),
        "At the stopping rule": at_stopping(rows),
    }
    tables = {title: part for title, part in tables.items() if not part.empty}
    write_tables(tables, facts, out)
    save_figure(study_figure(table), out.with_suffix(".png"), overwrite=True)


def redraw(out: Path) -> None:
    """The picture of results that are there, drawn again."""
    records = json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))["F1 by trial"]
    save_figure(study_figure(pd.DataFrame(records)), out.with_suffix(".png"), overwrite=True)


def strategy_of(text: str) -> StudyStrategy:
    """`NAME`, or `NAME:ACQUISITION` for the same model with another acquisition function."""
    name, _, acquisition = text.partition(":")
    settings = {"acquisition": acquisition} if acquisition else {}
    return StudyStrategy(name, settings, label=f"{name}+{acquisition}" if acquisition else name)


def space_of(text: str) -> DesignSpace:
    """A space by name, or its high end [ms], counted from the valve or from the reference before the colon."""
    if text in SPACES:
        return SPACES[text]
    reference, _, high_ms = text.rpartition(":")
    return replace(SPACES[reference or "valve"], high_ms=float(high_ms))


def run(study: Study, folder: Path, workers: int, progress: Progress) -> pd.DataFrame:
    """All rows of a study; what its folder holds already is not run again."""
    units = study.units()
    names = ", ".join(strategy.label for strategy in study.strategies)
    bar = progress.add_task(f"{names}: {len(units)} batches", total=len(units))
    store = conduct(study, folder, Processes(workers), on_done=lambda _u, _r: progress.advance(bar))
    if len(failed := store.errors()):
        raise SystemExit(f"{len(failed)} sessions failed: {failed['error'].iloc[0]}")
    progress.update(bar, completed=len(units))
    return store.rows()


def run_oracle(
    study: Study,
    workers: int,
    progress: Progress,
    simulate: Callable[[SimulatedSession], pd.DataFrame] = simulate_oracle,
) -> pd.DataFrame:
    """An oracle on the same people, in those cohorts whose profiles it knows; their amplitudes as they are."""
    cohorts = [name for name in study.cohorts if name in SPANS]
    plan = {"seed": study.seed, "trials": study.trials, "marks": study.marks, "space": study.space}
    sessions = paired_sessions(["oracle"], cohorts, study.people, **plan)
    if not sessions:
        return pd.DataFrame()
    bar = progress.add_task("oracle", total=len(sessions))
    return run_study(sessions, workers=workers, run=simulate, on_done=lambda _s, _r: progress.advance(bar))


def main(  # noqa: PLR0913, PLR0917 - a command's options are its arguments
    strategies: Annotated[str, typer.Option(help="Comma-separated; NAME or NAME:ACQUISITION.")] = "default",
    others: Annotated[str, typer.Option(help="The same, with the first --other-people only.")] = (
        "particles-mi,gpr,nr,svmr,pf"
    ),
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = ",".join(COHORTS),
    people: Annotated[int, typer.Option(help="People a cohort.")] = 200,
    other_people: Annotated[int, typer.Option(help="People a cohort for the others.")] = 50,
    oracle_people: Annotated[int, typer.Option(help="People a cohort for the oracle, at most.")] = 200,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 10_000,
    space: Annotated[str, typer.Option(help="valve or impact, or with another high end [ms]: 300 or impact:300.")] = (
        "valve"
    ),
    amplitude: Annotated[float, typer.Option(help="Factor on all amplitudes.")] = 1.0,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("acquisition"),
    *,
    stopping: Annotated[bool, typer.Option(help="Note when the stopping rule fires: an estimate a trial.")] = True,
    only_draw: Annotated[bool, typer.Option(help="Draw the results again that are there; run nothing.")] = False,
) -> None:
    """Compare strategies on paired simulated people."""
    if only_draw:
        redraw(out)
        return
    names = cohorts.split(",")
    study = Study(
        strategies=tuple(strategy_of(text) for text in strategies.split(",")),
        cohorts=tuple(names),
        people=people,
        seed=seed,
        trials=trials,
        marks=tuple(mark for mark in MARKS if mark <= trials),
        space=space_of(space),
        amplitude=amplitude,
        stopping="noted" if stopping else "ignored",
        engine="batched",
    )
    studies = [study]
    if others:
        rest = tuple(strategy_of(text) for text in others.split(","))
        studies.append(replace(study, strategies=rest, people=min(people, other_people)))
    folder = out.with_suffix(".parts")
    with Progress() as progress:
        tables = [run(part, folder / str(number), workers, progress) for number, part in enumerate(studies)]
        if amplitude == 1.0:
            tables.append(run_oracle(replace(study, people=min(people, oracle_people)), workers, progress))
    fixed = fixed_windows(names, people, seed, study.space)
    facts = facts_of("acquisition", "torch", "numpy", seed=seed, people=people)
    write(pd.concat(tables, ignore_index=True), facts, out, fixed)
    print(out.with_suffix(".md").read_text())


if __name__ == "__main__":
    understood("acquisition")
    typer.run(main)
