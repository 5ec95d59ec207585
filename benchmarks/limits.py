"""What stands between the default and the oracle: the default again, told ever more about the people it meets.

    python -m benchmarks.limits --out benchmarks/results/limits
    python -m benchmarks.limits --cohorts steep,late,flat,weak --seed 100000 --out benchmarks/results/limits_off_map

The oracle knows a person's response and that there is a window. Here the default's own model is given the cohort's
laws as its prior, first with "no window" as probable as the default has it, then knowing that there is one. Uniform
laws are told by their SD, and artefacts it goes on expecting.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer
from rich.progress import Progress

from benchmarks.beside_oracle import MARKS, run, run_oracle, write
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from isiw.studies import Study, StudyStrategy

# The laws of the cohorts, as one component a block; a number that is the same in everybody has a small SD.
PROFILE: dict[str, Any] = {
    "shapes": {"gaussian": 1.0, "skewed": 0.0, "plateau": 0.0, "two_peak": 0.0},
    "start": {
        "spans": [{"share": 1.0, "low_ms": 5.0, "high_ms": 110.0}],
        "hit_delay_ms": [180.0, 5.8],
        "p_anywhere": 0.0,
    },
    "widths": [{"share": 1.0, "width_ms": [100.0, 0.42]}],
}
PEOPLE: dict[str, Any] = {"profile": PROFILE, "session": {"drift_sd": 0.01, "startup": [0.0, 0.01]}}
FOREARM: dict[str, Any] = {
    "name": "forearm",
    "share": 1.0,
    "ratio": [16.0, 0.43],
    "slope_per_pct": [0.30, 0.01],
    "input_sd": [2.1, 0.17],
    "sigma_y": [0.39, 0.15],
    "boost_pct": [11.3, 0.33],
    "rest_pct": [-15.0, 1.2],
}
RECRUITMENT: dict[str, Any] = PEOPLE | {
    "noise": {"constant_cv": 0.0, "missing": 0.0, "recruitment": 1.0, "all_or_none": 0.0},
    "floors": [{"share": 1.0, "median_mv": [0.010, 0.25], "log_sd": [0.18, 0.2]}],
    "muscles": [FOREARM],
}
LATE: dict[str, Any] = PROFILE["start"] | {"spans": [{"share": 1.0, "low_ms": 80.0, "high_ms": 200.0}]}
TOLD: dict[str, dict[str, Any]] = {
    "recruitment": RECRUITMENT,
    "gaussian": PEOPLE
    | {
        "noise": {"constant_cv": 1.0, "missing": 0.0, "recruitment": 0.0, "all_or_none": 0.0},
        "floors": [{"share": 1.0, "median_mv": [0.008, 0.3], "log_sd": [0.35, 0.02]}],
        "gains": [{"share": 1.0, "ratio": [7.5, 0.58], "cv": [0.63, 0.23]}],
    },
    "steep": RECRUITMENT | {"muscles": [FOREARM | {"slope_per_pct": [0.60, 0.01], "input_sd": [1.76, 0.20]}]},
    "flat": RECRUITMENT | {"muscles": [FOREARM | {"slope_per_pct": [0.20, 0.01], "input_sd": [2.28, 0.13]}]},
    "weak": RECRUITMENT | {"muscles": [FOREARM | {"boost_pct": [5.9, 0.20]}]},
    "late": RECRUITMENT | {"profile": PROFILE | {"start": LATE}},
}


def studies(cohorts: list[str], plan: dict[str, Any]) -> dict[str, Study]:
    """The default as it is, told a cohort's laws, and told besides that there is a window; and on non-responders."""
    planned = {}
    for cohort in cohorts:
        laws = TOLD[cohort]
        told = StudyStrategy("default", {"prior": laws}, label=f"told-{cohort}")
        certain = StudyStrategy(
            "default",
            {"prior": laws | {"profile": laws["profile"] | {"p_window": 1.0}}},
            label=f"told-{cohort}-and-window",
        )
        planned[cohort] = Study((StudyStrategy("default"), told, certain), (cohort,), **plan)
        planned[f"{cohort}-nonresponder"] = Study((told,), ("nonresponder",), **plan)
    return planned


def main(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = "recruitment,gaussian",
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
        for name, study in studies(cohorts.split(","), plan | {"engine": "batched", "hit_delay": "stated"}).items():
            tables += [run(study, out.with_suffix(".parts") / name, workers, progress)]
            tables += [run_oracle(study, workers, progress)]
    write(pd.concat(tables, ignore_index=True), facts_of("limits", "torch", "numpy", seed=seed, people=people), out)
    print(out.with_suffix(".md").read_text())


if __name__ == "__main__":
    understood("limits")
    typer.run(main)
