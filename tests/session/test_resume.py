from __future__ import annotations

import dataclasses
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from forked import Forked
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.protocol import Readiness
from isiw.devices.simulated import SimulatedDevice, SimulatedPerson
from isiw.errors import DamagedLogError, DeviceError, InvalidValueError, LimitExceededError, LogError, StrategyError
from isiw.findings import Kind
from isiw.log.headers import StrategyRecipe
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Intent, decode
from isiw.log.writer import LogWriter
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.session.replay import strategy_of
from isiw.session.resuming import open_session, resume
from isiw.session.sink import SessionUpdate
from isiw.strategy.catalogue import make_strategy, remade_strategy
from isiw.strategy.strategy import Strategy
from isiw.subjects.cohorts import cohort
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from isiw.visit import VisitProtocol
from known import known
from log.written import make_header
from logs import cut_after, damage
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy, told_to


@pytest.fixture
def uninterrupted(tmp_path: Path) -> list[float | None]:
    """The asks of a session of ten trials that nothing disturbed."""
    device = ScriptedDevice()
    Session(device, scripted_strategy(10), log=tmp_path / "uninterrupted.mcap").run()
    return [stimulus.isi_ms for stimulus in device.delivered]


def stop_after(trials: int) -> Callable[[SessionUpdate], None]:
    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index + 1 == trials:
            raise KeyboardInterrupt

    return on_trial


@pytest.fixture
def interrupted(log: Path) -> Path:
    """A log that ends after four of ten trials, between two stimuli."""
    with pytest.raises(KeyboardInterrupt):
        Session(ScriptedDevice(), scripted_strategy(10), log=log, on_trial=stop_after(4)).run()
    return log


def test_a_resumed_session_asks_what_an_uninterrupted_one_would_have(
    interrupted: Path, uninterrupted: list[float | None]
) -> None:
    device = ScriptedDevice()
    result = resume(interrupted, device, scripted_strategy(10)).run()
    assert [stimulus.isi_ms for stimulus in device.delivered] == uninterrupted[4:]
    assert [trial.commanded_isi_ms for trial in result.trials] == uninterrupted
    record = read_session(interrupted)
    assert record.table == result.trials
    assert [event.kind for event in record.events] == ["pause", "resume"]


def test_resuming_twice_is_no_different(interrupted: Path, uninterrupted: list[float | None]) -> None:
    with pytest.raises(KeyboardInterrupt):
        resume(interrupted, ScriptedDevice(), scripted_strategy(10), on_trial=stop_after(7)).run()
    result = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert [trial.commanded_isi_ms for trial in result.trials] == uninterrupted


def kill_during_trial_4(log: Path, isi_ms: float | None) -> None:
    with LogWriter.continuing(log, salvage(log), read_session(log).header) as writer:
        writer.append(Intent(trial=4, isi_ms=isi_ms))


def test_a_stimulus_without_outcome_becomes_a_mistrial_and_is_asked_again(
    interrupted: Path, uninterrupted: list[float | None]
) -> None:
    kill_during_trial_4(interrupted, uninterrupted[4])
    device = ScriptedDevice()
    session = resume(interrupted, device, scripted_strategy(10))
    result = session.run()
    assert result.trials[4].reason is Kind.OUTCOME_UNKNOWN
    assert result.trials[4].commanded_isi_ms == uninterrupted[4]
    assert device.delivered[0].trial == 5
    assert device.delivered[0].isi_ms == uninterrupted[4]
    assert len(result.trials) == 10
    assert len(told_to(session.strategy)) == 9


def test_earlier_stimuli_count_against_the_limits(interrupted: Path, space: DesignSpace) -> None:
    device = ScriptedDevice()
    limits = Limits.of_space(space, max_pulses=6)
    result = resume(interrupted, device, scripted_strategy(10), limits=limits).run()
    assert len(device.delivered) == 2
    assert result.decision.reason == "The limit of 6 pulses is reached."


