"""How many particles, and how fast they converge (Fig. 4.28, 4.30)."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from benchmarks.reduction.comparison import PEOPLE_OF_KIM, error_of_mean
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, panels
from benchmarks.reduction.readings import BASE, PEOPLE, READINGS, Reading
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.significance import paired_tests
from benchmarks.reduction.size import Size
from isiw.plots.style import FAINT, INK, explain

COUNTS: Final = (10, 20, 30, 40, 50)
GENERATIONS: Final = 8

RANGES: Final[dict[str, tuple[Reading, bool]]] = {
    "without": (BASE, False),
    "with, impact + 500": (READINGS["range end: hit + 500"][0], True),
    "with, valve + 500": (BASE, True),
}
"""Without accelerometer; with it, the text's particles cover 500 ms from the impact (4.4.5), which is no narrower a
range, and its regressions what is left of the 500 ms from the valve command (4.4.7)."""

STYLES: Final = dict(zip(RANGES, (("-", INK), ("--", FAINT), (":", COLOURS["pf"])), strict=True))

PROSE = """\
The text: 30–40 particles need 3–4 iterations, 100–150 trials (yet 199 in Fig. 4.24); fewer particles fewer trials,
but poorer convergence; no significant difference in F1. With accelerometer the variance falls faster, until
iteration 5 or 6. The text's particles then cover 500 ms from the impact: as wide a range as before, in which the
window lies nearer to an end. A range that is really narrower is given beside it."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Every number with the same people, for as many generations at least as are shown."""
    return [
        Session(
            "pf",
            PEOPLE,
            person,
            seed,
            reading,
            accelerometer=accelerometer,
            horizon=GENERATIONS * count,
            settings=(("particles", count),),
        )
        for count, (reading, accelerometer) in itertools.product(COUNTS, RANGES.values())
        for person in range(size.sweep)
    ]


def labelled(rows: pd.DataFrame) -> pd.DataFrame:
    """With the name of each session's range."""
    names = {pair: name for name, pair in RANGES.items()}
    pairs = zip(rows["reading"], rows["accelerometer"], strict=True)
    return rows.assign(range=[names[reading, bool(accelerometer)] for reading, accelerometer in pairs])


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Trials, iterations, convergence and F1 by number of particles."""
    rows = rows.assign(iterations=rows["trials"] / rows["particles"])
    columns = {
        "trials": ("trials", "mean"),
        "SD": ("trials", "std"),
        "iterations": ("iterations", "mean"),
        "converged": ("converged", "mean"),
        "F1: measured": ("f1, measured", "mean"),
        "F1: true": ("f1, true", "mean"),
    }
    grouped = rows.groupby(["range", "particles"], sort=False)
    errors = {
        f"{name} SE": pd.Series({key: error_of_mean(group, value) for key, group in grouped})
        for name, value in (("trials", "trials"), ("F1", "f1, measured"))
    }
    return grouped.agg(**columns).assign(**errors).reset_index()


def variances(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean variance of the particles [ms²] by range, number and iteration (0: before the first)."""
    table = []
    for (label, count), group in rows.groupby(["range", "particles"], sort=False):
        # A session that stops early keeps the spread that it stopped with.
        spreads = [spread[: GENERATIONS + 1] for spread in group["spread_ms"]]
        longest = max(map(len, spreads))
        mean = (np.array([spread + spread[-1:] * (longest - len(spread)) for spread in spreads]) ** 2).mean(axis=0)
        table.append({"range": label, "particles": count} | {f"k={k}": value for k, value in enumerate(mean.tolist())})
    return pd.DataFrame(table)


def figure(table: pd.DataFrame, spread: pd.DataFrame) -> Figure:
    """Fig. 4.28 and 4.30."""
    picture, axes = panels(1, 4, width=3.0)
    for label, (style, colour) in STYLES.items():
        rows = table[table["range"] == label]
        for one, value in ((axes[0, 0], "trials"), (axes[0, 1], "F1: measured")):
            one.plot(rows["particles"], rows[value], style, marker="o", ms=3, color=colour, label=label)
        for one, count in ((axes[0, 2], 10), (axes[0, 3], 30)):
            line = spread[(spread["range"] == label) & (spread["particles"] == count)].filter(like="k=").iloc[0]
            one.plot(range(GENERATIONS + 1), line, style, marker="o", ms=3, color=colour, label=label)
            one.set(title=f"Fig. 4.30: {count} particles", xlabel="iteration", ylabel="variance [ms²]", ylim=(0, None))
    axes[0, 0].set(title="Fig. 4.28a: trials", xlabel="particles", ylim=(0, None))
    axes[0, 1].set(title="Fig. 4.28b: F1 (measured window)", xlabel="particles", ylim=(0, 1))
    explain(picture, ncols=3)
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    rows = labelled(rows)
    table, spread = summary(rows), variances(rows)
    bare = rows[rows["range"] == "without"]
    values = bare.pivot_table(index=bare["person"] % PEOPLE_OF_KIM, columns="particles", values="f1, measured")
    iterations = table[table["range"] == "without"].set_index("particles")["iterations"]
    by_range = {label: group.filter(like="k=").mean() for label, group in spread.groupby("range", sort=False)}
    conclusions = [
        f"Iterations at 30 and 40 particles, without: {iterations[30]:.1f} and {iterations[40]:.1f} (text 3–4).",
        f"Least corrected p of any difference in F1: {paired_tests(values)['p'].min():.3f} (text: none significant).",
    ]
    conclusions += [
        f"Variance by iteration, {label}, by that without: {', '.join(f'{v:.2f}' for v in mean / by_range['without'])}."
        for label, mean in by_range.items()
        if label != "without"
    ]
    tables = [Table("Fig. 4.28.", table), Table("Fig. 4.30: variance of the particles [ms²] by iteration.", spread)]
    prose = f"`{PEOPLE}`, {rows['person'].nunique()} sessions for each number. {PROSE}"
    return Section(
        "How many particles (Fig. 4.28, 4.30)", prose, tables, ("particles", figure(table, spread)), conclusions
    )
