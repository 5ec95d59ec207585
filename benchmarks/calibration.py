"""Whether the posteriors are honest: simulation-based calibration, and coverage on people that no model has drawn.

    python -m benchmarks.calibration --out benchmarks/results/calibration

First, people of a model's own prior: each has MEPs at random ISIs of the valve space, by the model's own law; the ranks
of the true edges among the posterior's samples must be uniform, 90 % intervals must hold 90 % of them, and the expected
F1 and the probability of a window must come true. Second, people of the cohorts, examined by a Gaussian-process
strategy, whose prior they were not drawn from.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import matplotlib.figure
import numpy as np
import pandas as pd
import scipy.stats
import torch
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.metrics import covers, edge_ranks, f1
from isiw.models.protocol import Observation, Posterior, PriorPerson
from isiw.studies import paired_sessions, run_study

SPACE = isiw.VALVE_SPACE
MODELS = ("particles", "parametric")
STRATEGY_OF = {"particles": "default", "parametric": "parametric-mi"}
BINS = 20
TENTHS = 10


@dataclass(frozen=True)
class Batch:
    """Some replications of one model, run in one process."""

    model: str
    first_seed: int
    people: int
    trials: int


def replicate(batch: Batch) -> list[dict[str, float | None]]:
    """Draw people, show the model their trials, and judge what it makes of them."""
    torch.set_num_threads(1)
    model = isiw.make_strategy(STRATEGY_OF[batch.model]).model
    seeds = range(batch.first_seed, batch.first_seed + batch.people)
    isis_ms = np.stack([np.random.default_rng([seed, 1]).choice(SPACE.grid_ms, batch.trials) for seed in seeds])
    people = [model.simulate(SPACE, seed, isi_ms) for seed, isi_ms in zip(seeds, isis_ms, strict=True)]
    meps_mv = np.stack([person.mep_mv for person in people])
    told = [_observation(*trial) for trial in zip(isis_ms.T, meps_mv.T, strict=True)]
    begun = model.begin(SPACE, batch.first_seed, batch.people)
    return list(_judged(functools.reduce(model.update, told, begun), people, seeds))


def _observation(isi_ms: np.ndarray, mep_mv: np.ndarray) -> Observation:
    return Observation.of(isi_ms.tolist(), mep_mv.tolist())


def _judged(
    posterior: Posterior, people: Sequence[PriorPerson], seeds: Sequence[int]
) -> Iterator[dict[str, float | None]]:
    """What was expected and what was; ranks and coverage of the edges, which people without a window do not have."""
    for number, (person, seed) in enumerate(zip(people, seeds, strict=True)):
        estimate = posterior.estimate(number)
        found = {"probability": estimate.probability, "present": float(person.window is not None)}
        found |= {"expected_f1": estimate.expected_f1, "f1": f1(estimate, person.window, SPACE)}
        if person.window is None:
            yield found
            continue
        start, end = edge_ranks(estimate, person.window, SPACE, np.random.default_rng([seed, 2]))
        covered = covers(estimate, person.window, SPACE) or (math.nan, math.nan)
        yield found | {"start_rank": start, "end_rank": end, "start_covered": covered[0], "end_covered": covered[1]}


def calibration(model: str, replications: int, trials: int, seed: int, workers: int) -> pd.DataFrame:
    """What many replications of one model came to."""
    size = 25
    batches = [Batch(model, seed + first, size, trials) for first in range(0, replications, size)]
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        done = track(pool.map(replicate, batches), model, total=len(batches), console=Console(stderr=True))
        return pd.DataFrame([row for rows in done for row in rows], dtype=float)


def summary(rows: pd.DataFrame) -> dict[str, float]:
    """Uniformity of the ranks and coverage of the intervals."""
    facts: dict[str, float] = {"with a window": rows["start_rank"].count()}
    for edge in ("start", "end"):
        ranks = rows[f"{edge}_rank"].dropna()
        facts[f"{edge} p (χ²)"] = scipy.stats.chisquare(np.histogram(ranks, BINS, (0, 1))[0]).pvalue
        facts[f"{edge} p (KS)"] = scipy.stats.kstest(ranks, "uniform").pvalue
        facts[f"{edge} covered"] = rows[f"{edge}_covered"].mean()
    return facts


def by_tenths(tables: dict[str, pd.DataFrame], expected: str, actual: str) -> pd.DataFrame:
    """What each model expected against what was, by tenths of what was expected."""
    rows = pd.concat([table.assign(model=name) for name, table in tables.items()])
    tenth = (rows[expected] * TENTHS).astype(int).clip(0, TENTHS - 1) / TENTHS
    groups = rows.groupby(["model", tenth.rename(f"{expected} from")])
    people, error = groups.size().rename("people"), groups[actual].sem().rename("standard error")
    return pd.concat([people, groups[[expected, actual]].mean(), error], axis=1).reset_index()


def figure(tables: dict[str, pd.DataFrame]) -> matplotlib.figure.Figure:
    """Histograms of the ranks, with the band in which 99 % of honest bars lie."""
    picture = matplotlib.figure.Figure(figsize=(8, 2.6 * len(tables)), layout="constrained")
    for line, (name, rows) in zip(picture.subplots(len(tables), 2, squeeze=False), tables.items(), strict=True):
        low, high = scipy.stats.binom.ppf((0.005, 0.995), rows["start_rank"].count(), 1 / BINS)
        for axes, edge in zip(line, ("start", "end"), strict=True):
            axes.hist(rows[f"{edge}_rank"].dropna(), BINS, range=(0, 1))
            axes.axhspan(low, high, color="black", alpha=0.15)
            axes.set(title=f"{name}: {edge}", xlabel="rank of the true edge", ylabel="people")
    return picture


def smooth_people(strategy: str, cohorts: tuple[str, ...], people: int, seed: int, workers: int) -> pd.DataFrame:
    """Coverage of a strategy's intervals on people of some cohorts, by trial."""
    sessions = paired_sessions([strategy], cohorts, people, seed=seed, trials=30, marks=(20, 30))
    with Console(stderr=True).status(f"{strategy} on {', '.join(cohorts)}"):
        rows = run_study(sessions, workers=workers)
    groups = rows[rows["true_window"]].groupby(["strategy", "cohort", "trial"])
    return groups[["f1", "start_covered", "end_covered"]].mean().reset_index()


