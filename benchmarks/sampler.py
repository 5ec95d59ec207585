"""How far the particles of the default are from what many more say of the same trials: `python -m benchmarks.sampler`.

`record` keeps the trials of sessions with the default, and what 4,000 particles with twice the sweeps make of them.
`compare` gives the same trials to the default of the isiw that is imported, with several seeds, and says how often both
are sure and wrong; an earlier version is compared by putting its `src` before this one's. People are of the work seeds
where what this says is a choice's reason.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import torch
import typer

from benchmarks.before_and_now import study_of
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.steps import Noting
from isiw.metrics import f1
from isiw.models.particles.changes import ChangeKind
from isiw.models.protocol import Observation
from isiw.studies import summary
from isiw.studies.sessions import SimulatedSession, examine

MARKS = (20, 40, 60)
COHORTS = "retuned,step,above-threshold,recruitment"
KEYS = ["cohort", "person", "trial"]
SAID = ["probability", "of a step", "expected_f1"]
WRONG = "sure and wrong"

app = typer.Typer(help=__doc__)


def units_of(cohort: str, people: int, seed: int, trials: int) -> Iterator[Sequence[SimulatedSession]]:
    """Sessions with the default, side by side."""
    return (unit.sessions for unit in study_of(cohort, people, seed, (trials,)).units())


def said_of(
    sessions: Sequence[SimulatedSession], trials: pd.DataFrame, seed: int, particles: int | None = None, sweeps: int = 1
) -> pd.DataFrame:
    """What the default's particles, or so many with so many times the sweeps, make of recorded trials at the marks."""
    model, rows = sessions[0].player().model, list[dict[str, Any]]()
    own = model.moves
    moves = replace(own, sweeps=sweeps * own.sweeps, max_trial_sweeps=sweeps * own.max_trial_sweeps)
    model = replace(model, particles=particles or model.particles, moves=moves)
    posterior = model.begin(sessions[0].space, seed, len(sessions))
    for trial, told in trials.groupby("trial"):
        columns = (told.sort_values("person")[name].tolist() for name in ("isi_ms", "mep_mv", "isi_sd_ms"))
        posterior = model.update(posterior, Observation.of(*columns))
        if trial in MARKS:
            change = posterior.swarm.latents.change
            stepped = (change != ChangeKind.NONE) & (change != ChangeKind.ENHANCEMENT)
            of_step = (stepped * np.exp(posterior.swarm.log_weights)).sum(-1).tolist()
            for number, session in enumerate(sessions):
                estimate = posterior.estimate(number)
                actual = f1(estimate, session.subject().window(session.space, int(trial)), session.space)
                wrong = estimate.expected_f1 >= summary.SURE_F1 and estimate.expected_f1 - actual >= summary.WRONG_F1
                said = (estimate.probability, of_step[number], estimate.expected_f1, float(wrong))
                who = (session.cohort, session.person, trial)
                rows.append(dict(zip(KEYS, who, strict=True)) | dict(zip([*SAID, WRONG], said, strict=True)))
    return pd.DataFrame(rows)


@app.command()
def record(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = COHORTS,
    people: Annotated[int, typer.Option(help="People a cohort.")] = 25,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 800,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    particles: Annotated[int, typer.Option(help="Particles of the yardstick.")] = 4000,
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("sampler"),
) -> None:
    """Keep trials, and what many particles say of them."""
    torch.set_num_threads(1)
    out.mkdir(parents=True, exist_ok=True)
    for name in cohorts.split(","):
        tables, yardsticks = [], []
        for sessions in units_of(name, people, seed, trials):
            crowd = Noting(sessions)
            examine(sessions, crowd)
            tables.append(pd.DataFrame(crowd.named))
            yardsticks += [said_of(sessions, tables[-1], n, particles, sweeps=2) for n in (1001, 1002)]
        pd.concat(tables).to_parquet(out / f"{name}.trials.parquet")
        means = pd.concat(yardsticks).groupby(KEYS, as_index=False)[[*SAID, WRONG]].mean()
        means.assign(seed=seed).to_parquet(out / f"{name}.yardstick.parquet")


@app.command()
def compare(
    folder: Annotated[Path, typer.Argument(help="Folder of the tables.")],
    repeats: Annotated[int, typer.Option(help="Seeds of the particles.")] = 4,
) -> None:
    """Print how far the default is from the yardstick, and its processor time."""
    torch.set_num_threads(1)
    rows = []
    for file in sorted(folder.glob("*.yardstick.parquet")):
        yardstick, name = pd.read_parquet(file), file.name.split(".")[0]
        trials, seed = pd.read_parquet(folder / f"{name}.trials.parquet"), int(yardstick["seed"].iloc[0])
        began_s, found = time.process_time(), []
        for sessions in units_of(name, 1 + int(trials["person"].max()), seed, int(trials["trial"].max())):
            theirs = trials[trials["person"].isin([session.person for session in sessions])]
            found += [said_of(sessions, theirs, number) for number in range(1, repeats + 1)]
        spent_s = (time.process_time() - began_s) / (repeats * trials["person"].nunique())
        both = pd.concat(found).merge(yardstick, on=KEYS, suffixes=("", "_yardstick"))
        for trial, at in both.groupby("trial"):
            apart = {said: np.sqrt(np.mean((at[said] - at[f"{said}_yardstick"]) ** 2)) for said in SAID}
            wrong = {WRONG: at[WRONG].mean(), f"{WRONG}, yardstick": at[f"{WRONG}_yardstick"].mean()}
            rows.append({"cohort": name, "trial": trial} | apart | wrong | {"s a session": spent_s})
    print(f"- command: `{command_of('sampler')}`")
    print(f"- {made_with('torch')}\n")
    print(pd.DataFrame(rows).to_markdown(index=False, floatfmt=".3f"))


if __name__ == "__main__":
    understood("sampler")
    app()
