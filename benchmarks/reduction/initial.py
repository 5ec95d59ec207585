"""How many initial observations: two to nine, for each regression (Fig. 4.31–4.33)."""

from __future__ import annotations

import itertools
from typing import Final

import pandas as pd
from matplotlib.figure import Figure

from benchmarks.reduction.comparison import PEOPLE_OF_KIM, WORDS, error_of_mean
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, NAMES, panels
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.significance import paired_tests
from benchmarks.reduction.size import Size
from isiw.plots.style import explain

COUNTS: Final = tuple(range(2, 10))
FEWEST: Final = {"nr": 4, "svmr": 2, "gpr": 2}
"""A Gaussian has three parameters: no fit, and no noise, from two or three trials."""

COHORTS: Final = (PEOPLE,)
KEYS: Final = ["cohort", "method", "accelerometer", "initial"]

PROSE = """\
F1 by the measured window. NR cannot be run from two or three, as in the text. The text: NR's F1 rises from 7 to 8
without and from 6 to 9 with accelerometer; SVMR's is best at 4 and 3, GPR's at 6 and below 8; NR's trials are low
below 7 and 5, SVMR's at 4 to 8 and above 3. Stars: paired t-test against one observation fewer, Holm within a
method and accelerometer."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Every number with the same people."""
    return [
        Session(method, cohort, person, seed, accelerometer=accelerometer, settings=(("initial", count),))
        for cohort, method, accelerometer, count in itertools.product(COHORTS, FEWEST, WORDS, COUNTS)
        if count >= FEWEST[method]
        for person in range(size.sweep)
    ]


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 and trials by cohort, method, accelerometer and number; stars against the number before it."""
    table = rows.groupby(KEYS).agg(
        F1=("f1, measured", "mean"), trials=("trials", "mean"), converged=("converged", "mean")
    )
    for value, name in (("f1, measured", "F1"), ("trials", "trials")):
        errors = {key: error_of_mean(group, value) for key, group in rows.groupby(KEYS)}
        table[f"{name} SE"] = pd.Series(errors).reindex(table.index)
        table[f"{name} *"] = _stars(rows, value).reindex(table.index).fillna("")
    return table.reset_index().assign(accelerometer=lambda t: t["accelerometer"].map(WORDS))


def _stars(rows: pd.DataFrame, value: str) -> pd.Series:
    """Significance of each step from one number to the next, corrected within a method and accelerometer."""
    found = {}
    for key, group in rows.groupby(KEYS[:3]):
        person = group["person"] % PEOPLE_OF_KIM if key[0] == PEOPLE else group["person"]
        values = group.pivot_table(index=person, columns="initial", values=value)
        tests = paired_tests(values, list(itertools.pairwise(values.columns)))
        found |= {(*key, row.second): row.stars for row in tests.itertuples()}
    return pd.Series(found)


def figure(table: pd.DataFrame) -> Figure:
    """Fig. 4.31–4.33."""
    picture, axes = panels(2, 3, sharex=True)
    for column, (method, number) in enumerate(zip(FEWEST, ("4.31", "4.32", "4.33"), strict=True)):
        for word, style in (("without", "-"), ("with", "--")):
            chosen = (table["method"] == method) & (table["accelerometer"] == word)
            for line, value in enumerate(("F1", "trials")):
                rows = table[chosen]
                label, colour = f"{NAMES[method]}, {word} acc.", COLOURS[method]
                axes[line, column].plot(
                    rows["initial"], rows[value], style, marker="o", ms=3, color=colour, label=label
                )
        axes[0, column].set(title=f"Fig. {number}: {NAMES[method]}", ylim=(0, 1), ylabel="F1 (measured window)")
        axes[1, column].set(xlabel="initial observations", ylabel="trials", ylim=(0, None))
    explain(picture, ncols=4)
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    table = summary(rows)
    curves = table.groupby(KEYS[:3])
    best = [
        f"`{cohort}`, {NAMES[method]} {word} accelerometer: F1 best at {group.loc[group['F1'].idxmax(), 'initial']} "
        f"({group['F1'].max():.2f}; {group['F1'].min():.2f} at worst), fewest trials at "
        f"{group.loc[group['trials'].idxmin(), 'initial']} ({group['trials'].min():.1f})."
        for (cohort, method, word), group in curves
    ]
    prose = f"{rows['person'].nunique()} sessions of each cohort for each number. {PROSE}"
    picture = ("initial", figure(table))
    return Section("How many initial observations (Fig. 4.31–4.33)", prose, [Table("Means.", table)], picture, best)
