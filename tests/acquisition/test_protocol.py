"""From scores to the next ISI: ties, and scores that are none."""

from __future__ import annotations

import math

import pytest
import torch

from isiw.acquisition.protocol import best_candidate


def test_the_highest_score_wins_for_each_person() -> None:
    assert best_candidate(torch.tensor([[0.0, 2.0, 1.0], [5.0, -1.0, 0.0]])).tolist() == [1, 0]


@pytest.mark.parametrize("ties", [2, 101, 5000])
def test_a_tie_goes_to_the_first_from_where_it_is_told_to_begin(ties: int) -> None:
    assert best_candidate(torch.zeros(1, ties)).tolist() == [0]
    assert best_candidate(torch.zeros(1, ties), first=1).tolist() == [1]
    assert best_candidate(torch.cat((torch.zeros(1, 3), torch.ones(1, ties)), dim=1)).tolist() == [3]
    assert best_candidate(torch.cat((torch.ones(1, ties), torch.zeros(1, 3)), dim=1), first=ties).tolist() == [0]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("first", [0, 2])
def test_a_score_that_is_not_finite_loses(bad: float, first: int) -> None:
    assert best_candidate(torch.tensor([[bad, -1e30, bad, -5.0]]), first=first).tolist() == [3]
