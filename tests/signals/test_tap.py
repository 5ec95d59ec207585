"""The tap's own response: learnt from the EMG that shows it alone, and subtracted where the MEP window meets it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isiw.devices.robot.tapper import Tapper, TapperSettings, preset
from isiw.signals import judge, tap
from isiw.signals.tap import LONGER_MS, TapResponses
from isiw.subjects.changes import TapResponse
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus, Trial, TrialTable
from isiw.types import FloatArray
from isiw.window import Window
from known import known
from tapped import IMPACT, TapRig, reflex

LONG_MS = (310.0, 280.0, 250.0, 220.0, 300.0, 260.0)


@pytest.mark.slow
def test_without_a_response_to_the_tap_an_mep_keeps_its_amplitude_at_every_isi() -> None:
    rig = TapRig()
    rig.trials(LONG_MS)
    usual = np.median([known(trial.mep_mv) for trial in rig.trials([200.0] * 20)])
    for isi_ms in np.arange(0.0, 61.0, 5.0).tolist():
        told = rig.trials([isi_ms] * 12)
        assert np.median([known(trial.mep_mv) for trial in told]) == pytest.approx(usual, rel=0.05), isi_ms
        assert {trial.tap_mv for trial in told} == {0.0}


@pytest.mark.slow
@pytest.mark.parametrize("size_mv", [0.1, 0.3])
@pytest.mark.parametrize("isi_ms", [0.0, 10.0, 20.0, 30.0, 45.0])
def test_a_response_to_the_tap_is_not_told_as_an_mep(size_mv: float, isi_ms: float) -> None:
    rig = TapRig(reflex(size_mv))
    rig.trials(LONG_MS * 2)
    told = [rig.trial(isi_ms, 0.0) for _ in range(10)]
    above = [known(trial.mep_mv) - known(trial.tap_mv) - 0.01 for trial in told]
    assert np.mean(above) < max(0.01, 0.15 * size_mv)
    assert np.mean([abs(one) > 3 * trial.mep_sd_mv + 0.01 for one, trial in zip(above, told, strict=True)]) <= 0.1


def test_a_response_that_is_always_the_same_leaves_the_mep_as_it_is() -> None:
    rig = TapRig(reflex(0.3, log_sd=0.0))
    rig.trials(LONG_MS * 3)
    told = rig.trials([20.0] * 10)
    assert np.median([known(trial.mep_mv) for trial in told]) == pytest.approx(0.155, rel=0.06)
    assert told[0].mep_sd_mv < 0.06


@pytest.mark.parametrize("isi_ms", [25.0, 40.0, 50.0, 60.0])  # it begins within the MEP window, before, or ends in it
def test_a_response_is_subtracted_in_the_size_that_the_trial_shows_outside_its_mep_window(isi_ms: float) -> None:
    rig = TapRig(TapResponse(50.0, 50.0, 0.3, 0.5))
    for _ in range(6):
        rig.trial(None, pulse=False)
    told = [rig.trial(isi_ms, 0.05) for _ in range(20)]
    assert max(abs(known(trial.mep_mv) - 0.055) for trial in told) < 0.015
    assert max(known(trial.tap_mv) + trial.mep_sd_mv for trial in told) < 0.03


class TwoWaves(TapResponse):
    """A response whose second wave is of a size of its own."""

    def sample_mv(self, rng: np.random.Generator) -> float:
        first_mv, later_mv = super().sample_mv(rng), super().sample_mv(rng)
        self.__dict__["ratio"] = later_mv / first_mv
        return first_mv

    def course(self, after_hit_ms: FloatArray) -> FloatArray:
        later = TapResponse(self.start_ms + 20.0, self.duration_ms, 1.0, 0.0)
        return np.asarray(super().course(after_hit_ms) + self.__dict__["ratio"] * later.course(after_hit_ms))


def test_where_the_size_outside_the_mep_window_says_nothing_of_that_within_it_no_more_is_claimed_to_be_known() -> None:
    rig = TapRig(TwoWaves(30.0, 20.0, 0.3, 0.5))
    for _ in range(12):
        rig.trial(None, pulse=False)
    told = [rig.trial(36.0, 0.0) for _ in range(30)]
    left = [known(trial.mep_mv) - 0.01 for trial in told]
    assert np.mean(left) == pytest.approx(np.mean([known(trial.tap_mv) for trial in told]), rel=0.5)
    far = [abs(one - known(trial.tap_mv)) > 2 * trial.mep_sd_mv for one, trial in zip(left, told, strict=True)]
    assert np.mean(far) <= 0.1


def test_an_mep_that_lasts_longer_than_its_window_is_not_taken_for_the_response() -> None:
    class Late(TapRig):
        def deliver(self, stimulus: Stimulus, timeout_s: float = 1.0) -> Sweep:
            sweep = super().deliver(stimulus, timeout_s)
            emg = sweep.channels["emg"]
            since_ms = emg.t0_ms + np.arange(emg.values.size) * 1000 / emg.rate_hz - 33.0
            tail = 0.05 * np.where((since_ms > 0) & (since_ms < 12), np.sin(np.pi * since_ms / 12), 0)
            late = replace(emg, values=emg.values + (not stimulus.tap_alone) * tail)
            return replace(sweep, channels={"emg": late})

    rig = Late(TapResponse(50.0, 50.0, 0.1, 0.5))
    for _ in range(6):
        rig.trial(None, pulse=False)
    told = [rig.trial(40.0, 0.3) for _ in range(20)]
    assert np.median([known(trial.mep_mv) - known(trial.tap_mv) for trial in told]) == pytest.approx(0.3, abs=0.04)


def test_how_far_a_trial_is_known_depends_on_its_isi_and_not_on_its_amplitude() -> None:
    sizes = []
    for mep_mv in (0.0, 0.1, 1.0):  # with the same noise and the same response
        rig = TapRig(reflex(0.3))
        rig.trials(LONG_MS)
        trial = rig.trial(20.0, mep_mv)
        sizes.append((trial.tap_mv, trial.mep_sd_mv))
    assert sizes[0] == pytest.approx(sizes[1])
    assert sizes[0] == pytest.approx(sizes[2])
    assert known(rig.trial(200.0).tap_mv) == 0.0


def test_tms_alone_is_told_as_it_is() -> None:
    rig = TapRig(reflex(0.3))
    rig.trials(LONG_MS)
    alone = rig.trial(None)
    assert (alone.tap_mv, alone.mep_sd_mv) == (None, 0.0)
    assert alone.mep_mv == pytest.approx(0.155, rel=0.05)


def test_where_no_sweep_shows_the_response_nothing_is_subtracted() -> None:
    rig = TapRig(reflex(0.3))
    told = rig.trials([0.0, 10.0, 20.0, 30.0] * 3)
    assert {(trial.tap_mv, trial.mep_sd_mv) for trial in told} == {(None, 0.0)}


def test_three_taps_alone_show_it_all() -> None:
    rig = TapRig(reflex(0.3))
    for _ in range(3):
        rig.trial(None, pulse=False)
    assert known(rig.trial(20.0).tap_mv) > 0.03


def test_earlier_trials_are_corrected_when_the_course_is_known_and_when_twice_as_much_is() -> None:
    rig, trials, corrected_after = TapRig(reflex(0.3)), [], []
    for isi_ms in (10.0, 20.0, *LONG_MS, *LONG_MS):
        trials.append(rig.trial(isi_ms))
        rig.taps, others = rig.taps.corrected(trials)
        for other in others:
            trials[other.index] = other
            corrected_after.append((other.index, len(trials)))
    assert corrected_after[:2] == [(0, 5), (1, 5)]
    assert {after for _, after in corrected_after} <= {5, 8, 14}
    assert known(trials[1].mep_mv) - known(trials[1].tap_mv) < 0.25


def test_a_trial_of_a_long_session_is_corrected_without_a_look_at_all_courses_for_each_trial(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig, looked = TapRig(reflex(0.3)), 0
    worked_out = tap._left_of  # noqa: SLF001 - its calls are counted

    def counted(*given: Any) -> tap.Left:
        nonlocal looked
        looked += 1
        return worked_out(*given)

    monkeypatch.setattr(tap, "_left_of", counted)
    trials: list[Trial] = []
    for number in range(60):
        trials.append(rig.trial(20.0 if number % 2 else 300.0))
        rig.taps, _ = rig.taps.corrected(trials)
    assert 30 < looked < 60 * 3


def test_the_isis_that_would_show_what_is_not_known_within_a_window_are_longer_than_its_trials() -> None:
    rig, window = TapRig(reflex(0.3)), Window(10.0, 60.0)
    trials = TrialTable(tuple(rig.trials([20.0, 50.0, 90.0, 100.0])))
    assert rig.taps.shown_from_ms(window, trials) == 50.0 + 35.0 + LONGER_MS
    assert rig.taps.shown_from_ms(None, trials) is None
    tried = tuple(replace(trial, index=10 + n) for n, trial in enumerate(rig.trials([100.0] * 3)))
    assert rig.taps.shown_from_ms(window, TrialTable((*trials, *tried))) is None
    for trial in rig.trials(LONG_MS[:3]):
        trials = trials.appended(trial)
    assert rig.taps.shown_from_ms(window, trials) is None


def test_what_comes_after_all_responses_to_a_tap_is_known_to_have_none() -> None:
    rig = TapRig(reflex(0.3))
    trials = TrialTable(tuple(rig.trials([136.0, 150.0, 170.0])))
    assert [trial.tap_mv for trial in trials] == [0.0] * 3
    assert rig.taps.shown_from_ms(Window(100.0, 200.0), trials) is None


@pytest.mark.parametrize("isi_ms", [0.0, 1.0, 3.0, 15.0])
def test_an_electrical_pulse_is_known_by_its_own_times_and_nothing_is_blanked_for_a_tap(isi_ms: float) -> None:
    shock = TapResponse(-0.5, 12.0, 1.0, 0.1)  # its artefact and M-wave, over before any MEP
    rig = TapRig(shock)
    rig.trials(LONG_MS)
    told = rig.trials([isi_ms] * 12)
    assert np.median([known(trial.mep_mv) for trial in told]) == pytest.approx(0.155, rel=0.06)
    assert {trial.tap_mv for trial in told} == {0.0}


def test_a_late_response_to_an_electrical_pulse_is_subtracted_as_one_to_a_tap() -> None:
    rig = TapRig(TapResponse(28.0, 10.0, 0.3, 0.0))  # an H-reflex
    rig.trials(LONG_MS * 3)
    told = rig.trials([5.0] * 10)
    assert np.median([known(trial.mep_mv) for trial in told]) == pytest.approx(0.155, rel=0.1)


def test_a_rig_without_a_response_gets_no_correction() -> None:
    rig, trials = TapRig(), []
    for isi_ms in (10.0, 20.0, 0.0, *LONG_MS, *LONG_MS):
        trials.append(rig.trial(isi_ms))
        rig.taps, others = rig.taps.corrected(trials)
        assert not others


def test_a_trial_that_an_operator_excluded_is_not_corrected() -> None:
    rig = TapRig(reflex(0.3))
    raw = [rig.trial(20.0), *rig.trials(LONG_MS)]
    excluded = [replace(raw[0], excluded=True), *raw[1:]]
    assert [trial.index for trial in rig.taps.corrected(raw)[1]] == [0]
    assert not rig.taps.corrected(excluded)[1]


@pytest.mark.parametrize(("isi_ms", "name"), [(0.0, "subject1"), (5.0, "subject2"), (10.0, "subject1")])
def test_the_artefact_of_the_robots_tap_is_known(isi_ms: float, name: str) -> None:
    class Evoked:
        mep_mv = 0.0

    taps = TapResponses()
    robot = Tapper(lambda _: Evoked, replace(preset(name), artefact_mv=0.1), TapperSettings(), seed=3)
    told = []
    for trial in range(18):
        stimulus = Stimulus(trial, None, tap_alone=True) if trial < 6 else Stimulus(trial, isi_ms)
        sweep = robot.answer(stimulus)
        judged = judge(sweep, stimulus, IMPACT)
        taps = taps.after(judged, sweep)
        told.append(taps.measured(judged))
    pairs = [trial for trial in told[6:] if trial.counts]
    assert abs(np.mean([known(trial.mep_mv) - known(trial.tap_mv) for trial in pairs])) < 0.03


@pytest.mark.slow
@given(
    rate_hz=st.floats(500.0, 50_000.0),
    before_ms=st.floats(0.0, 400.0),
    after_ms=st.floats(0.0, 200.0),
    hit_ms=st.floats(-250.0, 60.0),
    t0_ms=st.floats(-1e4, 1e4),
)
@settings(max_examples=40, deadline=None)
def test_whatever_rate_length_and_offset_a_sweep_has_it_shows_something_or_nothing(
    rate_hz: float, before_ms: float, after_ms: float, hit_ms: float, t0_ms: float
) -> None:
    samples = max(2, int((before_ms + after_ms) * rate_hz / 1000))
    emg = Channel(0.002 * np.random.default_rng(0).standard_normal(samples), rate_hz, "mV", t0_ms=t0_ms)
    pulse_ms, taps = t0_ms + before_ms, TapResponses()
    for trial in range(4):
        stimulus = Stimulus(trial, -hit_ms)
        sweep = Sweep({"emg": emg}, t_tms_ms=pulse_ms, t_hit_ms=pulse_ms + hit_ms)
        judged = judge(sweep, stimulus, IMPACT)
        taps = taps.after(judged, sweep)
        assert taps.measured(judged).status == judged.status
        taps.corrected([judged])
