from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from isiw.design import VALVE_SPACE
from isiw.devices.limits import Limits
from isiw.devices.simulated import RecordedTrials, SimulatedDevice, SimulatedPerson
from isiw.errors import DeviceError
from isiw.findings import Kind
from isiw.log.record import SessionRecord, read_session
from isiw.metrics import f1
from isiw.session.loop import Session
from isiw.session.sink import SessionResult
from isiw.strategy.catalogue import make_strategy
from isiw.subjects.cohorts import cohort
from isiw.subjects.subject import SimulatedSubject
from isiw.sweeps import Measurement
from isiw.trials import Status, Stimulus, Trial, TrialTable
from known import instance

TABLE = TrialTable(
    (
        Trial(0, Status.ACCEPTED, 10.0, isi_ms=11.0, mep_mv=0.01),
        Trial(1, Status.MISTRIAL, 10.0, Kind.NO_IMPACT),
        Trial(2, Status.ACCEPTED, 50.0, isi_ms=49.0, mep_mv=0.05),
        Trial(3, Status.ACCEPTED, 50.0, isi_ms=51.0, mep_mv=0.06, excluded=True),
        Trial(4, Status.ACCEPTED, 50.0, isi_ms=52.0, mep_mv=0.07),
        Trial(5, Status.ACCEPTED, None, mep_mv=0.02),
    )
)


@pytest.fixture
def device() -> SimulatedDevice:
    replay = SimulatedDevice(RecordedTrials(TABLE, "impact"))
    replay.stage()
    return replay


def meps(device: SimulatedDevice, *isis: float | None) -> list[float]:
    return [instance(Measurement, device.deliver(Stimulus(trial, isi), 1.0)).mep_mv for trial, isi in enumerate(isis)]


def test_the_same_asks_get_the_same_answers_in_order(device: SimulatedDevice) -> None:
    assert meps(device, 10.0, 50.0, 50.0) == [0.01, 0.05, 0.07]


def test_another_ask_gets_the_nearest_trial_at_its_own_isi(device: SimulatedDevice) -> None:
    assert instance(Measurement, device.deliver(Stimulus(0, 35.0), 1.0)).isi_ms == 49.0


def test_tms_alone_is_answered_by_tms_alone(device: SimulatedDevice) -> None:
    assert meps(device, None) == [0.02]


def test_each_trial_answers_once(device: SimulatedDevice) -> None:
    meps(device, 10.0, 50.0, 50.0)
    with pytest.raises(DeviceError, match=r"no recorded trial.*max_pulses"):
        device.deliver(Stimulus(3, 50.0), 1.0)


def test_a_trial_at_another_intensity_answers_only_a_stimulus_of_that_intensity() -> None:
    strong = replace(TABLE.told[0], index=6, isi_ms=48.0, intensity_pct_rmt=110.0)
    alone = Trial(7, Status.ACCEPTED, None, mep_mv=0.9, intensity_pct_rmt=110.0)
    recorded = RecordedTrials(TrialTable((*TABLE.trials, strong, alone)), "impact")
    assert [recorded.answer(Stimulus(0, isi_ms)).isi_ms for isi_ms in (48.0, None, 48.0)] == [49.0, None, 52.0]
    assert recorded.answer(Stimulus(3, 10.0, intensity_pct_rmt=110.0)).isi_ms == 48.0
    assert recorded.answer(Stimulus(4, None, intensity_pct_rmt=110.0)).mep_mv == 0.9
    with pytest.raises(DeviceError, match=r"no recorded trial.*got '100 % RMT'"):
        recorded.answer(Stimulus(5, 10.0, intensity_pct_rmt=100.0))


@pytest.fixture
def person() -> SimulatedSubject:
    return cohort("gaussian", 1, 3)[0]


@pytest.fixture
def recording(person: SimulatedSubject, tmp_path: Path) -> SessionRecord:
    """A logged session of a strategy that asks at random."""
    begun = person.begin(5)
    device = SimulatedDevice(SimulatedPerson(lambda isi_ms: begun.respond(isi_ms, "valve"), "valve"))
    strategy = make_strategy("random", space=VALVE_SPACE, particles=200, max_trials=24)
    return read_session(Session(device, strategy, log=tmp_path / "first.mcap").run().log)


def run_again(recording: SessionRecord, log: Path, tolerance_ms: float) -> SessionResult:
    """A session of the default strategy on the recorded trials, as the device's documentation says."""
    space = replace(recording.header.space, tolerance_ms=tolerance_ms)
    pairs = sum(trial.isi_ms is not None for trial in recording.table.told)
    device = SimulatedDevice(RecordedTrials(recording.table, space.reference))
    limits = Limits.of_space(space, max_pulses=pairs)
    return Session(device, make_strategy(space=space, particles=200), log=log, limits=limits).run()


def test_another_strategy_learns_from_every_recorded_trial_of_a_session(
    recording: SessionRecord, person: SimulatedSubject, tmp_path: Path
) -> None:
    result = run_again(recording, tmp_path / "again.mcap", tolerance_ms=1000.0)
    assert all(trial.told for trial in result.trials)
    recorded = {(trial.isi_ms, trial.mep_mv) for trial in recording.table.told}
    assert {(trial.isi_ms, trial.mep_mv) for trial in result.trials} <= recorded
    assert [trial.commanded_isi_ms for trial in result.trials] != [t.commanded_isi_ms for t in recording.table]
    assert f1(result.estimate, person.window(VALVE_SPACE), VALVE_SPACE) > 0.9


def test_with_the_usual_tolerance_recorded_trials_far_from_the_ask_are_mistrials(
    recording: SessionRecord, tmp_path: Path
) -> None:
    result = run_again(recording, tmp_path / "again.mcap", tolerance_ms=10.0)
    lost = [trial for trial in result.trials if trial.reason is Kind.ISI_OFF]
    assert lost
    for trial in result.trials:
        assert trial.isi_ms is not None
        assert trial.commanded_isi_ms is not None
        assert (trial in lost) == (abs(trial.isi_ms - trial.commanded_isi_ms) > 10.0)
