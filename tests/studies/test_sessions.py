from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import torch

from isiw.design import IMPACT_SPACE
from isiw.errors import InvalidValueError, StrategyError, StudyError
from isiw.estimate import WindowEstimate
from isiw.metrics import f1
from isiw.signals.judgement import wrong_isi
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.studies import SimulatedSession, paired_sessions, play, run_study, simulate
from isiw.studies.sessions import simulate_batch
from isiw.subjects import SimulatedSubject, cohort
from isiw.subjects.subject import Responder, Response
from isiw.types import Reference
from isiw.window import Window
from known import instance, known

TIMES = ["ask_ms", "tell_ms"]
SMALL = (("particles", 100),)


def small(strategy: str = "even", cohort: str = "gaussian", person: int = 0) -> SimulatedSession:
    return SimulatedSession(strategy, cohort, person, seed=5, trials=4, marks=(2, 4), settings=SMALL)


class Perfect:
    """Knows the window from the start, and remembers what it was told."""

    def __init__(self, session: SimulatedSession) -> None:
        self.window = session.subject().window(session.space)
        self.told: list[tuple[float | None, float | None]] = []

    def ask(self) -> float:
        return 250.0

    def tell(self, isi_ms: float | None, mep_mv: float | None = None, *, isi_sd_ms: float = 0.0) -> None:
        assert isi_sd_ms == 0.0
        self.told.append((isi_ms, mep_mv))

    def estimate(self) -> Window | None:
        return self.window


def test_each_mark_is_a_row_and_the_perfect_player_scores_one() -> None:
    session = small()
    rows = play(session, Perfect(session))
    assert rows["trial"].tolist() == [2, 4]
    assert rows["f1"].tolist() == [1.0, 1.0]
    assert rows["start_covered"].isna().all()
    assert rows["reported_window"].all()


def test_a_mark_of_zero_is_what_is_believed_before_any_trial() -> None:
    session = replace(small(), marks=(0, 4))
    rows = simulate(session)
    before = instance(WindowEstimate, session.player().estimate())
    assert rows["trial"].tolist() == [0, 4]
    assert rows["delivered"].tolist() == [0, 4]
    assert rows["probability"][0] == before.probability
    assert rows["f1"][0] == f1(before, session.subject().window(session.space), session.space)
    assert rows["tell_ms"].isna().tolist() == [True, False]


def test_every_player_meets_the_same_person_with_the_same_noise() -> None:
    session = small()
    players = [Perfect(session), Perfect(session)]
    for player in players:
        play(session, player)
    assert players[0].told == players[1].told


def test_a_person_without_a_window_is_one_in_the_table() -> None:
    rows = simulate(small(cohort="nonresponder"))
    assert not rows["true_window"].any()
    assert (rows["f1"] == (~rows["reported_window"]).astype(float)).all()


def test_amplitudes_are_scaled_and_the_window_stays() -> None:
    usual, scaled = small(), replace(small(), amplitude=10.0)
    players = [Perfect(usual), Perfect(scaled)]
    rows = [play(session, player) for session, player in zip((usual, scaled), players, strict=True)]
    np.testing.assert_allclose(
        [10 * known(mep) for _, mep in players[0].told], [known(mep) for _, mep in players[1].told]
    )
    assert rows[0]["f1"].tolist() == rows[1]["f1"].tolist() == [1.0, 1.0]


def test_the_moment_of_stopping_is_kept_with_its_f1_and_coverage() -> None:
    settings = (*SMALL, ("max_trials", 2))
    session = replace(small(), trials=6, marks=(2, 6), stopping="noted", settings=settings)
    early, late = simulate(session).to_dict("records")
    # The budget is used up after two trials; what is noted then no longer changes.
    assert early["stop_trial"] == late["stop_trial"] == 2.0
    assert early["stop_f1"] == late["stop_f1"] == early["f1"]
    assert early["stop_start_covered"] == late["stop_start_covered"] == early["start_covered"]


