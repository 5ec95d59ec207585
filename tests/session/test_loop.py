from __future__ import annotations

import dataclasses
import math
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Never, cast

import numpy as np
import pytest

from isiw.design import IMPACT_SPACE, DesignSpace
from isiw.devices.clock import VirtualClock
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.errors import DeviceError, InvalidValueError, LimitExceededError, LogError, StrategyError
from isiw.findings import Kind
from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import EstimateRecord, Intent
from isiw.models.particles import ParticleModel
from isiw.session.loop import Session
from isiw.session.sink import SessionUpdate
from isiw.session.state import State
from isiw.signals import SignalLimits
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.recipe import Recipe
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus, Trial
from known import instance, known
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy, told_to


def run_failing(session: Session, error: type[BaseException]) -> tuple[SessionRecord, str]:
    with pytest.raises(error) as caught:
        session.run()
    return read_session(session.log_path), str(caught.value)


def test_a_session_runs_to_its_budget_and_logs_everything(log: Path) -> None:
    result = Session(ScriptedDevice(), scripted_strategy(6), log=log).run()
    record = read_session(log)
    assert len(result.trials) == len(record.table) == len(record.intents) == len(record.estimates) == 6
    assert record.table == result.trials
    assert result.decision.reason == "The budget of 6 stimuli is used up."
    assert record.decision == result.decision
    assert result.log == log
    assert record.finished
    assert record.losses == ()


def test_a_result_and_its_record_are_printed_in_a_few_lines(log: Path) -> None:
    result = Session(ScriptedDevice(), scripted_strategy(2), log=log, subject="P07").run()
    found = [str(result.estimate), "Ended: The budget of 2 stimuli is used up.", f"Log: {log}"]
    assert str(result).split("\n") == [*found[0].split("\n"), "Trials: 2 delivered, 2 told", *found[1:]]
    record = read_session(log)
    assert str(record).split("\n") == [
        f"Session of P07, {record.header.created}",
        "Strategy: of a user's own objects, seed 0, 0–200 ms after the valve command, every 1 ms",
        "Trials: 2 delivered, 2 told",
        *found[0].split("\n"),
        *found[1:],
    ]


def test_each_trial_is_logged_as_intent_then_trial_then_estimate(log: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(2), log=log).run()
    assert [type(entry) for entry in read_session(log).history] == [Intent, Trial, EstimateRecord] * 2


def test_the_intent_is_on_disk_before_the_device_is_called(log: Path) -> None:
    device = ScriptedDevice()

    def answer(stimulus: Stimulus) -> Measurement | Sweep:
        last = instance(Intent, read_session(log).history[-1])
        assert last == Intent.of(stimulus, last.t_s, boot_id=last.boot_id, boot_s=last.boot_s)
        return Measurement(0.1, stimulus.isi_ms)

    device.answer = answer
    Session(device, scripted_strategy(3), log=log).run()
    assert len(device.delivered) == 3


def test_what_is_reported_is_on_disk(log: Path) -> None:
    seen = []

    def on_trial(update: SessionUpdate) -> None:
        record = read_session(log)
        assert record.table[-1] == update.trial
        assert record.estimates[-1].next_isi_ms == update.next_isi_ms
        seen.append(update.stimuli_left)

    Session(ScriptedDevice(), scripted_strategy(4), log=log, on_trial=on_trial).run()
    assert seen == [3, 2, 1, 0]


def test_the_next_stimulus_is_the_announced_one(log: Path) -> None:
    device = ScriptedDevice()
    Session(device, scripted_strategy(6), log=log).run()
    announced = [estimate.next_isi_ms for estimate in read_session(log).estimates]
    assert announced == [stimulus.isi_ms for stimulus in device.delivered[1:]] + [None]


def test_the_header_tells_how_to_make_the_session_again(log: Path) -> None:
    session = Session(ScriptedDevice(), scripted_strategy(1, seed=9), log=log, subject="P1", config={"a": {"b": 1}})
    session.run()
    header = read_session(log).header
    assert (header.subject, header.seed, header.config) == ("P1", 9, {"a": {"b": 1}})
    assert header.space == session.strategy.space
    assert header.device.name == "scripted"
    assert {"python", "torch"} <= set(header.versions)


