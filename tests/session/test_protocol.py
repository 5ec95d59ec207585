"""The protocol of a visit in a session: intervals, blocks and rests, control trials, and what is noted."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import isiw
from isiw import schedule
from isiw.design import DesignSpace
from isiw.devices.clock import VirtualClock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device
from isiw.errors import DeviceError, InvalidValueError
from isiw.findings import Kind
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.resuming import open_session, resume
from isiw.session.sink import SessionUpdate
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus
from isiw.visit import Control, Visit, VisitProtocol
from scripted import ALONE_MS, FakeRealClock, ScriptedDevice, scripted_strategy, told_to

MIXED = VisitProtocol(iti_s=(5.0, 8.0), tms_alone=0.2, tap_alone=0.1, block_trials=12, rest_s=120.0)


class KilledHereError(Exception):
    pass


def device(*, simulated: bool = True) -> ScriptedDevice:
    scripted = ScriptedDevice(simulated=simulated)
    scripted.info = dataclasses.replace(scripted.info, tap_alone=True)
    return scripted


def session(log: Path, protocol: VisitProtocol = MIXED, trials: int = 30) -> Session:
    return Session(device(), scripted_strategy(trials, seed=5), log=log, protocol=protocol)


def given(log: Path) -> list[tuple[float | None, bool]]:
    return [(intent.isi_ms, intent.tap_alone) for intent in read_session(log).intents]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a session in which all went well."""
    log = tmp_path_factory.mktemp("undisturbed") / "s.mcap"
    session(log).run()
    return log


def test_intervals_and_rests_are_those_of_the_protocol(undisturbed: Path) -> None:
    t_s = [intent.t_s for intent in read_session(undisturbed).intents]
    gaps = [after - before for before, after in pairwise(t_s)]
    wanted = [schedule.interval_s(MIXED, trial, 5) for trial in range(1, len(t_s))]
    assert gaps == pytest.approx(wanted)
    assert gaps[11] == pytest.approx(120.0)


def test_the_limits_are_a_floor_that_no_protocol_passes(log: Path) -> None:
    limits = Limits.of_space(scripted_strategy().space, min_iti_s=20.0, max_pulses=25)
    protocol = VisitProtocol(iti_s=(5.0, 21.0), tms_alone=0.3, tap_alone=0.2, block_trials=5, rest_s=22.0)
    result = Session(device(), scripted_strategy(30), log=log, limits=limits, protocol=protocol).run()
    t_s = [intent.t_s for intent in read_session(log).intents]
    assert len(t_s) == len(result.trials) == 25
    assert result.decision.reason == "The limit of 25 pulses is reached."
    assert min(after - before for before, after in pairwise(t_s)) >= 20.0


def test_controls_come_where_the_protocol_says_with_their_intents_first(log: Path) -> None:
    result = session(log).run()
    record = read_session(log)
    assert [intent.trial for intent in record.intents] == list(range(len(result.trials)))
    for trial, (isi_ms, tap_alone) in zip(result.trials, given(log), strict=True):
        control = schedule.control(MIXED, trial.index, 5)
        assert (isi_ms is None, tap_alone) == (control is not None, control is Control.TAP_ALONE)
        assert (trial.commanded_isi_ms, trial.tap_alone) == (isi_ms, tap_alone)
        assert trial.told is (control is not Control.TAP_ALONE)
    assert record.table == result.trials


def test_controls_use_up_no_budget_and_tms_alone_is_learnt(log: Path) -> None:
    left: list[int] = []
    result = Session(
        device(), scripted_strategy(10, seed=5), log=log, protocol=MIXED, on_trial=lambda u: left.append(u.stimuli_left)
    ).run()
    kinds = [schedule.control(MIXED, trial.index, 5) for trial in result.trials]
    assert kinds.count(None) == 10
    assert len(kinds) > 10
    assert result.decision.reason == "The budget of 10 stimuli is used up."
    assert left[-1] == 0
    assert left == [10 - kinds[: trial + 1].count(None) for trial in range(len(kinds))]


def test_what_is_learnt_is_in_the_order_of_delivery(log: Path) -> None:
    running = session(log, trials=8)
    result = running.run()
    expected = [ALONE_MS if trial.commanded_isi_ms is None else trial.commanded_isi_ms for trial in result.trials.told]
    assert [isi_ms for isi_ms, _ in told_to(running.strategy)] == expected
    assert ALONE_MS in expected


