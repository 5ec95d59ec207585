"""How many sessions of 30 trials of the default strategy a study runs per second: one at a time, and side by side.

    python -m benchmarks.throughput > benchmarks/results/throughput.md
    python -m benchmarks.throughput --law 500 > benchmarks/results/batch_law.md

The sessions are those of a study on the `recruitment` cohort in the valve space whose stopping rule is ignored and
whose estimate is recorded after 10, 20 and 30 trials. The clock starts when twice as many sessions, or batches, are
finished as there are workers, which have loaded everything by then, and stops at the last one. With `--law` nothing is
timed: the mean F1 of both engines is compared on so many people, who are the same.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")

import pandas as pd

from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.studies import Failure, Processes, Study, StudyStrategy, run_unit

TRIALS = 30
LAW_TRIALS = {"default": TRIALS, "nr": TRIALS, "pf": 4 * TRIALS}  # a generation of the particle filter is 30 trials


def results(study: Study, workers: int) -> Iterator[pd.DataFrame]:
    """The rows of a study, unit by unit as they are finished; any failure ends it."""
    for unit, result in Processes(workers).results(run_unit, study.units()):
        if isinstance(result, Failure):
            sys.exit(f"{unit.key} failed: {result.error}\n{result.details}")
        yield result


def sessions_per_second(study: Study, workers: int) -> float:
    """How many sessions of a study so many workers finish per second, once each had time to finish two units."""
    units, began_s = 2 * workers, 0.0
    more = replace(study, people=study.people + units * (study.batch if study.engine == "batched" else 1))
    for number, _ in enumerate(results(more, workers), 1):
        if number == units:
            began_s = time.perf_counter()
    return study.people / (time.perf_counter() - began_s)


def print_throughput(plan: Study, arguments: argparse.Namespace) -> None:
    """Time both engines, with one worker and with several."""
    batched = replace(plan, engine="batched", batch=arguments.batch, people=arguments.batch * arguments.batches)
    measured = [("one at a time", plan, n) for n in (1, arguments.workers)]
    measured += [(f"{arguments.batch} side by side", batched, n) for n in (1, arguments.workers)]
    print("| engine | sessions | workers | sessions per second | against one worker |\n|---|---|---|---|---|")
    alone = 0.0
    for engine, study, workers in measured:
        rate = sessions_per_second(study, workers)
        alone = rate if workers == 1 else alone
        print(f"| {engine} | {study.people} | {workers} | {rate:.2f} | {rate / alone:.2f} |", flush=True)


def print_law(plan: Study, strategies: Sequence[str], workers: int) -> None:
    """Compare the mean F1 of both engines, person by person."""
    print("| strategy | trials | F1 one at a time | F1 side by side | difference ± SE |\n|---|---|---|---|---|")
    for name in strategies:
        trials = LAW_TRIALS[name]
        study = replace(plan, strategies=(StudyStrategy(name),), trials=trials, marks=(trials // 2, trials))
        both = results(study, workers), results(replace(study, engine="batched"), workers)
        tables = [pd.concat(each, ignore_index=True) for each in both]
        f1 = [table.pivot_table(index="trial", columns="person", values="f1") for table in tables]
        difference = f1[1] - f1[0]
        for trial in study.marks:
            means = " | ".join(f"{each.loc[trial].mean():.4f}" for each in f1)
            paired = f"{difference.loc[trial].mean():+.4f} ± {difference.loc[trial].sem():.4f}"
            print(f"| {name} | {trial} | {means} | {paired} |", flush=True)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--single", type=int, default=40, help="sessions one at a time")
    parser.add_argument("--batches", type=int, default=4, help="batches")
    parser.add_argument("--batch", type=int, default=50, help="people side by side")
    parser.add_argument("--workers", type=int, default=2, help="as many as there are cores, beside one")
    parser.add_argument("--seed", type=int, default=10_000)
    parser.add_argument("--law", type=int, default=0, help="compare the mean F1 of both engines on so many people")
    parser.add_argument("--strategies", default=",".join(LAW_TRIALS), help="with --law: which, comma-separated")
    arguments = parser.parse_args()
    plan = Study(
        (StudyStrategy("default"),),
        ("recruitment",),
        people=arguments.law or arguments.single,
        seed=arguments.seed,
        trials=TRIALS,
        marks=(10, 20, TRIALS),
        stopping="ignored",
        batch=arguments.batch,
    )
    print(f"- command: `{command_of('throughput')}`")
    print(f"- {made_with('numpy', 'joblib')}")
    print(f"- {os.cpu_count()} cores, {platform.machine()}; one thread a worker\n")
    if arguments.law:
        print_law(plan, arguments.strategies.split(","), arguments.workers)
    else:
        print_throughput(plan, arguments)


if __name__ == "__main__":
    understood("throughput", prints=True)
    main()