class Stimulator(ScriptedDevice):
    """Reports its intensity, which it does not know the first few times."""

    intensity_pct_mso = 60.0
    silent = 0

    def readiness(self) -> Readiness:
        self.silent -= 1
        return Readiness(intensity_pct_mso=None if self.silent >= 0 else self.intensity_pct_mso)


@pytest.mark.parametrize("silent", [0, 1])
def test_the_intensity_that_a_session_began_with_is_locked_also_when_it_is_resumed(
    log: Path, space: DesignSpace, silent: int
) -> None:
    stimulator = Stimulator()
    stimulator.silent = silent
    with pytest.raises(LimitExceededError, match="85 % MSO"):
        Session(
            stimulator,
            scripted_strategy(10),
            log=log,
            on_trial=lambda update: setattr(stimulator, "intensity_pct_mso", 85.0 if update.trial.index == 2 else 60.0),
        ).run()
    assert read_session(log).header.limits.intensity_pct_mso == 60.0
    with pytest.raises(LimitExceededError, match=r"85 % MSO.*60 % MSO"):
        resume(log, stimulator, scripted_strategy(10)).run()
    assert len(stimulator.delivered) == 3
    as_set = Limits.of_space(space, max_pulses=4)  # what somebody says anew holds
    resume(log, stimulator, scripted_strategy(10), limits=as_set).run()
    header = read_session(log).header
    assert (len(stimulator.delivered), header.limits.intensity_pct_mso) == (4, 85.0)
    assert header.asks_from == 0


def test_a_loop_of_the_labs_own_cannot_keep_a_locked_intensity_and_is_told_so(log: Path) -> None:
    Session(Stimulator(simulated=False), scripted_strategy(2), log=log, clock=FakeRealClock()).run()
    before = log.read_bytes()
    with pytest.raises(InvalidValueError, match=r"neither intensity nor coil temperature.*60"):
        open_session(scripted_strategy(9), log, resume=True)
    assert log.read_bytes() == before


def test_what_a_session_went_on_with_holds_when_it_is_resumed_again(interrupted: Path, space: DesignSpace) -> None:
    before, limits, device = (
        read_session(interrupted).header,
        Limits.of_space(space, max_pulses=6).stated(5.0),
        ScriptedDevice(),
    )
    device.info = dataclasses.replace(device.info, version="2.1")
    resume(interrupted, device, scripted_strategy(10), limits=limits, timeout_s=9.0).run()
    after = read_session(interrupted).header
    assert (after.limits, after.device.version, after.timeout_s) == (limits, "2.1", 9.0)
    assert (after.created, after.subject, after.seed) == (before.created, before.subject, before.seed)
    again = ScriptedDevice()
    assert resume(interrupted, again, scripted_strategy(10)).run().decision.reason.startswith("The limit of 6 pulses")
    assert again.delivered == []


def test_the_header_of_each_part_stays_in_the_log(interrupted: Path, space: DesignSpace) -> None:
    headers = [read_session(interrupted).header]
    for pulses in (6, 8):
        resume(
            interrupted, ScriptedDevice(), scripted_strategy(10), limits=Limits.of_space(space, max_pulses=pulses)
        ).run()
        headers.append(read_session(interrupted).header)
    messages = salvage(interrupted).messages
    assert messages[0].topic == "/header"
    assert [decode(m.topic, m.data) for m in messages if m.topic == "/header"] == headers
    assert len({header.limits for header in headers}) == 3


@pytest.fixture
def own_loop(log: Path) -> Path:
    """A log of a lab's own loop, without limits that anybody stated, after two of ten trials."""
    with open_session(scripted_strategy(10), log) as session:
        for _ in range(2):
            session.tell(session.ask(), 0.02)
    return log


def test_a_device_that_takes_over_a_loop_of_the_labs_own_waits_the_usual_interval(own_loop: Path) -> None:
    device, clock = ScriptedDevice(simulated=False), FakeRealClock()
    with pytest.raises(KeyboardInterrupt):
        resume(own_loop, device, scripted_strategy(10), clock=clock, on_trial=stop_after(4)).run()
    record = read_session(own_loop)
    assert [intent.t_s for intent in record.intents][2:] == [105.0, 110.0]
    assert "At least 5 s between two stimuli from here on; it was 0 s." in record.events[0].text
    resume(own_loop, device, scripted_strategy(10), clock=clock).run()
    assert clock.now_s() == 110.0 + 6 * 5.0