def session_with_detection_limits(
    device: ScriptedDevice, strategy: Strategy, log: Path, *, device_mv: float | None, strategy_mv: float | None
) -> Session:
    settings = {} if strategy_mv is None else {"detection_limit_mv": strategy_mv}
    strategy.recipe = Recipe("", 0, settings)
    device.info = dataclasses.replace(device.info, detection_limit_mv=device_mv)
    return Session(device, strategy, log=log)


def test_another_detection_limit_than_the_strategys_is_refused(log: Path) -> None:
    with pytest.raises(DeviceError, match=r"0.05 mV.*0.005 mV"):
        session_with_detection_limits(ScriptedDevice(), scripted_strategy(), log, device_mv=0.05, strategy_mv=0.005)
    assert not log.exists()


def test_another_detection_limit_than_that_of_a_model_of_ones_own_is_refused(log: Path) -> None:
    default, device = make_strategy("default", particles=50), ScriptedDevice()
    device.info = dataclasses.replace(device.info, reference="valve", detection_limit_mv=0.05)
    strategy = Strategy(default.space, ParticleModel(particles=50), default.acquisition, default.stopping)
    with pytest.raises(DeviceError, match=r"0.05 mV.*0.005 mV"):
        Session(device, strategy, log=log)


@pytest.mark.parametrize(("device_mv", "strategy_mv"), [(0.05, 0.05), (None, 0.005), (0.05, None)])
def test_the_same_or_an_unknown_detection_limit_is_accepted(
    log: Path, device_mv: float | None, strategy_mv: float | None
) -> None:
    limits = {"device_mv": device_mv, "strategy_mv": strategy_mv}
    assert session_with_detection_limits(ScriptedDevice(), scripted_strategy(2), log, **limits).run().decision.stop


def test_the_raw_sweeps_are_logged(log: Path) -> None:
    def answer(stimulus: Stimulus) -> Sweep:
        emg = 0.001 * np.random.default_rng(stimulus.trial).standard_normal(451)
        return Sweep({"emg": Channel(emg, 3000.0, "mV", -50.0)}, t_valve_ms=-known(stimulus.isi_ms), t_tms_ms=0.0)

    device = ScriptedDevice(answer)
    Session(device, scripted_strategy(2), log=log).run()
    record = read_session(log)
    for stimulus in device.delivered:
        expected = answer(stimulus).channels["emg"]
        np.testing.assert_array_equal(record.sweep(stimulus.trial)["emg"].values, expected.values)
        assert record.sweep(stimulus.trial)["emg"].t0_ms == -50.0


def test_a_simulated_session_does_not_sleep_through_its_intervals(log: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(4), log=log).run()
    assert [intent.t_s for intent in read_session(log).intents] == [5.0, 10.0, 15.0, 20.0]


def test_the_interval_between_trials_is_waited_for_before_the_first_one_too(log: Path, space: DesignSpace) -> None:
    limits = Limits.of_space(space, min_iti_s=7.5)
    device, clock = ScriptedDevice(simulated=False), FakeRealClock()
    Session(device, scripted_strategy(3), log=log, clock=clock, limits=limits).run()
    assert [intent.t_s for intent in read_session(log).intents] == [107.5, 115.0, 122.5]


def test_a_virtual_clock_is_refused_where_somebody_may_be_stimulated(log: Path) -> None:
    with pytest.raises(DeviceError, match=r"does not wait.*simulated=True"):
        Session(ScriptedDevice(simulated=False), scripted_strategy(3), log=log, clock=VirtualClock())


def test_the_limit_of_pulses_ends_the_session_and_is_logged(log: Path, space: DesignSpace) -> None:
    limits = Limits.of_space(space, max_pulses=3)
    result = Session(ScriptedDevice(), scripted_strategy(9), log=log, limits=limits).run()
    assert len(result.trials) == 3
    assert result.decision.reason == "The limit of 3 pulses is reached."
    record = read_session(log)
    assert [event.kind for event in record.events] == ["limit"]
    assert record.decision == result.decision


