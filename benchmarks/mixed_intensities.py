"""What pairs of several intensities in one session are worth, against pairs below the threshold only.

    python -m benchmarks.mixed_intensities --people 60 --out benchmarks/results/mixed_intensities

The people are those of `recruitment`, whose window is that at 90 % RMT. Each is examined with pairs at 90 % only; at 90
and 110 % in turn; with 90, 100 and 110 % of which the strategy chooses; with TMS alone at 100 % in every fifth trial,
as a baseline at the threshold; and with a strategy that knows that responses recruit, with which the default's doubt
about other kinds of noise costs nothing. All F1 are of the same people, with the same noise. Reported people come from
seed 160,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import torch
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.metrics import f1, trials_to_criterion
from isiw.models.particles.laws import NoiseShares
from isiw.models.particles.prior import Prior
from isiw.strategy.strategy import Strategy
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import Trial

SPACE: Final = isiw.VALVE_SPACE
USUAL_PCT_RMT: Final = 90.0
TRIALS: Final = 30
MARKS: Final = 10, 20, 30
CRITERION: Final = 0.7
ALONE_EVERY: Final = 5
CURVES: Final = NoiseShares(0.0, 0.0, 0.95, 0.0, 0.05)

WAYS: Final[dict[str, dict[str, Any]]] = {
    "90 % only": {},
    "90 and 110 % in turn": {"intensities_pct_rmt": (90.0, 110.0)},
    "90, 100, 110 %, chosen": {"intensities_pct_rmt": (90.0, 100.0, 110.0), "chooses_intensity": True},
    "90 %, and 100 % alone": {},
    "90 % only, curves known": {"prior": Prior(noise=CURVES)},
    "90, 100, 110 %, chosen, curves known": {
        "prior": Prior(noise=CURVES),
        "intensities_pct_rmt": (90.0, 100.0, 110.0),
        "chooses_intensity": True,
    },
}
"""Settings of the default, by what the pairs are."""


def strategy_for(person: SimulatedSubject, seed: int, settings: dict[str, Any]) -> Strategy:
    """The default with these settings."""
    known = {"hit_delay_ms": person.stated_hit_delay_ms, "intensity_pct_rmt": USUAL_PCT_RMT}
    return isiw.make_strategy("default", SPACE, seed, **known, **settings)


def session(person: SimulatedSubject, seed: int, way: str) -> list[dict[str, Any]]:
    """F1 after every stimulus, and how many of the pairs were at another intensity."""
    strategy, rig, truth = strategy_for(person, seed, WAYS[way]), person.begin(seed), person.window(SPACE)
    rows, others = [], 0
    for trial in range(TRIALS):
        if "alone" in way and trial % ALONE_EVERY == ALONE_EVERY - 1:
            outcome = rig.respond(None, SPACE.reference, intensity_pct_rmt=100.0)
            strategy.learn(Trial.of(None, outcome.mep_mv, intensity_pct_rmt=100.0))
        else:
            isi_ms = strategy.ask()
            own = None if strategy.choice is None else strategy.choice.intensity_pct_rmt
            others += own is not None
            outcome = rig.respond(isi_ms, SPACE.reference, intensity_pct_rmt=own or USUAL_PCT_RMT)
            strategy.learn(Trial.of(outcome.isi_ms, outcome.mep_mv, intensity_pct_rmt=own))
        row = {"way": way, "person": seed, "trial": trial + 1, "F1": f1(strategy.estimate(), truth, SPACE)}
        rows.append(row | {"other": others / (trial + 1)})
    return rows


def needed(rows: pd.DataFrame) -> float:
    """Stimuli to a mean F1 that stays at `CRITERION`; NaN if it never does."""
    found = trials_to_criterion(rows.groupby("trial")["F1"].mean().to_numpy(), CRITERION)
    return np.nan if found is None else float(found)


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """One row a way: F1, its gain over the pairs below the threshold only, and the stimuli needed."""
    lines = []
    for way, rows in table.groupby("way", sort=False):
        usual = table[table["way"] == ("90 % only, curves known" if "known" in str(way) else "90 % only")]
        line: dict[str, Any] = {"pairs": way}
        for mark in MARKS:
            own, base = (_at(each, mark) for each in (rows, usual))
            gain = own - base
            more = (
                "" if way in {"90 % only", "90 % only, curves known"} else f" ({gain.mean():+.3f}, SE {gain.sem():.3f})"
            )
            line[f"F1 after {mark}"] = f"{own.mean():.3f}{more}"
        line[f"stimuli to a lasting F1 of {CRITERION:g}"] = needed(rows)
        line["share at another intensity"] = float(rows.loc[rows["trial"] == TRIALS, "other"].mean())
        lines.append(line)
    return pd.DataFrame(lines)


def _at(rows: pd.DataFrame, trial: int) -> pd.Series:
    found: pd.Series = rows[rows["trial"] == trial].set_index("person")["F1"]
    return found


def report(table: pd.DataFrame, people: int, seed: int, shown: Callable[[pd.DataFrame], str]) -> str:
    """The result as Markdown."""
    return f"""\
# Pairs of several intensities in one session

- command: `{command_of("mixed_intensities")}`; {people} people of `recruitment`, seed {seed:,}
- {made_with("torch")}

F1 of the window at 90 % RMT after so many stimuli, TMS alone among them, and how much more than with 90 % only.

{shown(summary(table))}
"""


def main(
    people: Annotated[int, typer.Option(help="People.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 160_000,
    out: Annotated[Path | None, typer.Option(help="Path of the result, without suffix.")] = None,
) -> None:
    """Print what pairs of several intensities are worth, and write it where it is wanted."""
    torch.set_num_threads(1)
    persons = isiw.subjects.cohort("recruitment", people, seed)
    rows = [row for n, person in enumerate(persons) for way in WAYS for row in session(person, seed + n, way)]
    said = report(pd.DataFrame(rows), people, seed, lambda shown: str(shown.to_markdown(index=False, floatfmt=".2f")))
    print(said)
    if out is not None:
        out.with_suffix(".md").write_text(said)


if __name__ == "__main__":
    understood("mixed_intensities")
    typer.run(main)
