"""Strategies × cohorts × paired people → F1 by trial, coverage, false decisions and latency, the oracle beside them.

    python benchmarks/acquisition.py --out benchmarks/results/acquisition

writes a table (Markdown), the raw rows with versions, command and seeds (JSON), and a figure (PNG). Reported people
come from seed 10,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
import platform
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import matplotlib.figure
import numpy as np
import pandas as pd
import torch
import typer
from rich.progress import Progress

import isiw
from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.studies import SimulatedSession, paired_sessions, run_study, simulate
from isiw.subjects import COHORTS
from oracle import ORACLE_COHORTS, simulate_oracle

MARKS = (5, 10, 12, 15, 20, 25, 30, 40, 60, 80)
SPACES = {"valve": VALVE_SPACE, "impact": IMPACT_SPACE}


def run_session(session: SimulatedSession) -> pd.DataFrame:
    """Run one session with the oracle or a named strategy."""
    return simulate_oracle(session) if session.strategy == "oracle" else simulate(session)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a strategy, cohort and trial: mean F1 with its standard error, coverage, and rates of "no window"."""
    groups = rows.groupby(["cohort", "strategy", "trial"])
    return pd.DataFrame(
        {
            "people": groups.size(),
            "f1": groups["f1"].mean(),
            "f1_se": groups["f1"].sem(),
            "start_coverage": groups["start_covered"].mean(),
            "end_coverage": groups["end_covered"].mean(),
            "called_none": 1.0 - groups["reported_window"].mean(),
            "ask_ms": groups["ask_ms"].median(),
            "tell_ms": groups["tell_ms"].median(),
        }
    ).reset_index()


def figure(table: pd.DataFrame) -> matplotlib.figure.Figure:
    """Mean F1 by trial, a panel a cohort."""
    names = list(table["cohort"].unique())
    columns = min(4, len(names))
    lines = -(-len(names) // columns)
    picture = matplotlib.figure.Figure(figsize=(3.4 * columns, 2.8 * lines), layout="constrained")
    for axes, name in zip(picture.subplots(lines, columns, squeeze=False).flat, names, strict=False):
        for strategy, curve in table[table["cohort"] == name].groupby("strategy"):
            style = {"color": "black", "linestyle": "--"} if strategy == "oracle" else {}
            axes.errorbar(curve["trial"], curve["f1"], curve["f1_se"], label=strategy, **style)
        axes.set(title=name, xlabel="trials", ylabel="mean F1", ylim=(0, 1))
        axes.legend(fontsize=7)
    return picture


def write(rows: pd.DataFrame, facts: dict[str, object], out: Path) -> None:
    """Table, rows and figure."""
    out.parent.mkdir(parents=True, exist_ok=True)
    table = summary(rows)
    lines = [" | ".join(table.columns), " | ".join("---" for _ in table.columns)]
    lines += [" | ".join(f"{v:.3f}" if isinstance(v, float) else str(v) for v in row) for row in table.to_numpy()]
    header = "\n".join(f"- {key}: `{value}`" for key, value in facts.items())
    body = "\n".join(f"| {line} |" for line in lines)
    out.with_suffix(".md").write_text(f"{header}\n\n{body}\n")
    records = json.loads(table.to_json(orient="records", double_precision=6))
    out.with_suffix(".json").write_text(json.dumps({"facts": facts, "summary": records}, indent=1))
    figure(table).savefig(out.with_suffix(".png"), dpi=110)


def main(  # noqa: PLR0913 - a command's options are its arguments
    strategies: Annotated[str, typer.Option(help="Named strategies, comma-separated.")] = "default",
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = ",".join(COHORTS),
    people: Annotated[int, typer.Option(help="People a cohort.")] = 200,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 10_000,
    space: Annotated[str, typer.Option(help="valve or impact.")] = "valve",
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("acquisition"),
    *,
    quick: Annotated[bool, typer.Option(help="Three cohorts, few people: under two minutes.")] = False,
) -> None:
    """Compare strategies on paired simulated people."""
    names = cohorts.split(",")
    if quick:
        names, people, trials = ["gaussian", "recruitment", "nonresponder"], 6, 20
    marks = tuple(mark for mark in MARKS if mark <= trials)
    plan = {"seed": seed, "trials": trials, "marks": marks, "space": SPACES[space]}
    sessions = paired_sessions(strategies.split(","), names, people, **plan)
    sessions += paired_sessions(["oracle"], [name for name in names if name in ORACLE_COHORTS], people, **plan)
    rows = with_progress(sessions, workers)
    versions = {m.__name__: m.__version__ for m in (isiw, torch, np)} | {"python": platform.python_version()}
    command = shlex.join(["python", "benchmarks/acquisition.py", *sys.argv[1:]])
    facts = {"command": command, "versions": versions, "seed": seed, "space": space, "people": people}
    write(rows, facts, out)
    print(summary(rows).to_string(index=False, float_format=lambda value: f"{value:.3f}"))


def with_progress(sessions: Sequence[SimulatedSession], workers: int) -> pd.DataFrame:
    """Run sessions behind a progress bar."""
    with Progress() as progress:
        bar = progress.add_task("sessions", total=len(sessions))
        return run_study(sessions, workers=workers, run=run_session, on_done=lambda _s: progress.advance(bar))


if __name__ == "__main__":
    typer.run(main)
