from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.devices.robot.tapper import Tapper, TapperSettings
from isiw.devices.robot.vane.rotation import Vane
from isiw.devices.robot.vane.tapper import draw_strokes
from isiw.devices.simulated import SimulatedDevice
from isiw.dissertation.repeatability import (
    STUDY_ISI_MS,
    RotationEvents,
    TimingStudy,
    error_probabilities,
    hit_delay_ms,
    study_emg,
    study_preset,
    study_session,
    study_sweeps,
    study_vane,
    timing_report,
)
from isiw.errors import InvalidValueError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.signals import TapEvents
from isiw.signals.impact import VALVE_MS
from isiw.sweeps import Sweep
from isiw.trials import Stimulus
from isiw.visit import VisitProtocol
from known import instance, known
from scripted import scripted_strategy

# Table 3.2 of the dissertation: mean and SD [ms from the trial's start], number of taps.
TABLE = {
    "bench": ({"fill": (523, 0), "descent": (621, 2), "hit": (688, 1), "away": (690, 1)}, 50),
    "subject1": ({"fill": (523, 0), "descent": (631, 5), "hit": (683, 4), "away": (698, 4), "memg": (701, 4)}, 538),
    "subject2": ({"fill": (523, 0), "descent": (626, 4), "hit": (672, 2), "away": (681, 2), "memg": (695, 2)}, 324),
    "subject3": ({"fill": (523, 0), "descent": (615, 2), "hit": (676, 1), "away": (693, 1), "memg": (695, 1)}, 252),
    "subject4": ({"fill": (523, 0), "descent": (629, 2), "hit": (682, 1), "away": (697, 1), "memg": (704, 2)}, 346),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLE)
def test_the_presets_reproduce_the_event_table_by_detection_on_their_waveforms(name: str) -> None:
    expected, taps = TABLE[name]
    table = study_preset(name, taps=taps, isi_ms=(), seed=1).event_table
    assert set(table.index) == set(expected)
    for event, (mean_ms, sd_ms) in expected.items():
        assert table.loc[event, "mean_ms"] == pytest.approx(mean_ms, abs=1.0), event
        assert table.loc[event, "sd_ms"] == pytest.approx(sd_ms, abs=1.0), event
        assert table.loc[event, "n"] == taps, event


SEEDS = [pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.long)]


@pytest.mark.parametrize("seed", SEEDS)
def test_the_gaussian_preset_has_the_pooled_isi_error_and_no_mistrials(seed: int) -> None:
    study = study_preset("cushion", seed=seed)
    assert len(study.commanded_ms) == 900
    assert study.pooled_sd_ms == pytest.approx(1.93, abs=0.3)
    assert study.error_table["mean_ms"].abs().max() <= 1.5
    assert study.mistrials == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_timing_fault_preset_has_negative_isis_at_10_ms_only(seed: int) -> None:
    table = study_preset("timing-fault", seed=seed).error_table
    assert table["mistrials"].loc[10.0] == pytest.approx(8, abs=5)
    assert (table.drop(10.0)["mistrials"] == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize(("person", "hit_ms"), [(7, 683), (8, 682), (9, 673), (10, 677), (11, 688)])
def test_the_later_people_are_hit_when_the_figure_says_and_vary_by_less_than_2_ms(person: int, hit_ms: float) -> None:
    hit = study_preset(f"subject{person}", taps=60, isi_ms=(), seed=1).event_table.loc["hit"]
    assert hit["mean_ms"] == pytest.approx(hit_ms, abs=1.0)
    assert hit["sd_ms"] < 2.0


@pytest.mark.slow
def test_jitter_of_the_pulse_adds_to_the_isi_error() -> None:
    study = study_preset("cushion", isi_ms=(50.0, 90.0), taps=150, seed=3, pulse_jitter_ms=6.0)
    assert study.pulse_table["sd_ms"].to_numpy() == pytest.approx([6.0, 6.0], rel=0.2)
    assert study.pooled_sd_ms == pytest.approx(np.hypot(1.93, 6.0), rel=0.15)


def test_without_jitter_the_pulse_does_not_vary_against_the_valve() -> None:
    assert study_preset("cushion", isi_ms=(50.0,), taps=20, seed=3).pulse_table["sd_ms"].tolist() == [0.0]


def test_a_negative_jitter_is_an_error() -> None:
    with pytest.raises(InvalidValueError):
        study_preset("cushion", taps=1, pulse_jitter_ms=-1.0)


def test_errors_are_counted_by_magnitude_without_the_mean_of_their_set() -> None:
    commanded = np.array([50.0, 50.0, 50.0, 90.0, 90.0, 90.0, 10.0])
    table = error_probabilities(commanded, commanded + np.array([7, 9, 8, -4.5, 4.5, 0, -30]), sd_ms=2.0)
    assert table["counted"].tolist() == pytest.approx([2 / 6, 2 / 6, 0, 0, 2 / 6])
    assert table["gaussian"].tolist() == pytest.approx([0.38292, 0.29976, 0.18370, 0.08811, 0.04550], abs=1e-5)


def test_without_an_sd_there_is_no_gaussian_but_a_count() -> None:
    table = error_probabilities(np.array([50.0]), np.array([51.0]), sd_ms=np.nan)
    assert table["gaussian"].isna().all()
    assert table["counted"].tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]


