"""How far the particles of the default are from what many more say of the same trials: `python -m benchmarks.sampler`.

`record` keeps the trials of sessions with the default, and what 8,000 particles with six times the sweeps make of them.
`compare` gives the same trials to the default of the isiw that is imported, with several seeds; an earlier version is
compared by putting its `src` before this one's. People are of the work seeds, as what this says is a choice's reason.
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
from isiw.models.protocol import Observation
from isiw.studies.sessions import SimulatedSession, _Batch, examine
from isiw.subjects.subject import Response

MARKS = (20, 40, 60)
COHORTS = "retuned,step,above-threshold,recruitment"
KEYS = ["cohort", "person", "trial"]
SAID = ["probability", "of a step", "expected_f1"]

app = typer.Typer(help=__doc__)


class _Recording(_Batch):
    """People side by side, whose trials are kept."""

    def __init__(self, sessions: Sequence[SimulatedSession]) -> None:
        super().__init__(sessions, "cpu")
        self.sessions, self.rows = sessions, list[dict[str, object]]()

    def tell(self, responses: Sequence[Response]) -> None:
        """Learn from one trial of each person."""
        super().tell(responses)
        for session, told in zip(self.sessions, responses, strict=True):
            who = {"cohort": session.cohort, "person": session.person, "trial": self.course.told}
            self.rows.append(who | {"isi_ms": told.isi_ms, "mep_mv": told.mep_mv, "isi_sd_ms": told.isi_sd_ms})


def units_of(cohort: str, people: int, seed: int, trials: int) -> Iterator[Sequence[SimulatedSession]]:
    """Sessions with the default, side by side."""
    return (unit.sessions for unit in study_of(cohort, people, seed, (trials,)).units())


def said_of(sessions: Sequence[SimulatedSession], trials: pd.DataFrame, seed: int, **settings: Any) -> pd.DataFrame:
    """What particles make of recorded trials at the marks."""
    model, space = sessions[0].player().model, sessions[0].space
    sweeps = settings.pop("sweeps", 1)
    moves = replace(model.moves, sweeps=sweeps * model.moves.sweeps, max_trial_sweeps=sweeps * 240)
    posterior, rows = replace(model, moves=moves, **settings).begin(space, seed, len(sessions)), list[dict[str, Any]]()
    for trial, told in trials.groupby("trial"):
        columns = (told.sort_values("person")[name].tolist() for name in ("isi_ms", "mep_mv", "isi_sd_ms"))
        posterior = posterior.model.update(posterior, Observation.of(*columns))
        if trial in MARKS:
            swarm = posterior.swarm
            stepped = ((swarm.latents.change > 0) & (swarm.latents.change != 3)) * swarm.log_weights.exp()
            for number, session in enumerate(sessions):
                estimate = posterior.estimate(number)
                said = (estimate.probability, float(stepped[number].sum()), estimate.expected_f1)
                who = (session.cohort, session.person, trial)
                rows.append(dict(zip(KEYS, who, strict=True)) | dict(zip(SAID, said, strict=True)))
    return pd.DataFrame(rows)


@app.command()
def record(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = COHORTS,
    people: Annotated[int, typer.Option(help="People a cohort.")] = 25,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 800,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    particles: Annotated[int, typer.Option(help="Particles of the yardstick.")] = 8000,
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("sampler"),
) -> None:
    """Keep trials, and what many particles say of them."""
    torch.set_num_threads(1)
    out.mkdir(parents=True, exist_ok=True)
    for name in cohorts.split(","):
        tables, yardsticks = [], []
        for sessions in units_of(name, people, seed, trials):
            crowd = _Recording(sessions)
            examine(sessions, crowd)
            tables.append(pd.DataFrame(crowd.rows))
            yardsticks += [said_of(sessions, tables[-1], n, particles=particles, sweeps=6) for n in (1001, 1002)]
        pd.concat(tables).to_parquet(out / f"{name}.trials.parquet")
        means = pd.concat(yardsticks).groupby(KEYS, as_index=False)[SAID].mean()
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
            rows.append({"cohort": name, "trial": trial} | apart | {"s a session": spent_s})
    print(f"- command: `{command_of('sampler')}`")
    print(f"- {made_with('torch', 'numba')}\n")
    print(pd.DataFrame(rows).to_markdown(index=False, floatfmt=".3f"))


if __name__ == "__main__":
    understood("sampler")
    app()
