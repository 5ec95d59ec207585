from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.dissertation.interval.task import SESSIONS, answer, feedback, score_pct, session_blocks
from isiw.errors import InvalidValueError
from isiw.log.headers import Block


def test_the_score_is_equation_6_1_with_the_example_of_the_text() -> None:
    assert float(score_pct(294.0, 300.0)) == pytest.approx(100 * math.exp(-0.36), rel=1e-12)
    assert f"{float(score_pct(294.0, 300.0)):.1f}" == "69.8"
    assert float(score_pct(500.0, 500.0, 50.0)) == 50.0


@given(st.floats(1, 5000), st.floats(1, 4999), st.floats(1, 100))
def test_a_score_is_highest_at_the_target_and_even_about_it(produced: float, target: float, scale: float) -> None:
    score = float(score_pct(produced, target, scale))
    assert 0 <= score <= scale
    assert score == pytest.approx(float(score_pct(2 * target - produced, target, scale)), abs=1e-6)


def test_the_sessions_are_those_of_the_text() -> None:
    assert {
        key: [(b.mode, b.target_ms, b.scale_pct, b.trials) for b in blocks] for key, blocks in SESSIONS.items()
    } == {
        1: [(mode, 300.0, 100.0, 200) for mode in (1, 2, 3, 4)],
        2: [(mode, 500.0, 100.0, 200) for mode in (1, 2, 3, 4)],
        3: [(mode, 300.0, 50.0, 200) for mode in (1, 2)],
    }


def test_modes_come_in_the_order_asked_for() -> None:
    assert session_blocks(2, (4, 1), trials=5) == (Block(4, 500.0, 100.0, 5), Block(1, 500.0, 100.0, 5))


@pytest.mark.parametrize(
    ("session", "modes", "trials", "match"),
    [(4, (), 200, "session is unknown"), (3, (3,), 200, "a mode of session 3"), (1, (), 0, "Block.trials")],
)
def test_a_session_mode_or_number_that_there_is_not_is_refused(
    session: int, modes: tuple[int, ...], trials: int, match: str
) -> None:
    with pytest.raises(InvalidValueError, match=match):
        session_blocks(session, modes, trials)


@pytest.mark.parametrize("bad", [{"mode": 5}, {"target_ms": -1}, {"target_ms": math.nan}, {"scale_pct": 0.5}])
def test_a_block_that_makes_no_sense_is_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=f"Block.{next(iter(bad))}"):
        Block(**({"mode": 1, "target_ms": 300.0} | bad))


def test_the_light_comes_as_often_as_the_score_says_and_again_the_same() -> None:
    block = Block(2, 300.0, 50.0)
    lights = [answer(block, 0, trial, 300.0, seed=7).light for trial in range(2000)]
    assert np.mean([bool(light) for light in lights]) == pytest.approx(0.5, abs=4 * math.sqrt(0.25 / 2000))
    assert lights[3] == answer(block, 0, 3, 300.0, seed=7).light


def test_there_is_a_light_in_mode_2_only() -> None:
    assert [answer(Block(mode, 300.0), 0, 0, 300.0, seed=0).light for mode in (1, 2, 3, 4)] == [None, True, None, None]


@pytest.mark.parametrize(
    ("mode", "shown"),
    [
        (1, f"score  0 |{'#' * 28}{'.' * 12}| 100"),
        (2, "light  off"),
        (3, "target 300 ms, yours 294 ms"),
        (4, "target 300 ms, off by 6 ms"),
    ],
)
def test_each_mode_shows_what_the_text_says(mode: int, shown: str) -> None:
    block = Block(mode, 300.0)
    production = answer(block, 0, 0, 294.0, seed=1)
    if mode == 2:
        production = production.model_copy(update={"light": False})
        assert feedback(block, production.model_copy(update={"light": True})) == "light  ON"
    assert feedback(block, production) == shown


@pytest.mark.parametrize("mode", [1, 2])
def test_a_hidden_target_is_not_shown(mode: int) -> None:
    assert "300" not in feedback(Block(mode, 300.0), answer(Block(mode, 300.0), 0, 0, 294.0, seed=0))
