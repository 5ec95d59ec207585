"""One Gaussian or two, and whether profiles are normal (Fig. 4.34, Table 4.1)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.comparison import PEOPLE_OF_KIM
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size

ZERO = 0.01
"""A component has converged to zero where it has less than this share of the person's largest amplitude."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Ten runs for each of eleven people, or as many as the size has."""
    return [Session("nr2", "kim11", person, seed) for person in range(size.kim)]


def summary(rows: pd.DataFrame) -> dict[str, float]:
    """Mean normalised amplitudes of the higher and the lower component, and how often the lower is zero.

    Amplitudes are normalised by each person's largest of all runs.
    """
    amplitudes = np.array(rows["amplitudes_mv"].tolist())
    person = rows["person"].to_numpy() % PEOPLE_OF_KIM
    largest = np.array([amplitudes[person == p].max() for p in person])
    shares = amplitudes / largest[:, None]
    high, low = shares.mean(axis=0).tolist()
    return {"high": high, "low": low, "lower is zero": float((shares[:, 1] < ZERO).mean())}


def section(rows: pd.DataFrame, main: pd.DataFrame) -> Section:
    """This part of the report.

    Args:
        rows: the sessions of two Gaussians.
        main: those of the comparison, for the sweeps' normality.
    """
    ours, theirs = summary(rows), dict(zip(("high", "low", "lower is zero"), text.TWO_GAUSSIANS, strict=True))
    components = pd.DataFrame([{"": "dissertation"} | theirs, {"": "here"} | ours])
    sweep = main[(main["method"] == "incremental") & ~main["accelerometer"]].groupby("cohort")
    normal = pd.DataFrame(
        {"inside the true window": sweep["normal"].mean(), "whole range": sweep["normal throughout"].mean()}
    )
    normal["dissertation"] = text.NORMAL_OF_ELEVEN / PEOPLE_OF_KIM
    prose = (
        f"Two Gaussians are fitted by `nr2` until its stopping rule, {len(rows)} runs of `kim11`; amplitudes as shares of each person's largest. "
        "The Shapiro–Wilk test is on the mean MEPs by ISI, as in the text, which tests their distribution over amplitudes and not the profile's form."
    )
    tables = [
        Table(f"Fig. 4.34: amplitudes of the two components (zero: below {ZERO:g}).", components),
        Table("Table 4.1: share of measured profiles whose normality is not rejected at .05.", normal.reset_index()),
    ]
    return Section("8. One Gaussian or two, and normality (Fig. 4.34, Table 4.1)", prose, tables)
