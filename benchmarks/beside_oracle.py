"""Studies beside the oracle: F1 by trial, coverage, false decisions and latency, for `people` and `limits`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from rich.progress import Progress

from benchmarks.oracle import SPANS, simulate_oracle
from benchmarks.tables import write_tables
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.metrics import trials_to_criterion
from isiw.plots.comparison import study_figure
from isiw.plots.style import save_figure
from isiw.studies import Processes, SimulatedSession, Study, conduct, paired_sessions, run_study, summarise

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


def write(rows: pd.DataFrame, facts: dict[str, object], out: Path) -> None:
    """Tables and picture."""
    table = summary(rows)
    tables = {
        "F1 by trial": table,
        "Pairs delivered from which on mean F1 is kept (among the marked trials)": reached(table),
        "False decisions": decisions(rows),
        "At the stopping rule": at_stopping(rows),
    }
    tables = {title: part for title, part in tables.items() if not part.empty}
    write_tables(tables, facts, out)
    save_figure(study_figure(table), out.with_suffix(".png"), overwrite=True)


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
