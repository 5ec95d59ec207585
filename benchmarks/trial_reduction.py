"""The dissertation's reduction of trials, reproduced.

    python -m benchmarks.trial_reduction --quick
    python -m benchmarks.trial_reduction
    python -m benchmarks.trial_reduction --rows 88

writes a report (Markdown), its tables with versions, command and seed (JSON) and figures (PNG). Run it from the
project's root. `--rows` plays only the main comparison, with so many sessions a row, and judges its claims again.
Reported people come from seed 10,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import os
import shutil
import time
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import joblib
import pandas as pd
import typer

from benchmarks.dissertation.claims import claims_as_json
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.reduction import (
    comparison,
    conventional,
    gaussians,
    initial,
    online,
    particles,
    pf_readings,
    reading_table,
    rows,
    verdicts,
    wrong,
)
from benchmarks.reduction.document import write
from benchmarks.reduction.parallel import Workers, frame, in_parallel, run_sessions
from benchmarks.reduction.size import FEW, FULL, Size

Rows = dict[ModuleType, pd.DataFrame]
Measured = tuple[dict[str, pd.DataFrame], list[Any]]
"""The sessions' rows by part, and the sessions on waveforms."""

RESULTS = Path("benchmarks/results/trial_reduction")
TITLE = "The dissertation's reduction of trials, reproduced"
PARTS = (comparison, reading_table, pf_readings, initial, particles, gaussians, wrong)
VERSIONS = ("numpy", "scipy", "torch", "scikit-learn", "statsmodels")


def measured(size: Size, seed: int, workers: Workers) -> Measured:
    """Run everything."""
    plans = {part: part.sessions(size, seed) for part in PARTS}
    outcomes = run_sessions((session for plan in plans.values() for session in plan), workers)
    found = {part.__name__: frame(plan, outcomes) for part, plan in plans.items()}
    waveforms = in_parallel(online.examine, online.plan(size.online, seed, size.default), workers, "online")
    return found, waveforms


def report(found: Measured, facts: dict[str, Any], out: Path) -> None:
    """Tell it."""
    named, waveforms = found
    of_part = {part: named[part.__name__] for part in PARTS}
    claims = verdicts.all_claims(of_part, waveforms)
    sections = [
        verdicts.section(claims),
        comparison.section(of_part[comparison]),
        reading_table.section(of_part[reading_table]),
        pf_readings.section(of_part[pf_readings]),
        conventional.section_sweeps(of_part[comparison]),
        conventional.section_burden(of_part[comparison]),
        initial.section(of_part[initial]),
        particles.section(of_part[particles]),
        gaussians.section(of_part[gaussians], of_part[comparison]),
        online.section(waveforms),
    ]
    opening = verdicts.opening(claims, of_part[comparison])
    write(sections, facts, out, TITLE, opening, claims_as_json(claims))


def facts(size: Size, seed: int, processes: int, took: str) -> dict[str, object]:
    """What a run was; telling it again does not change it."""
    return {
        "command": f"`{command_of('trial_reduction')}`",
        "versions": made_with(*VERSIONS),
        "seed": seed,
        "sessions": ", ".join(f"{name} {count}" for name, count in vars(size).items()),
        "took": f"{took} with {processes} process{'' if processes == 1 else 'es'}",
    }


def main(
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 10_000,
    processes: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = RESULTS,
    *,
    few: Annotated[bool, typer.Option(help="Hardly any people.")] = False,
    go_on: Annotated[bool, typer.Option(help="Go on with a run that was interrupted, with the same code.")] = False,
    again: Annotated[bool, typer.Option(help="Tell once more what the last run measured.")] = False,
    rows_of: Annotated[
        int, typer.Option("--rows", help="Only the main comparison, so many sessions a row, and the claims about it.")
    ] = 0,
) -> None:
    """Reproduce the dissertation's reduction of trials."""
    kept = out.with_suffix(".parts")
    if rows_of:
        workers = Workers(processes, kept.with_suffix(".done.parts"))
        made = {"command": f"`{command_of('trial_reduction')}`", "versions": made_with(*VERSIONS), "seed": seed}
        print(rows.rewritten(rows.measured(replace(FULL, kim=rows_of), seed, workers), made, out))
        return
    if not again:
        run(FEW if few else FULL, seed, processes, kept, go_on=go_on)
    if not kept.exists():
        raise typer.BadParameter(f"{kept} is not there: run without --again first")
    found, facts = joblib.load(kept)
    report(found, facts, out)
    print(out.with_suffix(".md").read_text())


def run(size: Size, seed: int, processes: int, kept: Path, *, go_on: bool) -> None:
    """Measure, and keep what was measured in a file; results so far are in a folder beside it."""
    began_s = time.monotonic()
    folder = kept.with_suffix(".done.parts")
    if not go_on:
        shutil.rmtree(folder, ignore_errors=True)
    found = measured(size, seed, Workers(processes, folder))
    took = f"{(time.monotonic() - began_s) / 60:.1f} minutes{' after an interruption' if go_on else ''}"
    joblib.dump((found, facts(size, seed, processes, took)), kept)
    shutil.rmtree(folder)


if __name__ == "__main__":
    understood("trial_reduction")
    typer.run(main)