def test_a_session_that_fails_ends_none_of_the_others() -> None:
    sessions = [small(person=person) for person in range(3)]
    kept: dict[int, pd.DataFrame] = {}

    def run(session: SimulatedSession) -> pd.DataFrame:
        if session.person == 1:
            raise RuntimeError("the sweep is stuck")
        return simulate(session)

    with pytest.raises(StudyError, match=r"1 of 3 .*RuntimeError: "):
        run_study(sessions, run=run, on_done=lambda session, rows: kept.update({session.person: rows}))
    assert {person: set(rows["person"]) for person, rows in kept.items()} == {0: {0}, 2: {2}}


@pytest.mark.slow
def test_a_study_is_the_same_in_one_process_and_in_two() -> None:
    sessions = [small(strategy, person=person) for strategy in ("even", "random") for person in (0, 1)]
    done: list[SimulatedSession] = []
    here = run_study(sessions, on_done=lambda session, _rows: done.append(session))
    there = run_study(sessions, workers=2)
    assert done == sessions
    pd.testing.assert_frame_equal(here.drop(columns=TIMES), there.drop(columns=TIMES))
    assert (here[TIMES] > 0).all(axis=None)


def test_a_study_in_the_other_space_counts_from_the_impact() -> None:
    session = SimulatedSession("even", "gaussian", 0, 5, 3, (3,), IMPACT_SPACE, SMALL)
    assert np.isfinite(simulate(session)["f1"]).all()


def test_paired_sessions_cross_strategies_cohorts_and_people() -> None:
    sessions = paired_sessions(["even", "random"], ["gaussian", "wide"], 3, seed=7, trials=5, marks=(5,))
    assert len({(s.strategy, s.cohort, s.person) for s in sessions}) == 12


class Acquaintance(SimulatedSession):
    """A session with somebody of no cohort."""

    def subject(self) -> SimulatedSubject:
        return replace(cohort("gaussian", 1, 8)[0], scale=2.0)


def test_people_of_ones_own_have_a_cohort_of_any_name() -> None:
    session = Acquaintance("even", "mine", 0, 5, 4, (4,), settings=SMALL)
    (row,) = run_study([session]).to_dict("records")
    assert (row["cohort"], row["true_window"]) == ("mine", True)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"trials": 0}, "SimulatedSession.trials"),
        ({"person": -1}, "SimulatedSession.person"),
        ({"seed": -5}, "SimulatedSession.seed"),
        ({"marks": (3, 20)}, "a mark of a session of 3 trials must be a whole number from 0 to 3; got 20"),
        ({"marks": 20}, "a whole number from 0 to 3; got 20"),
        ({"marks": ()}, r"without a mark has no rows. Give it marks=\(3,\)"),
        ({"cohort": "mine"}, r"unknown cohorts; got \['mine'\].*People of your own. in docs/studies.md"),
        ({"strategy": make_strategy("even", particles=10)}, "by a name; got 'Strategy'.*A strategy of your own"),
    ],
)
def test_an_invalid_session_is_refused(wrong: dict[str, Any], message: str) -> None:
    values: dict[str, Any] = {
        "strategy": "even",
        "cohort": "gaussian",
        "person": 0,
        "seed": 0,
        "trials": 3,
        "marks": (3,),
    }
    with pytest.raises(InvalidValueError, match=message):
        SimulatedSession(**(values | wrong))


def test_a_study_without_workers_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="worker"):
        run_study([small()], workers=0)
    with pytest.raises(InvalidValueError, match="needs sessions"):
        run_study([])


def test_what_runs_a_session_returns_its_rows() -> None:
    with pytest.raises(StudyError, match=r"got 'DataFrame'"):
        run_study([small()], run=lambda _session: pd.DataFrame())


@pytest.mark.parametrize("run", [simulate, lambda session: simulate_batch([session])])
@pytest.mark.parametrize("strategy", ["even", "unknown"])
def test_torch_has_as_many_threads_afterwards_as_before(run: Callable[[SimulatedSession], Any], strategy: str) -> None:
    torch.set_num_threads(2)
    try:
        with nullcontext() if strategy == "even" else pytest.raises(StrategyError):
            run(small(strategy))
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(1)


