"""Sessions: what is searched, what answers, and how a method is judged."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from benchmarks.reduction.readings import LIVE, Reading
from benchmarks.reduction.recorded import SWEPT
from benchmarks.reduction.sessions import (
    Range,
    Session,
    answers,
    correlation,
    play,
    profile_mv,
    recorded_person,
    run,
    searched,
)

from isiw.estimate import WindowEstimate
from isiw.strategy.strategy import Strategy
from isiw.window import Window

BARE = Session("nr", "gaussian", 0, 3)
HIT = replace(BARE, accelerometer=True)
SWEEP = recorded_person("gaussian", 0, 3)


def test_without_accelerometer_500_ms_from_the_valve_command_are_searched() -> None:
    where = searched(BARE, 182.0)
    assert (where.space.low_ms, where.space.high_ms, where.space.step_ms, where.offset_ms) == (0.0, 500.0, 5.0, 0.0)


@pytest.mark.parametrize(("end", "length_ms"), [("valve", 320.0), ("hit", 500.0)])
def test_with_accelerometer_the_range_begins_at_the_impact(end: Literal["valve", "hit"], length_ms: float) -> None:
    where = searched(replace(HIT, reading=Reading(range_end=end)), 182.0)
    assert where.space.reference == "impact"
    assert (where.space.low_ms, where.space.high_ms, where.offset_ms) == (0.0, length_ms, 180.0)
    assert where.from_valve(Window(20.0, 90.0)) == Window(200.0, 270.0)


def test_an_observation_is_one_of_the_ten_recorded_trials_there_or_their_mean() -> None:
    isi_ms, stop = 250.0, SWEEP.index(250.0)
    one, mean = answers(BARE, SWEEP, 0.0), answers(replace(BARE, reading=Reading("mean")), SWEEP, 0.0)
    drawn = {one(isi_ms)[1] for _ in range(60)}
    assert len(drawn) > 3
    assert drawn <= set(SWEEP.kept_mv[stop].tolist())
    assert mean(isi_ms) == pytest.approx((isi_ms, SWEEP.kept_mv[stop].mean()))


def test_with_accelerometer_the_same_trials_are_drawn_from_the_impact_on() -> None:
    mean = answers(replace(HIT, reading=Reading("mean")), SWEEP, 180.0)
    assert mean(70.0) == pytest.approx((70.0, SWEEP.kept_mv[SWEEP.index(250.0)].mean()))


def test_zero_outside_silences_all_but_the_measured_window() -> None:
    window = SWEEP.windows["measured, 100 % RMT"]
    assert window is not None
    answer = answers(replace(BARE, reading=Reading(outside="zero")), SWEEP, 0.0)
    heard = np.array([answer(isi)[1] > 0 for isi in SWEPT.grid_ms.tolist()])
    assert np.array_equal(heard, window.mask(SWEPT.grid_ms))
    assert answer(600.0)[1] == 0.0


def test_a_live_trial_is_of_the_person_and_of_no_record() -> None:
    answer = answers(replace(BARE, reading=LIVE), SWEEP, 0.0)
    assert answer(250.0)[1] not in SWEEP.trials_mv


def test_a_profile_is_compared_where_the_sweep_was_whatever_its_isis_count_from() -> None:
    grid_ms = np.arange(0.0, 321.0)
    hill = np.exp(-0.5 * ((grid_ms - 70.0) / 25.0) ** 2)
    estimate = WindowEstimate(None, None, grid_ms=grid_ms, profile_quantiles_mv=np.stack((hill, hill, hill)))
    profile = profile_mv(estimate, Range(SWEPT, 180.0))
    assert profile is not None
    assert SWEPT.grid_ms[profile.argmax()] == 250.0
    assert profile_mv(WindowEstimate(None, None), Range(SWEPT, 0.0)) is None


def test_profiles_that_are_missing_or_flat_do_not_break_the_correlation() -> None:
    rising = np.arange(5.0)
    assert np.isnan(correlation(None, rising))
    assert correlation(np.ones(5), rising) == 0.0
    assert correlation(2 * rising + 1, rising) == pytest.approx(1.0)


@pytest.mark.slow
def test_a_session_can_be_run_again_and_tells_when_it_stopped() -> None:
    session = replace(BARE, horizon=12)
    first = run(session)
    assert first == run(session)
    assert len(first["f1_by_trial"]) == len(first["f1_measured_by_trial"]) == 12
    assert first["f1 before, true"] == 0.0
    assert 6 + 4 <= first["trials"] <= 105
    assert first["converged"]


def test_a_particle_filter_tells_its_spread_after_each_generation() -> None:
    outcome = run(Session("pf", "gaussian", 0, 3, horizon=90, settings=(("particles", 30),)))
    assert len(outcome["spread_ms"]) >= 4
    assert outcome["spread_ms"][-1] < outcome["spread_ms"][0]


def test_two_gaussians_tell_two_amplitudes() -> None:
    # Without noise; its stopping rule ends the session after eleven trials, and the lower peak is still 16 % off.
    peaks_mv = [mv * np.exp(-0.5 * ((SWEEP.isi_ms - at_ms) / 15) ** 2) for mv, at_ms in ((0.03, 330), (0.08, 230))]
    clean = replace(SWEEP, trials_mv=np.repeat(0.01 + np.sum(peaks_mv, axis=0)[:, None], 12, axis=1))
    assert play(replace(BARE, method="nr2"), clean)["amplitudes_mv"] == pytest.approx((0.08, 0.03), rel=0.2)
    assert len(play(BARE, clean)["amplitudes_mv"]) == 1


def test_the_conventional_sweep_is_judged_by_the_true_window() -> None:
    outcome = run(replace(BARE, method="incremental"))
    assert outcome["near"] < outcome["trials"] <= outcome["whole"] == 1212
    assert 0.5 < outcome["f1, of .135"] <= 1.0


@pytest.mark.slow
def test_a_live_pulse_before_the_impact_is_counted_and_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    reported_ms: list[float] = []
    usual = Strategy.tell

    def tell(strategy: Strategy, isi_ms: float, mep_mv: float) -> None:
        reported_ms.append(isi_ms)
        usual(strategy, isi_ms, mep_mv)

    monkeypatch.setattr(Strategy, "tell", tell)
    sessions = [Session("nr", "gaussian", person, 3, LIVE, accelerometer=True, horizon=8) for person in range(4)]
    delivered = sum(play(one, recorded_person("gaussian", one.person, 3))["trials"] for one in sessions)
    assert min(reported_ms) >= 0
    assert len(reported_ms) < delivered  # NR asks 0 ms first, where every second pulse comes too early