@pytest.mark.parametrize(
    ("own_s", "stated_s", "holds_s"), [(0.0, 0.5, 0.5), (0.0, None, 5.0), (3.0, None, 5.0), (8.0, None, 8.0)]
)
def test_the_interval_that_a_device_takes_over_is_the_longer_one_unless_another_is_stated(
    log: Path, own_s: float, stated_s: float | None, holds_s: float
) -> None:
    space = scripted_strategy().space
    with open_session(scripted_strategy(10), log, limits=Limits.of_space(space, min_iti_s=own_s)):
        pass
    limits = None if stated_s is None else Limits.of_space(space, min_iti_s=stated_s)
    session = resume(log, ScriptedDevice(simulated=False), scripted_strategy(10), limits=limits)
    assert session.header.limits.min_iti_s == holds_s


IDLE = (
    dataclasses.replace(
        Limits.of_space(scripted_strategy().space, min_iti_s=5.0, max_pulses=5), max_block_pulses=3, rest_s=2.0
    ),
    VisitProtocol(block_trials=3, rest_s=2.0),
)
"""Limits and a protocol whose rests are shorter than the interval."""


@pytest.mark.parametrize("part", [{"limits": IDLE[0]}, {"protocol": IDLE[1]}])
def test_rests_that_limit_nothing_are_refused_where_they_are_stated_and_go_on_from_an_earlier_log(
    log: Path, part: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    own = {"limits": Limits.of_space(scripted_strategy().space, min_iti_s=5.0)} | part
    with pytest.raises(InvalidValueError, match="no effect"):
        Session(ScriptedDevice(), scripted_strategy(4), log=log, **part).run()
    with pytest.raises(InvalidValueError, match="no effect"):
        open_session(scripted_strategy(4), log, **own)
    assert not list(log.parent.iterdir())
    monkeypatch.setattr(Session, "require_effect", lambda _: None)
    with pytest.raises(KeyboardInterrupt):
        Session(ScriptedDevice(), scripted_strategy(4), log=log, on_trial=stop_after(2), **part).run()
    monkeypatch.undo()
    with pytest.raises(InvalidValueError, match="no effect"):
        resume(log, ScriptedDevice(), scripted_strategy(4), limits=IDLE[0])
    resume(log, ScriptedDevice(), scripted_strategy(4)).run()
    header = read_session(log).header
    assert {name: getattr(header, name) for name in part} == part


def test_the_first_stimulus_after_resuming_waits_a_whole_interval(interrupted: Path) -> None:
    resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert read_session(interrupted).intents[4].t_s == 5.0


def test_another_strategy_is_refused_before_anything_happens(interrupted: Path) -> None:
    before = interrupted.read_bytes()
    with pytest.raises(StrategyError, match=r"another seed.*got 1; expected 0.*seed=0"):
        resume(interrupted, ScriptedDevice(), scripted_strategy(10, seed=1))
    other = make_strategy("even", scripted_strategy().space, particles=10)
    with pytest.raises(StrategyError, match="asked in trial 0"):
        resume(interrupted, ScriptedDevice(), other)
    assert interrupted.read_bytes() == before


def test_without_verification_the_logged_trials_are_told_as_they_are(interrupted: Path) -> None:
    result = resume(interrupted, ScriptedDevice(), scripted_strategy(10, seed=1), verify=False).run()
    assert len(result.trials) == 10


def test_an_ask_that_was_answered_by_the_fallback_is_replayed_as_logged(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    strategy = scripted_strategy(10)
    asked = strategy.ask
    monkeypatch.setattr(strategy, "ask", lambda _=None: 1.0 if len(told_to(strategy)) == 2 else asked())
    with pytest.raises(KeyboardInterrupt):
        Session(ScriptedDevice(), strategy, log=log, on_trial=stop_after(5)).run()
    with pytest.raises(StrategyError, match="trial 2"):
        resume(log, ScriptedDevice(), scripted_strategy(10))
    with LogWriter.continuing(log, salvage(log), read_session(log).header) as writer:
        writer.append(Event(kind="fallback", trial=2, text="no time left"))
    assert len(resume(log, ScriptedDevice(), scripted_strategy(10)).run().trials) == 10


@pytest.mark.parametrize(
    ("overrides", "timeout_s", "ask_deadline_s"),
    [({}, 7.0, 40.0), ({"timeout_s": 9.0, "ask_deadline_s": 50.0}, 9.0, 50.0)],
)
def test_the_times_allowed_are_those_of_the_log_or_of_the_call(
    log: Path, monkeypatch: pytest.MonkeyPatch, overrides: dict[str, Any], timeout_s: float, ask_deadline_s: float
) -> None:
    times: dict[str, Any] = {"timeout_s": 7.0, "ask_deadline_s": 40.0}
    with pytest.raises(KeyboardInterrupt):
        Session(ScriptedDevice(), scripted_strategy(4), log=log, on_trial=stop_after(2), **times).run()
    device = ScriptedDevice()
    deadlines: list[float | None] = []
    timeouts: list[float] = []
    session = resume(log, device, scripted_strategy(4), **overrides)
    ask, deliver = session.strategy.ask, device.deliver

    def timed_ask(deadline_s: float | None = None) -> float:
        deadlines.append(deadline_s)
        return ask(deadline_s)

    def timed_deliver(stimulus: Stimulus, timeout_s: float) -> Any:
        timeouts.append(timeout_s)
        return deliver(stimulus, timeout_s)

    monkeypatch.setattr(session.strategy, "ask", timed_ask)
    monkeypatch.setattr(device, "deliver", timed_deliver)
    session.run()
    assert (set(timeouts), set(deadlines)) == ({timeout_s}, {ask_deadline_s})


def test_a_strategy_of_own_objects_must_be_handed_over(interrupted: Path) -> None:
    with pytest.raises(StrategyError, match="own objects"):
        resume(interrupted, ScriptedDevice())


@pytest.mark.parametrize("settings", [{"particles": 10**9}, {"initial_trials": 10**9}, {"moves": {"sweeps": 10**9}}])
def test_a_log_that_asks_for_too_much_is_not_resumed(tmp_path: Path, settings: dict[str, Any]) -> None:
    recipe = StrategyRecipe(name="random", seed=1, settings=settings)
    with LogWriter.create(tmp_path / "s.mcap", make_header(strategy=recipe)):
        pass
    with pytest.raises(InvalidValueError, match="at most"):
        resume(tmp_path / "s.mcap", ScriptedDevice(simulated=False))


def test_an_exclusion_counts_from_where_it_stands(interrupted: Path, uninterrupted: list[float | None]) -> None:
    exclude(interrupted, 1, "sneezed")
    device = ScriptedDevice()
    session = resume(interrupted, device, scripted_strategy(10))
    session.run()
    assert len(told_to(session.strategy)) == 9
    expected = scripted_strategy(10)
    for trial in session.trials.told[:3]:
        expected.tell(trial.isi_ms, trial.mep_mv)
    assert device.delivered[0].isi_ms == expected.ask() != uninterrupted[4]
    again = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert again.trials == session.trials


def test_the_trial_that_was_excluded_last_is_known_after_an_interruption(interrupted: Path) -> None:
    exclude(interrupted, 3, "sneezed")
    exclude(interrupted, 1, "moved")
    seen: list[int | None] = []

    def undo(_: SessionUpdate) -> None:
        seen.append(session.last_excluded)
        if seen[-1] is not None:
            session.include(seen[-1])

    session = resume(interrupted, ScriptedDevice(), scripted_strategy(7), on_trial=undo)
    session.run()
    assert seen == [1, 3, None]


def test_a_loop_of_ones_own_knows_after_an_interruption_which_trial_was_excluded_last(log: Path) -> None:
    with open_session(scripted_strategy(10), log) as recorder:
        for mep_mv in (0.1, 0.2):
            recorder.tell(recorder.ask(), mep_mv)
        recorder.exclude(1)
        recorder.exclude(0)
    with open_session(scripted_strategy(10), log, resume=True) as recorder:
        assert recorder.last_excluded == 0


@pytest.mark.parametrize("trial", [-1, 4, 99])
def test_only_a_trial_that_counts_can_be_excluded(interrupted: Path, trial: int) -> None:
    with pytest.raises(InvalidValueError, match="cannot exclude this trial"):
        exclude(interrupted, trial, "because")


def lose_trial_1(log: Path) -> None:
    damage(log, 5)  # header, then intent, trial, estimate of each trial: the trial of number 1
    assert [intent.trial for intent in read_session(log).unknown] == [1]


def test_a_log_with_a_lost_trial_goes_on_without_it(interrupted: Path) -> None:
    lose_trial_1(interrupted)
    result = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert result.trials[1].reason is Kind.OUTCOME_UNKNOWN
    assert len(result.trials) == 10
    assert "fails its checksum" in read_session(interrupted).losses[0]
    again = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert again.trials == result.trials


def test_a_log_with_a_lost_trial_goes_on_after_an_exclusion(interrupted: Path) -> None:
    lose_trial_1(interrupted)
    with pytest.raises(KeyboardInterrupt):
        resume(interrupted, ScriptedDevice(), scripted_strategy(10), on_trial=stop_after(6)).run()
    exclude(interrupted, 2, "sneezed")
    session = resume(interrupted, ScriptedDevice(), scripted_strategy(10))
    result = session.run()
    assert [trial.index for trial in result.trials] == list(range(10))
    assert [trial.index for trial in result.trials if not trial.told] == [1, 2]
    assert len(told_to(session.strategy)) == 8


def test_what_was_asked_before_an_exclusion_is_compared_as_it_was_asked(
    interrupted: Path, uninterrupted: list[float | None]
) -> None:
    kill_during_trial_4(interrupted, uninterrupted[4])
    exclude(interrupted, 1, "sneezed")
    result = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert result.trials[4].reason is Kind.OUTCOME_UNKNOWN
    again = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert again.trials == result.trials


def test_a_stimulus_of_which_nothing_is_left_is_compared_with_nothing(interrupted: Path) -> None:
    with LogWriter.continuing(interrupted, salvage(interrupted), read_session(interrupted).header) as writer:
        writer.append(Intent(trial=5, isi_ms=77.0))  # intent and trial 4 are lost; what was told of it is not known
    result = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert [trial.commanded_isi_ms for trial in list(result.trials)[4:6]] == [None, 77.0]
    again = resume(interrupted, ScriptedDevice(), scripted_strategy(10)).run()
    assert again.trials == result.trials


def test_what_was_asked_and_never_answered_is_compared_as_well(interrupted: Path) -> None:
    kill_during_trial_4(interrupted, 199.0)
    with pytest.raises(StrategyError, match="asked in trial 4"):
        resume(interrupted, ScriptedDevice(), scripted_strategy(10))


def test_a_session_with_a_real_device_does_not_go_on_with_a_simulated_one(log: Path) -> None:
    real, clock = ScriptedDevice(simulated=False), FakeRealClock()
    with pytest.raises(KeyboardInterrupt):
        Session(real, scripted_strategy(10), log=log, clock=clock, on_trial=stop_after(4)).run()
    before = log.read_bytes()
    with pytest.raises(DeviceError, match=r"real device.*simulated = false"):
        resume(log, ScriptedDevice(), scripted_strategy(10))
    assert log.read_bytes() == before
    assert len(resume(log, real, scripted_strategy(10), clock=clock).run().trials) == 10


def test_a_simulated_session_does_not_go_on_with_a_real_device(interrupted: Path) -> None:
    real, before = ScriptedDevice(simulated=False), interrupted.read_bytes()
    with pytest.raises(DeviceError, match=r"simulated device.*isiw run CONFIG"):
        resume(interrupted, real, scripted_strategy(10))
    assert interrupted.read_bytes() == before
    assert real.delivered == []


def test_of_two_resumptions_of_one_log_the_second_is_refused(interrupted: Path) -> None:
    first = resume(interrupted, ScriptedDevice(), scripted_strategy(10))
    device = ScriptedDevice()
    second = resume(interrupted, device, scripted_strategy(10))
    first.run()
    with pytest.raises(LogError, match="has changed"):
        second.run()
    assert device.delivered == []
    assert len(read_session(interrupted).table) == 10


def test_what_is_not_a_log_cannot_be_resumed(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such log"):
        resume(tmp_path / "nothing.mcap", ScriptedDevice())


def simulated_person() -> SimulatedDevice:
    person = cohort("drift", 1, 3)[0].begin(3)
    return SimulatedDevice(SimulatedPerson(lambda isi_ms: person.respond(isi_ms, "valve"), "valve"))


def test_a_default_session_with_a_drifting_person_goes_on_as_if_never_interrupted(tmp_path: Path) -> None:
    def strategy() -> Strategy:
        return make_strategy("default", space=VALVE_SPACE, seed=2, max_trials=7)

    whole = Session(simulated_person(), strategy(), log=tmp_path / "whole.mcap").run()
    with pytest.raises(KeyboardInterrupt):
        Session(simulated_person(), strategy(), log=tmp_path / "s.mcap", on_trial=stop_after(3)).run()
    resumed = resume(tmp_path / "s.mcap", simulated_person()).run()
    assert resumed.trials == whole.trials
    assert resumed.estimate.window == whole.estimate.window
    assert resumed.estimate.probability == whole.estimate.probability


VICTIM = """
import sys, time
sys.path.insert(0, {tests!r})
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy, told_to
from isiw.devices.clock import VirtualClock
from isiw.session.loop import Session

def hang(*_, **__):
    print("hanging", flush=True)
    time.sleep(600)

device, strategy, clock, on_trial = ScriptedDevice(), scripted_strategy(10), VirtualClock(), None
point, answer, learn = {point!r}, device.answer, strategy.learn
if point == "while the device delivers":
    device.answer = lambda stimulus: hang() if stimulus.trial == 4 else answer(stimulus)
elif point == "before the trial is told":
    strategy.learn = lambda *a, **k: hang() if len(told_to(strategy)) == 3 else learn(*a, **k)
elif point == "after the trial was reported":
    on_trial = lambda update: hang() if update.trial.index == 3 else None
else:
    clock.sleep_s = lambda duration_s: hang() if len(device.delivered) == 4 else VirtualClock.sleep_s(clock, duration_s)
Session(device, strategy, log={log!r}, clock=clock, on_trial=on_trial).run()
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(
    ("point", "open_intents"),
    [
        ("while the device delivers", 1),
        ("before the trial is told", 0),
        ("after the trial was reported", 0),
        ("between two stimuli", 0),
    ],
)
def test_a_killed_session_loses_nothing_and_asks_the_same_again(
    log: Path, uninterrupted: list[float | None], point: str, open_intents: int
) -> None:
    script = VICTIM.format(tests=str(Path(__file__).parents[1]), point=point, log=str(log))
    with Forked(script) as victim:
        assert victim.stdout.readline() == "hanging\n"
        victim.send_signal(signal.SIGKILL)
    assert victim.returncode == -signal.SIGKILL
    killed = read_session(log)
    assert killed.losses == ()
    assert [trial.commanded_isi_ms for trial in killed.table] == uninterrupted[:4]
    assert len(killed.unknown) == open_intents
    device = ScriptedDevice()
    result = resume(log, device, scripted_strategy(10)).run()
    assert [stimulus.isi_ms for stimulus in device.delivered] == uninterrupted[4 : 10 - open_intents]
    assert [t.reason for t in result.trials if t.reason] == [Kind.OUTCOME_UNKNOWN] * open_intents
    assert len(result.trials) == 10
    assert not log.with_name("s.mcap.part").exists()


def test_a_measured_zero_and_its_uncertainty_are_replayed(log: Path) -> None:
    def answer(stimulus: Stimulus) -> Measurement:
        return Measurement(0.0, known(stimulus.isi_ms) + 0.25, isi_sd_ms=2.0)

    with pytest.raises(KeyboardInterrupt):
        Session(ScriptedDevice(answer), scripted_strategy(10), log=log, on_trial=stop_after(2)).run()
    session = resume(log, ScriptedDevice(answer), scripted_strategy(10))
    assert [mep for _, mep in told_to(session.strategy)] == [0.0, 0.0]
    assert [trial.isi_sd_ms for trial in session.trials] == [2.0, 2.0]


@pytest.fixture
def cut(log: Path) -> Any:
    """A closed log of six trials, of which the last two were cut off."""
    Session(ScriptedDevice(), scripted_strategy(6), log=log).run()
    cut_after(log, 4)
    assert len(read_session(log).table) == 4
    return log


def test_a_log_without_its_end_does_not_go_on_before_somebody_says_how_many_stimuli_it_lost(cut: Path) -> None:
    before = cut.read_bytes()
    with pytest.raises(DamagedLogError, match=r"end is missing.*--lost-pulses"):
        resume(cut, ScriptedDevice(), scripted_strategy(10))
    with pytest.raises(DamagedLogError, match="end is missing"):
        exclude(cut, 1, "sneezed")
    assert cut.read_bytes() == before


def test_the_stimuli_of_a_lost_end_are_counted_and_their_numbers_not_used_again(cut: Path) -> None:
    device = ScriptedDevice()
    result = resume(cut, device, scripted_strategy(10), lost_pulses=2).run()
    assert [trial.reason for trial in list(result.trials)[4:6]] == [Kind.OUTCOME_UNKNOWN] * 2
    assert [stimulus.trial for stimulus in device.delivered] == [6, 7, 8, 9]
    after = read_session(cut)
    assert (len(after.table), after.end_lost) == (10, False)
    assert "cut off" in next(event.text for event in after.events if event.kind == "loss")
    assert len(after.losses) == 1  # an exclusion may have been lost, too


@pytest.mark.parametrize("pulses", [-1, 1.5, "2", True, 10**9])
def test_lost_pulses_are_a_number_of_stimuli(cut: Path, pulses: Any) -> None:
    with pytest.raises(InvalidValueError, match="lost_pulses"):
        resume(cut, ScriptedDevice(), scripted_strategy(10), lost_pulses=pulses)


def test_a_log_with_its_end_has_lost_no_pulses(interrupted: Any) -> None:
    with pytest.raises(InvalidValueError, match="this one's is there"):
        resume(interrupted, ScriptedDevice(), scripted_strategy(10), lost_pulses=1)


def test_excluding_a_trial_of_a_damaged_log_says_in_the_log_what_was_lost(interrupted: Any) -> None:
    damage(interrupted, 6)
    exclude(interrupted, 0, "sneezed")
    assert "fails its checksum" in next(e.text for e in read_session(interrupted).events if "checksum" in e.text)


def test_a_session_that_is_over_arms_nothing_when_it_is_resumed(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    Session(ScriptedDevice(), scripted_strategy(2), log=log).run()
    device = ScriptedDevice()
    result = resume(log, device, scripted_strategy(2)).run()
    assert result.decision.stop
    assert device.calls == []
    assert read_session(log).finished


def test_a_session_that_would_not_be_accepted_any_more_goes_on_as_it_was(tmp_path: Path) -> None:
    space = DesignSpace(0, 100, reference="valve")
    settings: dict[str, Any] = {"hit_delay_ms": (150.0, 5.0), "particles": 50}
    with pytest.raises(InvalidValueError, match="after the last ISI"):
        make_strategy(space=space, **settings)
    log = tmp_path / "s.mcap"
    with open_session(remade_strategy("default", space, 0, **settings), log) as session:
        session.tell(session.ask(), 0.05)
    with open_session(strategy_of(read_session(log).header), log, resume=True) as session:
        session.tell(session.ask(), 0.05)
    assert len(read_session(log).table.told) == 2
