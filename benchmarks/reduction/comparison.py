"""The methods side by side: trials, F1, correlation, convergence, with and without accelerometer (Fig. 4.23–4.26)."""

from __future__ import annotations

import itertools
import math

import pandas as pd
from matplotlib.figure import Figure

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import NAMES, beside, panels
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.significance import paired_tests
from benchmarks.reduction.size import Size
from isiw.plots.style import explain

METHODS = (*text.METHODS, "default")
PEOPLE_OF_KIM = 11
WORDS = {False: "without", True: "with"}

PROSE = """\
Sessions end by each method's own stopping rule (default: both 90 % intervals within 30 ms under every likely kind of
noise, or 80 trials, which count as not converged). F1 is judged by the measured window: where the mean of ten MEPs is
above that of TMS alone at 100 % RMT (the text's ground truth, 4.2.1), or at the 90 % of the pairs, or has 0.135 of
the largest excess; and by the true one. All but the last leave out people whose sweep shows no window.
Conventional: from the range's start until the window was passed. PF's profile is a Gaussian fitted to its MEPs (Fig.
4.13, 4.14). Tests are on the eleven people's means over noise seeds (the text has n = 5 with accelerometer),
corrected by Holm's method within a table."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Every method with the same people, with and without accelerometer."""
    people = {
        PEOPLE: (size.kim, size.kim_default),
        "kim11": (size.people, size.people_default),
        "recruitment": (size.people, size.people_default),
    }
    return [
        Session(
            method,
            cohort,
            person,
            seed,
            accelerometer=accelerometer,
            settings=size.default if method == "default" else (),
        )
        for cohort, (usual, slow) in people.items()
        for method, accelerometer in itertools.product((*METHODS, "incremental"), WORDS)
        for person in range(slow if method == "default" else usual)
    ]


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a method and accelerometer of one cohort: ours, and the dissertation's."""
    table = []
    for (accelerometer, word), method in itertools.product(WORDS.items(), (*METHODS, "incremental")):
        group = rows[(rows["method"] == method) & (rows["accelerometer"] == accelerometer)]
        if len(group):
            table.append({"method": NAMES[method], "accelerometer": word} | _means(group) | _theirs(method, word))
    return pd.DataFrame(table)


def _means(group: pd.DataFrame) -> dict[str, float]:
    return {
        "sessions": len(group),
        "trials": group["trials"].mean(),
        "SD": group["trials"].std(),
        "SE": error_of_mean(group, "trials"),
        "F1: measured": group["f1, measured"].mean(),
        "F1 SE": error_of_mean(group, "f1, measured"),
        "F1: measured, 90 %": group["f1, measured, 90 % RMT"].mean(),
        "F1: measured, .135": group["f1, measured, .135"].mean(),
        "F1: true": group["f1, true"].mean(),
        "r: measured": group["correlation, measured"].mean(),
        "r: true": group["correlation, true"].mean(),
        "converged %": 100 * group["converged"].mean(),
    }


def error_of_mean(group: pd.DataFrame, value: str) -> float:
    """Standard error of a mean; sessions of one of the eleven people of `kim11` count as one person's."""
    eleven = group["cohort"].str.startswith("kim11")
    person = group["person"].where(~eleven, group["person"] % PEOPLE_OF_KIM)
    return float(group.groupby(person)[value].mean().sem())


def _theirs(method: str, word: str) -> dict[str, float]:
    return {
        "text: trials": text.TRIALS[word].get(method, math.nan),
        "text: F1": text.F1[word].get(method, math.nan),
        "text: r": text.CORRELATION.get(method, math.nan) if word == "without" else math.nan,
        "text: converged %": 100 * text.CONVERGED[word].get(method, math.nan),
    }


def by_person(rows: pd.DataFrame, value: str) -> pd.DataFrame:
    """Means of a value: a row for each of the eleven people, a column for each method."""
    person = (rows["person"] % PEOPLE_OF_KIM).rename("person")
    return rows.pivot_table(index=person, columns="method", values=value)


def significance(rows: pd.DataFrame) -> list[Table]:
    """Paired tests between methods, and of the accelerometer, on the eleven people."""
    methods = [method for method in METHODS if (rows["method"] == method).any()]
    rows = rows[rows["method"].isin(methods)]
    bare = rows[~rows["accelerometer"]]
    titles = {
        "correlation, measured": "Correlation with the measured profile (Fig. 4.23)",
        "trials": "Trials (Fig. 4.24)",
        "f1, measured": "F1 by the measured window (Fig. 4.25)",
    }
    tests = {value: paired_tests(by_person(bare, value)[methods]) for value in titles}
    claimed = set(map(frozenset, text.SIGNIFICANT_CORRELATIONS))
    pairs = tests["correlation, measured"][["first", "second"]].to_numpy()
    tests["correlation, measured"]["text"] = ["*" if frozenset(pair) in claimed else "" for pair in pairs]
    tables = [Table(f"{titles[value]}, without accelerometer: paired t-tests.", test) for value, test in tests.items()]
    changes = pd.concat([_change(rows, value).assign(value=value) for value in ("trials", "f1, measured")])
    return [*tables, Table("The accelerometer: paired t-tests, corrected within each value.", changes)]


def _change(rows: pd.DataFrame, value: str) -> pd.DataFrame:
    """Each method with against without accelerometer."""
    values = pd.concat(
        {word: by_person(rows[rows["accelerometer"] == flag], value) for flag, word in WORDS.items()}, axis=1
    )
    values.columns = [f"{method} {word}" for word, method in values.columns]
    return paired_tests(values, [(f"{method} with", f"{method} without") for method in rows["method"].unique()])


def figure(table: pd.DataFrame) -> Figure:
    """Fig. 4.23 to 4.26."""
    picture, axes = panels(2, 4, width=3.1)
    values = (
        ("trials", "text: trials", "Fig. 4.24: trials"),
        ("F1: measured", "text: F1", "Fig. 4.25: F1 (measured window)"),
        ("r: measured", "text: r", "Fig. 4.23: correlation"),
        ("converged %", "text: converged %", "Fig. 4.26: converged [%]"),
    )
    for line, word in zip(axes, WORDS.values(), strict=True):
        rows = table[(table["accelerometer"] == word) & (table["method"] != NAMES["incremental"])]
        for one, (ours, theirs, title) in zip(line, values, strict=True):
            error = rows["SD"] if ours == "trials" else None
            beside(one, rows["method"], rows[theirs], rows[ours], error)
            one.set_title(f"{title}, {word} acc.")
        line[0].set_yscale("log")
    explain(picture, ncols=2)
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    tables = {name: summary(group) for name, group in rows.groupby("cohort", sort=False)}
    shown = [Table(f"Cohort `{name}`.", table) for name, table in tables.items()]
    tests = significance(rows[rows["cohort"] == PEOPLE])
    picture = ("methods", figure(tables[PEOPLE]))
    return Section("The methods side by side (Fig. 4.23–4.26)", PROSE, [*shown, *tests], picture)
