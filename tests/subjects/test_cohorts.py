"""Simulated people: who is drawn, what is true of them, and how they answer.

Distributions are checked with Kolmogorov–Smirnov tests at a level of 1e-5, and means within four standard errors; all
seeds are fixed, so that a figure that fails has changed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import stats

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.subjects.cohorts import CHANGED, COHORTS, another_day, cohort, person_of
from isiw.subjects.measured import LABS, lab
from isiw.subjects.responses import (
    EmgFloor,
    GainResponse,
    OpposedProfile,
    PeakProfile,
    RecruitmentResponse,
    TwoPeakProfile,
)
from isiw.subjects.subject import Drift, SimulatedSubject
from isiw.types import ArrayLike, FloatArray
from known import instance, known

PEOPLE = 400
KS_LEVEL = 1e-5
OFF_THE_MAP = ("other-rig", "late", "very-wide", "steep", "flat", "weak", "rmt-off", "hand", "electrical")
REALITIES = (*CHANGED, "narrow-unstated", "wide-early", "above-threshold", "hand-flat")
OTHER_LAWS = {"odd", "kim11", "kim11-measured", "another-day", "supra-threshold", *LABS, *REALITIES}
USUAL_START = [name for name in COHORTS if name not in {"late", "very-wide", "electrical", *OTHER_LAWS}]
USUAL_DELAY = [name for name in COHORTS if name not in {"other-rig", *OTHER_LAWS}]
USUAL_WIDTH = [name for name in COHORTS if name not in {"narrow", "wide", "very-wide", "electrical", *OTHER_LAWS}]
GAIN = [name for name in COHORTS if name not in {"recruitment", "nonresponder", *OTHER_LAWS, *OFF_THE_MAP}]
SOME_WITHOUT_A_WINDOW = {
    "nonresponder": 0.0,
    "hand-flat": 0.0,
    **dict.fromkeys((*CHANGED, "above-threshold"), 0.5),
    **dict.fromkeys(("steep", "weak", "rmt-off", "odd", "another-day", *LABS), 0.9),
}
SPACES = [VALVE_SPACE, IMPACT_SPACE]

NO_FLOOR = EmgFloor(1e-12, 0.1)
ALMOST_NO_NOISE = 0.01

GOLDEN = {  # person 3 of seed 7: start, width, hit delay [ms]; baseline, one MEP at 250 ms after the valve command [µV]
    "gaussian": (40.385003297, 142.605303763, 185.387790760, 9.283267197, 124.559797961),
    "skewed": (71.838248366, 110.006953995, 182.049613457, 11.241728991, 17.141355539),
    "plateau": (97.563982731, 156.792106940, 189.761084462, 14.992801624, 12.705447840),
    "two-peak": (101.771074108, 85.471684805, 184.740219847, 7.509958859, 6.364284501),
    "narrow": (15.075943097, 44.086013991, 186.396052820, 6.910930984, 17.623261535),
    "wide": (22.701704279, 206.679454523, 185.044556284, 8.854540866, 88.836840965),
    "low-response": (5.926701773, 124.685713882, 171.084615393, 12.755400053, 10.809392008),
    "outliers": (37.564053483, 99.782330768, 184.525615202, 6.082426445, 27.590061987),
    "drift": (69.012082281, 117.714815929, 171.709582996, 11.164728174, 26.665071479),
    "jitter": (40.662382453, 76.481062757, 178.390330530, 9.113457604, 55.491849111),
    "jitter-untold": (78.432525752, 208.300523975, 172.927639430, 9.351442068, 14.704390346),
    "recruitment": (96.892748306, 71.935450590, 177.483696598, 21.276365608, 41.408047498),
    "other-rig": (50.774375107, 201.754096680, 129.684698220, 15.174688088, 85.865921882),
    "late": (136.744705865, 115.766258068, 181.776550122, 25.161180991, 40.969330841),
    "very-wide": (58.799324690, 239.604187578, 181.625122203, 18.218483325, 48.735587589),
    "steep": (43.855151622, 184.263783909, 177.800843054, 13.046661095, 13.324514283),
    "flat": (5.276830186, 67.488740174, 175.948203357, 33.535328430, 89.525069846),
    "weak": (17.935991515, 120.696943048, 183.443699559, 15.700784707, 56.608959530),
    "rmt-off": (74.218307886, 112.525712103, 188.232285430, 24.203424727, 37.024783464),
    "hand": (84.807565834, 40.000000000, 188.025895468, 405.512286791, 836.441568198),
    "electrical": (19.976246574, 19.837553640, 187.852063419, 21.786812540, 38.306593589),
    "odd": (90.440553468, 45.837527776, 184.314130489, 194.289659538, 464.222031414),
    "supra-threshold": (24.866261922, 32.847816077, 189.879315173, 826.299001084, 825.329106370),
    "nonresponder": (26.795763804, 200.583631934, 171.477980223, 17.537323509, 27.809842272),
    "kim11": (29.786337130, 70.000000000, 183.644876006, 27.459353025, 130.665956671),
    "kim11-measured": (-46.799876568, 271.342643979, 171.075676807, 14.702096626, 59.881802762),
    "lab": (43.607468962, 98.778181474, 185.045472366, 16.924413868, 55.411189166),
    "lab-late": (138.189661220, 85.013381303, 177.032057023, 55.153055983, 134.267019245),
    "lab-rig": (-1.656078453, 138.533150191, 45.954129384, 17.539448992, 24.883362277),
    "another-day": (86.347281970, 48.950264038, 184.314189247, 13.879170544, 14.421862001),
    "step": (81.012881495, 90.560929756, 189.365568514, 22.170657720, 45.164054131),
    "ramp": (29.857617357, 62.566342772, 185.971627415, 14.919375828, 19.411587999),
    "retuned": (106.458277098, 88.860301485, 181.353444246, 24.494754465, 58.121870850),
    "fading": (15.136013650, 60.182860626, 180.402314083, 13.750959843, 22.808404145),
    "moving": (28.058038202, 85.162561249, 185.570235669, 22.583014655, 41.157359736),
    "tap-response": (9.006871941, 59.787186602, 188.459837551, 17.672638757, 24.533129379),
    "coarse": (36.490709217, 76.347793697, 182.223155273, 22.105619155, 35.000000000),
    "narrow-unstated": (20.616196848, 34.005905577, 176.681130899, 13.584031706, 16.984726636),
    "wide-early": (5.719166380, 232.895172209, 186.014928978, 15.309943927, 58.461965103),
    "above-threshold": (78.356068374, 113.496183169, 188.615581818, 78.655825082, 102.568477278),
    "hand-flat": (97.698950486, 148.604497863, 189.425449654, 12.975470100, 17.062463144),
}


@dataclass(frozen=True)
class LinearProfile:
    """A profile from whose value the ISI can be read."""

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        return np.asarray(isi_ms, dtype=float) / 1000.0


@cache
def people(name: str) -> list[SimulatedSubject]:
    return cohort(name, PEOPLE, seed=3)


def assert_uniform(values: object, low: float, high: float) -> None:
    array = np.asarray(values, dtype=float)
    assert low <= array.min()
    assert array.max() <= high
    assert stats.kstest(array, stats.uniform(low, high - low).cdf).pvalue > KS_LEVEL


def assert_log_normal(values: object, median: float, log_sd: float) -> None:
    z = np.log(np.asarray(values, dtype=float) / median) / log_sd
    assert stats.kstest(z, stats.norm.cdf).pvalue > KS_LEVEL


def profile_of(subject: SimulatedSubject) -> PeakProfile | TwoPeakProfile:
    profile = subject.profile.facilitated if isinstance(subject.profile, OpposedProfile) else subject.profile
    assert isinstance(profile, PeakProfile | TwoPeakProfile)
    return profile


def gain_of(subject: SimulatedSubject) -> GainResponse:
    return instance(GainResponse, subject.response)


def recruitment_of(subject: SimulatedSubject) -> RecruitmentResponse:
    return instance(RecruitmentResponse, subject.response)


def bare_subject(**changes: Any) -> SimulatedSubject:
    """A person who answers with the facilitation itself, almost without noise."""
    return SimulatedSubject(
        LinearProfile(), GainResponse(NO_FLOOR, 1.0, 1e-6), hit_delay_ms=180.0, hit_delay_sd_ms=0.0, **changes
    )


def sweep_of_meps(subject: SimulatedSubject, isi_ms: float | None, trials: int, seed: int) -> np.ndarray:
    responder = subject.begin(seed)
    return np.array([responder.respond(isi_ms, "impact").mep_mv for _ in range(trials)])


# Who is drawn


@pytest.mark.parametrize("name", COHORTS)
def test_person_3_of_seed_7_is_the_same_on_every_machine(name: str) -> None:
    subject = cohort(name, 4, 7)[3]
    mep_mv = subject.begin(11).respond(250.0, "valve").mep_mv
    profile = profile_of(subject)
    drawn = (profile.start_ms, profile.width_ms, subject.hit_delay_ms, 1e3 * subject.baseline_mv, 1e3 * mep_mv)
    assert drawn == pytest.approx(GOLDEN[name], rel=1e-7)


def test_every_cohort_has_its_golden_person() -> None:
    assert set(GOLDEN) == set(COHORTS)


@pytest.mark.parametrize("name", COHORTS)
def test_a_person_depends_neither_on_how_many_are_drawn_nor_on_earlier_draws(name: str) -> None:
    assert cohort(name, 20, 5)[:3] == cohort(name, 3, 5) == cohort(name, 3, 5)


@pytest.mark.parametrize("name", COHORTS)
def test_people_differ_within_a_cohort(name: str) -> None:
    sessions = cohort(name, 11, 5)[:: 2 if name == "another-day" else 1]
    assert len({subject.hit_delay_ms for subject in sessions}) == len(sessions)


@pytest.mark.parametrize("name", [name for name in COHORTS if not name.startswith("kim11")])
def test_people_differ_from_seed_to_seed(name: str) -> None:
    assert all(a != b for a, b in zip(cohort(name, 5, 5), cohort(name, 5, 6), strict=True))


def test_cohorts_do_not_share_their_people() -> None:
    delays = {name: cohort(name, 1, 5)[0].hit_delay_ms for name in COHORTS}
    assert len(set(delays.values())) == len(COHORTS)


def test_an_unknown_cohort_names_the_known_ones() -> None:
    with pytest.raises(InvalidValueError, match="kim11") as caught:
        cohort("martian", 1, 0)
    assert all(name in str(caught.value) for name in COHORTS)


@pytest.mark.parametrize(("n", "seed"), [(-1, 0), (1, -1)])
def test_a_negative_number_of_people_or_seed_is_refused(n: int, seed: int) -> None:
    with pytest.raises(InvalidValueError, match="at least 0"):
        cohort("gaussian", n, seed)


@pytest.mark.parametrize("name", COHORTS)
def test_a_person_is_the_same_without_the_others(name: str) -> None:
    assert person_of(name, 3, seed=7) == cohort(name, 4, seed=7)[3]


def test_nobody_is_a_cohort_too() -> None:
    assert cohort("gaussian", 0, 0) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", USUAL_START)
def test_windows_start_as_stated(name: str) -> None:
    assert_uniform([profile_of(s).start_ms for s in people(name)], 5, 110)


@pytest.mark.parametrize(
    ("name", "low_ms", "high_ms"), [("late", 80, 200), ("very-wide", 0, 60), ("electrical", 5, 50)]
)
def test_late_very_wide_and_electrical_windows_have_their_starts(name: str, low_ms: float, high_ms: float) -> None:
    assert_uniform([profile_of(s).start_ms for s in people(name)], low_ms, high_ms)


@pytest.mark.parametrize("name", USUAL_DELAY)
def test_taps_arrive_as_stated(name: str) -> None:
    drawn = people(name)
    assert_uniform([s.hit_delay_ms for s in drawn], 170, 190)
    assert_uniform([s.hit_delay_sd_ms for s in drawn], 1, 4)


def test_another_rig_hits_at_any_time_and_states_it() -> None:
    drawn = people("other-rig")
    assert_uniform([s.hit_delay_ms for s in drawn], 20, 300)
    assert all(s.stated_hit_delay_ms == (s.hit_delay_ms, 6.0) for s in drawn)


@pytest.mark.slow
@pytest.mark.parametrize("name", COHORTS)
def test_what_rigs_state_of_their_hit_delay_is_true(name: str) -> None:
    off = [(s.hit_delay_ms - s.stated_hit_delay_ms[0]) / s.stated_hit_delay_ms[1] for s in people(name)]
    assert np.abs(off).max() < 4.0


def test_only_people_of_electrical_are_not_tapped() -> None:
    assert {name for name in COHORTS if cohort(name, 1, 3)[0].conditioning == "electrical"} == {"electrical"}


def assert_clipped_log_normal(values: object, median: float, log_sd: float, ends: tuple[float, float]) -> None:
    array = np.asarray(values, dtype=float)
    low, high = ends
    assert low <= array.min()
    assert array.max() <= high
    unclipped = array[(array > low) & (array < high)]
    law = stats.norm(math.log(median), log_sd)
    below, above = law.cdf(np.log(ends))
    uniform = (law.cdf(np.log(unclipped)) - below) / (above - below)
    assert stats.kstest(uniform, "uniform").pvalue > KS_LEVEL
    # More than this many at an end come by chance in fewer than 1 of 1000 seeds.
    for end, expected in ((low, below), (high, 1.0 - above)):
        assert (array == end).sum() <= stats.binom(len(array), expected).ppf(0.999)


@pytest.mark.parametrize("name", USUAL_WIDTH)
def test_widths_are_log_normal_and_clipped(name: str) -> None:
    assert_clipped_log_normal([profile_of(s).width_ms for s in people(name)], 100, 0.42, (40, 230))


def test_very_wide_windows_have_their_widths() -> None:
    assert_clipped_log_normal([profile_of(s).width_ms for s in people("very-wide")], 200, 0.25, (120, 320))
    assert_clipped_log_normal([profile_of(s).width_ms for s in people("electrical")], 20, 0.3, (10, 40))


@pytest.mark.parametrize(("name", "low_ms", "high_ms"), [("narrow", 35, 50), ("wide", 180, 230)])
def test_narrow_and_wide_windows_have_their_widths(name: str, low_ms: float, high_ms: float) -> None:
    assert_uniform([profile_of(s).width_ms for s in people(name)], low_ms, high_ms)


@pytest.mark.parametrize("name", GAIN)
def test_gains_and_floors_are_those_of_constant_cv_noise(name: str) -> None:
    responses = [gain_of(s) for s in people(name)]
    assert {r.floor.log_sd for r in responses} == {0.35}
    assert_log_normal([r.floor.median_mv for r in responses], 0.008, 0.3)
    assert_log_normal([r.gain_mv for r in responses], 0.06, 0.5)
    assert_uniform([r.cv for r in responses], 0.4, 0.9)


@pytest.mark.parametrize("name", [name for name in COHORTS if name not in {"skewed", "plateau", "two-peak"}])
def test_profiles_are_gaussian_unless_stated(name: str) -> None:
    profiles = [profile_of(s) for s in people(name)]
    assert all(p == PeakProfile(p.start_ms, p.width_ms) for p in profiles)


def test_skewed_profiles_peak_early_or_late_half_of_the_time() -> None:
    profiles = [instance(PeakProfile, s.profile) for s in people("skewed")]
    peak_at = np.array([p.peak_at for p in profiles])
    late = peak_at > 0.5
    assert_uniform(np.where(late, 1 - peak_at, peak_at), 0.22, 0.40)
    assert late.mean() == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(PEOPLE))
    assert {p.exponent for p in profiles} == {2.0}


def test_plateaus_are_flat_topped_and_symmetric() -> None:
    profiles = [instance(PeakProfile, s.profile) for s in people("plateau")]
    assert_uniform([p.exponent for p in profiles], 4, 8)
    assert {p.peak_at for p in profiles} == {0.5}


def test_two_peaks_have_one_of_height_1_and_a_lower_one_on_either_side() -> None:
    profiles = [instance(TwoPeakProfile, s.profile) for s in people("two-peak")]
    assert_uniform([min(p.first, p.second) for p in profiles], 0.4, 1.0)
    first_higher = np.mean([p.first > p.second for p in profiles])
    assert first_higher == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(PEOPLE))


def test_low_responders_have_a_response_probability_and_others_none() -> None:
    assert_uniform([gain_of(s).max_response_probability for s in people("low-response")], 0.4, 0.7)
    others = [name for name in GAIN if name != "low-response"]
    assert {gain_of(s).max_response_probability for name in others for s in people(name)[:20]} == {None}


def test_only_the_cohorts_that_say_so_have_outliers_drift_or_jitter() -> None:
    for name in COHORTS:
        for subject in people(name)[:20]:
            assert subject.outlier_probability == (0.06 if name == "outliers" else 0.0)
            assert subject.drift == (Drift(0.97, 0.12, (0.29, 0.20)) if name == "drift" else None)
            assert (subject.isi_jitter_ms > 0) == name.startswith("jitter")
            assert subject.jitter_reported == (name != "jitter-untold")
            assert subject.scale == 1.0


@pytest.mark.parametrize("name", ["jitter", "jitter-untold"])
def test_jitter_has_an_sd_of_1_to_5_ms(name: str) -> None:
    assert_uniform([s.isi_jitter_ms for s in people(name)], 1, 5)


def test_recruitment_has_the_parameters_of_the_physiology_table() -> None:
    drawn = people("recruitment")
    responses = [recruitment_of(s) for s in drawn]
    assert {(r.slope_per_pct, r.intensity_pct_rmt) for r in responses} == {(0.30, 90.0)}
    assert_log_normal([r.amplitude_mv for r in responses], 0.16, 0.35)
    assert_log_normal([r.floor.median_mv for r in responses], 0.010, 0.25)
    assert_uniform([r.floor.log_sd for r in responses], 0.12, 0.25)
    assert_uniform([r.x50_pct_rmt for r in responses], 103, 107)
    assert_uniform([r.boost_pct_rmt for r in responses], 6, 18)
    assert_uniform([r.sigma_x_pct_rmt for r in responses], 5, 9)
    assert_uniform([r.sigma_y for r in responses], 0.3, 0.5)
    assert_uniform([s.input_correlation for s in drawn], 0, 0.2)


OFF_RECRUITMENT = {
    "steep": {"sigma_x_pct_rmt": (2, 4)},
    "flat": {"sigma_x_pct_rmt": (9, 14)},
    "weak": {"boost_pct_rmt": (4, 8)},
    "hand": {"x50_pct_rmt": (112, 122), "boost_pct_rmt": (8, 24)},
}
SLOPES = {"steep": 0.6, "flat": 0.2, "hand": 0.23}


@pytest.mark.parametrize("name", OFF_THE_MAP)
def test_people_off_the_map_recruit_as_usual_but_for_what_is_stated(name: str) -> None:
    drawn = people(name)
    responses = [recruitment_of(s) for s in drawn]
    usual = {"x50_pct_rmt": (103, 107), "boost_pct_rmt": (6, 18), "sigma_x_pct_rmt": (5, 9), "sigma_y": (0.3, 0.5)}
    for field, (low, high) in {**usual, **OFF_RECRUITMENT.get(name, {})}.items():
        assert_uniform([getattr(r, field) for r in responses], low, high)
    assert {r.slope_per_pct for r in responses} == {SLOPES.get(name, 0.3)}
    assert_log_normal([r.amplitude_mv for r in responses], *((1.0, 0.6) if name == "hand" else (0.16, 0.35)))
    assert_log_normal([r.floor.median_mv for r in responses], 0.010, 0.25)
    assert_uniform([s.input_correlation for s in drawn], 0, 0.2)


def test_intensities_are_90_percent_of_rmt_but_for_a_wrong_threshold_and_the_hand() -> None:
    intensities = {name: np.array([recruitment_of(s).intensity_pct_rmt for s in people(name)]) for name in OFF_THE_MAP}
    off, hand = intensities.pop("rmt-off"), intensities.pop("hand")
    assert {float(value) for values in intensities.values() for value in values} == {90.0}
    assert stats.kstest((off - 90.0) / 6.0, stats.norm.cdf).pvalue > KS_LEVEL
    assert all((hand == pct).mean() == pytest.approx(1 / 3, abs=0.1) for pct in (90.0, 100.0, 110.0))


def test_odd_people_are_of_each_other_cohort_off_the_map() -> None:
    drawn = people("odd")
    response = [recruitment_of(s) for s in drawn]
    kinds = {
        "hand": np.array([r.slope_per_pct == 0.23 for r in response]),
        "steep or flat": np.array([r.slope_per_pct in (0.6, 0.2) for r in response]),
        "another rig": np.array([s.stated_hit_delay_ms[0] == s.hit_delay_ms for s in drawn]),
        "a wrong threshold": np.array([r.slope_per_pct == 0.3 and r.intensity_pct_rmt != 90.0 for r in response]),
    }
    for of_kind in kinds.values():
        assert of_kind.mean() == pytest.approx(1 / 7, abs=4 * math.sqrt(6 / 49 / PEOPLE))


def test_half_of_the_nonresponders_are_of_either_kind() -> None:
    drawn = people("nonresponder")
    kinds = [type(s.response) for s in drawn]
    assert kinds.count(GainResponse) == kinds.count(RecruitmentResponse) == PEOPLE // 2
    assert {s.response.gain_mv for s in drawn if isinstance(s.response, GainResponse)} == {0.0}
    assert {s.response.boost_pct_rmt for s in drawn if isinstance(s.response, RecruitmentResponse)} == {0.0}


def test_kim11_has_the_eleven_widths_of_table_4_1_in_order() -> None:
    drawn = cohort("kim11", 11, 0)
    assert [profile_of(s).width_ms for s in drawn] == [75, 65, 80, 70, 110, 120, 220, 145, 135, 110, 60]
    assert all(20 <= profile_of(s).start_ms <= 100 for s in drawn)
    assert all(6 <= recruitment_of(s).boost_pct_rmt <= 14 for s in drawn)


@pytest.mark.parametrize("name", ["kim11", "kim11-measured"])
def test_kim11_cycles_over_its_eleven_people_and_ignores_the_seed(name: str) -> None:
    assert cohort(name, 25, 0) == cohort(name, 25, 10_000)
    assert cohort(name, 25, 0)[11:22] == cohort(name, 11, 0)


def peak(subject: SimulatedSubject) -> PeakProfile:
    return instance(PeakProfile, subject.profile)


def curve(subject: SimulatedSubject) -> RecruitmentResponse:
    return instance(RecruitmentResponse, subject.response)


@pytest.mark.parametrize("name", LABS)
def test_the_people_of_a_lab_have_its_law(name: str) -> None:
    law, drawn = lab(name, 3), people(name)
    normal = {law.start_ms: [peak(s).start_ms for s in drawn], law.hit_delay_ms: [s.hit_delay_ms for s in drawn]}
    for (mean, sd), values in normal.items():
        assert stats.kstest(values, stats.norm(mean, sd).cdf).pvalue > KS_LEVEL
    assert_clipped_log_normal([peak(s).width_ms for s in drawn], *law.width_ms, (40, 230))
    assert_log_normal([curve(s).amplitude_mv for s in drawn], *law.amplitude_mv)
    assert_log_normal([curve(s).boost_pct_rmt for s in drawn], *law.boost_pct_rmt)
    assert_log_normal([curve(s).sigma_x_pct_rmt for s in drawn], *law.sigma_x_pct_rmt)
    assert_log_normal([s.response.floor.median_mv for s in drawn], *law.floor_mv)


def test_labs_differ_in_where_windows_start_and_rigs_in_when_they_hit() -> None:
    laws = {name: [lab(name, seed) for seed in range(PEOPLE)] for name in LABS}
    for name, (start_ms, hit_delay_ms) in LABS.items():
        assert_uniform([law.start_ms[0] for law in laws[name]], *start_ms)
        assert_uniform([law.hit_delay_ms[0] for law in laws[name]], *hit_delay_ms)


def test_sessions_of_another_day_come_in_pairs_of_one_person() -> None:
    first, second = people("another-day")[::2], people("another-day")[1::2]
    for kept in ("hit_delay_ms", "hit_delay_sd_ms", "input_correlation"):
        assert [getattr(s, kept) for s in first] == [getattr(s, kept) for s in second]
    assert [curve(s).boost_pct_rmt for s in first] == [curve(s).boost_pct_rmt for s in second]


@pytest.mark.slow
def test_another_day_the_window_has_shifted_or_is_anyones() -> None:
    first, second = cohort("another-day", 2 * PEOPLE, 3)[::2], cohort("another-day", 2 * PEOPLE, 3)[1::2]
    stayed = np.array([peak(a).width_ms == peak(b).width_ms for a, b in zip(first, second, strict=True)])
    assert stayed.mean() == pytest.approx(0.7, abs=4 * math.sqrt(0.21 / PEOPLE))
    shift_ms = np.array([peak(b).start_ms - peak(a).start_ms for a, b in zip(first, second, strict=True)])
    assert stats.kstest(shift_ms[stayed] / 12.0, stats.norm.cdf).pvalue > KS_LEVEL
    assert_uniform([peak(b).start_ms for b, same in zip(second, stayed, strict=True) if not same], 5, 110)
    x50 = [curve(b).x50_pct_rmt - curve(a).x50_pct_rmt for a, b in zip(first, second, strict=True)]
    assert stats.kstest(np.array(x50) / 3.0, stats.norm.cdf).pvalue > KS_LEVEL
    amplitude = [curve(b).amplitude_mv / curve(a).amplitude_mv for a, b in zip(first, second, strict=True)]
    assert_log_normal(amplitude, 1.0, 0.4)


def test_only_people_with_a_recruitment_curve_come_back_another_day() -> None:
    (person,), rng = cohort("gaussian", 1, 3), np.random.default_rng(1)
    with pytest.raises(TypeError, match="GainResponse"):
        another_day(person, person, rng)


# What is true of them


@pytest.mark.parametrize("space", SPACES, ids=["valve", "impact"])
def test_a_nonresponder_has_no_window(space: DesignSpace) -> None:
    assert {s.window(space) for s in people("nonresponder")} == {None}


@pytest.mark.slow
@pytest.mark.parametrize("space", SPACES, ids=["valve", "impact"])
@pytest.mark.parametrize("name", COHORTS)
def test_all_others_have_one_or_nearly_all(name: str, space: DesignSpace) -> None:
    share = np.mean([s.window(space) is not None for s in people(name)[:30]])
    assert share >= SOME_WITHOUT_A_WINDOW.get(name, 1.0)


@pytest.mark.parametrize("name", ["gaussian", "skewed", "narrow", "wide", "outliers", "drift", "jitter"])
def test_the_window_of_a_gain_is_the_span_of_its_profile(name: str) -> None:
    for subject in people(name)[:60]:
        window, profile = known(subject.window(IMPACT_SPACE)), profile_of(subject)
        span = (profile.start_ms, min(profile.start_ms + profile.width_ms, 320.0))
        # exp(-2) is 0.1353, a little above the rule's 0.135.
        assert (window.start_ms, window.end_ms) == pytest.approx(span, abs=1.0)


def test_a_window_counts_from_the_valve_later_by_the_hit_delay() -> None:
    for subject in people("gaussian")[:60]:
        by_valve, by_impact = known(subject.window(VALVE_SPACE)), known(subject.window(IMPACT_SPACE))
        assert by_valve.start_ms - by_impact.start_ms == pytest.approx(subject.hit_delay_ms, abs=1.0)


def test_a_low_responder_has_a_narrower_window_than_the_profile_alone() -> None:
    for subject in people("low-response")[:60]:
        whole = replace(subject, response=replace(gain_of(subject), max_response_probability=None))
        assert known(subject.window(VALVE_SPACE)).width_ms < known(whole.window(VALVE_SPACE)).width_ms


@pytest.mark.parametrize("space", SPACES, ids=["valve", "impact"])
def test_a_two_peaked_window_is_one_segment_where_its_valley_is_above_the_rule(space: DesignSpace) -> None:
    # No valley of this cohort is below: its peaks are 3.45 SDs apart, so each has 0.23 of its height half way.
    drawn = [s for s in people("two-peak") if profile_of(s).start_ms + profile_of(s).width_ms < 300]
    assert drawn
    for subject in drawn:
        profile = profile_of(subject)
        between = np.linspace(0.27, 0.73, 500) * profile.width_ms + profile.start_ms
        assert profile(between).min() > 0.135 * profile(between).max()
        assert len(known(subject.window(space)).segments) == 1


def test_a_person_with_two_peaks_far_apart_has_a_window_of_two_segments() -> None:
    @dataclass(frozen=True)
    class FarPeaks:
        def __call__(self, isi_ms: ArrayLike) -> FloatArray:
            isi = np.asarray(isi_ms, dtype=float)
            return np.asarray(np.exp(-0.5 * ((isi - 60) / 10) ** 2) + 0.6 * np.exp(-0.5 * ((isi - 160) / 10) ** 2))

    subject = SimulatedSubject(FarPeaks(), GainResponse(EmgFloor(0.008, 0.3), 0.06, 0.5), 180.0, 2.0)
    first, second = known(subject.window(IMPACT_SPACE)).segments
    assert first == pytest.approx((40, 80), abs=1)
    half_ms = 10 * math.sqrt(2 * math.log(0.6 / 0.135))
    assert second == pytest.approx((160 - half_ms, 160 + half_ms), abs=1)


@pytest.mark.parametrize("name", ["gaussian", "recruitment", "nonresponder"])
def test_the_window_does_not_depend_on_the_unit_above_the_least_excess(name: str) -> None:
    for subject in people(name)[:20]:
        assert replace(subject, scale=10.0).window(VALVE_SPACE) == subject.window(VALVE_SPACE)


def test_what_differs_from_trial_to_trial_leaves_the_truth_alone() -> None:
    subject = cohort("gaussian", 1, 3)[0]
    disturbed = replace(subject, drift=Drift(), outlier_probability=0.06, isi_jitter_ms=5.0, jitter_reported=False)
    np.testing.assert_array_equal(disturbed.expected_mep_mv(VALVE_SPACE), subject.expected_mep_mv(VALVE_SPACE))
    assert disturbed.baseline_mv == subject.baseline_mv


# How they answer


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gaussian", "low-response", "recruitment", "nonresponder"])
@pytest.mark.parametrize("share", [None, 0.0, 0.5])
def test_answers_have_the_expected_mep_as_their_mean(name: str, share: float | None) -> None:
    subject = replace(cohort(name, 1, 3)[0], hit_delay_sd_ms=0.0, input_correlation=0.0)
    profile = profile_of(subject)
    isi_ms = None if share is None else round(profile.start_ms + share * profile.width_ms)
    meps = sweep_of_meps(subject, isi_ms, 2000, seed=21)
    expected = subject.baseline_mv if isi_ms is None else subject.expected_mep_mv(IMPACT_SPACE)[isi_ms]
    assert meps.mean() == pytest.approx(expected, abs=4 * meps.std() / math.sqrt(len(meps)))


@pytest.mark.parametrize("name", COHORTS)
def test_the_same_session_seed_gives_the_same_answers_and_another_does_not(name: str) -> None:
    subject = cohort(name, 1, 3)[0]
    runs = [
        [responder.respond(isi_ms, "valve") for isi_ms in (200.0, None, 250.0)]
        for responder in (subject.begin(1), subject.begin(1), subject.begin(2))
    ]
    assert runs[0] == runs[1] != runs[2]


def test_two_sessions_with_one_person_do_not_disturb_each_other() -> None:
    subject = cohort("drift", 1, 3)[0]
    alone = subject.begin(1)
    expected = [alone.respond(250.0, "valve") for _ in range(4)]
    one, other = subject.begin(1), subject.begin(2)
    answers = []
    for _ in range(4):
        answers.append(one.respond(250.0, "valve"))
        other.respond(100.0, "valve")
    assert answers == expected


def test_tms_alone_is_told_without_an_isi() -> None:
    for name in ("gaussian", "jitter", "jitter-untold"):
        response = cohort(name, 1, 3)[0].begin(1).respond(None, "impact")
        assert (response.isi_ms, response.isi_sd_ms) == (None, 0.0)


def test_amplitudes_scale_with_the_unit() -> None:
    subject = cohort("outliers", 1, 3)[0]
    meps = sweep_of_meps(subject, 60.0, 200, seed=1)
    np.testing.assert_allclose(sweep_of_meps(replace(subject, scale=10.0), 60.0, 200, seed=1), 10 * meps)


def test_from_the_valve_the_hit_delay_varies_unseen() -> None:
    subject = replace(bare_subject(), hit_delay_sd_ms=3.0)
    responder = subject.begin(4)
    answers = [responder.respond(400.0, "valve") for _ in range(4000)]
    assert {(a.isi_ms, a.isi_sd_ms) for a in answers} == {(400.0, 0.0)}
    from_impact_ms = 1e3 * np.array([a.mep_mv for a in answers])
    assert from_impact_ms.mean() == pytest.approx(400.0 - 180.0, abs=4 * 3 / math.sqrt(4000))
    assert from_impact_ms.std() == pytest.approx(3.0, rel=4 / math.sqrt(2 * 4000))


def test_from_the_impact_the_realised_isi_varies_with_the_hit_delay_and_is_told() -> None:
    responder = replace(bare_subject(), hit_delay_sd_ms=3.0).begin(4)
    answers = [responder.respond(200.0, "impact") for _ in range(4000)]
    reported_ms = np.array([a.isi_ms for a in answers])
    assert reported_ms.mean() == pytest.approx(200.0, abs=4 * 3 / math.sqrt(4000))
    assert reported_ms.std() == pytest.approx(3.0, rel=4 / math.sqrt(2 * 4000))
    np.testing.assert_allclose([1e3 * a.mep_mv for a in answers], reported_ms, rtol=1e-4)


@pytest.mark.parametrize("told", [True, False])
def test_jitter_moves_the_realised_isi_and_is_told_or_not(*, told: bool) -> None:
    responder = bare_subject(isi_jitter_ms=4.0, jitter_reported=told).begin(5)
    answers = [responder.respond(200.0, "impact") for _ in range(4000)]
    realised_ms = 1e3 * np.array([a.mep_mv for a in answers])
    assert realised_ms.std() == pytest.approx(4.0, rel=4 / math.sqrt(2 * 4000))
    if told:
        np.testing.assert_allclose([known(a.isi_ms) for a in answers], realised_ms, rtol=1e-4)
    assert {a.isi_sd_ms for a in answers} == {0.0 if told else 4.0}
    assert ({a.isi_ms for a in answers} == {200.0}) == (not told)


def test_6_in_100_trials_are_artefacts_of_100_to_500_uv() -> None:
    subject = bare_subject(outlier_probability=0.06)
    meps = sweep_of_meps(subject, None, 10_000, seed=6)
    artefacts = meps[meps > 1e-6]
    assert len(artefacts) / len(meps) == pytest.approx(0.06, abs=4 * math.sqrt(0.06 * 0.94 / 10_000))
    assert_uniform(artefacts, 0.1, 0.5)


def log_gains(trials: int, seed: int) -> np.ndarray:
    subject = replace(bare_subject(drift=Drift()), response=GainResponse(NO_FLOOR, 1.0, ALMOST_NO_NOISE))
    return np.asarray(np.log(sweep_of_meps(subject, 1000.0, trials, seed)))


def test_drift_is_an_ar_1_walk() -> None:
    walk = log_gains(10_000, seed=7)[2:]
    persistence = float(walk[1:] @ walk[:-1] / (walk[:-1] @ walk[:-1]))
    assert persistence == pytest.approx(0.97, abs=4 * math.sqrt((1 - 0.97**2) / len(walk)))
    steps = walk[1:] - 0.97 * walk[:-1]
    assert steps.std() == pytest.approx(0.12, rel=4 / math.sqrt(2 * len(walk)))


def test_drift_starts_from_zero_with_larger_first_trials() -> None:
    first = np.array([log_gains(3, seed) for seed in range(1000)])
    spread = 0.12 * np.sqrt([1, 1 + 0.97**2, 1 + 0.97**2 + 0.97**4])
    np.testing.assert_allclose(first.mean(0), [0.29, 0.20, 0.0], atol=4 * spread.max() / math.sqrt(1000))
    np.testing.assert_allclose(first.std(0), spread, rtol=4 / math.sqrt(2 * 1000))


def input_noise(correlation: float, trials: int, seed: int) -> np.ndarray:
    curve = RecruitmentResponse(NO_FLOOR, 1.0, 0.30, 104.0, 0.0, 7.2, 0.0)
    subject = replace(bare_subject(input_correlation=correlation), response=curve)
    meps = sweep_of_meps(subject, None, trials, seed)
    return np.asarray((np.log(meps / (1 - meps)) / 0.30 + 14.0) / 7.2)


@pytest.mark.parametrize("correlation", [0.0, 0.2])
def test_input_noise_is_standard_normal_with_its_lag_1_correlation(correlation: float) -> None:
    z = input_noise(correlation, 10_000, seed=8)
    assert z.mean() == pytest.approx(0.0, abs=4 * math.sqrt((1 + correlation) / (1 - correlation) / 10_000))
    assert z.std() == pytest.approx(1.0, abs=0.035)
    assert np.corrcoef(z[1:], z[:-1])[0, 1] == pytest.approx(correlation, abs=0.04)


def test_input_noise_has_its_full_spread_from_the_first_trial_on() -> None:
    first = np.array([input_noise(0.2, 1, seed)[0] for seed in range(1000)])
    assert stats.kstest(first, stats.norm.cdf).pvalue > KS_LEVEL


@pytest.mark.parametrize("stimulus", [(100.0, "hit"), (100.0, "Valve"), (float("nan"), "valve")])
def test_a_stimulus_that_means_nothing_is_refused(stimulus: tuple[float, Any]) -> None:
    with pytest.raises(InvalidValueError):
        cohort("gaussian", 1, 0)[0].begin(0).respond(*stimulus)
