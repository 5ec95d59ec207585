"""A script may set torch's default to double precision, before a session or in the middle of one: no answer changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple
from functools import cache
from typing import Any

import numpy as np
import pytest
import torch

from isiw.strategy.catalogue import list_strategies, make_strategy
from isiw.trials import Trial
from quick import quick

MEPS_MV = (0.1, 0.0)
SINGLE, DOUBLE = torch.float32, torch.float64


@pytest.fixture(autouse=True)
def _default_restored() -> Iterator[None]:
    usual = torch.get_default_dtype()
    yield
    torch.set_default_dtype(usual)


def answers(name: str, *defaults: torch.dtype) -> list[Any]:
    """Asks, scores and estimates of a session whose script sets torch's default before each trial."""
    torch.set_default_dtype(defaults[0])
    at_once: dict[str, Any] = {"initial_trials": 1} if name.startswith("gp-") else {}
    strategy = make_strategy(name, seed=3, **quick(name), **at_once)
    given: list[Any] = []
    for default, mep_mv in zip(defaults, MEPS_MV, strict=True):
        torch.set_default_dtype(default)
        asked_ms, choice = strategy.ask(), strategy.choice
        given += [asked_ms, None if choice is None or choice.scores is None else choice.scores]
        strategy.learn(Trial.of(asked_ms, mep_mv, isi_sd_ms=1.0))
        strategy.learn(Trial.of(None, 0.01))
        given += astuple(strategy.estimate())
    return given


usual_answers = cache(answers)


@pytest.mark.slow
@pytest.mark.parametrize("name", list_strategies())
def test_double_precision_as_the_default_changes_no_answer(name: str) -> None:
    usual = usual_answers(name, SINGLE, SINGLE)
    np.testing.assert_equal(answers(name, DOUBLE, DOUBLE), usual)


@pytest.mark.slow
@pytest.mark.parametrize("name", list_strategies())
def test_a_default_that_changes_in_the_middle_of_a_session_changes_no_answer(name: str) -> None:
    usual = usual_answers(name, SINGLE, SINGLE)
    np.testing.assert_equal(answers(name, SINGLE, DOUBLE), usual)
