"""The methods side by side: trials, F1, correlation and convergence, with and without accelerometer (Fig. 4.23–4.26)."""

from __future__ import annotations

import itertools
import math

import pandas as pd
from matplotlib.figure import Figure

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import NAMES, beside, panels
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.significance import paired_tests
from benchmarks.reduction.size import Size

METHODS = (*text.METHODS, "default")
PEOPLE_OF_KIM = 11
WORDS = {False: "without", True: "with"}


def sessions(size: Size, seed: int) -> list[Session]:
    """Every method with the same people, with and without accelerometer."""
    people = {"kim11": (size.kim, size.kim_default), "recruitment": (size.people, size.people)}
    return [
        Session(method, cohort, person, seed, accelerometer=accelerometer)
        for cohort, (usual, slow) in people.items()
        for method, accelerometer in itertools.product((*METHODS, "incremental"), (False, True))
        for person in range(slow if method == "default" else usual)
    ]


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a method and accelerometer of one cohort: ours, and the dissertation's."""
    table = []
    for accelerometer, method in itertools.product((False, True), (*METHODS, "incremental")):
        group = rows[(rows["method"] == method) & (rows["accelerometer"] == accelerometer)]
        word = WORDS[accelerometer]
        table.append(
            {
                "method": NAMES[method],
                "accelerometer": word,
                "sessions": len(group),
                "trials": group["trials"].mean(),
                "SD": group["trials"].std(),
                "text": text.TRIALS[word].get(method, math.nan),
                "F1 measured, baseline": group["f1, measured, baseline"].mean(),
                "measured, .135": group["f1, measured, .135"].mean(),
                "true": group["f1, true"].mean(),
                "text F1": text.F1[word].get(method, math.nan),
                "correlation measured": group["correlation, measured"].mean(),
                "true profile": group["correlation, true"].mean(),
                "text corr.": math.nan if accelerometer else text.CORRELATION.get(method, math.nan),
                "converged %": 100 * group["converged"].mean(),
                "text %": 100 * text.CONVERGED[word].get(method, math.nan),
            }
        )
    return pd.DataFrame(table)


def by_person(rows: pd.DataFrame, value: str) -> pd.DataFrame:
    """Means of a value: a row for each of the eleven people, a column for each method."""
    person = (rows["person"] % PEOPLE_OF_KIM).rename("person")
    return rows.pivot_table(index=person, columns="method", values=value, observed=True)


def significance(rows: pd.DataFrame) -> list[Table]:
    """Paired tests between methods, and of the accelerometer, on the eleven people of `kim11`."""
    rows = rows[rows["method"].isin(METHODS)]
    bare = rows[~rows["accelerometer"]]
    tables = []
    for value, name in (
        ("correlation, measured", "Correlation with the measured profile (Fig. 4.23)"),
        ("trials", "Trials (Fig. 4.24)"),
        ("f1, true", "F1 by the true window (Fig. 4.25)"),
    ):
        tests = paired_tests(by_person(bare, value)[list(METHODS)])
        if value.startswith("correlation"):
            claimed = set(map(frozenset, text.SIGNIFICANT_CORRELATIONS))
            tests["text"] = [
                "*" if frozenset(pair) in claimed else "" for pair in zip(tests["first"], tests["second"], strict=True)
            ]
        tables.append(Table(f"{name}, without accelerometer: paired t-tests.", tests))
    changes = []
    for value in ("trials", "f1, true"):
        both = {word: by_person(rows[rows["accelerometer"] == flag], value) for flag, word in WORDS.items()}
        values = pd.concat(both, axis=1)
        values.columns = [f"{method} {word}" for word, method in values.columns]
        tests = paired_tests(values, [(f"{method} with", f"{method} without") for method in METHODS])
        changes.append(tests.assign(value=value))
    return [*tables, Table("The accelerometer: paired t-tests, corrected within each value.", pd.concat(changes))]


