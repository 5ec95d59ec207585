"""Distances and duels: on numbers made by hand."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from benchmarks.reduction.comparison import WORDS
from benchmarks.reduction.headline import changes, duel, equal_f1, equal_trials, judged
from benchmarks.reduction.reading_table import distance

from benchmarks.reduction import dissertation as text


def test_the_dissertations_own_figures_have_no_distance_and_thirty_percent_more_trials_a_part_of_one() -> None:
    rows: list[dict[str, object]] = []
    for accelerometer, word in WORDS.items():
        for method in text.METHODS:
            scores = {"f1, true": text.F1[word][method], "correlation, true": text.CORRELATION[method]}
            fate = {"trials": text.TRIALS[word][method], "converged": text.CONVERGED[word][method]}
            rows.append({"method": method, "accelerometer": accelerometer, **scores, **fate})
    own = pd.DataFrame(rows)
    assert distance(own, "true") == pytest.approx(0.0)
    more = own.assign(trials=1.3 * own["trials"])
    assert distance(more, "true") == pytest.approx(math.sqrt(8 / 28))


def test_a_duel_compares_at_each_sessions_own_trials_and_finds_where_it_stays_ahead() -> None:
    curves = [[0.0, 0.2, 0.6, 0.8], [0.0, 0.6, 0.6, 0.8]]
    rows = pd.DataFrame(
        {
            "method": ["gpr", "gpr", "default", "default"],
            "person": [0, 1, 0, 1],
            "trials": [2, 3, 80, 80],
            "f1": [0.3, 0.5, 0.9, 0.9],
            "f1_by_trial": [[0.0] * 4, [0.0] * 4, *curves],
        }
    )
    row = duel(rows, "gpr")
    assert row["default's F1 at as many"] == pytest.approx(np.mean([0.2, 0.6]))
    assert row["gain"] == pytest.approx(np.mean([0.2, 0.6]) - 0.4)
    assert row["default's trials to its F1"] == 2
    assert row["share of its trials"] == pytest.approx(2 / 2.5)


def test_a_duel_leaves_out_whom_the_default_has_not_seen() -> None:
    methods, persons = ["nr"] * 3 + ["default"] * 2, [0, 1, 2, 0, 1]
    rows = pd.DataFrame({"method": methods, "person": persons, "trials": 4, "f1": [0.2, 0.4, 0.9, 0.5, 0.5]})
    rows = rows.assign(f1_by_trial=pd.Series([[0.5] * 4] * 5))
    assert duel(rows, "nr")["its F1"] == pytest.approx(0.3)


def test_a_method_that_loses_what_it_had_is_said_to_get_worse() -> None:
    falling = [[0.9] * 10 + [low] * 30 for low in (0.3, 0.4, 0.35)]
    rows = pd.DataFrame({"cohort": "gaussian", "alone": 0, "method": "nr", "f1_by_trial": falling})
    assert changes(rows)["worse by more than 2 SE"].tolist() == ["yes"]
    steady = rows.assign(f1_by_trial=pd.Series([[0.9] * 40] * 3))
    assert changes(steady)["worse by more than 2 SE"].tolist() == ["no"]


def test_curves_are_read_both_ways() -> None:
    curves = [[0.1, 0.3, 0.7, 0.6, 0.9], [0.3, 0.5, 0.7, 0.6, 0.9]]
    rows = pd.DataFrame({"cohort": "gaussian", "alone": 0, "method": "nr", "f1_by_trial": curves})
    assert equal_trials(rows).iloc[0]["5"] == pytest.approx(0.9)
    reached = equal_f1(rows).iloc[0]
    # The mean touches .7 at the third trial, and leaves it again.
    assert [reached[level] for level in ("0.5", "0.6", "0.7", "0.9")] == ["3", "3", "5", "5"]
    assert equal_f1(rows.assign(f1_by_trial=pd.Series([[0.1], [0.1]]))).iloc[0]["0.5"] == "–"


def test_people_with_the_texts_windows_are_judged_by_the_measured_window_and_others_by_the_true_one() -> None:
    scores = {"f1, measured": 0.3, "f1_measured_by_trial": [0.3], "f1 before, measured": 0.1}
    true = {"f1, true": 0.8, "f1_by_trial": [0.8], "f1 before, true": 0.6}
    sessions = [{"cohort": cohort, **scores, **true} for cohort in ("kim11-measured", "gaussian")]
    without_a_window = sessions[0] | {"f1, measured": math.nan, "f1_measured_by_trial": [math.nan]}
    found = judged(pd.DataFrame([*sessions, without_a_window]))
    assert found["f1"].tolist() == [0.3, 0.8]
    assert found["f1_by_trial"].tolist() == [[0.3], [0.8]]
    assert found["f1 before"].tolist() == [0.1, 0.6]
