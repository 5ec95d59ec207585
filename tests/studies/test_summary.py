"""What a study comes to."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd
import pytest

from isiw.studies import summarise


def rows(strategy: str, cohort: str, f1s: Sequence[float], **columns: object) -> pd.DataFrame:
    usual = {
        "trial": 10,
        "start_covered": [1.0, 0.0, math.nan][: len(f1s)],
        "end_covered": 1.0,
        "reported_window": [True, True, False][: len(f1s)],
        "delivered": [10, 8, 9][: len(f1s)],
        "stop_trial": [math.nan, 8.0, 9.0][: len(f1s)],
        "stop_f1": [math.nan, 0.7, 0.8][: len(f1s)],
        "converged": [0.0, 1.0, 1.0][: len(f1s)],
        "ask_ms": [1.0, 2.0, 30.0][: len(f1s)],
        "tell_ms": 4.0,
    }
    return pd.DataFrame(
        {"strategy": strategy, "cohort": cohort, "person": range(len(f1s)), "f1": f1s} | usual | columns
    )


NOBODY = pd.DataFrame()


def test_each_column_is_the_mean_over_people_that_it_says() -> None:
    (row,) = summarise(rows("nr", "wide", [0.9, 0.6, 0.0]), NOBODY).to_dict("records")
    assert row["people"] == 3
    assert row["f1"] == pytest.approx(0.5)
    assert row["f1_se"] == pytest.approx(math.sqrt(0.21 / 3))
    assert (row["start_coverage"], row["end_coverage"]) == (0.5, 1.0)
    assert row["called_none"] == pytest.approx(1 / 3)
    assert (row["delivered"], row["stop_trial"], row["stop_f1"]) == (9.0, 8.5, 0.75)
    assert (row["end_delivered"], row["end_f1"]) == (9.0, pytest.approx(0.8))  # who went on has 10 and .9 here
    assert row["converged"] == pytest.approx(2 / 3)
    assert (row["ask_ms"], row["tell_ms"]) == (2.0, 4.0)
    assert row["failed"] == 0


def test_where_the_stopping_rule_is_ignored_nobody_ends() -> None:
    ignored = {"stop_trial": math.nan, "stop_f1": math.nan, "converged": math.nan}
    (row,) = summarise(rows("nr", "wide", [0.9, 0.6], **ignored), NOBODY).to_dict("records")
    assert math.isnan(row["end_delivered"])
    assert math.isnan(row["end_f1"])


def test_who_failed_is_counted_and_a_strategy_that_failed_for_all_is_not_left_out() -> None:
    table = summarise(
        pd.concat([rows("nr", "wide", [0.9, 0.6]), rows("nr", "narrow", [0.5])]),
        pd.DataFrame({"strategy": ["nr", "pf", "pf"], "cohort": ["wide", "wide", "wide"], "person": [2, 0, 1]}),
    )
    counts = table[["cohort", "strategy", "trial", "people", "failed"]].to_numpy().tolist()
    assert counts == [["narrow", "nr", 10, 1, 0], ["wide", "nr", 10, 2, 1], ["wide", "pf", 0, 0, 2]]


def test_a_study_of_which_nothing_is_finished_has_an_empty_table() -> None:
    assert len(summarise(NOBODY, NOBODY)) == 0
