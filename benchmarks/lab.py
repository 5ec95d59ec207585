"""The eleventh person of a lab: what ten sessions of its own people are worth.

    python -m benchmarks.lab --labs 20 --seed 100000 --out benchmarks/results/lab
    python -m benchmarks.lab --labs 20 --seed 100000 --stated --out benchmarks/results/lab_stated
    python -m benchmarks.lab --labs 20 --misfits 0 --priors "told,windows known" --out benchmarks/results/lab_bound

In each lab ten people are measured with the default, and a prior is learnt from their logs; then other people of the
lab, and people who do not belong there, are measured with the built-in prior, with the learnt one, and with a prior
that was told the lab's law. "windows known" is a bound: told the law but for start and width, which are learnt from the
windows of the ten people as they are. With `--stated` the lab's rig states its hit delay, in earlier sessions and
in later ones.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import torch
import typer

import isiw
from benchmarks.earlier import logged_session, measured
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_table
from isiw.checks import choice
from isiw.design import VALVE_SPACE
from isiw.models.particles.laws import Floor, Muscle, NoiseShares
from isiw.models.particles.places import Place
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ShapeShares
from isiw.models.shared.scales import Scale
from isiw.priors import LabPrior
from isiw.priors.lab import LEAST_USUAL, LearntSession, share_of
from isiw.priors.population import LatentBlock, People, hyper_prior, place
from isiw.priors.population import learnt as law_of
from isiw.studies import SimulatedSession, simulate
from isiw.subjects import SimulatedSubject, cohort
from isiw.subjects.measured import LABS, Lab, lab

MARKS = (1, 5, 10, 20, 40)
PRIORS = ("built-in", "learnt", "told", "windows known")
TOLD_SHARE = 1.0 - LEAST_USUAL
CERTAIN = -1e6
"""Log density of windows that are certainly of the lab under the prior of people in general."""
LEARNT, EARLIER_TRIALS = 10, 40


@dataclass(frozen=True)
class Unit:
    """One lab.

    Args:
        name: of the kind of lab.
        seed: of the lab.
        people: how many are measured then.
        misfits: how many people of `odd` are measured then.
        trials: of each session that is measured then.
        priors: which of `PRIORS` they are measured with.
        stated: whether the lab's rig states its hit delay.
    """

    name: str
    seed: int
    people: int
    misfits: int
    trials: int
    priors: tuple[str, ...]
    stated: bool


def told(law: Lab) -> Prior:
    """The prior of who was told a lab's law."""
    floor_mv, ceiling_mv = law.floor_mv, law.amplitude_mv
    start_ms = law.start_ms[0] + law.hit_delay_ms[0]
    slope = 0.30
    return LabPrior(
        sessions=(LearntSession("", "everybody", 1),),  # a prior is always learnt from something
        p_window=0.98,
        shapes=ShapeShares(0.97, 0.01, 0.01, 0.01),
        noise=NoiseShares(0.02, 0.01, 0.96, 0.01, 0.0),
        place=Place(
            TOLD_SHARE, Scale(start_ms, math.hypot(law.start_ms[1], law.hit_delay_ms[1])), Scale(*law.width_ms)
        ),
        floor=Floor(TOLD_SHARE, Scale(*floor_mv), Scale(*law.floor_log_sd)),
        muscle=Muscle(
            "as in the lab",
            TOLD_SHARE,
            ratio=Scale(ceiling_mv[0] / floor_mv[0], math.hypot(ceiling_mv[1], floor_mv[1])),
            slope_per_pct=Scale(slope, 0.02),
            input_sd=Scale(slope * law.sigma_x_pct_rmt[0], law.sigma_x_pct_rmt[1]),
            sigma_y=Scale(*law.sigma_y),
            boost_pct=Scale(*law.boost_pct_rmt),
            rest_pct=Scale(-15.0, 1.2),
        ),
    ).joined()


