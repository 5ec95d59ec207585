"""Readings of the text against its figures: how far each is from them, and which explains them best."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.readings import READINGS, TRUTHS, Reading
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size

ENDS = ("base", "outside the window: zero")
"""Readings of which both ends of the range with accelerometer are run."""

TRIALS_UNIT = math.log(1.3)
SCORE_UNIT = 0.1


def sessions(size: Size, seed: int) -> list[Session]:
    """Every reading with the same people."""
    bare = [(reading, False) for reading in READINGS.values()]
    return [
        Session(method, "kim11", person, seed, reading=reading, accelerometer=accelerometer)
        for reading, accelerometer in [*bare, *((reading, True) for reading in with_ends().values())]
        for method in text.METHODS
        for person in range(size.readings)
    ]


def with_ends() -> dict[str, Reading]:
    """Readings with both ends of the range."""
    return {
        f"{name}, ends with the {end}": replace(READINGS[name], range_end=end)
        for name in ENDS
        for end in ("valve", "hit")
    }


def distance(rows: pd.DataFrame, truth: str, word: str = "without") -> float:
    """Root mean square deviation from the dissertation's figures.

    Trials count in units of 30 %, F1, correlation and convergence in units of 0.1, each method and figure once. What
    could not be computed is left out.

    Args:
        rows: sessions of one reading.
        truth: what F1 is judged by.
        word: "with" or "without" accelerometer.
    """
    return math.sqrt(pd.Series(list(_deviations(rows, truth, word))).pow(2).mean())


def _deviations(rows: pd.DataFrame, truth: str, word: str) -> Iterable[float]:
    for method, group in rows.groupby("method"):
        yield math.log(group["trials"].mean() / text.TRIALS[word][method]) / TRIALS_UNIT
        yield (group[f"f1, {truth}"].mean() - text.F1[word][method]) / SCORE_UNIT
        yield (group["converged"].mean() - text.CONVERGED[word][method]) / SCORE_UNIT
        if word == "without":
            against = "true" if truth == "true" else "measured"
            yield (group[f"correlation, {against}"].mean() - text.CORRELATION[method]) / SCORE_UNIT


def row_of(name: str, rows: pd.DataFrame, word: str = "without") -> dict[str, object]:
    """One reading's figures, and its distances by each truth."""
    row: dict[str, object] = {"reading": name}
    for value, label in (("trials", "n"), ("f1, measured, baseline", "F1"), ("correlation, measured", "r")):
        row |= {f"{label} {NAMES[method]}": rows.loc[rows["method"] == method, value].mean() for method in text.METHODS}
    return row | {f"distance: {truth}": distance(rows, truth, word) for truth in TRUTHS}


def _text_row(word: str) -> dict[str, object]:
    row: dict[str, object] = {"reading": "dissertation"}
    for values, label in (
        (text.TRIALS[word], "n"),
        (text.F1[word], "F1"),
        (text.CORRELATION if word == "without" else {}, "r"),
    ):
        row |= {f"{label} {NAMES[method]}": float(values.get(method, math.nan)) for method in text.METHODS}
    return row


def summary(rows: pd.DataFrame, readings: dict[str, Reading], word: str) -> pd.DataFrame:
    """The dissertation, then one row a reading."""
    rows = rows[rows["accelerometer"] == (word == "with")]
    ours = [row_of(name, rows[rows["reading"] == reading], word) for name, reading in readings.items()]
    return pd.DataFrame([_text_row(word), *ours])


def best(table: pd.DataFrame) -> tuple[str, str, float]:
    """The reading and truth of the least distance."""
    found = table.set_index("reading").filter(like="distance: ").stack()
    reading, truth = found.idxmin()
    return str(reading), str(truth).removeprefix("distance: "), float(found.min())


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    bare, ends = summary(rows, READINGS, "without"), summary(rows, with_ends(), "with")
    reading, truth, least = best(bare)
    base = bare.set_index("reading").loc["base", f"distance: {TRUTHS[0]}"]
    prose = (
        f"`kim11`, {rows['person'].nunique()} sessions for each reading. Base: an observation is one recorded trial; MEPs outside the window as recorded; the floor subtracted (PF: raw); both edges, five "
        "values; the acquisition function is the profile's variance; truth is the measured window above the baseline. One factor at a time, then combinations. Distance: root mean square over methods of the deviations of trials (in units of "
        "30 %), F1, correlation and convergence (in units of 0.1), under each truth (by the true window, correlation is with the true profile); 1 would be within those units. "
        "Convergence in percent with thirds (99.33, 82.33, 91.33) is what 300 runs give, not 11: the text's runs differed on the same record, so that observations were drawn from it; a mean of ten would leave nothing to draw."
    )
    tables = [
        Table(
            "Without accelerometer; n: trials, F1 by the measured window above the baseline, r: correlation with the measured profile.",
            bare,
        ),
        Table("With accelerometer: where the range ends.", ends),
    ]
    conclusion = f"The reading that explains the figures best: **{reading}**, judged by *{truth}*: distance {least:.2f} (base: {base:.2f})."
    return Section("3. Readings of the text", prose, tables, conclusions=[conclusion])