def test_an_isi_beyond_the_limits_is_never_delivered(log: Path) -> None:
    device = ScriptedDevice()
    record, message = run_failing(
        Session(device, scripted_strategy(9), log=log, limits=Limits(0.0, 1.0)), LimitExceededError
    )
    assert device.delivered == []
    assert record.intents == ()
    assert "beyond the limits" in message
    assert [event.kind for event in record.events] == ["limit"]
    assert record.finished


@pytest.mark.parametrize("press", [Session.pause, Session.end])
def test_what_is_paused_or_ended_before_it_is_armed_is_not_armed(log: Path, press: Callable[..., None]) -> None:
    device = ScriptedDevice()
    session = Session(device, scripted_strategy(), log=log)
    press(session, "Not yet.")
    assert not session.run().decision.stop
    assert "stage" not in device.calls
    assert session.state is State.ENDED


def test_the_device_is_always_stopped(log: Path) -> None:
    device = ScriptedDevice()
    Session(device, scripted_strategy(2), log=log).run()
    assert device.calls == ["stage", "stop", "unstage"]


@pytest.mark.parametrize("error", [DeviceError("coil too hot"), RuntimeError("cable"), KeyboardInterrupt()])
def test_a_device_that_fails_leaves_an_intact_log_and_is_stopped(log: Path, error: BaseException) -> None:
    def answer(stimulus: Stimulus) -> Measurement | Sweep:
        if stimulus.trial == 2:
            raise error
        return Measurement(0.1, stimulus.isi_ms)

    device = ScriptedDevice(answer)
    session = Session(device, scripted_strategy(), log=log)
    record, _ = run_failing(session, type(error))
    assert record.finished
    assert record.losses == ()
    assert [trial.status for trial in record.table] == [Status.ACCEPTED, Status.ACCEPTED, Status.MISTRIAL]
    assert record.table[2].reason is Kind.OUTCOME_UNKNOWN
    assert record.table[2].commanded_isi_ms == device.delivered[2].isi_ms
    kind = "pause" if isinstance(error, KeyboardInterrupt) else "fault"
    assert (record.events[-1].kind, record.events[-1].trial) == (kind, 2)
    assert device.calls == ["stage", "stop", "unstage"]
    assert len(told_to(session.strategy)) == 2


def test_an_impossible_amplitude_is_an_error_that_names_it(log: Path) -> None:
    mep_mv, device = -0.001, ScriptedDevice(lambda stimulus: Measurement(-0.001, stimulus.isi_ms))
    session = Session(device, scripted_strategy(), log=log)
    record, message = run_failing(session, InvalidValueError)
    assert "mep_mv" in message
    assert repr(mep_mv) in message
    assert record.table[0].reason is Kind.OUTCOME_UNKNOWN
    assert told_to(session.strategy) == ()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (None, "returned None;"),
        (0.1, "returned 0.1 (float);"),
        ((50.0, 0.1), "returned (50.0, 0.1) (tuple);"),
        ([0.1] * 999, "… (list);"),
    ],
)
def test_an_answer_of_another_type_is_an_error_that_shows_it_shortly(log: Path, answer: object, words: str) -> None:
    _, message = run_failing(Session(ScriptedDevice(lambda _: answer), scripted_strategy(), log=log), DeviceError)
    assert words in message
    assert "expected an isiw.Sweep or an isiw.Measurement" in message
    assert len(message) < 400


def test_an_answer_to_another_kind_of_trial_is_an_error(log: Path) -> None:
    _, message = run_failing(
        Session(ScriptedDevice(lambda _: Measurement(0.1, None)), scripted_strategy(), log=log), DeviceError
    )
    assert "another kind of trial" in message


def test_an_isi_that_is_off_is_a_mistrial_and_asked_again(log: Path) -> None:
    def answer(stimulus: Stimulus) -> Measurement | Sweep:
        off_ms = 10.1 if stimulus.trial == 1 else 9.9
        return Measurement(0.1, known(stimulus.isi_ms) + off_ms)

    device = ScriptedDevice(answer)
    session = Session(device, scripted_strategy(3), log=log)
    session.run()
    record = read_session(log)
    assert record.table[1].reason is Kind.ISI_OFF
    assert device.delivered[1].isi_ms == device.delivered[2].isi_ms
    assert len(told_to(session.strategy)) == 2


