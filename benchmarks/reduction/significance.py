"""Paired tests over people, with Holm's correction."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
import pandas as pd
from scipy.stats import ttest_rel
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.power import TTestPower

__all__ = ["no_power", "paired_tests", "stars"]

FEWEST: Final = 3
"""People of whom a spread is known."""


def paired_tests(values: pd.DataFrame, pairs: list[tuple[str, str]] | None = None) -> pd.DataFrame:
    """Paired t-tests between columns, two-sided, corrected for their number by Holm's method.

    Args:
        values: one row a person, one column a condition; a person that lacks one of a pair is left out of it.
        pairs: of columns; every pair by default.

    Returns:
        One row a pair: first, second, their mean difference, people, p after correction, and its stars.
    """
    rows = []
    for first, second in pairs or itertools.combinations(values.columns, 2):
        both = values[[first, second]].dropna()
        same = np.allclose(both[first], both[second])  # of which a t-test makes noise, or nothing
        p = 1.0 if same else float(ttest_rel(both[first], both[second]).pvalue)
        difference = float((both[first] - both[second]).mean())
        rows.append({"first": first, "second": second, "difference": difference, "people": len(both), "p": p})
    table = pd.DataFrame(rows, columns=["first", "second", "difference", "people", "p"])
    if table.empty:
        return table.assign(stars=[])
    table["p"] = multipletests(table["p"], method="holm")[1]
    return table.assign(stars=[stars(p) for p in table["p"]])


POWER: Final = 0.8
WORTH: Final = 0.1
"""A difference of F1 or correlation that a test should find if it says that there is none, and how often it should."""


def no_power(differences: pd.Series) -> str:
    """Why "not significant" says nothing: how seldom the paired test would find a difference of `WORTH`; else empty.

    Args:
        differences: of each person.
    """
    values = differences.dropna()
    if len(values) < FEWEST or not values.std():
        return ""
    effect = WORTH / float(values.std())
    power = float(TTestPower().power(effect, len(values), 0.05, alternative="two-sided"))
    if not power < POWER:  # not a number where the effect is very large
        return ""
    return f"the test of {len(values)} people would find a difference of {WORTH:g} with a power of {power:.2f} only"


def stars(p: float) -> str:
    """The dissertation's marks: * below .05, ** below .01, *** below .001."""
    return "*" * sum(p < level for level in (0.05, 0.01, 0.001))
