"""The law of going on, for several people side by side."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from isiw.acquisition.fixed import EvenSpacing, IncrementalSweep
from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.dissertation.bootstrap import BootstrapPosterior
from isiw.dissertation.strategies import Settling
from isiw.models.particles import ParticlePosterior
from isiw.models.protocol import Observation, Posterior
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.choice import Choice, evenly_spaced
from isiw.strategy.course import Course, Method
from isiw.strategy.stopping import Budget
from isiw.types import Array
from known import instance


def course(name: str, people: int = 3, **changes: Any) -> Course:
    settings: dict[str, Any] = {"particles": 4} if name == "pf" else {}
    strategy = make_strategy(name, **settings)
    method = Method(strategy.space, strategy.model, strategy.acquisition, strategy.stopping)
    return replace(method, **changes).begin(0, people)


def told(before: Course, isi_ms: float | None = 250.0) -> Course:
    return before.after(Observation.of([isi_ms] * before.people, [0.02] * before.people))


def test_initial_isis_come_before_a_methods_own_plan_and_that_before_scores() -> None:
    first = course("pf", initial_ms=(7.0,))
    assert first.choices == (Choice(7.0),) * 3
    planned = told(first)
    wanted_ms = instance(BootstrapPosterior, planned.posterior).proposed_isis_ms()[:, 0].tolist()
    assert [choice.isi_ms for choice in planned.choices] == wanted_ms
    scored = course("pf", acquisition=EvenSpacing())
    assert scored.planned is None
    assert scored.choices == (Choice(evenly_spaced(VALVE_SPACE, 0)),) * 3


def test_a_sweep_is_asked_on_the_grid_of_the_space_and_tms_alone_is_none_of_its_pairs() -> None:
    going = course("nr", people=2, space=IMPACT_SPACE, acquisition=IncrementalSweep(trials_per_isi=2))
    asked_ms: list[float] = []
    for trial in range(12):
        if trial % 3 == 2:
            going = told(going, None)
            continue
        assert going.choices == (Choice(going.choices[0].isi_ms),) * 2
        asked_ms.append(going.choices[0].isi_ms)
        going = told(going, asked_ms[-1])
    assert asked_ms == [0.0, 0.0, 5.0, 5.0, 10.0, 10.0, 15.0, 15.0]


def test_tms_alone_uses_up_no_initial_isi() -> None:
    first = course("nr", people=1, initial_ms=(7.0, 9.0))
    assert told(first, None).choices == first.choices
    assert (told(first, None).told, told(first, None).alone) == (1, 1)
    assert told(told(first, None)).choices == (Choice(9.0),)


def test_isis_are_chosen_as_usual_and_windows_estimated_as_believed() -> None:
    scored = list[Posterior]()

    class Recording(EvenSpacing):
        def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
            scored.append(posterior)
            return super().__call__(posterior, isi_ms)

    going = told(course("default", people=1, acquisition=Recording()))
    assert going.choices
    posterior = instance(ParticlePosterior, going.posterior)
    assert scored == [posterior.as_usual]
    assert not np.array_equal(posterior.as_usual.swarm.log_weights, posterior.swarm.log_weights)
    assert going.estimate().probability == posterior.estimate().probability


def test_a_rule_remembers_as_much_as_it_looks_back_on() -> None:
    going = course("nr", people=2, initial_ms=(7.0, 9.0), stopping=Settling(stop_last=2))
    remembered = []
    for _ in range(5):
        going = told(going)
        remembered.append(len(going.past))
        assert all(going.past[-1].estimate(i) is going.estimate(i) for i in range(2) if going.past)
    assert remembered == [0, 1, 2, 2, 2]


def test_a_rule_never_looks_back_on_trials_before_the_session_however_often_they_are_learnt() -> None:
    seen = (Observation.of([200.0], [0.02]), Observation.of([None], [0.02]))
    first = course("even", 1, model=make_strategy("even", particles=20).model)
    later = first.after(seen[0]).after(seen[1]).begun_here().after(seen[0])
    again = later.again(0, (*seen, None, seen[0]))
    counts = [(one.told, one.alone, one.known, one.known_all, len(one.past)) for one in (later, again)]
    assert counts == [(1, 0, 1, 2, 1)] * 2


def test_a_rule_that_does_not_look_back_remembers_nothing() -> None:
    assert told(course("nr", stopping=Budget(3))).past == ()


def test_trials_that_nobody_decides_upon_are_told_without_an_estimate() -> None:
    going = course("nr", people=2, stopping=Settling(stop_last=2))
    for _ in range(5):
        going = told(going)
    assert [each.made for each in going.past] == [{}, {}]
    going.decision(0)
    assert [list(each.made) for each in going.past] == [[0], [0]]


def test_of_trials_that_were_decided_upon_only_the_estimates_are_kept() -> None:
    going = course("nr", people=2, stopping=Settling(stop_last=3))
    looked_at = []
    for _ in range(3):
        going = told(going)
        looked_at.append([going.estimate(i) for i in range(2)])
    going = told(going)
    assert [belief.posterior for belief in going.earlier] == [None, None, None]
    assert [[belief.estimate(i) for i in range(2)] for belief in going.earlier] == looked_at


def test_a_decision_counts_the_mistrials_of_its_person() -> None:
    going = told(course("nr", people=2, stopping=Budget(3)))
    assert not going.decision(0).stop
    assert going.decision(1, mistrials=2).stop


def test_an_estimate_says_how_probable_a_window_was_before_the_first_trial() -> None:
    first = course("default", people=2)
    before = [first.estimate(person).probability for person in range(2)]
    after = told(told(first))
    assert [after.estimate(person).beforehand for person in range(2)] == before
    assert 0.6 < (before[0] or 0.0) < 0.75
    assert told(course("nr")).estimate().beforehand is None