def test_the_text_has_errors_beyond_4_ms_as_often_as_its_sd_gives() -> None:
    table = error_probabilities(np.zeros(2), np.zeros(2), sd_ms=1.926)
    assert table["gaussian"].iloc[-1] == pytest.approx(0.0378, abs=1e-4)


def test_a_mistrial_counts_and_is_left_out_of_the_statistics() -> None:
    commanded = np.array([10.0, 10.0, 10.0, 10.0, np.nan])
    nothing = np.full(5, np.nan)
    events = TapEvents(nothing, nothing, nothing, nothing, nothing)
    table = TimingStudy("five taps", events, commanded, np.array([11.0, 9.5, -3.0, np.nan, 5.0])).error_table
    assert list(table.loc[10.0, ["n", "mean_ms", "mistrials"]]) == [2, pytest.approx(0.25), 2]


def test_an_event_that_was_never_found_is_not_in_the_table() -> None:
    nowhere = np.full(3, np.nan)
    events = TapEvents(nowhere, nowhere, np.array([680.0, 682.0, np.nan]), nowhere, nowhere)
    table = TimingStudy("three taps", events, nowhere, nowhere).event_table
    assert table.index.tolist() == ["hit"]
    assert table[["mean_ms", "low_ms", "high_ms", "n"]].to_numpy().tolist() == [[681.0, 680.0, 682.0, 2.0]]


@pytest.mark.slow
def test_the_pooled_sd_leaves_the_means_of_the_sets_out() -> None:
    study = study_preset("subject4", taps=50, isi_ms=(30.0, 60.0), seed=3)
    shifted = type(study)(
        "shifted", study.events, study.commanded_ms, study.realised_ms + np.where(study.commanded_ms > 40, 7.0, 0.0)
    )
    assert shifted.pooled_sd_ms == pytest.approx(study.pooled_sd_ms)


@pytest.mark.parametrize("lost", [(), (10.0,), (10.0, 20.0, 30.0)])
def test_an_isi_of_which_every_trial_is_lost_leaves_the_pooled_sd_as_it_is(lost: tuple[float, ...]) -> None:
    commanded = np.array([50.0, 50.0, 50.0, *lost])
    realised = np.array([49.0, 50.0, 51.0, *(-1.0 for _ in lost)])
    events = TapEvents(*(np.full(len(commanded), np.nan) for _ in range(5)))
    assert TimingStudy("hand-made", events, commanded, realised).pooled_sd_ms == pytest.approx(1.0)


class NoResponse:
    mep_mv = 0.0


@pytest.mark.slow
def test_recorded_sweeps_are_studied_like_a_preset() -> None:
    device = SimulatedDevice(Tapper(lambda _: NoResponse(), "subject4", TapperSettings(trigger="impact")))
    device.stage()
    sweeps = [instance(Sweep, device.deliver(Stimulus(trial, 50.0), 1.0)) for trial in range(30)]
    study = study_sweeps("thirty taps", sweeps, [50.0] * 30)
    assert study.event_table.loc["hit", "mean_ms"] == pytest.approx(682, abs=1.0)
    assert study.pooled_sd_ms < 0.1
    assert study.mistrials == 0


