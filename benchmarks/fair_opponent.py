"""What the dissertation's regressions should take for the EMG floor, without TMS alone and with ten trials of it.

    python -m benchmarks.fair_opponent --out benchmarks/results/fair_opponent

Each treatment of the floor with each regression on the same people, of seeds for work: the choice is not made on the
people who are reported. The regressions ask as usual, so that a treatment changes what is asked as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import pandas as pd
import typer
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.reduction.headline import BY_TRUTH, JUDGED, reading_of
from benchmarks.reduction.sessions import Session, play, recorded_person
from benchmarks.tables import write_tables
from isiw.design import DesignSpace
from isiw.dissertation.regression import FittedCurve, RegressionMethod, RegressionModel, curve_masks
from isiw.models.shared.history import FloorTreatment
from isiw.types import FloatArray

LOWEST, ROUNDS, NEAR_MV = 0.1, 5, 1e-4
MARKS = (5, 10, 15, 20, 30, 40)
ALONE: Final = 10

Fit = Callable[[FloatArray], FittedCurve]
"""The curve above some floor, from what the MEPs have above it [mV]."""


def jointly(isi_ms: FloatArray, mep_mv: FloatArray, space: DesignSpace, fit: Fit) -> FittedCurve:
    """Curve and floor in turn, each given the other: the floor is the mean of what the curve leaves."""
    level_mv = float(np.quantile(mep_mv, LOWEST))
    for _ in range(ROUNDS):
        curve = fit(mep_mv - level_mv)
        left_mv = mep_mv - np.interp(isi_ms, space.grid_ms, curve.mean_mv)
        before_mv, level_mv = level_mv, max(float(left_mv.mean()), 0.0)
        if not curve.fitted or abs(level_mv - before_mv) < NEAR_MV:
            break
    return fit(mep_mv - level_mv)


def of_the_curve(isi_ms: FloatArray, mep_mv: FloatArray, space: DesignSpace, fit: Fit) -> FittedCurve:
    """The lowest value of a curve that is free to lie above 0 everywhere."""
    del isi_ms, space
    level_mv = float(np.median(mep_mv))
    curve = fit(mep_mv - level_mv)
    lowest_mv = max(float(curve.mean_mv.min()), -level_mv)
    return replace(curve, mean_mv=curve.mean_mv - lowest_mv, samples_mv=curve.samples_mv - lowest_mv)


def outside(isi_ms: FloatArray, mep_mv: FloatArray, space: DesignSpace, fit: Fit) -> FittedCurve:
    """The median of the MEPs outside the window of the curve before, which begins with the lowest tenth as floor."""
    level_mv = float(np.quantile(mep_mv, LOWEST))
    curve = fit(mep_mv - level_mv)
    for _ in range(ROUNDS):
        mask = curve_masks(curve.mean_mv[None], level_mv)[0]
        inside = np.interp(isi_ms, space.grid_ms, mask.astype(float)) > 0.5
        if not curve.fitted or inside.all() or not inside.any():
            return curve
        before_mv, level_mv = level_mv, float(np.median(mep_mv[~inside]))
        if abs(level_mv - before_mv) < NEAR_MV:
            return curve
        curve = fit(mep_mv - level_mv)
    return curve


FITTED: Final = {
    "jointly with the curve": jointly,
    "lowest value of the curve": of_the_curve,
    "MEPs outside the window": outside,
}
SET: Final = {"median of all MEPs": "median", "lowest tenth of all MEPs": "lowest", "as they are": "raw"}
TOLD: Final = f"mean of {ALONE} TMS alone"
TREATMENTS: Final = (*SET, *FITTED, TOLD)
PAIRS_TOLD: Final = f"lowest tenth of all pairs beside {ALONE} TMS alone"
"""What NR does where there is TMS alone; on request, since it is no treatment of its own."""


@dataclass(frozen=True)
class Treated:
    """A regression with a floor of its own: it is given MEPs as they are.

    Args:
        method: what fits the curve above the floor.
        treatment: one of `FITTED`.
    """

    method: RegressionMethod
    treatment: str

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """The curve above the floor; see `RegressionMethod`."""
        if not len(isi_ms):
            return self.method.fit(isi_ms, excess_mv, space, rng)
        seed = int(rng.integers(2**31))  # each fit of a round draws the same

        def fit(above_mv: FloatArray) -> FittedCurve:
            return self.method.fit(isi_ms, above_mv, space, np.random.default_rng(seed))

        return FITTED[self.treatment](isi_ms, excess_mv, space, fit)


def treated(usual: isiw.Strategy, treatment: str) -> isiw.Strategy:
    """A regression's strategy with one of `FITTED`."""
    model = RegressionModel(Treated(usual.model.method, treatment), FloorTreatment("raw"))
    return isiw.Strategy(
        usual.space, model, usual.acquisition, usual.stopping, seed=usual.seed, initial_ms=usual.initial_ms
    )


