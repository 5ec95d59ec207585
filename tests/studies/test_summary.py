"""What a study comes to."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest

from isiw.errors import InvalidValueError
from isiw.studies import differences, means_table, summarise


def rows(strategy: str, cohort: str, f1s: Sequence[float], **columns: object) -> pd.DataFrame:
    usual = {
        "trial": 10,
        "expected_f1": math.nan,
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


def several(people: int, **shifts: float) -> pd.DataFrame:
    """Strategies on the same people: F1 of the first, and what each other one adds to it, with some noise."""
    rng = np.random.default_rng(3)
    usual = rng.uniform(0.3, 0.7, people)
    parts = [
        rows_of(strategy, usual + shift + (0.02 * rng.standard_normal(people) if shift else 0.0))
        for strategy, shift in ({"default": 0.0} | shifts).items()
    ]
    return pd.concat(parts, ignore_index=True)


def rows_of(strategy: str, f1s: np.ndarray) -> pd.DataFrame:
    known = {"expected_f1": math.nan, "start_covered": 1.0, "end_covered": 1.0, "reported_window": True}
    stop = {"stop_trial": math.nan, "stop_f1": math.nan, "converged": math.nan}
    spent = {"delivered": 10, "ask_ms": 1.0, "tell_ms": 1.0}
    who = {"strategy": strategy, "cohort": "wide", "trial": 10, "person": range(len(f1s)), "f1": f1s}
    return pd.DataFrame(who | known | stop | spent)


def test_rows_alone_can_be_summarised() -> None:
    assert list(summarise(several(4))["failed"]) == [0]


def test_the_band_of_three_people_is_wide_and_stays_within_0_and_1() -> None:
    (row,) = summarise(rows("nr", "wide", [0.9, 0.6, 0.0])).to_dict("records")
    assert (row["f1_low"], row["f1_high"]) == (0.0, 1.0)  # 0.5 ± 4.30 standard errors
    (one,) = summarise(rows("nr", "wide", [0.9])).to_dict("records")
    assert math.isnan(one["f1_low"])


def test_an_answer_is_sure_and_wrong_if_it_expects_much_more_than_it_has() -> None:
    mixed = rows("default", "wide", [0.3, 0.6, 0.2], expected_f1=[0.7, 0.9, 0.65])
    (row,) = summarise(mixed).to_dict("records")
    assert row["sure_and_wrong"] == pytest.approx(1 / 3)  # the first; the second is near enough, the third unsure
    (unknown,) = summarise(rows("nr", "wide", [0.3])).to_dict("records")
    assert math.isnan(unknown["sure_and_wrong"])


def test_differences_are_paired_by_person() -> None:
    (row,) = differences(several(40, better=0.1)).to_dict("records")
    assert (row["strategy"], row["reference"], row["people"]) == ("better", "default", 40)
    assert row["difference"] == pytest.approx(0.1, abs=0.01)
    assert 0.08 < row["low"] < row["difference"] < row["high"] < 0.12
    assert row["se"] < 0.2 * summarise(several(40, better=0.1))["f1_se"].min()  # what no pairing would give


def test_people_without_rows_of_both_do_not_count() -> None:
    whole = several(10, better=0.1)
    lost = whole[(whole["strategy"] == "default") | (whole["person"] < 6)]
    assert list(differences(lost)["people"]) == [6]


def test_more_comparisons_have_wider_intervals() -> None:
    one, *_ = differences(several(40, better=0.1)).to_dict("records")
    (same,) = differences(several(40, better=0.1, x=0.2, y=0.3, z=0.4)).query("strategy == 'better'").to_dict("records")
    assert same["difference"] == one["difference"]
    assert same["high"] - same["low"] > 1.2 * (one["high"] - one["low"])


def test_the_interval_of_a_few_people_is_students() -> None:
    f1s = np.array([0.4, 0.5, 0.45, 0.3, 0.35, 0.4])
    compared = pd.concat([rows_of("default", np.full(6, 0.5)), rows_of("b", f1s)])
    (row,) = differences(compared).to_dict("records")
    assert (row["low"], row["high"]) == pytest.approx((-0.1 - 2.5706 * row["se"], -0.1 + 2.5706 * row["se"]), abs=1e-5)


@pytest.mark.slow
def test_intervals_hold_for_the_share_of_studies_that_they_say() -> None:
    rng, held = np.random.default_rng(5), 0
    for _ in range(60):
        base = rng.uniform(0.2, 0.8, 30)
        other = base + 0.05 + 0.1 * rng.standard_normal(30)
        (row,) = differences(pd.concat([rows_of("default", base), rows_of("b", other)])).to_dict("records")
        held += row["low"] <= 0.05 <= row["high"]
    assert held >= 52  # of 60 at 95 %; fewer come by chance in 1 of 500 runs


def test_a_comparison_needs_two_strategies_and_a_reference_among_them() -> None:
    with pytest.raises(InvalidValueError, match="two strategies"):
        differences(several(4))
    with pytest.raises(InvalidValueError, match="default"):
        differences(several(4, better=0.1), "defualt")


def test_the_printed_table_fits_100_columns_and_names_people_and_reference() -> None:
    marks = [
        several(30, **{f"a-strategy-{k}": k / 50 for k in range(1, 6)}).assign(trial=mark) for mark in range(5, 65, 5)
    ]
    every = pd.concat(marks)
    text = means_table(summarise(every), differences(every))
    assert max(map(len, text.splitlines())) <= 100
    assert "30 people" in text
    assert "minus default" in text
    assert text.splitlines()[1].split()[-1] == "60"  # the last mark is kept


def test_nobody_counts_twice() -> None:
    twice = pd.concat([rows("nr", "wide", [0.9, 0.6]), rows("default", "wide", [0.9, 0.6])] * 2)
    for made in (summarise, differences):
        with pytest.raises(InvalidValueError, match="would count twice"):
            made(twice)
