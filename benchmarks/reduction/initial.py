"""How many initial observations: two to nine, for each regression (Fig. 4.31–4.33)."""

from __future__ import annotations

import itertools

import pandas as pd
from matplotlib.figure import Figure

from benchmarks.reduction.comparison import PEOPLE_OF_KIM, WORDS
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, NAMES, panels
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.significance import paired_tests
from benchmarks.reduction.size import Size

COUNTS = tuple(range(2, 10))
FEWEST = {"nr": 4, "svmr": 2, "gpr": 2}
"""A Gaussian has three parameters: no fit, and no noise, from two or three trials."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Every number with the same people."""
    return [
        Session(method, "kim11", person, seed, accelerometer=accelerometer, settings=(("initial", count),))
        for method, accelerometer, count in itertools.product(FEWEST, (False, True), COUNTS)
        if count >= FEWEST[method]
        for person in range(size.sweep)
    ]


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 and trials by method, accelerometer and number; stars against the number before it."""
    keys = ["method", "accelerometer", "initial"]
    table = rows.groupby(keys).agg(F1=("f1, true", "mean"), trials=("trials", "mean"), converged=("converged", "mean"))
    table["F1 measured"] = rows.groupby(keys)["f1, measured, baseline"].mean()
    for value, name in (("f1, true", "F1 *"), ("trials", "trials *")):
        table[name] = _stars(rows, value).reindex(table.index).fillna("")
    return table.reset_index().assign(accelerometer=lambda t: t["accelerometer"].map(WORDS))


def _stars(rows: pd.DataFrame, value: str) -> pd.Series:
    """Significance of each step from one number to the next, corrected within a method and accelerometer."""
    found = {}
    for (method, accelerometer), group in rows.groupby(["method", "accelerometer"]):
        person = (group["person"] % PEOPLE_OF_KIM).rename("person")
        values = group.pivot_table(index=person, columns="initial", values=value)
        tests = paired_tests(values, list(itertools.pairwise(values.columns)))
        found |= {(method, accelerometer, row.second): row.stars for row in tests.itertuples()}
    return pd.Series(found)


def figure(table: pd.DataFrame) -> Figure:
    """Fig. 4.31–4.33."""
    picture, axes = panels(2, 3, sharex=True)
    for column, (method, number) in enumerate(zip(FEWEST, ("4.31", "4.32", "4.33"), strict=True)):
        for word, style in (("without", "-"), ("with", "--")):
            rows = table[(table["method"] == method) & (table["accelerometer"] == word)]
            for line, value in enumerate(("F1", "trials")):
                axes[line, column].plot(
                    rows["initial"], rows[value], style, marker="o", ms=3, color=COLOURS[method], label=f"{word} acc."
                )
        axes[0, column].set(title=f"Fig. {number}: {NAMES[method]}", ylim=(0, 1), ylabel="F1 (true window)")
        axes[1, column].set(xlabel="initial observations", ylabel="trials", ylim=(0, None))
        axes[0, column].legend(fontsize=7, frameon=False)
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    table = summary(rows)
    cells = table.set_index(["method", "accelerometer", "initial"])["F1"]
    best = [
        f"{NAMES[method]} {word} accelerometer: F1 best at {cells[method, word].idxmax()} ({cells[method, word].max():.2f})"
        for method, word in itertools.product(FEWEST, WORDS.values())
    ]
    rises = (
        f"NR's F1 from 7 to 8 without: {cells['nr', 'without', 7]:.2f} → {cells['nr', 'without', 8]:.2f}, from 6 to 9 with: "
        f"{cells['nr', 'with', 6]:.2f} → {cells['nr', 'with', 9]:.2f} (the text: both rise)"
    )
    prose = (
        f"`kim11`, {rows['person'].nunique()} sessions for each number. NR cannot be run from two or three, as in the text. The text finds SVMR's F1 "
        "best at 4 without and 3 with accelerometer, GPR's at 6 and below 8. Stars: paired t-test against one observation "
        "fewer, Holm within a method and accelerometer."
    )
    return Section(
        "6. How many initial observations (Fig. 4.31–4.33)",
        prose,
        [Table("Means.", table)],
        ("initial", figure(table)),
        [*best, rises],
    )
