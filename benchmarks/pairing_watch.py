"""Whether pairs stay in a window that moves, if it is watched: the same people with watching and without.

    python -m benchmarks.pairing_watch --people 60 --cohort leaving --out benchmarks/results/pairing_watch

Each person's window is searched for with the default, and then used for 200 pairs: once it stays, and once it moves
by 25 ms within the first 100 of them, earlier or later by turns, and stays there. "Watching" is the plan's default, a
tenth of the pairs as probes and an ISI that may move by 10 ms a block; without it the ISI stays where the search left
it. Shares are of all pairs, probes among them, whose realised ISI lies in the true window at that time. The people of
`leaving` have windows after an electrical pulse whose peak is 25 to 50 ms wide, so that 25 ms lead out of it or to its
edge; in the usual windows they do not. People whom the search found no window in have no intervention.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import pandas as pd
import typer

import isiw
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_table
from isiw import schedule
from isiw.intervention import Arm, Intervention, Plan, sealed
from isiw.pairing.agenda import Agenda
from isiw.strategy.strategy import Strategy
from isiw.subjects import PeakProfile, SimulatedSubject, cohort
from isiw.subjects.changes import Change
from isiw.trials import Status, Trial

MOVES_MS = 25.0
BOUND = 1.645
"""SEs from a difference to the lower end of its 90 % interval."""

PLAN = Plan("benchmark", before=1, after=1, pairs=200)
LEAVING, WIDTHS_MS = "leaving", (25.0, 50.0)
COHORTS = LEAVING, "narrow-unstated", "narrow", "recruitment"
STATED = {name: {"conditioning": "electrical"} for name in (LEAVING, "narrow-unstated")}
"""What is stated of the stimulus, as it is known where windows are so narrow."""

PLANS = {"watching": PLAN, "without": replace(PLAN, probes=0.0, follow_ms=0.0)}


def space_of(name: str) -> isiw.DesignSpace:
    """The design space of a cohort: after an electrical pulse ISIs count from it."""
    return isiw.IMPACT_SPACE if name in STATED else isiw.VALVE_SPACE


def people_of(name: str, people: int, seed: int) -> list[SimulatedSubject]:
    """The people of a cohort."""
    if name != LEAVING:
        return cohort(name, people, seed)
    widths_ms = np.random.default_rng(seed).uniform(*WIDTHS_MS, size=people)
    ordinary = cohort("narrow-unstated", people, seed)
    return [
        replace(one, profile=replace(cast("PeakProfile", one.profile), width_ms=float(width)))
        for one, width in zip(ordinary, widths_ms, strict=True)
    ]


def searched(name: str, subject: SimulatedSubject, seed: int, trials: int) -> Strategy | None:
    """A strategy that knows what a search for the window taught; None if it found none."""
    space = space_of(name)
    search = isiw.make_strategy("default", space, seed=seed, max_trials=trials, **STATED.get(name, {}))
    person = subject.begin(seed)
    table = []
    for index in range(trials):
        response = person.respond(search.ask(), space.reference)
        table.append(Trial(index, Status.ACCEPTED, None, isi_ms=response.isi_ms, mep_mv=response.mep_mv))
        search.learn(Trial.of(response.isi_ms, response.mep_mv))
    knowing = search.restarted()
    knowing.learn_all(table)
    return None if knowing.estimate().window is None else knowing


def paired(strategy: Strategy, subject: SimulatedSubject, plan: Plan, seed: int) -> tuple[float, float]:
    """The share of the pairs in the true window, and of those that were no probes."""
    agenda = Agenda(Intervention(plan, sealed(Arm.WINDOW)), strategy, seed)
    person, trials, inside = subject.begin(seed + 1_000_000), [], []
    window = subject.window(strategy.space)
    for slot in schedule.slots(plan)[: plan.last_pair + 1]:
        alone = agenda.control(slot.number) is not None
        isi_ms = None if alone else agenda.isi_ms(trials)
        response = person.respond(isi_ms, strategy.space.reference)
        trials.append(Trial(slot.number, Status.ACCEPTED, isi_ms, isi_ms=response.isi_ms, mep_mv=response.mep_mv))
        if response.isi_ms is not None:
            if subject.change is not None:
                window = subject.window(strategy.space, slot.place + 1)
            is_in = window is not None and bool(window.mask([response.isi_ms])[0])
            inside.append((is_in, schedule.is_probe(plan, slot, seed)))
    usual = [is_in for is_in, probe in inside if not probe]
    return sum(is_in for is_in, _ in inside) / len(inside), sum(usual) / len(usual)


def rows(name: str, people: int, seed: int, trials: int) -> Iterator[dict[str, object]]:
    """A row for each person, course of the window, and way."""
    for number, subject in enumerate(people_of(name, people, seed)):
        if (
            subject.window(space_of(name)) is None
            or (strategy := searched(name, subject, seed + number, trials)) is None
        ):
            continue
        shift_ms = MOVES_MS * (-1) ** number
        moving = replace(subject, change=Change(first=2, last=101, shift_ms=shift_ms))
        for course, one in {"stays": subject, "moves": moving}.items():
            for way, plan in PLANS.items():
                share, usual = paired(strategy, one, plan, seed + number)
                yield {"cohort": name, "person": number, "window": course, "way": way, "share": share, "usual": usual}


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Means over people, and what watching brings in pairs."""
    wide = table.pivot_table(index=["cohort", "window", "person"], columns="way", values="share")
    wide["more"] = wide["watching"] - wide["without"]
    grouped = wide.groupby(level=["cohort", "window"])
    mean = grouped.mean()
    mean["se"], mean["people"] = grouped["more"].sem(), grouped.size()
    mean["at least"] = mean["more"] - BOUND * mean["se"]
    return mean.reset_index()


def main(
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")],
    people: Annotated[int, typer.Option(help="People of each cohort.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 145_000,
    trials: Annotated[int, typer.Option(help="Trials of the search.")] = 40,
    cohorts: Annotated[list[str] | None, typer.Option("--cohort", help="A cohort; repeat it.")] = None,
) -> None:
    """Pair the people of some cohorts."""
    table = pd.DataFrame([row for name in cohorts or COHORTS for row in rows(name, people, seed, trials)])
    write_table(summary(table), facts_of("pairing_watch", "numpy", seed=seed, people=people, trials=trials), out)


if __name__ == "__main__":
    understood("pairing_watch")
    typer.run(main)
