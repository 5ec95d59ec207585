"""One Gaussian or two, and whether profiles are normal (Fig. 4.34, Table 4.1)."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.comparison import PEOPLE_OF_KIM
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.readings import PEOPLE, READINGS
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size

ZERO = 0.01
"""A component has converged to zero where it has less than this share of the person's largest amplitude."""

TRIED = ("base", "outside the window: zero")
STARTS = ("even", "unequal", "random")

PROSE = """\
Two Gaussians are fitted by `nr2` until its stopping rule, as often with each of the eleven people of
`kim11-measured`; amplitudes are shares of the person's largest in all runs. The text does not say where its search
starts: evenly, a quarter of a window to either side of mid-range; unequally, the second with a tenth of the amplitude;
or anywhere. The Shapiro–Wilk test is on the mean MEPs by ISI, as in the text: it tests how amplitudes are distributed,
and not the profile's form."""


def sessions(size: Size, seed: int) -> list[Session]:
    """As many runs as the main comparison has, under some readings."""
    readings = [READINGS[name][0] for name in TRIED]
    return [
        Session("nr2", PEOPLE, person, seed, reading=reading, settings=(("start", start),))
        for reading, start in itertools.product(readings, STARTS)
        for person in range(size.kim)
    ]


def summary(rows: pd.DataFrame) -> dict[str, float]:
    """Mean normalised amplitudes of the higher and the lower component, and how often the lower is zero.

    Amplitudes are normalised by each person's largest of all runs; a person without any is left out.
    """
    amplitudes = np.array(rows["amplitudes_mv"].tolist())
    person = rows["person"].to_numpy() % PEOPLE_OF_KIM
    largest = np.array([amplitudes[person == p].max() for p in person])
    shares = amplitudes[largest > 0] / largest[largest > 0, None]
    high, low = shares.mean(axis=0).tolist()
    return {"high": high, "low": low, "ratio": high / low, "lower is zero": float((shares[:, 1] < ZERO).mean())}


def components(rows: pd.DataFrame) -> pd.DataFrame:
    """The dissertation, then one row a reading."""
    high, low, zero = text.TWO_GAUSSIANS
    theirs = {"reading": "dissertation", "high": high, "low": low, "ratio": high / low, "lower is zero": zero}
    ours = [
        {"reading": f"{name}; {start} start"}
        | summary(rows[(rows["reading"] == READINGS[name][0]) & (rows["start"] == start)])
        for name, start in itertools.product(TRIED, STARTS)
    ]
    return pd.DataFrame([theirs, *ours])


def section(rows: pd.DataFrame, main: pd.DataFrame) -> Section:
    """This part of the report.

    Args:
        rows: the sessions of two Gaussians.
        main: those of the comparison, for the sweeps' normality.
    """
    sweep = main[(main["method"] == "incremental") & ~main["accelerometer"]].groupby("cohort", sort=False)
    normal = pd.DataFrame(
        {"inside the measured window": sweep["normal"].mean(), "whole range": sweep["normal throughout"].mean()}
    )
    normal["dissertation"] = text.NORMAL_OF_ELEVEN / PEOPLE_OF_KIM
    tables = [
        Table(f"Fig. 4.34: amplitudes of the two components (zero: below {ZERO:g}).", components(rows)),
        Table("Table 4.1: share of measured profiles whose normality is not rejected at .05.", normal.reset_index()),
    ]
    return Section("One Gaussian or two, and normality (Fig. 4.34, Table 4.1)", PROSE, tables)
