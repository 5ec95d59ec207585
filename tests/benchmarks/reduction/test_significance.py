"""Paired tests: what they find, and what the correction costs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from benchmarks.reduction.significance import paired_tests, stars
from scipy.stats import ttest_rel


def people(*shifts: float) -> pd.DataFrame:
    rng = np.random.default_rng(0)
    person = rng.normal(0, 5, 11)
    return pd.DataFrame({f"m{i}": person + shift + rng.normal(0, 0.3, 11) for i, shift in enumerate(shifts)})


def test_pairing_finds_a_difference_far_smaller_than_that_between_people() -> None:
    test = paired_tests(people(0.0, 1.0)).iloc[0]
    assert test["p"] < 0.001
    assert test["difference"] == pytest.approx(-1.0, abs=0.4)
    assert test["stars"] == "***"


def test_holm_multiplies_the_least_p_by_the_number_of_tests() -> None:
    values = people(0.0, 0.2, 0.1, 3.0)
    tests = paired_tests(values)
    raw = min(ttest_rel(values[a], values[b]).pvalue for a, b in zip(tests["first"], tests["second"], strict=True))
    assert tests["p"].min() == pytest.approx(len(tests) * raw)


def test_a_person_that_lacks_one_of_a_pair_is_left_out_of_it_alone() -> None:
    values = people(0.0, 1.0, 2.0)
    values.loc[3, "m2"] = np.nan
    assert paired_tests(values)["people"].tolist() == [11, 10, 10]


def test_equal_columns_do_not_differ() -> None:
    values = people(0.0)
    assert paired_tests(values.assign(same=values["m0"]))["p"].tolist() == [1.0]


@pytest.mark.parametrize(("p", "mark"), [(0.05, ""), (0.049, "*"), (0.009, "**"), (0.0009, "***")])
def test_stars_are_the_dissertations(p: float, mark: str) -> None:
    assert stars(p) == mark