def with_known_windows(prior: Prior, people: Sequence[SimulatedSubject]) -> Prior:
    """The same prior, but start and width are learnt from people whose windows are known.

    Args:
        prior: of who was told a lab's law.
        people: some of the lab.
    """
    windows = [[p.profile.start_ms + p.hit_delay_ms, math.log(p.profile.width_ms)] for p in people]
    block = LatentBlock(
        np.array(windows)[:, None], np.full((len(people), 1), CERTAIN), np.full((len(people), 1), fill_value=True)
    )
    hyper = {"place": hyper_prior(Prior(), VALVE_SPACE)["place"]}
    law = law_of(People({"place": block}, {}), hyper, {}, np.random.default_rng(0)).laws["place"]
    learnt = place(share_of(law.members), law.mean, law.sd, "valve")
    return replace(prior, profile=replace(prior.profile, places=(learnt,)))


def learnt_from(people: Sequence[SimulatedSubject], seed: int, hit_delay_ms: tuple[float, float] | None) -> Prior:
    """The prior that sessions with some people of a lab teach.

    Args:
        people: the people.
        seed: of the lab.
        hit_delay_ms: what its rig states, mean and SD [ms]; None where it states nothing.
    """
    with tempfile.TemporaryDirectory() as folder:
        logs = [
            logged_session(person, f"P{number}", seed + number, EARLIER_TRIALS, Path(folder), hit_delay_ms)
            for number, person in enumerate(people)
        ]
        return isiw.priors.learn(logs).joined()


def examine(unit: Unit) -> pd.DataFrame:
    """All sessions with later people of one lab; columns as in `isiw.studies.simulate`, and the kind of `people`."""
    torch.set_num_threads(1)
    law, earlier = lab(unit.name, unit.seed), cohort(unit.name, LEARNT, unit.seed)
    hit_delay_ms = law.hit_delay_ms if unit.stated else None
    made: dict[str, Callable[[], Prior]] = {
        "built-in": Prior,
        "learnt": partial(learnt_from, earlier, unit.seed, hit_delay_ms),
        "windows known": lambda: with_known_windows(told(law), earlier),
        "told": lambda: told(law),
    }
    own = [(unit.name, number) for number in range(LEARNT, LEARNT + unit.people)]
    odd = [("odd", number) for number in range(unit.misfits)]
    marks = tuple(mark for mark in MARKS if mark <= unit.trials)
    rows = []
    for label in unit.priors:
        prior = made[label]()
        for name, person in own + odd:
            session = SimulatedSession(
                "default",
                name,
                person,
                unit.seed,
                unit.trials,
                marks,
                settings=(("prior", prior), ("hit_delay_ms", hit_delay_ms)),
                label=label,
            )
            rows.append(simulate(session).assign(lab=unit.name, people="misfits" if name == "odd" else "own"))
    return pd.concat(rows, ignore_index=True)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 over labs, its standard error between labs, and the coverage of the edges."""
    by_lab = rows.groupby(["lab", "people", "strategy", "trial", "seed"])["f1"].mean()
    table = by_lab.groupby(["lab", "people", "strategy", "trial"]).agg(f1="mean", se="sem", labs="count")
    covered = rows.groupby(["lab", "people", "strategy", "trial"])[["start_covered", "end_covered"]].mean()
    return table.join(covered).reset_index()


def main(  # noqa: PLR0913, PLR0917 - the options of the command line
    kinds: Annotated[str, typer.Option(help="Comma-separated.")] = ",".join(LABS),
    labs: Annotated[int, typer.Option(help="Labs of each kind.")] = 20,
    people: Annotated[int, typer.Option(help="New people of each lab.")] = 10,
    misfits: Annotated[int, typer.Option(help="People of `odd` in each lab.")] = 5,
    trials: Annotated[int, typer.Option(help="Trials of each new session.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of the first lab.")] = 100_000,
    priors: Annotated[str, typer.Option(help="Comma-separated.")] = ",".join(PRIORS[:3]),
    stated: Annotated[bool, typer.Option("--stated", help="The labs' rigs state their hit delay.")] = False,  # noqa: FBT002 - a flag of the command line
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("lab"),
) -> None:
    """Measure the eleventh person of a lab."""
    seeds = range(seed, seed + 100 * labs, 100)  # people have seeds of their own
    names = tuple(choice("the prior", name, PRIORS) for name in priors.split(","))
    units = [Unit(kind, s, people, misfits, trials, names, stated) for kind in kinds.split(",") for s in seeds]
    rows = measured(examine, units, workers, out)
    write_table(summary(rows), facts_of("lab", "torch", "numpy", seed=seed, people=people), out)


if __name__ == "__main__":
    understood("lab")
    typer.run(main)
