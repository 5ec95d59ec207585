"""The recorded sweep: what it holds, and what it shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.reduction.recorded import BASELINES, SWEPT, alone_at_rmt_mv, record, stops_inside

from isiw.subjects.cohorts import cohort
from isiw.subjects.responses import EmgFloor, GainResponse, PeakProfile, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.window import Window
from known import instance, known

CLEAR = SimulatedSubject(
    profile=PeakProfile(50.0, 100.0),
    response=GainResponse(EmgFloor(0.005, 0.05), gain_mv=0.3, cv=0.02),
    hit_delay_ms=180.0,
    hit_delay_sd_ms=0.0,
)
SWEEP = record(CLEAR, seed=1)


def test_ten_trials_are_kept_of_twelve_at_each_five_milliseconds() -> None:
    assert SWEEP.trials_mv.shape == (139, 12)
    assert SWEEP.kept_mv.tolist() == SWEEP.trials_mv[:, 2:].tolist()
    assert np.unique(np.diff(SWEEP.isi_ms)).tolist() == [5.0]
    assert (SWEPT.low_ms, SWEPT.high_ms, len(SWEEP.measured_mv)) == (0.0, 500.0, 101)


def test_isis_count_from_the_valve_command_so_that_the_peak_lies_behind_the_hit() -> None:
    assert SWEPT.grid_ms[SWEEP.measured_mv.argmax()] == pytest.approx(180 + 100, abs=5)


def test_without_noise_the_measured_window_by_the_share_is_the_true_one() -> None:
    true, measured = SWEEP.windows["true"], SWEEP.windows["measured, .135"]
    assert true == Window(230.0, 330.0)
    assert measured is not None
    assert (measured.start_ms, measured.end_ms) == pytest.approx((230.0, 330.0), abs=5)


def test_a_non_responder_shows_no_window() -> None:
    nobody = replace(CLEAR, response=GainResponse(EmgFloor(0.01, 0.3), gain_mv=0.0, cv=0.5))
    nonresponder = record(nobody, seed=2)
    over_either = dict.fromkeys(("measured, 100 % RMT", "measured, 90 % RMT"))
    assert nonresponder.windows == {"true": None, "measured, .135": None, **over_either}
    assert nonresponder.sweep().terminated == nonresponder.sweep().trials == 1212


def test_a_sweep_ends_when_the_window_was_passed_and_sooner_the_later_it_begins() -> None:
    whole, near = SWEEP.sweep(), SWEEP.sweep(205.0)
    assert whole.terminated < whole.trials == 1212
    assert near.terminated == whole.terminated - 12 * 41


def test_above_tms_alone_at_rmt_the_window_is_narrower_and_its_noise_takes_nothing_from_the_sweep() -> None:
    person = cohort("kim11-measured", 7, 0)[6]
    sweep = record(person, 3)
    at_rmt, at_90 = (known(sweep.windows[f"measured, {baseline}"]) for baseline in BASELINES)
    assert at_90.start_ms < at_rmt.start_ms < at_rmt.end_ms < at_90.end_ms
    assert at_rmt.width_ms == pytest.approx(220, abs=22)
    assert sweep.alone_mv["100 % RMT"].mean() > 2 * sweep.alone_mv["90 % RMT"].mean()
    silent = replace(person, response=replace(instance(RecruitmentResponse, person.response), boost_pct_rmt=0.0))
    assert np.array_equal(record(silent, 3).alone_mv["90 % RMT"], sweep.alone_mv["90 % RMT"])


def test_people_without_a_recruitment_curve_know_no_intensity() -> None:
    assert alone_at_rmt_mv(CLEAR, 1) is None
    assert SWEEP.windows["measured, 100 % RMT"] == SWEEP.windows["measured, 90 % RMT"]


def test_stops_inside_count_both_ends() -> None:
    assert stops_inside(Window(100.0, 200.0)) == 21
    assert stops_inside(None) == 0


@pytest.mark.slow
def test_the_same_seed_records_the_same_sweep() -> None:
    assert np.array_equal(record(CLEAR, 5).trials_mv, record(CLEAR, 5).trials_mv)
    assert not np.array_equal(record(CLEAR, 5).trials_mv, record(CLEAR, 6).trials_mv)