def test_each_sweep_of_a_study_has_its_isi() -> None:
    device = SimulatedDevice(Tapper(lambda _: NoResponse(), "subject4", TapperSettings(trigger="impact")))
    device.stage()
    sweeps = [instance(Sweep, device.deliver(Stimulus(trial, 50.0), 1.0)) for trial in range(3)]
    with pytest.raises(InvalidValueError, match="got 2; expected 3"):
        study_sweeps("three taps", sweeps, [50.0, 50.0])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["subject1", "subject2", "subject3", "subject4"])
def test_without_an_accelerometer_the_hit_is_found_in_the_emg_to_within_what_people_differ_by(name: str) -> None:
    robot = Tapper(lambda _: NoResponse(), name, TapperSettings(trigger="impact"))
    sweeps = [robot.answer(Stimulus(trial, 60.0)) for trial in range(20)]
    usual = study_sweeps("with", sweeps, [60.0] * 20)
    blind = [replace(sweep, channels={"emg": sweep.channels["emg"]}) for sweep in sweeps]
    study = study_emg("without", blind, [60.0] * 20)
    off_ms = instance(TapEvents, study.events).hit_ms - instance(TapEvents, usual.events).hit_ms
    assert abs(off_ms.mean()) < 1.5 * study.hit_sd_ms
    assert off_ms.std() < 2.0
    said = timing_report(study)
    assert "No acceleration: hits are 20.5 ms before the tap shows in the EMG" in said
    assert known(hit_delay_ms(study))[1] > known(hit_delay_ms(usual))[1]


def on_the_pulses_clock(sweep: Sweep) -> Sweep:
    """The same sweep on a clock that is zero at the magnetic pulse."""
    pulse_ms = known(sweep.t_tms_ms)
    channels = {name: replace(wave, t0_ms=wave.t0_ms - pulse_ms) for name, wave in sweep.channels.items()}
    return replace(sweep, channels=channels, t_valve_ms=known(sweep.t_valve_ms) - pulse_ms, t_tms_ms=0.0)