def test_what_a_session_would_reject_is_delivered_again_and_not_told() -> None:
    strict = replace(IMPACT_SPACE, tolerance_ms=2.0)
    session = replace(small(), trials=40, marks=(40,), space=strict)
    player = Perfect(session)
    (row,) = play(session, player).to_dict("records")
    assert len(player.told) == 40
    assert all(abs(known(isi_ms) - 250.0) <= 2.0 for isi_ms, _ in player.told)
    assert row["mistrials"] > 0
    assert row["delivered"] == 40 + row["mistrials"]


class Late(SimulatedSession):
    """Sessions with somebody whom the hammer hits now and then much too late."""

    def subject(self) -> SimulatedSubject:
        return replace(super().subject(), hit_delay_sd_ms=25.0)


@pytest.mark.parametrize("run", [simulate, lambda session: simulate_batch([session])])
def test_a_session_with_mistrials_ends_where_its_budget_is_used_up(run: Callable[[SimulatedSession], Any]) -> None:
    settings = (("max_trials", 12), ("particles", 40))
    session = Late("even", "gaussian", 2, 5, 40, (0, 5, 40), IMPACT_SPACE, settings, stopping="ends")
    rows = run(session)
    assert rows["trial"].tolist() == [0, 5, 40]
    last = rows.iloc[-1]
    assert last["mistrials"] > 0
    assert last["delivered"] == last["stop_trial"] == 12
    assert last["stop_reason"] == "The budget of 12 stimuli is used up."


def test_where_trials_are_lost_a_study_asks_what_a_session_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = (("max_trials", 12), ("particles", 40))
    session = Late("even", "gaussian", 2, 5, 40, (40,), IMPACT_SPACE, settings, stopping="ends")
    delivered, usual = list[tuple[float, Response]](), Responder.respond

    def respond(responder: Responder, isi_ms: float | None, reference: Reference, **how: Any) -> Response:
        response = usual(responder, isi_ms, reference, **how)
        delivered.append((known(isi_ms), response))
        return response

    monkeypatch.setattr(Responder, "respond", respond)
    simulate(session)
    strategy, lost = instance(Strategy, session.player()), 0
    for isi_ms, response in delivered[:12]:
        assert strategy.ask() == isi_ms
        if wrong_isi(known(response.isi_ms), isi_ms, session.space) is None:
            strategy.tell(response.isi_ms, response.mep_mv)
        else:
            strategy.count_mistrial()
            lost += 1
    assert lost > 2
    assert strategy.decision().stop


def test_what_is_lost_leaves_the_noise_of_later_trials_as_it_is() -> None:
    person = replace(cohort("gaussian", 1, 5)[0], hit_delay_sd_ms=0.0)
    usual, with_loss = person.begin(3), person.begin(3)
    first = usual.respond(100.0, "impact")
    assert with_loss.respond(100.0, "impact") == first
    assert with_loss.respond_instead(100.0, "impact") != first
    assert usual.respond(120.0, "impact") == with_loss.respond(120.0, "impact")


def test_a_space_that_no_realised_isi_keeps_is_refused() -> None:
    session = replace(small(), space=replace(IMPACT_SPACE, tolerance_ms=0.0))
    with pytest.raises(StudyError, match="wider tolerance_ms"):
        play(session, Perfect(session))


def test_several_intensities_which_no_person_of_a_study_is_given_are_refused() -> None:
    settings = (("intensities_pct_rmt", (90.0, 110.0)), ("intensity_pct_rmt", 90.0), ("particles", 40))
    session = SimulatedSession("default", "recruitment", 0, 5, 3, (3,), settings=settings)
    for run in (simulate, lambda one: simulate_batch([one])):
        with pytest.raises(StudyError, match="usual intensity"):
            run(session)
