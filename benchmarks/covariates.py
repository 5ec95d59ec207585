"""The eleventh person of a lab, of whom a height is noted that windows go with, or an age that they do not go with.

    python -m benchmarks.covariates --labs 8 --people 6 --out benchmarks/results/covariates
    python -m benchmarks.covariates --labs 4 --people 1 --learnt 30 --out benchmarks/results/covariates_30

In each lab ten people are measured with the default. Their heights are correlated with the start of their windows,
their ages are not; a prior is learnt from their logs, which state both. Then other people of the lab are measured with
that prior, once without what is noted of them, and once with the height or the age. The rig states its hit delay.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import pandas as pd
import typer

import isiw
from benchmarks.earlier import logged_session, measured
from benchmarks.lab import EARLIER_TRIALS
from benchmarks.lab import LEARNT as USUAL
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_table
from isiw.priors import LabPrior
from isiw.priors.covariates import expected
from isiw.studies import SimulatedSession, simulate
from isiw.subjects import SimulatedSubject, cohort
from isiw.subjects.measured import Lab, lab

MARKS: Final = (1, 5, 10, 20)
FORESEEN: Final = 100
"""People of each lab of whom only the expected start is compared with the true one."""

NOTED: Final[Mapping[str, tuple[str, ...]]] = {"nothing": (), "height": ("height_cm",), "age": ("age_years",)}


@dataclass(frozen=True)
class Unit:
    """One lab: its kind and seed, how many people come then, how starts go with height, and how many teach that."""

    kind: str
    seed: int
    people: int
    correlation: float
    learnt: int


def noted_of(person: SimulatedSubject, law: Lab, correlation: float, rng: np.random.Generator) -> isiw.Visit:
    """What is noted of a person of a lab.

    Args:
        person: of whom.
        law: of the lab.
        correlation: of height and the start of windows.
        rng: draws the rest of the height, and the age.
    """
    start = (person.profile.start_ms - law.start_ms[0]) / law.start_ms[1]
    height = correlation * start + math.sqrt(1.0 - correlation**2) * rng.standard_normal()
    return isiw.Visit(height_cm=175.0 + 9.0 * height, age_years=float(rng.uniform(20.0, 60.0)))


def examine(unit: Unit) -> pd.DataFrame:
    """All sessions with later people of one lab; columns as in `isiw.studies.simulate`."""
    law, everybody = lab(unit.kind, unit.seed), cohort(unit.kind, unit.learnt + FORESEEN, unit.seed)
    rng = np.random.default_rng(unit.seed)
    visits = [noted_of(person, law, unit.correlation, rng) for person in everybody]
    learnt, rows = learnt_from(everybody[: unit.learnt], visits, unit.seed, law.hit_delay_ms), []
    for label, names in NOTED.items():
        known = [isiw.Visit(**{name: getattr(visit, name) for name in names}) for visit in visits]
        error_ms = foresight(learnt, known[unit.learnt :], everybody[unit.learnt :])
        for person in range(unit.learnt, unit.learnt + unit.people):
            prior = learnt.joined(visit=known[person])
            settings = (("prior", prior), ("hit_delay_ms", law.hit_delay_ms))
            session = SimulatedSession(
                "default", unit.kind, person, unit.seed, MARKS[-1], MARKS, settings=settings, label=label
            )
            rows.append(simulate(session).assign(lab=unit.kind, error_ms=error_ms))
    return pd.concat(rows, ignore_index=True)


def foresight(learnt: LabPrior, visits: list[isiw.Visit], people: list[SimulatedSubject]) -> float:
    """Root mean square error of where windows are expected to start, without a trial [ms]."""
    if learnt.place is None:
        return math.nan
    places = [expected(learnt.place, learnt.slopes, visit) for visit in visits]
    errors_ms = [
        person.profile.start_ms + person.hit_delay_ms - place.start_ms.law[0]
        for person, place in zip(people, places, strict=True)
    ]
    return math.sqrt(np.mean(np.square(errors_ms)))


def learnt_from(
    people: list[SimulatedSubject], visits: list[isiw.Visit], seed: int, hit_delay_ms: tuple[float, float]
) -> LabPrior:
    """What sessions with some people of a lab teach, whose logs state heights and ages."""
    with tempfile.TemporaryDirectory() as folder:
        logs = [
            logged_session(person, f"P{n}", seed + n, EARLIER_TRIALS, Path(folder), hit_delay_ms, visits[n])
            for n, person in enumerate(people)
        ]
        return isiw.priors.learn(logs)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """By what is noted: mean F1 over labs and error of the expected start, and how much better than with nothing."""
    keys = ["lab", "noted", "trial"]
    rows = rows.rename(columns={"strategy": "noted"})
    by_lab = rows.groupby([*keys, "seed"])[["f1", "error_ms"]].mean().reset_index()
    without = by_lab[by_lab["noted"] == "nothing"].drop(columns="noted")
    both = by_lab.merge(without, on=["lab", "trial", "seed"], suffixes=("", "_without"))
    changed = {name: both[name] - both[f"{name}_without"] for name in ("f1", "error_ms")}
    table = both.assign(gain=changed["f1"], less_ms=-changed["error_ms"]).groupby(keys)
    found = table.agg(
        f1=("f1", "mean"), gain=("gain", "mean"), gain_se=("gain", "sem"), error_ms=("error_ms", "mean"),
        less_ms=("less_ms", "mean"), less_se_ms=("less_ms", "sem"), labs=("f1", "count"),
    )  # fmt: skip
    return found.join(rows.groupby(keys)[["start_covered", "end_covered"]].mean()).reset_index()


def main(
    kinds: Annotated[str, typer.Option(help="Comma-separated.")] = "lab-late",
    labs: Annotated[int, typer.Option(help="Labs of each kind.")] = 8,
    people: Annotated[int, typer.Option(help="New people of each lab.")] = 10,
    correlation: Annotated[float, typer.Option(help="Of height and start.")] = 0.8,
    learnt: Annotated[int, typer.Option(help="People of each lab who teach its prior.")] = USUAL,
    seed: Annotated[int, typer.Option(help="Seed of the first lab.")] = 180_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("covariates"),
) -> None:
    """Measure what a noted height or age is worth for the eleventh person of a lab."""
    seeds = range(seed, seed + 100 * labs, 100)
    units = [Unit(kind, each, people, correlation, learnt) for kind in kinds.split(",") for each in seeds]
    rows = measured(examine, units, workers, out)
    write_table(
        summary(rows),
        facts_of("covariates", "numpy", seed=seed, learnt=learnt, people=people, correlation=correlation),
        out,
    )


if __name__ == "__main__":
    understood("covariates")
    typer.run(main)
