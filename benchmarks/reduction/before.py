"""What F1 there is before any trial: the default's own estimate, and one fixed window for everybody."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd

from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.headline import NOISE, before, judged
from benchmarks.reduction.readings import BASE, PEOPLE
from benchmarks.reduction.recorded import SWEPT
from benchmarks.reduction.sessions import recorded_person
from benchmarks.zero_trials import best_fixed, fixed_windows
from isiw.design import VALVE_SPACE
from isiw.metrics import f1
from isiw.subjects.measured import MEASURED_KIM
from isiw.window import Window

FIXED: Final = "one fixed window"

PROSE = """\
Mean F1 without a single stimulus, judged as in the headline: what the default believes of people at large;
and the window that is best for other people of the cohort: a thousand others, or, of the eleven
of `kim11-measured`, the other ten. What a method reaches is to be held against this."""


def table(rows: pd.DataFrame, seed: int) -> pd.DataFrame:
    """One row a cohort of the headline.

    Args:
        rows: the headline's sessions.
        seed: of its people.
    """
    rows = judged(rows[rows["alone"] == 0])
    others = [name for name in NOISE if name != PEOPLE]
    fixed = fixed_windows(others, rows["person"].nunique(), seed, VALVE_SPACE).set_index("cohort")
    guesses = {PEOPLE: of_the_other_ten(seed)} | {name: float(fixed.loc[name, "f1"]) for name in others}
    default = before(rows)
    return pd.DataFrame(
        [
            {"cohort": name, "default": default[name], FIXED: guesses[name], "GPR at its stop": _gpr(rows, name)}
            for name in NOISE
        ]
    )


def _gpr(rows: pd.DataFrame, cohort: str) -> float:
    return float(rows.loc[(rows["cohort"] == cohort) & (rows["method"] == "gpr"), "f1"].mean())


def of_the_other_ten(seed: int) -> float:
    """Mean F1 of the window that is best for the measured windows of the other people of `kim11-measured`."""
    sweeps = (recorded_person(PEOPLE, person, seed) for person in range(len(MEASURED_KIM)))
    windows = [window for sweep in sweeps if (window := sweep.windows[BASE.truth]) is not None]
    masks = np.array([window.mask(SWEPT.grid_ms) for window in windows])
    scores = [_left_out(masks, windows[person], person) for person in range(len(windows))]
    return float(np.mean(scores))


def _left_out(masks: np.ndarray, window: Window, person: int) -> float:
    return f1(best_fixed(np.delete(masks, person, axis=0), SWEPT), window, SWEPT)


def section(found: pd.DataFrame) -> Section:
    """This part of the report.

    Args:
        found: as from `table`.
    """
    return Section("Before any trial", PROSE, [Table("Mean F1.", found)])


def in_words(found: pd.DataFrame) -> str:
    """The table as a sentence."""
    rows: list[Mapping[str, float]] = found.to_dict("records")

    def listed(column: str) -> str:
        return ", ".join(f"{r[column]:.2f} on `{r['cohort']}`" for r in rows)

    return (
        f"Before any trial the default's F1 is {listed('default')}; one fixed window for everybody has {listed(FIXED)}."
    )
