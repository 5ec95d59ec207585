"""People above the motor threshold: who is drawn, and which ISIs in truth depress their MEPs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.subjects.changes import Plasticity
from isiw.subjects.cohorts import cohort
from isiw.subjects.responses import EmgFloor, GainResponse, OpposedProfile, PeakProfile, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from known import instance, known

SPACE = DesignSpace(0, 120, reference="impact")
PEOPLE = cohort("supra-threshold", 400, seed=3)
PROFILES = [instance(OpposedProfile, person.profile) for person in PEOPLE]
RESPONSES = [instance(RecruitmentResponse, person.response) for person in PEOPLE]
KS_LEVEL = 1e-5


def is_uniform(values: object, low: float, high: float) -> bool:
    law = stats.uniform(low, high - low)
    return float(stats.kstest(np.asarray(values, dtype=float), law.cdf).pvalue) > KS_LEVEL


def ends_ms(peak: PeakProfile) -> tuple[float, float]:
    return peak.start_ms, peak.start_ms + peak.width_ms


def test_the_curve_is_that_of_a_hand_at_120_percent_of_the_threshold() -> None:
    assert {(r.slope_per_pct, r.intensity_pct_rmt) for r in RESPONSES} == {(0.23, 120.0)}
    assert is_uniform([r.x50_pct_rmt for r in RESPONSES], 112, 122)
    z = [math.log(r.amplitude_mv / 1.0) / 0.4 for r in RESPONSES]
    assert stats.kstest(z, stats.norm.cdf).pvalue > KS_LEVEL


def test_one_segment_is_enhanced_and_another_depressed_by_the_stated_shifts() -> None:
    boosts = np.array([r.boost_pct_rmt for r in RESPONSES])
    assert is_uniform(boosts, 6, 18)
    assert is_uniform(boosts * [p.depth for p in PROFILES], 5, 12)


def test_segments_are_as_wide_as_stated_apart_and_in_the_range() -> None:
    widths_ms = np.array([[p.facilitated.width_ms, p.depressed.width_ms] for p in PROFILES])
    z = np.log(widths_ms.ravel() / 30.0) / 0.3  # clipping concerns one in a hundred
    assert stats.kstest(z, stats.norm.cdf).pvalue > KS_LEVEL
    for profile in PROFILES:
        first, second = sorted([ends_ms(profile.facilitated), ends_ms(profile.depressed)])
        assert first[0] >= 0
        assert first[1] <= second[0] + 1e-9
        assert second[1] <= 120 + 1e-9


def test_either_segment_comes_first_half_of_the_time() -> None:
    first = np.mean([p.facilitated.start_ms < p.depressed.start_ms for p in PROFILES])
    assert first == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(len(PROFILES)))


def test_everybody_has_both_kinds_of_segment_and_they_share_no_isi() -> None:
    for person in PEOPLE[:50]:
        window, depressed = known(person.window(SPACE)), known(person.depressed(SPACE))
        assert not (window.mask(SPACE.grid_ms) & depressed.mask(SPACE.grid_ms)).any()


def test_a_depression_ends_where_the_deficit_is_135_thousandths_of_the_deepest() -> None:
    person = replace(PEOPLE[1], profile=OpposedProfile(PeakProfile(70, 30), PeakProfile(10, 40), depth=0.8))
    deficit_mv = person.baseline_mv - person.expected_mep_mv(SPACE)
    inside = known(person.depressed(SPACE)).mask(SPACE.grid_ms)
    assert (deficit_mv[inside] >= 0.135 * deficit_mv.max()).all()
    assert (deficit_mv[~inside] < 0.135 * deficit_mv.max()).all()
    assert SPACE.grid_ms[inside].mean() == pytest.approx(30, abs=1)


def test_a_deficit_below_a_tenth_of_the_baseline_is_no_depression() -> None:
    shallow = replace(PEOPLE[1], profile=OpposedProfile(PeakProfile(70, 30), PeakProfile(10, 40), depth=0.02))
    assert shallow.depressed(SPACE) is None
    assert shallow.window(SPACE) is not None


def test_where_there_is_no_mep_without_a_tap_there_is_none_to_depress() -> None:
    person = PEOPLE[1]
    assert person.depressed(SPACE) is not None
    assert replace(person, scale=0.049 / person.baseline_mv).depressed(SPACE) is None


def test_depressed_pairs_leave_excitability_as_it_is() -> None:
    middle_ms = float(np.mean(known(PEOPLE[1].depressed(SPACE)).segments))
    plastic, usual = (replace(PEOPLE[1], plasticity=p).begin(1) for p in (Plasticity(0.5, pairs=5), None))
    for _ in range(50):
        assert plastic.respond(middle_ms, "impact").mep_mv == usual.respond(middle_ms, "impact").mep_mv


@pytest.mark.parametrize("name", ["recruitment", "gaussian", "nonresponder", "hand"])
def test_people_of_other_cohorts_are_not_depressed(name: str) -> None:
    assert [person.depressed(SPACE) for person in cohort(name, 20, 3)] == [None] * 20


def test_meps_are_smaller_in_the_depressed_segment_and_larger_in_the_other() -> None:
    person = replace(PEOPLE[1], profile=OpposedProfile(PeakProfile(70, 30), PeakProfile(10, 40), depth=0.8))
    responder = person.begin(1)
    low, rest, high = (
        np.median([responder.respond(isi_ms, "impact").mep_mv for _ in range(100)]) for isi_ms in (30.0, None, 85.0)
    )
    assert low < 0.8 * rest
    assert high > 1.1 * rest


def test_a_response_without_a_recruitment_curve_cannot_be_depressed() -> None:
    profile = OpposedProfile(PeakProfile(70, 30), PeakProfile(10, 40), depth=0.8)
    with pytest.raises(InvalidValueError, match="recruitment curve"):
        SimulatedSubject(profile, GainResponse(EmgFloor(0.01, 0.1), 0.1, 0.5), 180.0, 2.0)


@pytest.mark.parametrize("depth", [0.0, -1.0, math.nan])
def test_a_depth_must_be_positive(depth: float) -> None:
    with pytest.raises(InvalidValueError, match="depth"):
        OpposedProfile(PeakProfile(70, 30), PeakProfile(10, 40), depth)