def test_an_active_muscle_is_a_mistrial(log: Path) -> None:
    device = ScriptedDevice(lambda stimulus: Measurement(0.1, stimulus.isi_ms, background_rms_uv=10.5))
    result = Session(device, scripted_strategy(3), log=log).run()
    assert {trial.reason for trial in result.trials} == {Kind.BACKGROUND_ACTIVITY}
    assert {trial.told for trial in result.trials} == {False}
    assert result.decision.reason == "The budget of 3 stimuli is used up."


def test_a_device_that_measures_keeps_the_sessions_limits(log: Path) -> None:
    device = ScriptedDevice(lambda stimulus: Measurement(0.1, known(stimulus.isi_ms) + 3.0))
    result = Session(device, scripted_strategy(2), log=log, signals=SignalLimits(isi_tolerance_ms=2.0)).run()
    assert {trial.reason for trial in result.trials} == {Kind.ISI_OFF}


def test_an_error_of_the_observer_ends_the_session_with_an_intact_log(log: Path) -> None:
    def on_trial(update: SessionUpdate) -> Never:
        raise ZeroDivisionError(update)

    device = ScriptedDevice()
    record, _ = run_failing(Session(device, scripted_strategy(), log=log, on_trial=on_trial), ZeroDivisionError)
    assert len(record.table.told) == 1
    assert record.finished
    assert device.calls == ["stage", "stop", "unstage"]


@pytest.mark.parametrize(("device_s", "space_s"), [("impact", "valve"), ("valve", "impact")])
def test_a_device_on_another_reference_is_refused_and_the_space_is_to_be_given_the_devices(
    log: Path, device_s: Any, space_s: Any
) -> None:
    device, strategy = ScriptedDevice(), scripted_strategy(space=dataclasses.replace(IMPACT_SPACE, reference=space_s))
    object.__setattr__(device.info, "reference", device_s)
    with pytest.raises(DeviceError, match=rf'different events.*reference = "{device_s}"'):
        Session(device, strategy, log=log)


@pytest.mark.parametrize("settings", [{}, {"conditioning": "electrical"}])
def test_a_strategy_is_told_of_a_devices_electrical_pulse_or_refused(log: Path, settings: dict[str, Any]) -> None:
    device = ScriptedDevice()
    device.info = DeviceInfo("stimulator", "impact", simulated=True, conditioning="electrical")
    strategy = make_strategy(space=IMPACT_SPACE, particles=50, **settings)
    refused = pytest.raises(DeviceError, match=r'make_strategy\(..., conditioning="electrical"\)')
    with nullcontext() if settings else refused:
        Session(device, strategy, log=log)


def test_an_existing_log_stops_the_session_before_anything_is_delivered(log: Path) -> None:
    log.write_bytes(b"precious")
    device = ScriptedDevice()
    with pytest.raises(LogError, match="never overwritten"):
        Session(device, scripted_strategy(), log=log).run()
    assert device.delivered == []
    assert log.read_bytes() == b"precious"


def test_without_a_writable_log_nothing_is_delivered(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = ScriptedDevice()

    def answer(stimulus: Stimulus) -> Measurement | Sweep:
        def full(_: int) -> Never:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "fsync", full)
        return Measurement(0.1, stimulus.isi_ms)

    device.answer = answer
    with pytest.raises(LogError, match="No space left"):
        Session(device, scripted_strategy(), log=log).run()
    monkeypatch.undo()
    assert len(device.delivered) == 1
    assert device.calls == ["stage", "stop", "unstage"]
    assert len(read_session(log).intents) == 1


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
# Where it comes while a weak reference is cleared, Python prints it and goes on; the session ends all the same.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("delay_s", [0.005, 0.05, 0.12, 0.2])
def test_ctrl_c_at_any_time_leaves_an_intact_log(log: Path, delay_s: float) -> None:
    def interrupt() -> None:
        time.sleep(delay_s)
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Thread(target=interrupt)

    device = ScriptedDevice()
    formula = device.answer

    def answer(stimulus: Stimulus) -> object:
        # From the first stimulus on: before it, where nothing was delivered, a session ends without a log, too.
        if timer.ident is None:
            timer.start()
        return formula(stimulus)

    device.answer = answer
    session = Session(
        device, scripted_strategy(100_000), log=log, limits=Limits(0, 200, min_iti_s=0.0, max_pulses=100_000)
    )
    with pytest.raises(KeyboardInterrupt):
        session.run()
    timer.join()
    record = read_session(log)
    assert record.finished
    assert record.losses == ()
    assert record.unknown == ()
    # An interrupt between the intent and the device counts as a stimulus, although none was delivered.
    assert len(record.table) - len(device.delivered) in {0, 1}
    assert record.events[-1].text == "Interrupted by the operator."
    assert device.calls[-2:] == ["stop", "unstage"]