@pytest.mark.parametrize("last", [3, pytest.param(11, marks=pytest.mark.slow), 12])
def test_a_killed_and_resumed_session_has_the_intervals_and_controls_of_an_undisturbed_one(
    log: Path, undisturbed: Path, last: int
) -> None:
    def kill(update: SessionUpdate) -> None:
        if update.trial.index == last:
            raise KilledHereError

    with pytest.raises(KilledHereError):
        Session(device(), scripted_strategy(30, seed=5), log=log, protocol=MIXED, on_trial=kill).run()
    resume(log, device(), scripted_strategy(30, seed=5)).run()
    assert given(log) == given(undisturbed)
    assert read_session(log).header.protocol == MIXED
    t_s, wanted = ([intent.t_s for intent in read_session(path).intents][last + 1 :] for path in (log, undisturbed))
    gaps, wanted_gaps = ([b - a for a, b in pairwise(times)] for times in (t_s, wanted))
    assert gaps == pytest.approx(wanted_gaps)


def test_a_rest_goes_on_while_nothing_is_running(log: Path) -> None:
    protocol = VisitProtocol(block_trials=3, rest_s=600.0)

    def kill(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            raise KilledHereError

    def run(clock: FakeRealClock, killed: bool) -> None:  # noqa: FBT001
        rig, strategy = device(simulated=False), scripted_strategy(4)
        if killed:
            with pytest.raises(KilledHereError):
                Session(rig, strategy, log=log, protocol=protocol, clock=clock, on_trial=kill).run()
        else:
            resume(log, rig, strategy, clock=clock).run()

    run(FakeRealClock(), killed=True)
    clock = FakeRealClock()
    run(clock, killed=False)
    assert 590.0 < clock.time_s - 100.0 <= 600.0 + 1e-6


def test_a_device_without_a_tap_alone_is_refused_before_anything_happens(log: Path) -> None:
    rig = ScriptedDevice()
    with pytest.raises(DeviceError, match=r"tap_alone to 0.*tap_alone=True"):
        Session(rig, scripted_strategy(), log=log, protocol=MIXED)
    assert rig.calls == []
    assert not log.exists()


def test_a_lost_control_costs_neither_budget_nor_a_retry(log: Path) -> None:
    rig = device()
    protocol = VisitProtocol(tms_alone=0.4)

    def answer(stimulus: Stimulus) -> Measurement:
        loud = 500.0 if stimulus.isi_ms is None else 1.0
        return Measurement(0.1 + (stimulus.isi_ms or 0) / 1e3, stimulus.isi_ms, background_rms_uv=loud)

    rig.answer = answer
    result = Session(rig, scripted_strategy(10), log=log, protocol=protocol).run()
    assert sum(trial.reason is None for trial in result.trials) == 10
    assert sum(trial.reason is Kind.BACKGROUND_ACTIVITY for trial in result.trials) >= 5
    assert result.decision.reason == "The budget of 10 stimuli is used up."


@pytest.mark.slow
def test_an_isi_that_was_lost_is_asked_three_times_whatever_controls_come_between(log: Path) -> None:
    rig = device()

    def answer(stimulus: Stimulus) -> Measurement:
        loud = 1.0 if stimulus.isi_ms is None else 500.0
        return Measurement(0.1, stimulus.isi_ms, background_rms_uv=loud)

    rig.answer = answer
    strategy = scripted_strategy(8)
    Session(rig, strategy, log=log, protocol=VisitProtocol(tap_alone=0.5)).run()
    asked = [isi_ms for isi_ms, _ in given(log) if isi_ms is not None]
    assert [asked.count(isi_ms) for isi_ms in dict.fromkeys(asked)][:2] == [3, 3]


def person(kind: str) -> Device:
    answer = isiw.subjects.cohort("gaussian", 1, 3)[0].begin(3)
    if kind == "tapper":
        return isiw.SimulatedDevice(isiw.Tapper(lambda isi_ms: answer.respond(isi_ms, "impact")))
    return isiw.SimulatedDevice(isiw.SimulatedPerson(lambda isi_ms: answer.respond(isi_ms, "impact"), "impact"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tapper", "person"])
def test_simulated_rigs_tap_alone(log: Path, kind: str) -> None:
    space = DesignSpace(20, 200, reference="impact")
    strategy = isiw.make_strategy(space=space, max_trials=3, particles=100)
    protocol = VisitProtocol(tms_alone=0.25, tap_alone=0.25)
    result = Session(person(kind), strategy, log=log, protocol=protocol).run()
    taps = [trial for trial in result.trials if trial.tap_alone]
    assert taps
    assert all(trial.counts and not trial.told and trial.isi_ms is None for trial in taps)
    if kind == "tapper":
        assert all(trial.t_hit_ms is not None and trial.t_tms_ms is None for trial in taps)
        assert "emg" in read_session(log).sweep(taps[0].index)


def test_a_tap_alone_without_an_impact_is_a_mistrial_and_a_pulse_in_it_an_error() -> None:
    emg = Channel(0.002 * np.random.default_rng(0).standard_normal(3000), 3000.0, "mV")
    flat = Channel(0.001 * np.random.default_rng(1).standard_normal(3000), 3000.0, "m/s^2")
    tap = Stimulus(0, None, tap_alone=True)
    space = DesignSpace(0, 300, reference="impact")
    trial = isiw.signals.judge(Sweep({"emg": emg, "acceleration": flat}, t_valve_ms=500.0), tap, space)
    assert (trial.reason, trial.tap_alone) == (Kind.NO_IMPACT, True)
    trial = isiw.signals.judge(Sweep({"emg": emg}, t_hit_ms=600.0), tap, space)
    assert (trial.status, trial.mep_mv) == (Status.ACCEPTED, None)
    assert trial.background_rms_uv == pytest.approx(2.0, rel=0.2)
    with pytest.raises(DeviceError, match="magnetic pulse"):
        isiw.signals.judge(Sweep({"emg": emg}, t_hit_ms=600.0, t_tms_ms=700.0), tap, space)


def test_what_is_noted_about_a_visit_is_in_the_log_and_stays_there(log: Path) -> None:
    visit = Visit(day=2, operator="MK", muscle="FCR", intensity_pct_rmt=110.0, electrodes="belly-tendon, 2 cm")

    def kill(update: SessionUpdate) -> None:
        raise KilledHereError(update)

    with pytest.raises(KilledHereError):
        Session(device(), scripted_strategy(3), log=log, visit=visit, on_trial=kill).run()
    assert read_session(log).header.visit == visit
    resume(log, device(), scripted_strategy(3)).run()
    assert read_session(log).header.visit == visit


def test_a_loop_of_ones_own_waits_as_the_protocol_says(log: Path) -> None:
    protocol, clock = VisitProtocol(iti_s=(5.0, 8.0), block_trials=4, rest_s=60.0), VirtualClock()
    visit = Visit(day=1)

    def three(session: isiw.Recorder) -> None:
        for _ in range(3):
            session.tell(session.ask(), 0.02 + len(session.trials) / 1e3)

    with open_session(scripted_strategy(9, seed=2), log, protocol=protocol, visit=visit, clock=clock) as recorder:
        three(recorder)
    with open_session(scripted_strategy(9, seed=2), log, resume=True, clock=clock) as recorder:
        three(recorder)
    record = read_session(log)
    assert (record.header.protocol, record.header.visit) == (protocol, visit)
    gaps = [b.t_s - a.t_s for a, b in pairwise(record.intents)]
    assert gaps[:2] == pytest.approx([schedule.interval_s(protocol, trial, 2) for trial in (1, 2)])
    assert gaps[3] == pytest.approx(60.0)


def test_a_loop_of_ones_own_gives_its_controls_itself(log: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"tell\(None, mep_mv\)"):
        open_session(scripted_strategy(), log, protocol=VisitProtocol(tms_alone=0.1))
    assert not log.exists()
    with open_session(scripted_strategy(3), log) as recorder:
        for _ in range(3):
            recorder.tell(None, 0.01)
            recorder.tell(recorder.ask(), 0.02)
        assert recorder.decision().stop
    with open_session(scripted_strategy(3), log, resume=True) as recorder:
        assert recorder.decision().reason == "The budget of 3 stimuli is used up."
