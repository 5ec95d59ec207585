"""Models that are wrong on purpose are wrong as they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.reduction.guess import FIXED, UNRELATED, best_for_everybody, unrelated
from benchmarks.reduction.sessions import Session, recorded_person, run, searched, strategy_of
from benchmarks.reduction.size import FEW
from benchmarks.reduction.wrong import MISREAD, RANDOM, sessions

BARE = Session("nr", "kim11-measured", 0, 3)


@pytest.mark.parametrize("accelerometer", [False, True])
def test_a_fixed_guess_reports_the_same_window_whatever_it_is_told(*, accelerometer: bool) -> None:
    session = replace(BARE, wrong=FIXED, accelerometer=accelerometer)
    where = searched(session, recorded_person("kim11-measured", 0, 3).subject.hit_delay_ms)
    strategy = strategy_of(session, where)
    for mep_mv in (0.01, 0.5, 0.02, 0.3, 0.01):
        strategy.tell(strategy.ask(), mep_mv)
    window, guess = where.from_valve(strategy.estimate().window), best_for_everybody()
    assert window is not None
    assert (window.start_ms, window.end_ms) == pytest.approx((guess.start_ms, guess.end_ms), abs=10.0)


def test_unrelated_meps_are_those_of_other_isis() -> None:
    space = searched(BARE, 180.0).space
    answer = unrelated(lambda isi_ms: (isi_ms, isi_ms), space, seed=1)
    told, drawn = zip(*(answer(250.0) for _ in range(50)), strict=True)
    assert set(told) == {250.0}
    assert np.ptp(drawn) > 200.0


@pytest.mark.slow
def test_what_is_not_learnt_from_the_person_correlates_with_nothing() -> None:
    r = [run(replace(BARE, wrong=UNRELATED, person=person))["correlation, measured"] for person in range(4)]
    assert np.mean(r) < 0.5


def test_every_method_is_run_under_the_wrong_models_that_it_can_have() -> None:
    plan = [one for one in sessions(FEW, 3) if not dict(one.settings).keys() & {"initial", "particles"}]
    assert {one.wrong for one in plan if one.method == "pf"} == {UNRELATED, MISREAD}
    for method in ("nr", "svmr", "gpr"):
        assert {one.wrong for one in plan if one.method == method} == {UNRELATED, MISREAD, RANDOM, FIXED}