def test_a_sweep_clock_that_begins_elsewhere_changes_nothing() -> None:
    isi_ms = [20.0, 150.0] * 5
    robot = Tapper(lambda _: NoResponse(), "subject4", TapperSettings(trigger="impact"))
    sweeps = [robot.answer(Stimulus(trial, isi)) for trial, isi in enumerate(isi_ms)]
    usual = study_sweeps("ten taps", sweeps, isi_ms)
    other = study_sweeps("ten taps", [on_the_pulses_clock(sweep) for sweep in sweeps], isi_ms)
    for name, times in usual.events.columns().items():
        np.testing.assert_allclose(other.events.columns()[name], times, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(other.realised_ms, usual.realised_ms, atol=1e-9)
    assert usual.event_table.loc["hit", "mean_ms"] == pytest.approx(682, abs=2.0)


@pytest.mark.slow
def test_a_logged_session_is_studied_like_a_preset(tmp_path: Path) -> None:
    space = DesignSpace(0, 200, reference="impact")
    device = SimulatedDevice(Tapper(lambda _: NoResponse(), "subject4"))
    strategy = scripted_strategy(max_trials=12, space=space)
    result = Session(device, strategy, log=tmp_path / "taps.mcap", protocol=VisitProtocol(taps_first=0)).run()
    study = study_session(read_session(result.log))
    assert len(study.commanded_ms) == 12
    logged = [known(trial.t_hit_ms) for trial in result.trials]
    np.testing.assert_allclose(instance(TapEvents, study.events).hit_ms, logged, atol=0.01)
    apart = [known(trial.isi_ms) > 14 for trial in result.trials]  # sooner, the tap shows when the MEP does
    assert 0 < sum(apart) < 12
    assert study.event_table.loc["memg", "n"] == sum(apart)


@pytest.mark.slow
@pytest.mark.parametrize("fault", [0.0, np.nan])
@pytest.mark.parametrize("name", ["acceleration", "emg"])
def test_a_trial_with_a_dead_sensor_does_not_end_the_study(tmp_path: Path, name: str, fault: float) -> None:
    class Faulty(Tapper):
        def answer(self, stimulus: Stimulus) -> Sweep:
            sweep = super().answer(stimulus)
            if stimulus.trial != 1:
                return sweep
            dead = replace(sweep.channels[name], values=np.full_like(sweep.channels[name].values, fault))
            return replace(sweep, channels={**sweep.channels, name: dead})

    strategy = scripted_strategy(max_trials=4, space=DesignSpace(20, 200, reference="impact"))
    result = Session(
        SimulatedDevice(Faulty(lambda _: NoResponse(), "subject4")), strategy, log=tmp_path / "taps.mcap"
    ).run()
    study = study_session(read_session(result.log))
    event = "hit" if name == "acceleration" else "memg"
    assert np.isnan(study.events.columns()[event]).tolist() == [False, True, False, False]
    assert study.mistrials == (1 if name == "acceleration" else 0)
    assert "4 taps" in timing_report(study)


@pytest.mark.slow
def test_the_report_says_all_of_it() -> None:
    study = study_preset("cushion", taps=10, seed=4)
    report = timing_report(study)
    assert "90 taps" in report
    assert "in ms after the valve command:" in report
    assert "SD of 8.5 ms says how far the next person's may differ from it" in report
    assert "after the actuator's own valve opens:" in timing_report(study_vane(rotations=2))
    assert float(report.split("t_hit")[1].split()[0]) == pytest.approx(180.0, abs=2.0)
    assert f"{study.pooled_sd_ms:.2f} ms" in report
    assert all(f"\n{isi:7g}" in report for isi in STUDY_ISI_MS)


def test_what_is_not_known_is_no_number() -> None:
    study = study_preset("cushion", taps=1, seed=4)
    report = timing_report(study)
    assert "nan" not in report
    assert "No ISI has three accepted trials" in report


@pytest.mark.parametrize(("commanded_ms", "known"), [((50, 50, 60), False), ((50, 50, 60, 60), True)])
def test_one_isi_that_came_twice_has_no_sd(commanded_ms: tuple[float, ...], known: bool) -> None:  # noqa: FBT001
    commanded = np.array(commanded_ms, dtype=float)
    events = TapEvents(*(np.full(len(commanded), np.nan) for _ in range(5)))
    study = TimingStudy("hand-made", events, commanded, commanded + np.resize([1.0, -1.0], len(commanded)))
    assert study.error_table["sd_ms"].isna().all()
    assert ("Pooled SD of the ISI error: 1.41 ms" in timing_report(study)) == known
    assert ("the SD of the error is not known" in timing_report(study)) != known


def test_a_study_of_nothing_is_an_error() -> None:
    with pytest.raises(InvalidValueError, match="taps must be"):
        study_preset("bench", taps=0)
    with pytest.raises(InvalidValueError, match="time of the valve command; got 'nothing'"):
        study_sweeps("nothing", [], [])


def test_an_invalid_seed_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="seed"):
        study_preset("subject1", taps=1, seed=-1)


@pytest.mark.slow
def test_rotations_begin_within_a_few_milliseconds_of_each_other_and_end_within_a_second() -> None:
    study = study_vane(rotations=40, seed=3)
    table = study.event_table
    assert list(table.index) == ["fill", "motion", "end"]
    assert (table["n"] == 40).all()
    assert 500 + 22 < table["mean_ms"]["fill"] < table["mean_ms"]["motion"] < table["mean_ms"]["end"] < 1500
    assert 1 < table["sd_ms"]["motion"] < 10
    report = timing_report(study)
    assert "vane: 40 rotations" in report
    assert "hit_delay_ms" not in report
    strokes = draw_strokes(Vane(), 40, np.random.default_rng(3))
    assert isinstance(study.events, RotationEvents)
    found_ms = study.events.motion_ms - VALVE_MS
    turned = [np.interp(at, strokes.t_ms, angle) for at, angle in zip(found_ms, strokes.angle_rad, strict=True)]
    assert (found_ms > strokes.delay_ms).all()
    assert np.degrees(max(turned)) < 1.5  # what noise of 0.2° hides


@pytest.mark.parametrize(("rotations", "seed", "said"), [(0, 0, "rotations"), (10**6, 0, "rotations"), (1, -1, "seed")])
def test_a_study_of_rotations_that_cannot_be_is_refused(rotations: int, seed: int, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        study_vane(rotations=rotations, seed=seed)
