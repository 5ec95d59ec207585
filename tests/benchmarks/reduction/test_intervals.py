"""Interval production: the light, and how a run's row is counted."""

from __future__ import annotations

import pytest
from benchmarks.reduction.intervals import TRIALS, light_probability, runs, summary


def test_the_light_has_the_texts_example_of_seventy_percent_at_294_ms() -> None:
    assert light_probability(294.0, 1.0) == pytest.approx(0.698, abs=0.001)
    assert light_probability(300.0, 0.5) == 0.5


def test_each_light_has_as_many_runs_with_seeds_of_their_own() -> None:
    planned = runs(3, seed=7)
    assert sorted((run.scale, run.seed) for run in planned) == [(s, k) for s in (0.5, 1.0) for k in (7, 8, 9)]


def test_rows_are_of_each_runs_own_intervals() -> None:
    half = TRIALS // 2
    results = [
        {"scale": scale, "asked_ms": [200.0] * half + [300.0] * half, "target_ms": 300.0 + shift}
        for scale in (1.0, 0.5)
        for shift in (-2.0, 2.0)
    ]
    table = summary(results)
    ours = table[table["who"] == "isiw, 2 runs"].iloc[0]
    assert (ours["mean"], ours["SD"], ours["min"], ours["max"]) == (250.0, 50.0, 200.0, 300.0)
    assert (ours["within ± 20 ms"], ours["estimate of M"], ours["SD of estimate"]) == (0.5, 300.0, 2.0)
    late = table[table["who"] == "isiw, second half"].iloc[0]
    assert (late["mean"], late["SD"]) == (300.0, 0.0)
