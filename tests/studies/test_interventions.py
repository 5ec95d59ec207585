from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.excess import EDGE_LEVEL
from isiw.studies import InterventionPlan, intervene
from isiw.subjects import Change, Plasticity, cohort
from pairing.tested import BEST_MS, person

PLAN = InterventionPlan(before=5, pairs=60, after=4, after_min=(0.0, 30.0))
GROWS = Plasticity(0.5, 20.0, least=EDGE_LEVEL)


def test_pulses_and_pairs_come_when_the_plan_says() -> None:
    visit = intervene(person(0), BEST_MS, "impact", PLAN)
    assert [pulse.block for pulse in visit.pulses] == ["before"] * 5 + ["after 0 min"] * 4 + ["after 30 min"] * 4
    times_s = [pulse.after_last_pair_s for pulse in visit.pulses]
    assert times_s == sorted(times_s)
    assert [times_s[4] < 0, times_s[5], times_s[9]] == [True, 0.0, 1800.0]
    assert len(visit.delivered) == 60


def test_wrong_isis_leave_nothing_behind() -> None:
    subject = replace(person(0), plasticity=GROWS)
    right, wrong = (intervene(subject, isi_ms, "impact", PLAN) for isi_ms in (BEST_MS, 300.0))
    assert (right.inside, wrong.inside) == (1.0, 0.0)
    assert right.change > 1.4
    assert wrong.change == 1.0


def test_a_window_that_moves_away_spoils_an_intervention_that_does_not_follow() -> None:
    moving = replace(person(0), plasticity=GROWS, change=Change(5, 30, shift_ms=120.0))
    stays, follows = (
        intervene(moving, isi_ms, "impact", PLAN) for isi_ms in (BEST_MS, lambda pair: BEST_MS + min(120.0, 6.0 * pair))
    )
    assert stays.inside < 0.5 < follows.inside
    assert stays.change < follows.change


def test_an_after_effect_is_smaller_in_a_later_block_if_it_is_lost_with_time() -> None:
    early, late = intervene(
        replace(person(0), plasticity=replace(GROWS, half_life_min=20.0)), BEST_MS, "impact", PLAN
    ).changes
    assert np.log(late) == pytest.approx(np.log(early) * 2 ** (-30 / 20), rel=0.05)


def test_who_has_no_recruitment_curve_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="TMS alone evokes nothing"):
        intervene(cohort("gaussian", 1, 0)[0], 90.0, "impact")
