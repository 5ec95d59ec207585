"""Bad data pause a session, and are told as bad."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.devices.protocol import CallbackDevice
from isiw.findings import Kind, Severity
from isiw.log.record import read_session
from isiw.plots.session import session_figure
from isiw.report import final_statement
from isiw.session import progress_row
from isiw.session.loop import Session
from isiw.session.resuming import resume
from isiw.session.rig import Safeguards
from isiw.signals import SignalLimits
from isiw.signals.watch import Watch
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus, Trial, TrialTable
from scripted import ScriptedDevice, scripted_strategy
from wrong_rigs import NAMED, SPACE, WRONG, rig

NEVER: dict[str, Any] = {"stop_width_ms": 0.001, "stop_expected_f1": 1.0, "stop_gain": 0.0, "stop_no_window": 1.0}
"""Settings of a strategy that stops for no finding."""


def strategy_for_rigs(max_trials: int = 20) -> Strategy:
    return make_strategy("default", SPACE, max_trials=max_trials, particles=200)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", WRONG)
def test_each_wrong_rig_is_named_within_four_trials_and_ends_in_no_finding(wrong: str, log: Path) -> None:
    rows: list[tuple[str, ...]] = []
    session = Session(
        rig(wrong), strategy_for_rigs(), log=log, on_trial=lambda update: rows.append(progress_row(update))
    )
    result = session.run()
    assert len(result.trials) <= 4
    assert not result.decision.stop
    assert NAMED[wrong] in result.decision.reason
    record = read_session(log)
    statement = final_statement(record)
    assert statement.startswith("Nothing was measured")
    assert NAMED[wrong] in statement
    assert "The tap enhances" not in statement
    assert "No window" not in statement
    assert record.events[-1].kind == "pause"
    assert {row[4] for row in rows} == {"–"}
    assert session_figure(record).axes[0].get_title(loc="left").startswith("Too little was measured")


def test_a_right_rig_runs_to_its_end(log: Path) -> None:
    result = Session(rig(), strategy_for_rigs(8), log=log).run()
    assert result.decision.stop
    assert read_session(log).events == ()


def tense(stimulus: Stimulus) -> Measurement:
    return Measurement(0.1, stimulus.isi_ms, background_rms_uv=2900.0)


def test_three_mistrials_in_a_row_pause_the_session_and_resuming_gives_three_more(log: Path) -> None:
    result = Session(ScriptedDevice(tense), scripted_strategy(20), log=log).run()
    assert len(result.trials) == 3
    assert result.decision.reason.startswith("The session is paused: Something was wrong in 3 trials in a row")
    assert "isiw resume" in final_statement(read_session(log))
    assert len(resume(log, ScriptedDevice(tense), scripted_strategy(20)).run().trials) == 6
    relaxed = resume(log, ScriptedDevice(), scripted_strategy(20)).run()
    assert relaxed.decision.reason == "The budget of 20 stimuli is used up."


def test_how_many_mistrials_pause_a_session_is_a_limit(log: Path, space: DesignSpace) -> None:
    limits = Limits.of_space(space, max_consecutive_mistrials=5)
    assert len(Session(ScriptedDevice(tense), scripted_strategy(20), log=log, limits=limits).run().trials) == 5


def test_mistrials_that_use_up_the_budget_are_no_finding(log: Path, space: DesignSpace) -> None:
    limits = Limits.of_space(space, max_consecutive_mistrials=20)
    Session(ScriptedDevice(tense), scripted_strategy(20), log=log, limits=limits).run()
    statement = final_statement(read_session(log))
    assert statement.startswith(
        "Nothing was measured: 20 of 20 trials were rejected (20 background activity; background EMG 2.9 mV RMS)."
    )
    assert "enhances" not in statement


def test_two_trials_are_too_few_to_speak_of_a_window(log: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(2), log=log).run()
    said = "Too little was measured to speak of a window: 2 pairs of stimuli count, of 2 trials.\n"
    assert final_statement(read_session(log)).startswith(said)


def test_an_isi_whose_trial_was_lost_is_asked_again_twice_and_then_another(log: Path, space: DesignSpace) -> None:
    device = ScriptedDevice(tense)
    limits = Limits.of_space(space, max_consecutive_mistrials=20)
    Session(device, scripted_strategy(9), log=log, limits=limits).run()
    asked = [stimulus.isi_ms for stimulus in device.delivered]
    assert [len(set(asked[k : k + 3])) for k in (0, 3, 6)] == [1, 1, 1]
    assert len(set(asked)) == 3
    assert [event.trial for event in read_session(log).events if event.kind == "fallback"] == [3, 4, 5, 6, 7, 8]


def test_a_resumed_session_has_lost_as_many_trials_as_before(log: Path) -> None:
    Session(ScriptedDevice(tense), scripted_strategy(20), log=log).run()
    device = ScriptedDevice(tense)
    resume(log, device, scripted_strategy(20)).run()
    assert device.delivered[0].isi_ms != read_session(log).table[2].commanded_isi_ms


def test_volts_are_no_trials(log: Path) -> None:
    result = Session(ScriptedDevice(lambda s: Measurement(2e-5, s.isi_ms)), scripted_strategy(20), log=log).run()
    assert {trial.reason for trial in result.trials} == {Kind.IMPLAUSIBLE}
    assert "Is it in V?" in result.decision.reason


def test_microvolts_pause_a_session_once(log: Path) -> None:
    device = ScriptedDevice(lambda s: Measurement(8.0 + s.trial, s.isi_ms))
    result = Session(device, scripted_strategy(9), log=log).run()
    assert len(result.trials) == 3
    assert "Are they in µV?" in result.decision.reason
    assert resume(log, device, scripted_strategy(9)).run().decision.stop


def test_a_stimulator_that_stops_firing_pauses_the_session(log: Path) -> None:
    device = ScriptedDevice(lambda s: Measurement(0.1 + 0.02 * s.trial if s.trial < 8 else 0.0, s.isi_ms))
    result = Session(device, make_strategy("random", particles=200, max_trials=60, **NEVER), log=log).run()
    assert len(result.trials) < 40
    assert "Does the stimulator still fire" in result.decision.reason


def late_trigger(stimulus: Stimulus) -> Sweep:
    """EMG whose trigger is 20 ms late: the MEP lies 45 to 50 ms after the pulse that is reported."""
    rng, since_ms = np.random.default_rng(stimulus.trial), np.arange(-600, 100, 0.2)
    turns = [np.exp(-0.5 * ((since_ms - at_ms) / 2) ** 2) for at_ms in (45.0, 50.0)]
    emg_mv = 0.0015 * rng.standard_normal(since_ms.size) + rng.uniform(0.05, 0.5) * (turns[0] - turns[1])
    hit_ms = None if stimulus.isi_ms is None else -stimulus.isi_ms
    return Sweep({"emg": Channel(emg_mv, 5000.0, "mV", t0_ms=-600.0)}, t_tms_ms=0.0, t_hit_ms=hit_ms)


@pytest.mark.slow
def test_an_mep_outside_its_window_pauses_the_session_once(log: Path) -> None:
    info = DeviceInfo("late", "impact", simulated=True, channels={"emg": "mV"})
    device = CallbackDevice(lambda stimulus, _: late_trigger(stimulus), info)
    result = Session(device, strategy_for_rigs(), log=log).run()
    assert len(result.trials) == 4
    assert "a response at about 47 ms after the pulse, outside the MEP window" in result.decision.reason
    assert "Doubt since trial 3: In 4 trials the EMG has a response" in final_statement(read_session(log))
    assert resume(log, device).run().decision.stop
    assert [event.kind for event in read_session(log).events].count("doubt") == 1


def early(isi_ms: float, commanded_ms: float) -> Trial:
    return Trial(0, Status.MISTRIAL, commanded_ms, Kind.TMS_BEFORE_IMPACT, isi_ms=isi_ms)


def test_what_a_person_was_asked_to_look_at_is_told_with_the_finding_though_the_session_went_on(log: Path) -> None:
    frozen = ScriptedDevice(lambda stimulus: Measurement(0.12, stimulus.isi_ms))
    going_on = Safeguards(on_pause=lambda _reason: True)
    Session(frozen, scripted_strategy(6), log=log, safeguards=going_on).run()
    record = read_session(log)
    assert [event.kind for event in record.events][:2] == ["doubt", "pause"]
    assert "Doubt since trial 3: The last 4 amplitudes are exactly equal" in final_statement(record)


@pytest.mark.parametrize(("isi_ms", "commanded_ms", "paused"), [(-2.0, 1.0, False), (-147.0, 20.0, True)])
def test_a_pulse_that_is_early_within_the_tolerance_is_nobodys_fault(
    isi_ms: float, commanded_ms: float, *, paused: bool
) -> None:
    watch = Watch(SPACE, SignalLimits(), max_in_a_row=3)
    for _ in range(3):
        watch = watch.after(early(isi_ms, commanded_ms), Measurement(0.02, isi_ms))
    assert (watch.pause is not None) is paused


def test_pulses_that_are_early_at_one_isi_for_ever_pause_the_session() -> None:
    watch = Watch(SPACE, SignalLimits(), max_in_a_row=3)
    alone = Trial(0, Status.ACCEPTED, None, mep_mv=0.1)
    for isi_ms in (0.0, 1.0):
        for time in range(1, 10):
            watch = watch.after(replace(alone, mep_mv=0.1 + time / 100), Measurement(0.1, None))
            watch = watch.after(early(-1.0, isi_ms), Measurement(0.02, -1.0))
            assert (watch.pause is not None) == (time == 9)
        assert watch.pause is not None
        assert watch.pause.kind is Kind.EARLY_AT_ONE_ISI
    assert watch.seen().after(early(-1.0, 1.0), Measurement(0.02, -1.0)).pause is None


def test_a_fault_of_trials_that_count_is_shown_once() -> None:
    watch = Watch(SPACE, SignalLimits(background_uv=1000.0), max_in_a_row=3)
    loud = [
        Trial(trial, Status.ACCEPTED, 40.0, isi_ms=40.0, mep_mv=0.1 + 0.01 * trial, background_rms_uv=900.0)
        for trial in range(9)
    ]
    answer = Measurement(0.1, 40.0, background_rms_uv=900.0)
    for trial in loud[:3]:
        watch = watch.after(trial, answer)
    assert watch.pause is not None
    assert (watch.pause.kind, watch.pause.severity) == (Kind.LOUD, Severity.PAUSE)
    watch = watch.seen()
    for trial in loud[3:]:
        watch = watch.after(trial, answer)
        assert watch.pause is None
    resumed = Watch(SPACE, watch.signals, max_in_a_row=3).resumed(TrialTable(()), watch.paused_for)
    for trial in loud[3:]:
        resumed = resumed.after(trial, answer)
        assert resumed.pause is None
    lost = Trial(0, Status.MISTRIAL, 40.0, Kind.ISI_OFF, isi_ms=90.0)
    for _ in range(3):
        watch = watch.after(lost, Measurement(0.1, 90.0))
    assert watch.pause is not None
    assert watch.pause.kind is Kind.ISI_OFF


def moving(stimulus: Stimulus) -> Sweep:
    """EMG of a person who moves half a second after the pulse, long after a small MEP."""
    rng, since_ms = np.random.default_rng(stimulus.trial), np.arange(-400.0, 900.0, 0.2)
    emg_mv = 0.002 * rng.standard_normal(since_ms.size)
    size_mv = 0.05 * np.exp(0.6 * rng.standard_normal())
    emg_mv += size_mv * np.sin(np.pi * (since_ms - 21) / 6) * ((since_ms > 21) & (since_ms < 33))
    for at_ms in 400 + 300 * rng.random(3):
        emg_mv += np.sin(2 * np.pi * (since_ms - at_ms) / 5) * ((since_ms > at_ms) & (since_ms < at_ms + 5))
    hit_ms = None if stimulus.isi_ms is None else -stimulus.isi_ms
    return Sweep({"emg": Channel(emg_mv, 5000.0, "mV", t0_ms=-400.0)}, t_tms_ms=0.0, t_hit_ms=hit_ms)


def firing_six_times(stimulus: Stimulus) -> Sweep:
    """EMG of a stimulator that fires six times only, whatever it reports."""
    rng, since_ms = np.random.default_rng(stimulus.trial), np.arange(-400.0, 100.0, 0.5)
    size_mv = 0.05 * np.exp(0.5 * rng.standard_normal()) if stimulus.trial < 6 else 0.0
    mep_mv = size_mv * np.sin(np.pi * (since_ms - 21) / 6) * ((since_ms > 21) & (since_ms < 33))
    emg = Channel(mep_mv + 0.002 * rng.standard_normal(since_ms.size), 2000.0, "mV", t0_ms=-400.0)
    return Sweep({"emg": emg}, t_tms_ms=0.0, t_hit_ms=None if stimulus.isi_ms is None else -stimulus.isi_ms)


def short_before_the_pulse(stimulus: Stimulus) -> Sweep:
    """EMG that begins 5 ms before the pulse."""
    sweep = moving(stimulus)
    emg = Channel(sweep.channels["emg"].values[1975:2475], 5000.0, "mV", t0_ms=-5.0)
    return replace(sweep, channels={"emg": emg})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("answer", "trials", "found"),
    [(moving, 8, []), (firing_six_times, 24, [Kind.STOPPED]), (short_before_the_pulse, 4, [Kind.TOO_LITTLE_REST])],
)
def test_what_is_wrong_with_a_rig_that_returns_sweeps_pauses_it_once_and_a_movement_does_not(
    answer: Callable[[Stimulus], Sweep], trials: int, found: list[Kind], log: Path
) -> None:
    info = DeviceInfo("own", "impact", simulated=True, channels={"emg": "mV"})
    device = CallbackDevice(lambda stimulus, _: answer(stimulus), info)
    going_on = Safeguards(on_pause=lambda _reason: True)
    strategy = make_strategy("even", DesignSpace(40, 280, reference="impact"), max_trials=trials, **NEVER)
    Session(device, strategy, log=log, safeguards=going_on).run()
    pauses = [event.finding for event in read_session(log).events if event.kind == "pause"]
    assert [kind for kind in pauses if kind is not None] == found
