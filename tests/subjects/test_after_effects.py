from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.excess import EDGE_LEVEL
from isiw.subjects import (
    AFTER_EFFECTS,
    EmgFloor,
    GainResponse,
    PeakProfile,
    Plasticity,
    RecruitmentResponse,
    Responder,
    SimulatedSubject,
    cohort,
    with_after_effects,
)

INSIDE_MS, OUTSIDE_MS = 90.0, 300.0
PERSON = SimulatedSubject(
    PeakProfile(50.0, 80.0),
    RecruitmentResponse(EmgFloor(0.008, 0.1), 2.0, 0.25, 112.0, 12.0, 5.0, 0.2),
    180.0,
    hit_delay_sd_ms=0.0,
)


def after(plasticity: Plasticity, isi_ms: float | None, pairs: int = 150) -> Responder:
    """The person after so many pairs."""
    responder = replace(PERSON, plasticity=plasticity).begin(3)
    for _ in range(pairs):
        responder.respond(isi_ms, "impact")
    return responder


def test_tms_alone_shows_what_pairs_inside_the_window_leave_behind() -> None:
    grown = after(Plasticity(np.log(2.0), 20.0, least=EDGE_LEVEL), INSIDE_MS)
    same = after(Plasticity(0.0), INSIDE_MS)
    means = [
        np.mean([one.respond(None, "impact", intensity_pct_rmt=130).mep_mv for _ in range(300)])
        for one in (grown, same)
    ]
    assert means[0] / means[1] == pytest.approx(2.0, rel=0.03)


@pytest.mark.parametrize(("isi_ms", "log_gain"), [(INSIDE_MS, 0.5), (OUTSIDE_MS, 0.0), (None, 0.0)])
def test_only_pairs_inside_the_window_build_an_after_effect(isi_ms: float | None, log_gain: float) -> None:
    assert after(Plasticity(0.5, 20.0, least=EDGE_LEVEL), isi_ms).after_effect == pytest.approx(log_gain, abs=0.01)


def test_pairs_outside_the_window_lower_meps_where_that_is_stated() -> None:
    assert after(Plasticity(0.5, 20.0, EDGE_LEVEL, outside=-0.3), OUTSIDE_MS).after_effect == pytest.approx(
        -0.3, abs=0.01
    )


def test_an_after_effect_saturates_with_pairs() -> None:
    effects = [after(Plasticity(0.5, 40.0), INSIDE_MS, pairs).after_effect for pairs in (0, 50, 100, 150, 200)]
    gains = [later - earlier for earlier, later in pairwise(effects)]
    assert all(later < earlier for earlier, later in pairwise(gains))
    assert effects[-1] < 0.5


def test_an_after_effect_is_lost_with_time_and_not_where_it_stays() -> None:
    lost, stays = (after(Plasticity(0.5, 20.0, half_life_min=half), INSIDE_MS) for half in (30.0, None))
    before = lost.after_effect
    for one in (lost, stays):
        one.wait(30.0)
    assert lost.after_effect == pytest.approx(before / 2)
    assert stays.after_effect == pytest.approx(before)


def test_more_pairs_lower_what_the_first_ones_have_raised_if_the_effect_turns() -> None:
    effect = Plasticity(0.5, 30.0, turns_after=60.0)
    assert after(effect, INSIDE_MS, 60).after_effect > 0.3
    assert after(effect, INSIDE_MS, 200).after_effect < 0


def test_half_of_mixed_people_have_no_after_effect_and_of_none_nobody_has_one() -> None:
    people = cohort("recruitment", 200, 1)
    shares = {
        kind: np.mean([one.plasticity is not None for one in with_after_effects(people, kind, 1)])
        for kind in AFTER_EFFECTS
    }
    assert shares["mixed"] == pytest.approx(0.5, abs=0.1)
    assert shares["none"] == 0.0
    assert shares["growth"] == 1.0


def test_an_after_effect_leaves_window_and_responses_as_they_were() -> None:
    people = cohort("recruitment", 3, 1)
    assert [replace(one, plasticity=None) for one in with_after_effects(people, "timed", 1)] == people


def test_the_intensity_of_a_pulse_needs_a_recruitment_curve() -> None:
    person = replace(PERSON, response=GainResponse(EmgFloor(0.008, 0.1), 0.1, 0.5))
    with pytest.raises(InvalidValueError, match="recruitment curve"):
        person.begin(0).respond(None, "impact", intensity_pct_rmt=120.0)
    with pytest.raises(InvalidValueError, match="kind of after-effect"):
        with_after_effects([], "groth", 0)