def f1_by_trial(method: str, cohort: str, person: int, seed: int, treatment: str, trials: int) -> list[float]:
    """One session of so many trials: F1 after each."""
    floors = SET | {TOLD: "subtracted", PAIRS_TOLD: "lowest"}
    settings = () if treatment in FITTED else (("floor", floors[treatment]),)
    alone = ALONE if treatment in (TOLD, PAIRS_TOLD) else 0
    session = Session(method, cohort, person, seed, reading_of(cohort), horizon=trials, alone=alone, settings=settings)
    change = (lambda usual: treated(usual, treatment)) if treatment in FITTED else (lambda usual: usual)
    found = play(session, recorded_person(cohort, person, seed), change)
    return list(found[JUDGED.get(cohort, BY_TRUTH)[1]][:trials])


def played(method: str, cohort: str, treatment: str, people: int, seed: int, trials: int) -> FloatArray:
    """F1 by person and trial; NaN for whoever's sweep shows no window, since nothing can be judged by it."""
    return np.array([f1_by_trial(method, cohort, person, seed, treatment, trials) for person in range(people)])


def row(f1: FloatArray) -> dict[str, float]:
    """Mean F1 of one treatment after some trials, and how it changes from 10 trials to the last."""
    f1 = f1[~np.isnan(f1).any(axis=1)]
    marks = [mark for mark in MARKS if mark <= f1.shape[1]]
    change = f1[:, -1] - f1[:, min(10, f1.shape[1]) - 1]
    return (
        {"n": len(f1)}
        | {str(mark): float(f1[:, mark - 1].mean()) for mark in marks}
        | {"SE": _error(f1[:, -1])}
        | {"from 10 on": float(change.mean()), "its SE": _error(change)}
    )


def difference(f1: FloatArray, other: FloatArray) -> dict[str, float]:
    """Mean differences of F1 to those of the same people with another treatment, each with its standard error."""
    change = f1 - other
    change = change[~np.isnan(change).any(axis=1)]
    marks = [mark for mark in MARKS if mark <= f1.shape[1]]
    return {"n": len(change)} | {
        name: value
        for mark in marks
        for name, value in ((str(mark), float(change[:, mark - 1].mean())), (f"SE {mark}", _error(change[:, mark - 1])))
    }


def _error(values: FloatArray) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values)))


def main(
    methods: Annotated[str, typer.Option(help="Comma-separated.")] = "nr,svmr,gpr",
    cohorts: Annotated[str, typer.Option(help="Comma-separated.")] = "kim11-measured,gaussian",
    floors: Annotated[str, typer.Option(help="Treatments, comma-separated.")] = ",".join(TREATMENTS),
    people: Annotated[int, typer.Option(help="People a cohort.")] = 11,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 40,
    seed: Annotated[int, typer.Option(help="Seed of the cohorts; below 1,000 for a choice.")] = 500,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("fair_opponent"),
) -> None:
    """Compare the treatments."""
    plan = list(itertools.product(methods.split(","), cohorts.split(","), floors.split(",")))
    f1 = {one: played(*one, people, seed, trials) for one in track(plan, "treatments", console=Console(stderr=True))}
    keys = [dict(zip(("method", "cohort", "floor"), one, strict=True)) for one in plan]
    first = floors.split(",")[0]
    tables = {
        "F1 by the treatment of the floor": [key | row(f1[one]) for key, one in zip(keys, plan, strict=True)],
        f"Paired with {first}": [
            key | difference(f1[one], f1[*one[:2], first])
            for key, one in zip(keys, plan, strict=True)
            if one[2] != first
        ],
    }
    facts = facts_of("fair_opponent", "numpy", "scipy", "scikit-learn", seed=seed, people=people)
    write_tables({title: pd.DataFrame(rows) for title, rows in tables.items() if rows}, facts, out)
    print(out.with_suffix(".md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    understood("fair_opponent")
    typer.run(main)