def test_a_strategy_that_knows_of_other_trials_is_refused_before_anything_is_delivered(
    log: Path, tmp_path: Path
) -> None:
    strategy, device = scripted_strategy(3), ScriptedDevice()
    Session(ScriptedDevice(), strategy, log=tmp_path / "another.mcap").run()
    with pytest.raises(StrategyError, match=r"got '3 trials'.* 0 .*restarted"):
        Session(device, strategy, log=log).run()
    assert not device.delivered
    assert not list(tmp_path.glob("s.mcap*"))
    assert len(Session(device, strategy.restarted(), log=log).run().trials) == 3


WRONG_TIMES: tuple[dict[str, Any], ...] = (
    *({"timeout_s": wrong} for wrong in (0.0, math.nan, 30_000, True)),
    {"ask_deadline_s": -1.0},
)


@pytest.mark.parametrize("times", WRONG_TIMES)
def test_invalid_times_are_refused(log: Path, times: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"timeout_s|deadline_s"):
        Session(ScriptedDevice(), scripted_strategy(3), log=log, **times)


@pytest.mark.parametrize("channels", [{"emg": "microvolt"}, {"event": "mV"}])
def test_channels_that_cannot_be_judged_or_logged_are_refused_before_anything_is_delivered(
    log: Path, monkeypatch: pytest.MonkeyPatch, channels: dict[str, str]
) -> None:
    device = ScriptedDevice()
    info = dataclasses.replace(device.describe(), channels=channels)
    monkeypatch.setattr(device, "describe", lambda: info)
    with pytest.raises(InvalidValueError, match=r"unit of the channel|this name"):
        Session(device, scripted_strategy(3), log=log)


def test_numbers_of_numpy_are_numbers(space: DesignSpace, log: Path) -> None:
    seed, low_ms, pulses = cast("tuple[int, int, int]", (np.int64(3), np.int64(0), np.int64(2)))
    high_ms, iti_s = cast("tuple[float, float]", (np.float32(space.high_ms), np.float32(5)))
    strategy = make_strategy("even", space, seed, max_trials=np.int64(2), particles=np.int64(64))
    limits = Limits(low_ms, high_ms, min_iti_s=iti_s, max_pulses=pulses)
    result = Session(ScriptedDevice(), strategy, log=log, limits=limits).run()
    assert len(result.trials) == 2
    assert read_session(log).header.strategy.settings["particles"] == 64


def test_to_run_a_session_again_that_failed_says_how_to_go_on(log: Path) -> None:
    def answer(stimulus: Stimulus) -> Never:
        raise DeviceError(f"unplugged at {stimulus}")

    session = Session(ScriptedDevice(answer), scripted_strategy(3), log=log)
    run_failing(session, DeviceError)
    assert "isiw resume" in run_failing(session, LogError)[1]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"subject": 7}, 'subject must be a text.*"7"'),
        ({"log": None}, "needs a log"),
        ({"limits": (0, 320)}, r"limits.*isiw\.Limits"),
        ({"protocol": {"iti_s": (5, 8)}}, r"protocol.*isiw\.VisitProtocol"),
        ({"visit": {"day": 1}}, r"visit.*isiw\.Visit"),
        ({"strategy": "default"}, r"strategy.*isiw\.Strategy"),
        ({"device": None}, r"device.*isiw\.Device"),
    ],
)
def test_a_part_that_is_something_else_is_refused_in_words(log: Path, wrong: dict[str, Any], said: str) -> None:
    parts: dict[str, Any] = {"device": ScriptedDevice(), "strategy": scripted_strategy(), "log": log} | wrong
    with pytest.raises(InvalidValueError, match=said):
        Session(parts.pop("device"), parts.pop("strategy"), **parts)