def figure(table: pd.DataFrame) -> Figure:
    """Fig. 4.23 to 4.26."""
    picture, axes = panels(2, 4, width=3.1)
    values = (
        ("trials", "text", "SD", "Fig. 4.24: trials"),
        ("true", "text F1", None, "Fig. 4.25: F1 (true window)"),
        ("correlation measured", "text corr.", None, "Fig. 4.23: correlation"),
        ("converged %", "text %", None, "Fig. 4.26: converged [%]"),
    )
    for line, word in zip(axes, WORDS.values(), strict=True):
        rows = table[(table["accelerometer"] == word) & (table["method"] != NAMES["incremental"])]
        for one, (ours, theirs, error, title) in zip(line, values, strict=True):
            beside(
                one,
                list(rows["method"]),
                list(rows[theirs]),
                list(rows[ours]),
                None if error is None else list(rows[error]),
            )
            one.set_title(f"{title}, {word} acc.", fontsize=9)
    for line in axes:
        line[0].set_yscale("log")
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    tables = {name: summary(group) for name, group in rows.groupby("cohort")}
    kim = rows[rows["cohort"] == "kim11"]
    prose = (
        "Sessions end by each method's own stopping rule. F1 is judged by the measured window above the baseline (the "
        "text's ground truth), by the measured window by the 0.135 rule, and by the true one; the first two leave out "
        "people whose sweep shows no window. Conventional: from the range's start until the window was passed; its F1 is by "
        "the true window. PF has no profile: a Gaussian of SD 25 ms at its estimate stands in, since its rule stops at "
        "that SD and its window of ± 75 ms is called three of them. Tests are on the eleven people's means over "
        "noise seeds (the text has n = 5 with accelerometer), corrected by Holm's method within a table."
    )
    shown = [Table(f"Cohort `{name}`.", table) for name, table in tables.items()]
    return Section(
        "1. The methods side by side (Fig. 4.23–4.26)",
        prose,
        [*shown, *significance(kim)],
        ("methods", figure(tables["kim11"])),
        [f"{'holds' if holds else 'FAILS'}: {claim}" for claim, holds in orderings(tables["kim11"])],
    )


def orderings(table: pd.DataFrame) -> list[tuple[str, bool]]:
    """The dissertation's orderings, with our numbers, and whether they hold."""
    cells = table.set_index(["accelerometer", "method"])
    trials, f1, corr = (
        {word: cells.loc[word, name] for word in WORDS.values()} for name in ("trials", "true", "correlation measured")
    )
    n, c = trials["without"], corr["without"]
    claims = [
        (
            f"conventional ≫ PF ≫ SVMR in trials ({n['conventional']:.0f}, {n['PF']:.0f}, {n['SVMR']:.1f}; ≫: twice as many)",
            n["conventional"] > 2 * n["PF"] > 4 * n["SVMR"],
        ),
        (f"SVMR > GPR in trials ({n['SVMR']:.1f}, {n['GPR']:.1f})", n["SVMR"] > n["GPR"]),
        (f"GPR ≈ NR in trials, within 30 % ({n['GPR']:.1f}, {n['NR']:.1f})", within(n["GPR"], n["NR"])),
        (
            f"GPR > SVMR and PF > NR in correlation ({c['GPR']:.2f}; {c['SVMR']:.2f}, {c['PF']:.2f}; {c['NR']:.2f})",
            c["GPR"] > max(c["SVMR"], c["PF"]) and min(c["SVMR"], c["PF"]) > c["NR"],
        ),
        (f"SVMR ≈ PF in correlation, within .1 ({c['SVMR']:.2f}, {c['PF']:.2f})", abs(c["SVMR"] - c["PF"]) <= 0.1),
    ]
    for name in ("NR", "SVMR", "GPR", "PF"):
        claims.append(
            (
                f"{name}: the accelerometer helps: trials {n[name]:.1f} → {trials['with'][name]:.1f}, "
                f"F1 {f1['without'][name]:.2f} → {f1['with'][name]:.2f}",
                trials["with"][name] <= n[name] and f1["with"][name] >= f1["without"][name],
            )
        )
    for name, theirs in (("NR", 16), ("GPR", 18)):
        claims.append((f"{name}'s mean trials within 30 % of {theirs} ({n[name]:.1f})", within(n[name], theirs)))
    return [(claim, bool(holds)) for claim, holds in claims]


def within(ours: float, theirs: float, share: float = 0.3) -> bool:
    """Whether one number is within a share of another."""
    return abs(ours / theirs - 1.0) <= share
