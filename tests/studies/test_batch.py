"""People side by side follow the law of one at a time."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from isiw.dissertation.strategies import Settling
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.studies import SimulatedSession, simulate
from isiw.studies.sessions import Stopping, simulate_batch
from isiw.subjects.subject import Responder, Response
from isiw.types import Array, Reference
from quick import QUICK
from studies.tiny import FEW, timeless

FITTED = ("gp-straddle", "nr", "svmr", "gpr")
EVERY = [
    *("default", "even", "random", "pf", "incremental"),
    *(pytest.param(name, marks=pytest.mark.slow) for name in FITTED),
]
SETTINGS = {**QUICK, "default": FEW, "even": FEW, "random": FEW, "pf": {"particles": 4}}


def sessions(
    strategy: str,
    people: int = 3,
    *,
    first: int = 0,
    trials: int = 6,
    cohort: str = "recruitment",
    stopping: Stopping = "noted",
    **settings: Any,
) -> list[SimulatedSession]:
    chosen = tuple((SETTINGS.get(strategy, {}) | settings).items())
    one = SimulatedSession(strategy, cohort, first, 5, trials, (2, trials), settings=chosen, stopping=stopping)
    return [replace(one, person=first + number) for number in range(people)]


def one_at_a_time(batch: Sequence[SimulatedSession]) -> pd.DataFrame:
    return pd.concat([simulate(session) for session in batch], ignore_index=True)


@pytest.mark.parametrize("strategy", EVERY)
def test_a_batch_of_one_is_that_session(strategy: str) -> None:
    batch = sessions(strategy, 1, first=2, trials=8)  # one more than any initial design has
    pd.testing.assert_frame_equal(timeless(simulate_batch(batch)), timeless(one_at_a_time(batch)))


@pytest.mark.slow
def test_people_side_by_side_take_less_than_a_megabyte_each() -> None:
    batch = [SimulatedSession("default", "recruitment", person, 5, 3, (3,)) for person in range(12)]
    simulate_batch(batch[:1])  # what is kept for all people
    tracemalloc.start()
    try:
        simulate_batch(batch)
        assert tracemalloc.get_traced_memory()[1] < 1e6 * len(batch)
    finally:
        tracemalloc.stop()


@pytest.mark.slow
@pytest.mark.parametrize("strategy", EVERY)
def test_rounded_amplitudes_are_learnt_as_intervals_as_in_a_session(strategy: str) -> None:
    batch = sessions(strategy, 1, first=1, trials=12, cohort="coarse")  # whose step shows after some trials
    pd.testing.assert_frame_equal(timeless(simulate_batch(batch)), timeless(one_at_a_time(batch)))


def test_who_is_rounded_goes_on_as_if_alone() -> None:
    batch = sessions("random", 3, trials=16, cohort="coarse")  # by then all three are known to be rounded
    together, apart = (timeless(rows)[1::2] for rows in (simulate_batch(batch), one_at_a_time(batch)))
    pd.testing.assert_frame_equal(together, apart)


@pytest.mark.parametrize(
    ("strategy", "trials"),
    # NR draws to choose what to ask after its six initial ISIs; PF when a generation is complete.
    [("incremental", 30), ("nr", 6)],
)
def test_where_nothing_is_drawn_a_batch_is_its_sessions(strategy: str, trials: int) -> None:
    batch = sessions(strategy, 4, trials=trials, cohort="jitter")
    together, apart = (timeless(rows) for rows in (simulate_batch(batch), one_at_a_time(batch)))
    assert (together["mistrials"] == apart["mistrials"]).all()
    pd.testing.assert_frame_equal(
        together.drop(columns="troubles"), apart.drop(columns="troubles"), check_dtype=False, rtol=1e-6
    )


def test_each_person_is_asked_by_a_draw_of_its_own_where_the_acquisition_function_draws(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: dict[float, list[float]] = {}
    usual = Responder.respond

    def respond(responder: Responder, isi_ms: float, reference: Reference) -> Response:
        asked.setdefault(responder.subject.hit_delay_ms, []).append(isi_ms)
        return usual(responder, isi_ms, reference)

    monkeypatch.setattr(Responder, "respond", respond)
    simulate_batch(sessions("random", 3, trials=4, cohort="gaussian"))
    together = list(asked.values())
    asked.clear()
    one_at_a_time(sessions("random", 3, trials=4, cohort="gaussian"))
    assert together == list(asked.values())
    assert len(set(map(tuple, together))) == 3


def test_a_batch_is_the_same_again_and_those_behind_somebody_change_nothing_for_them() -> None:
    rows = [timeless(simulate_batch(sessions("default", people))) for people in (3, 3, 2)]
    pd.testing.assert_frame_equal(rows[0], rows[1])
    first = rows[0][rows[0]["person"] < 2].reset_index(drop=True)
    pd.testing.assert_frame_equal(first, rows[2].reset_index(drop=True))


def test_a_session_that_ends_keeps_its_last_estimate() -> None:
    batch = sessions("incremental", 2, trials=40, stopping="ends", max_trials=25)
    rows = simulate_batch([replace(session, marks=(10, 30, 40)) for session in batch])
    assert rows["delivered"].tolist() == [10, 25, 25] * 2
    assert rows["stop_trial"].isna().tolist() == [True, False, False] * 2
    assert (rows["converged"] == 0).all()
    assert rows["stop_reason"].iloc[-1] == "The budget of 25 stimuli is used up."


def test_each_person_stops_by_its_own_rule() -> None:
    batch = sessions("nr", 4, trials=30, stopping="ends", cohort="gaussian", stop_variance_ms2=400.0)
    rows = simulate_batch(batch)
    last = rows[rows["trial"] == 30]
    assert len(last) == 4
    assert len(set(last["stop_trial"])) > 1
    assert (last["delivered"] == last["stop_trial"]).all()
    assert last["stop_reason"].str.startswith("The window has settled").all()


@dataclass(frozen=True)
class NaNForOne:
    """Scores nothing for the second person."""

    needs: tuple[type, ...] = ()

    def __call__(self, posterior: Any, isi_ms: Array) -> Array:
        scores = np.zeros((posterior.told.people, len(isi_ms)))
        scores[:, 7] = 1.0
        scores[1:2] = math.nan
        return scores


def test_a_person_without_a_finite_score_falls_back_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def player(session: SimulatedSession) -> Strategy:
        usual = make_strategy("nr", session.space, session.seed)
        return Strategy(session.space, usual.model, NaNForOne(), Settling(), seed=session.seed)

    monkeypatch.setattr(SimulatedSession, "player", player)
    rows = simulate_batch(sessions("nr", 3, trials=5))
    assert rows[rows["trial"] == 5]["fallbacks"].tolist() == [0, 5, 0]


@pytest.mark.long
@pytest.mark.parametrize(("strategy", "trials"), [("default", 15), ("nr", 20), ("pf", 40)])
def test_the_mean_f1_of_a_batch_is_that_of_one_at_a_time(strategy: str, trials: int) -> None:
    # The same people with the same noise, other draws of the model: paired, so that people do not blur the difference.
    batch = sessions(strategy, 40, trials=trials, cohort="gaussian", stopping="ignored")
    together, apart = (
        rows[rows["trial"] == trials]["f1"].to_numpy() for rows in (simulate_batch(batch), one_at_a_time(batch))
    )
    difference = together - apart
    assert difference.any()
    assert abs(difference.mean()) < 3 * difference.std(ddof=1) / np.sqrt(len(difference))
