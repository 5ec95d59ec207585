"""What stands between the default and the oracle: the default again, told ever more about the people it meets.

    python benchmarks/limits.py --out benchmarks/results/limits

The oracle knows a person's response and that there is a window. Here the default's own model is given the cohort's
laws as its prior, first with "no window" as probable as the default has it, then knowing that there is one. Uniform
laws are told by their SD, and artefacts it goes on expecting. The same people as in `benchmarks/acquisition.py` with
the same seed; what it writes is told in the same way.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer
from rich.progress import Progress

from acquisition import MARKS, facts_of, run, run_oracle, write
from isiw.studies import Study, StudyStrategy

# The laws of the cohorts; scales are median, SD and tail, of the logarithm where it is one. Uniform and fixed numbers
# have the SD that they have, the fixed one a small one.
PEOPLE: dict[str, Any] = {
    "start_ms": [5.0, 110.0],
    "hit_delay_ms": [180.0, 5.8],
    "p_anywhere": 0.0,
    "width_ms": [100.0, 0.42, 0.0],
    "p_shape": [1.0, 0.0, 0.0, 0.0],
    "drift_sd": 0.0,
    "startup": [0.0, 0.0],
}
TOLD: dict[str, dict[str, Any]] = {
    "recruitment": PEOPLE
    | {
        "p_noise": [0.0, 0.0, 1.0, 0.0],
        "p_hand": 0.0,
        "floor_mv": [0.010, 0.25, 0.0],
        "floor_log_sd": [0.18, 0.2, 0.0],
        "recruitment_ratio": [16.0, 0.43, 0.0],
        "input_sd": [2.1, 0.17, 0.0],
        "output_sd": [0.39, 0.15, 0.0],
        "boost": [3.4, 0.33, 0.0],
        "rest": [-4.5, 0.35, 0.0],
    },
    "gaussian": PEOPLE
    | {
        "p_noise": [1.0, 0.0, 0.0, 0.0],
        "floor_mv": [0.008, 0.3, 0.0],
        "floor_log_sd": [0.35, 0.02, 0.0],
        "gain_ratio": [7.5, 0.58, 0.0],
        "cv": [0.63, 0.23, 0.0],
    },
}


def studies(plan: dict[str, Any]) -> dict[str, Study]:
    """The default as it is, told a cohort's laws, and told besides that there is a window; and on non-responders."""
    planned = {}
    for cohort, laws in TOLD.items():
        told = StudyStrategy("default", {"prior": laws}, label=f"told-{cohort}")
        certain = StudyStrategy("default", {"prior": laws | {"p_window": 1.0}}, label=f"told-{cohort}-and-window")
        planned[cohort] = Study((StudyStrategy("default"), told, certain), (cohort,), **plan)
        planned[f"{cohort}-nonresponder"] = Study((told,), ("nonresponder",), **plan)
    return planned


def main(
    people: Annotated[int, typer.Option(help="People a cohort.")] = 200,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts.")] = 10_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("limits"),
) -> None:
    """Tell the default ever more about simulated people."""
    marks = tuple(mark for mark in MARKS if mark <= trials)
    plan = {"people": people, "seed": seed, "trials": trials, "marks": marks, "stopping": "ignored"}
    tables = []
    with Progress() as progress:
        for name, study in studies(plan | {"engine": "batched"}).items():
            tables += [run(study, out.with_suffix(".parts") / name, workers, progress)]
            tables += [run_oracle(study, workers, progress)]
    write(pd.concat(tables, ignore_index=True), facts_of("benchmarks/limits.py", seed, people), out)
    print(out.with_suffix(".md").read_text())


if __name__ == "__main__":
    typer.run(main)