def markdown(table: pd.DataFrame) -> str:
    """A table in Markdown."""
    lines = [list(table.columns), ["---"] * table.shape[1]]
    lines += [[f"{v:.3f}" if isinstance(v, float) else str(v) for v in row] for row in table.to_numpy()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Measure, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", default=",".join(MODELS), help="comma-separated")
    parser.add_argument("--replications", type=int, default=1000)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--people", type=int, default=25, help="people a cohort for the Gaussian process; 0 skips it")
    parser.add_argument("--seed", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("calibration"), help="path of the results, without suffix")
    chosen = parser.parse_args()
    run = functools.partial(
        calibration, replications=chosen.replications, trials=chosen.trials, seed=chosen.seed, workers=chosen.workers
    )
    tables = {model: run(model) for model in chosen.models.split(",")}
    table = pd.DataFrame([{"model": name, **summary(rows)} for name, rows in tables.items()])
    foretold = [by_tenths(tables, "expected_f1", "f1"), by_tenths(tables, "probability", "present")]
    parts = [markdown(table), *map(markdown, foretold)]
    if chosen.people:
        cohorts = ("gaussian", "skewed", "plateau")
        parts.append(markdown(smooth_people("gp-straddle", cohorts, chosen.people, chosen.seed, chosen.workers)))
    versions, command = made_with("torch", "pyro-ppl", "gpytorch", "botorch", "numpy"), command_of("calibration")
    drawn = f"seed {chosen.seed}, {chosen.replications} people of each model's own, {chosen.trials} trials"
    facts = f"- command: `{command}`\n- {drawn}\n- {versions}"
    text = "\n\n".join([facts, *parts])
    print(text)
    chosen.out.with_suffix(".md").write_text(f"{text}\n")
    ranks = {name: json.loads(rows.to_json(orient="split", double_precision=4)) for name, rows in tables.items()}
    chosen.out.with_suffix(".json").write_text(json.dumps({"command": command, "versions": versions, "rows": ranks}))
    figure(tables).savefig(chosen.out.with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    understood("calibration")
    main()
