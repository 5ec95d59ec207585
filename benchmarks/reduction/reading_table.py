"""Readings of the text against its figures: how far each is from them, and which explains them best."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.comparison import WORDS
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.readings import READINGS, TRUTHS
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size

TRIALS_UNIT = math.log(1.3)
SCORE_UNIT = 0.1
FLOORS = {"lowest tenth": "base", "median": "floor: median of all MEPs", "as it is": "floor: raw"}

PROSE = """\
Base: an observation is one recorded trial; MEPs outside the measured window as recorded; the floor as in the headline
(PF: raw); both edges, five values; the acquisition function, which the text does not define, is the profile's variance;
with accelerometer the range ends 500 ms after the valve command. One factor at a time. *Zero
outside*: the text's record holds the windows alone (see the conventional sweep), so that elsewhere an MEP is zero.
*TMS alone at 90 %*: the measured window is above that instead of TMS alone at 100 % RMT. *Constant-CV noise*:
people of `gaussian` instead of `kim11-measured`; their TMS alone is the same at every intensity.

Distance: the root mean square deviation from the text's figures over the four methods, with and without
accelerometer: trials in units of 30 %, F1, correlation and convergence in units of 0.1; 1 is "within those units".
It is given under each truth; under the true window, correlation is with the true profile.

An observation as mean of ten leaves nothing random but the acquisition's samples, yet the text's convergences
(99.33, 82.33, 91.33 %) have the thirds of 300 runs, not of eleven: its runs differed on the same record, which
speaks for trials drawn from it, whatever the distance says."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Every reading with the same people of its cohort, with and without accelerometer."""
    return [
        Session(method, cohort, person, seed, reading=reading, accelerometer=accelerometer)
        for (reading, cohort), accelerometer in itertools.product(READINGS.values(), WORDS)
        for method in (*text.METHODS, "incremental")
        for person in range(size.readings)
    ]


def rows_of(name: str, rows: pd.DataFrame) -> pd.DataFrame:
    """The sessions of a reading."""
    reading, cohort = READINGS[name]
    return rows[(rows["reading"] == reading) & (rows["cohort"] == cohort)]


def distance(rows: pd.DataFrame, truth: str) -> float:
    """Root mean square deviation from the dissertation's figures; what could not be computed is left out.

    Args:
        rows: sessions of one reading.
        truth: what F1 is judged by.
    """
    return math.sqrt(pd.Series(list(_deviations(rows, truth))).pow(2).mean())


def _deviations(rows: pd.DataFrame, truth: str) -> Iterable[float]:
    against = "true" if truth == "true" else "measured"
    for (method, accelerometer), group in rows[rows["method"].isin(text.METHODS)].groupby(["method", "accelerometer"]):
        word = WORDS[bool(accelerometer)]
        yield math.log(group["trials"].mean() / text.TRIALS[word][method]) / TRIALS_UNIT
        yield (group[f"f1, {truth}"].mean() - text.F1[word][method]) / SCORE_UNIT
        yield (group["converged"].mean() - text.CONVERGED[word][method]) / SCORE_UNIT
        if word == "without":
            yield (group[f"correlation, {against}"].mean() - text.CORRELATION[method]) / SCORE_UNIT


def summary(rows: pd.DataFrame, *, accelerometer: bool) -> pd.DataFrame:
    """The dissertation, then one row a reading: trials n, F1 and correlation r by the measured window."""
    rows = rows[rows["accelerometer"] == accelerometer]
    word = WORDS[accelerometer]
    theirs = {"n": text.TRIALS[word], "F1": text.F1[word], "r": {} if accelerometer else text.CORRELATION}
    columns = {"n": "trials", "F1": "f1, measured", "r": "correlation, measured"}
    table = [
        {"reading": "dissertation"}
        | {f"{k} {NAMES[m]}": v.get(m, math.nan) for k, v in theirs.items() for m in text.METHODS}
    ]
    for name in READINGS:
        means = rows_of(name, rows).groupby("method")[list(columns.values())].mean()
        row = {f"{label} {NAMES[m]}": means.loc[m, column] for label, column in columns.items() for m in text.METHODS}
        table.append({"reading": name} | row)
    return pd.DataFrame(table).astype({f"n {NAMES[m]}": float for m in text.METHODS})


def distances(rows: pd.DataFrame) -> pd.DataFrame:
    """Distance of each reading under each truth, least first."""
    table = [{"reading": name} | {truth: distance(rows_of(name, rows), truth) for truth in TRUTHS} for name in READINGS]
    return (
        pd.DataFrame(table).assign(least=lambda t: t[list(TRUTHS)].min(axis=1)).sort_values("least", ignore_index=True)
    )


def floors(rows: pd.DataFrame) -> pd.DataFrame:
    """NR by what is subtracted as floor, with and without accelerometer, side by side."""
    columns = {"trials": "trials", "F1": "f1, measured", "F1: true": "f1, true", "r": "correlation, measured"}
    table = []
    for (flag, word), (kind, name) in itertools.product(WORDS.items(), FLOORS.items()):
        group = rows_of(name, rows)
        means = group[(group["method"] == "nr") & (group["accelerometer"] == flag)][list(columns.values())].mean()
        ours = {label: means[column] for label, column in columns.items()}
        table.append({"accelerometer": word, "floor": kind} | ours | {"text: F1": text.F1[word]["nr"]})
    return pd.DataFrame(table)


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    far = distances(rows)
    first = far.iloc[0]
    truth = far.loc[0, list(TRUTHS)].astype(float).idxmin()
    base = far.set_index("reading").loc["base", TRUTHS[0]]
    tables = [
        Table("Distance from the text's figures.", far),
        Table("Without accelerometer.", summary(rows, accelerometer=False)),
        Table("With accelerometer.", summary(rows, accelerometer=True)),
        Table("NR by what is subtracted as floor.", floors(rows)),
    ]
    best = (
        f"The reading that explains the figures best: **{first['reading']}**, judged by *{truth}*: distance "
        f"{first['least']:.2f} (base, by *{TRUTHS[0]}*: {base:.2f})."
    )
    prose = f"{rows['person'].nunique()} sessions for each reading. {PROSE}"
    return Section("Readings of the text", prose, tables, conclusions=[best])
