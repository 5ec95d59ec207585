"""The fixed window for everybody, which needs no trial, as rows beside those of the strategies."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from benchmarks.comparison.rows import EVEN, GUESS
from benchmarks.comparison.running import RECORDED
from benchmarks.recorded_people import RecordedPerson, recordings
from benchmarks.zero_trials import OTHER_PEOPLE, OTHER_SEED, best_fixed, masks_of
from isiw.design import VALVE_SPACE
from isiw.metrics import f1_of_masks
from isiw.types import BoolArray, FloatArray

UNKNOWN: Final = ("expected_f1", "start_covered", "end_covered", "probability", "stop_trial", "ask_ms", "tell_ms")


def masks(cohort: str, people: int, seed: int) -> BoolArray:
    """The true windows of people on the grid, shape (n, t).

    Args:
        cohort: a cohort of isiw's, or `RECORDED`.
        people: how many.
        seed: of the cohort.
    """
    if cohort != RECORDED:
        return masks_of(cohort, people, seed, VALVE_SPACE)
    grid_ms = VALVE_SPACE.grid_ms
    subjects = (RecordedPerson(number, seed, recordings()).subject() for number in range(people))
    windows = [subject.window(VALVE_SPACE) for subject in subjects]
    return np.stack([np.zeros(len(grid_ms), bool) if w is None else w.mask(grid_ms) for w in windows])


def guessed_f1(cohort: str, people: int, seed: int, others: int = OTHER_PEOPLE) -> FloatArray:
    """F1 of each person for the window with the largest mean F1 on other people of the cohort, shape (n,).

    Args:
        cohort: a cohort of isiw's, or `RECORDED`.
        people: how many.
        seed: of these people.
        others: on how many others the window is chosen.
    """
    fixed = best_fixed(masks(cohort, others, OTHER_SEED), VALVE_SPACE)
    grid_ms = VALVE_SPACE.grid_ms
    guess = np.zeros(len(grid_ms), bool) if fixed is None else fixed.mask(grid_ms)
    return f1_of_masks(guess, masks(cohort, people, seed))


def with_guess(rows: pd.DataFrame, others: int = OTHER_PEOPLE) -> pd.DataFrame:
    """Rows, and those of the fixed window for the people who were examined at even ISIs, if they are at hand.

    Args:
        rows: of strategies, with the columns of a study.
        others: on how many others the window is chosen.
    """
    found = [rows]
    for cohort, even in rows[rows["strategy"] == EVEN].groupby("cohort"):
        if cohort == RECORDED and not recordings().is_dir():
            continue
        guessed = guessed_f1(str(cohort), int(even["person"].max()) + 1, int(even["seed"].iloc[0]), others)
        same = even.assign(strategy=GUESS, f1=guessed[even["person"]], **dict.fromkeys(UNKNOWN, np.nan))
        found.append(same.assign(reported_window=True, answered=True))
    return pd.concat(found, ignore_index=True)
