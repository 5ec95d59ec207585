"""What is reached without stimulating anybody: the default's answer before any trial, and the best fixed window.

    python -m benchmarks.zero_trials > benchmarks/results/zero_trials.md

The fixed window is the one with the largest mean F1 on other people of the cohort, or no window at all. Neither of the
two has learnt anything from the person: a method is worth what it reaches beyond them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import pandas as pd
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.metrics import f1, f1_of_masks
from isiw.subjects.cohorts import COHORTS
from isiw.types import BoolArray, Conditioning, FloatArray, IntArray
from isiw.window import Window

WITHOUT_A_VALVE = {"electrical", "supra-threshold"}
"""Cohorts whose ISIs count from the impact alone."""

OTHER_PEOPLE, OTHER_SEED = 1000, 10_000
"""On whom the fixed window is chosen."""


def masks_of(cohort: str, people: int, seed: int, space: DesignSpace) -> BoolArray:
    """The true windows of a cohort's people on the grid, shape (n, t)."""
    windows = [person.window(space) for person in isiw.subjects.cohort(cohort, people, seed)]
    return np.stack([np.zeros(len(space.grid_ms), bool) if w is None else w.mask(space.grid_ms) for w in windows])


def best_fixed(masks: BoolArray, space: DesignSpace) -> Window | None:
    """The interval with the largest mean F1 over true windows, or None where no window has more.

    Args:
        masks: the true windows, shape (n, t).
        space: the design space.
    """
    inside = np.pad(np.cumsum(masks, axis=1), ((0, 0), (1, 0)))
    means = [_means_from(inside, first) for first in range(masks.shape[1])]
    first = int(np.argmax([mean.max() for mean in means]))
    if means[first].max() < (~masks.any(axis=1)).mean():
        return None
    last = first + int(means[first].argmax())
    return Window(space.grid_ms[first], space.grid_ms[last])


def _means_from(inside: IntArray, first: int) -> FloatArray:
    """Mean F1 of the intervals from a grid point to each one behind it, from cumulated masks (n, t + 1)."""
    shared = inside[:, first + 1 :] - inside[:, [first]]
    means: FloatArray = (2 * shared / (inside[:, [-1]] + np.arange(1, shared.shape[1] + 1))).mean(axis=0)
    return means


def fixed_windows(cohorts: Sequence[str], people: int, seed: int, space: DesignSpace) -> pd.DataFrame:
    """One row a cohort: the best fixed window, chosen on other people of it, and its mean F1.

    Args:
        cohorts: their names.
        people: people of each cohort, the first of which are those of a study with the same seed.
        seed: seed of these people.
        space: the design space.
    """
    return pd.DataFrame([_fixed_window(cohort, people, seed, space) for cohort in cohorts])


def _fixed_window(cohort: str, people: int, seed: int, space: DesignSpace) -> dict[str, object]:
    nowhere = np.zeros(len(space.grid_ms), bool)
    fixed = best_fixed(masks_of(cohort, OTHER_PEOPLE, OTHER_SEED, space), space)
    reached = f1_of_masks(
        nowhere if fixed is None else fixed.mask(space.grid_ms), masks_of(cohort, people, seed, space)
    )
    return {"cohort": cohort, "f1": np.mean(reached), "window": "none" if fixed is None else str(fixed)}


def before_any_trial(cohort: str, people: int, seed: int, space: DesignSpace) -> float:
    """Mean F1 of what the default reports before any trial, told what the person's rig states."""
    persons = isiw.subjects.cohort(cohort, people, seed)
    stated = [(person.stated_hit_delay_ms, person.conditioning) for person in persons]
    reported = {each: _reported(*each, space) for each in set(stated)}
    return float(np.mean([f1(reported[each], p.window(space), space) for each, p in zip(stated, persons, strict=True)]))


def _reported(hit_delay_ms: tuple[float, float], conditioning: Conditioning, space: DesignSpace) -> Window | None:
    known: dict[str, object] = {"conditioning": conditioning}
    if space.reference == "valve":
        known["hit_delay_ms"] = hit_delay_ms
    return isiw.make_strategy("default", space=space, **known).estimate().window


def without_any_trial(cohorts: Sequence[str], people: int, seed: int, space: DesignSpace) -> pd.DataFrame:
    """One row a cohort: mean F1 of the default before any trial, and of the best fixed window; as `fixed_windows`."""
    fixed = fixed_windows(cohorts, people, seed, space)
    before = [before_any_trial(cohort, people, seed, space) for cohort in cohorts]
    fixed.insert(1, "default before any trial", before)
    return fixed.rename(columns={"f1": "best fixed window", "window": "which"})


def main(
    people: Annotated[int, typer.Option(help="People per cohort.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the people that are reported.")] = 90_000,
) -> None:
    """Print mean F1 of both, by cohort, over 500 ms after the valve command."""
    table = without_any_trial([name for name in COHORTS if name not in WITHOUT_A_VALVE], people, seed, VALVE_SPACE)
    print(f"- command: `{command_of('zero_trials')}`")
    print(f"- {made_with('torch', 'numpy')}; seed {seed}, and {OTHER_SEED} for the fixed windows")
    print(f"- people: {people} per cohort; standard errors about .01 at most")
    print("- `kim11` has eleven people, so its fixed window was chosen on the same ones\n")
    print(table.to_markdown(index=False, floatfmt=".2f"))


if __name__ == "__main__":
    understood("zero_trials", prints=True)
    typer.run(main)
