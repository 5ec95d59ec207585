"""From scores to the next ISI: ties, scores that are none, and what a function may return."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch

from isiw.acquisition.fixed import EvenSpacing
from isiw.acquisition.protocol import best_candidate, require_scores
from isiw.acquisition.registry import ACQUISITIONS, acquisition_named
from isiw.errors import StrategyError


def test_the_highest_score_wins_for_each_person() -> None:
    assert best_candidate(np.array([[0.0, 2.0, 1.0], [5.0, -1.0, 0.0]])).tolist() == [1, 0]


@pytest.mark.parametrize("ties", [2, 101, 5000])
def test_a_tie_goes_to_the_first_from_where_it_is_told_to_begin(ties: int) -> None:
    assert best_candidate(np.zeros((1, ties))).tolist() == [0]
    assert best_candidate(np.zeros((1, ties)), first=1).tolist() == [1]
    assert best_candidate(np.array([[0.0] * 3 + [1.0] * ties])).tolist() == [3]
    assert best_candidate(np.array([[1.0] * ties + [0.0] * 3]), first=ties).tolist() == [0]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("first", [0, 2])
def test_a_score_that_is_not_finite_loses(bad: float, first: int) -> None:
    assert best_candidate(np.array([[bad, -1e30, bad, -5.0]]), first=first).tolist() == [3]


@pytest.mark.parametrize("kind", [list, np.array, torch.tensor, lambda scores: np.array(scores, dtype=np.float32)])
@pytest.mark.parametrize("scores", [[1.0, 2.0, 3.0], [[1.0, 2.0, 3.0]], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]])
def test_scores_may_be_whatever_becomes_an_array_of_numbers(kind: Any, scores: Any) -> None:
    given = require_scores(EvenSpacing(), kind(scores), 3, people=2)
    assert given.tolist() == scores


def test_whole_numbers_are_scores() -> None:
    assert require_scores(EvenSpacing(), [[3, 1, 2]], 3).dtype == np.float64


@pytest.mark.parametrize(
    ("scores", "said"),
    [
        (None, "got 'NoneType'"),
        (["1", "2", "3"], "numbers of shape"),
        ([[1.0, 2.0], [3.0]], "inhomogeneous"),
        (torch.ones(3, requires_grad=True), r"detach\(\)"),
        (np.ones((3, 1)), r"got \(3, 1\)"),
        (1.0, r"got \(\)"),
    ],
)
def test_scores_that_are_none_are_refused_with_what_was_expected(scores: Any, said: str) -> None:
    with pytest.raises(StrategyError, match=rf"EvenSpacing must score each ISI.*{said}"):
        require_scores(EvenSpacing(), scores, 3)


@pytest.mark.parametrize("name", sorted(ACQUISITIONS))
def test_acquisition_functions_of_the_same_settings_are_equal(name: str) -> None:
    assert acquisition_named(name, 3) == acquisition_named(name, 3)
