"""People in whose sessions something else than the ISI moves an MEP."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isiw.design import IMPACT_SPACE
from isiw.errors import InvalidValueError
from isiw.studies.sessions import SimulatedSession, simulate
from isiw.subjects import Change, EmgFloor, GainResponse, PeakProfile, SimulatedSubject, TapResponse
from isiw.subjects.cohorts import CHANGED, cohort
from known import known

PERSON = SimulatedSubject(
    PeakProfile(50.0, 80.0), GainResponse(EmgFloor(1e-9, 0.0), gain_mv=0.1, cv=1e-6), 180.0, hit_delay_sd_ms=0.0
)
BEST_MS = 90.0


def meps_mv(subject: SimulatedSubject, trials: int, isi_ms: float | None = BEST_MS) -> list[float]:
    responder = subject.begin(1)
    return [responder.respond(isi_ms, "impact").mep_mv for _ in range(trials)]


def test_a_step_multiplies_everything_that_is_evoked_from_its_trial_on() -> None:
    stepped = replace(PERSON, change=Change(3, 3, log_gain=np.log(4.0)))
    assert meps_mv(stepped, 5) == pytest.approx([0.1, 0.1, 0.4, 0.4, 0.4], rel=1e-4)


def test_a_ramp_is_log_linear_and_whole_at_its_last_trial() -> None:
    ramped = replace(PERSON, change=Change(1, 4, log_gain=np.log(16.0)))
    assert meps_mv(ramped, 5) == pytest.approx([0.2, 0.4, 0.8, 1.6, 1.6], rel=1e-4)


def test_a_step_of_the_level_leaves_the_true_window_as_it_is() -> None:
    stepped = replace(PERSON, change=Change(3, 3, log_gain=2.0))
    assert stepped.window(IMPACT_SPACE, 10) == PERSON.window(IMPACT_SPACE)


def test_a_moving_window_is_where_the_responses_are() -> None:
    moving = replace(PERSON, change=Change(5, 14, shift_ms=40.0))
    before, after = known(moving.window(IMPACT_SPACE, 4)), known(moving.window(IMPACT_SPACE, 14))
    assert (after.start_ms - before.start_ms, after.end_ms - before.end_ms) == (40.0, 40.0)
    assert meps_mv(moving, 30, BEST_MS + 40.0)[-1] == pytest.approx(0.1, rel=1e-4)


def test_a_fading_enhancement_halves_and_is_none_once_it_is_below_the_least() -> None:
    fading = replace(PERSON, change=Change(half_life=5.0))
    assert meps_mv(fading, 10)[4] == pytest.approx(0.05, rel=1e-4)
    assert fading.window(IMPACT_SPACE, 20) is not None
    assert fading.window(IMPACT_SPACE, 30) is None  # 0.1 mV × 2⁻⁶ is below 2 µV


def test_another_intensity_moves_the_baseline_of_a_recruitment_curve() -> None:
    person = cohort("recruitment", 1, 3)[0]
    up = replace(person, change=Change(1, 1, intensity_pct_rmt=20.0))
    assert np.mean(meps_mv(up, 100, None)) > 3 * np.mean(meps_mv(person, 100, None))


def test_another_intensity_needs_a_recruitment_curve() -> None:
    with pytest.raises(InvalidValueError, match="RecruitmentResponse"):
        replace(PERSON, change=Change(intensity_pct_rmt=5.0))


@pytest.mark.parametrize("change", [{"first": 5, "last": 4}, {"first": 0}, {"half_life": 0.0}, {"log_gain": np.nan}])
def test_a_change_that_cannot_be_is_refused(change: dict[str, float]) -> None:
    with pytest.raises(InvalidValueError):
        Change(**change)  # type: ignore[arg-type] # wrong on purpose


def test_the_tap_shows_in_the_mep_window_at_the_isis_at_which_it_falls_into_it() -> None:
    tap = TapResponse(start_ms=40.0, duration_ms=10.0, median_mv=0.2, log_sd=0.0)
    silent = GainResponse(EmgFloor(1e-9, 0.0), gain_mv=0.0, cv=1e-6)
    responder = replace(PERSON, response=silent, tap_response=tap).begin(1)
    told = {isi: responder.respond(isi, "impact").mep_mv for isi in (4.0, 20.0, 36.0)}
    assert told[20.0] == pytest.approx(0.2, rel=0.02)  # 35–55 ms after the hit hold all of it
    assert told[4.0] == told[36.0] == pytest.approx(0.0, abs=1e-6)
    assert responder.respond(None, "impact").mep_mv == pytest.approx(0.0, abs=1e-6)


def test_a_tap_alone_evokes_its_own_response_and_no_mep() -> None:
    tap = TapResponse(start_ms=100.0, duration_ms=20.0, median_mv=0.2, log_sd=0.0)
    responder = replace(PERSON, tap_response=tap).begin(1)
    assert responder.respond(BEST_MS, "impact", pulse=False).mep_mv == pytest.approx(0.2, rel=0.02)
    assert responder.respond(60.0, "impact", pulse=False).mep_mv == pytest.approx(0.0, abs=1e-6)


def test_a_mep_without_the_tap_in_its_window_keeps_its_amplitude() -> None:
    tap = TapResponse(start_ms=20.0, duration_ms=20.0, median_mv=0.2, log_sd=0.0)
    assert meps_mv(replace(PERSON, tap_response=tap), 3) == pytest.approx(meps_mv(PERSON, 3), rel=1e-4)


def test_coarse_amplitudes_are_multiples_of_their_step() -> None:
    coarse = replace(cohort("hand", 1, 3)[0], amplitude_step_mv=0.01)
    steps = np.array(meps_mv(coarse, 50)) / 0.01
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert len(set(steps.round())) > 3


@pytest.mark.parametrize("name", CHANGED)
def test_half_of_the_people_have_a_window(name: str) -> None:
    has = [subject.window(IMPACT_SPACE) is not None for subject in cohort(name, 20, 3)]
    assert has == [number % 2 == 0 for number in range(20)]


@pytest.mark.parametrize(
    ("name", "width_ms", "start_ms"), [("narrow-unstated", (15, 40), (5, 90)), ("wide-early", (200, 320), (-40, 20))]
)
def test_narrow_and_early_windows_are_uniform(
    name: str, width_ms: tuple[float, float], start_ms: tuple[float, float]
) -> None:
    profiles = [s.profile for s in cohort(name, 200, 3) if isinstance(s.profile, PeakProfile)]
    for values, (low, high) in (([p.width_ms for p in profiles], width_ms), ([p.start_ms for p in profiles], start_ms)):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < max(values) <= high


def test_above_the_threshold_tms_alone_already_gives_meps() -> None:
    people = (cohort(name, 40, 3) for name in ("above-threshold", "recruitment"))
    above, usual = (np.mean([subject.baseline_mv for subject in drawn]) for drawn in people)
    assert above > 3 * usual


@pytest.mark.slow
def test_a_study_judges_a_fading_window_by_that_of_now() -> None:
    people = cohort("fading", 40, 3)
    person = next(n for n in range(0, 40, 2) if known(known(people[n].change).half_life) < 20)
    session = SimulatedSession("random", "fading", person, seed=3, trials=120, marks=(1, 120))
    assert list(simulate(session)["true_window"]) == [True, False]
