from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import isiw
from isiw.devices.robot.mechanism import Faults
from isiw.devices.robot.tapper import Tapper, TapperSettings, preset
from isiw.devices.simulated import SimulatedDevice
from isiw.errors import InvalidValueError
from isiw.session.loop import Session
from isiw.signals import impact_time
from isiw.subjects.cohorts import cohort
from isiw.sweeps import Sweep
from isiw.testing import check_device
from isiw.trials import Stimulus
from known import known
from scripted import scripted_strategy

SPACE = isiw.DesignSpace(20, 200, reference="impact")


@dataclass(frozen=True)
class Answer:
    mep_mv: float = 0.1


def tapper(*, accelerometer: bool = True) -> Tapper:
    settings = TapperSettings("impact" if accelerometer else "valve", accelerometer=accelerometer)
    return Tapper(lambda _: Answer(), "subject3", settings)


@pytest.fixture(scope="module")
def robot() -> isiw.RotatingTapper:
    return isiw.RotatingTapper(tapper())


def begins_ms(sweep: Sweep) -> float:
    angle = sweep.channels["angle"]
    moved = np.flatnonzero(angle.values > angle.values[:400].mean() + 2)
    return float(moved[0]) * 1000 / angle.rate_hz


@pytest.mark.slow
def test_it_keeps_what_every_device_promises() -> None:
    def made() -> SimulatedDevice:
        subject = cohort("recruitment", 1, 0)[0].begin(1)
        robot = Tapper(lambda isi_ms: subject.respond(isi_ms, "impact"), "subject3")
        return SimulatedDevice(isiw.RotatingTapper(robot))

    said: list[str] = []
    check_device(made, SPACE, say=said.append)
    assert "with vane actuator" in made().describe().name


def test_the_wrist_turns_by_its_full_range_after_the_tap_and_the_pulse(robot: isiw.RotatingTapper) -> None:
    sweep = robot.answer(Stimulus(0, 50.0))
    opened_ms = known(sweep.t_tms_ms) + robot.wait_ms
    assert opened_ms + 22 < begins_ms(sweep) < opened_ms + 150
    angle = sweep.channels["angle"].values
    assert angle[-1] == pytest.approx(180, abs=2)
    assert np.ptp(angle[: int(opened_ms)]) < 2


def test_a_pulse_long_before_the_impact_does_not_hasten_the_rotation() -> None:
    early = isiw.RotatingTapper(Tapper(lambda _: Answer(), "subject3", TapperSettings(reference="valve")))
    sweep = early.answer(Stimulus(0, 20.0))
    hit_ms = known(impact_time(sweep.channels["acceleration"].values, 5000.0))
    assert known(sweep.t_tms_ms) < hit_ms - 100
    assert begins_ms(sweep) > hit_ms + early.wait_ms


def test_what_it_adds_changes_nothing_of_the_taps_own_sweep(robot: isiw.RotatingTapper) -> None:
    alone, turned = tapper().answer(Stimulus(5, 40.0)), isiw.RotatingTapper(tapper()).answer(Stimulus(5, 40.0))
    assert {*turned.channels} - {*alone.channels} == {"angle", "vane_pressure"}
    assert all((turned.channels[name].values == channel.values).all() for name, channel in alone.channels.items())
    assert robot.info.channels == {name: channel.unit for name, channel in turned.channels.items()}


def test_without_an_accelerometer_it_turns_after_the_predicted_tap() -> None:
    assert begins_ms(isiw.RotatingTapper(tapper(accelerometer=False)).answer(Stimulus(0, 230.0))) > 680 + 60


def test_the_wrist_is_turned_after_a_tap_alone_and_not_after_tms_alone(robot: isiw.RotatingTapper) -> None:
    assert np.ptp(robot.answer(Stimulus(0, None, tap_alone=True)).channels["angle"].values) > 170
    assert np.ptp(robot.answer(Stimulus(1, None)).channels["angle"].values) < 3


def test_a_hammer_that_does_not_reach_the_wrist_turns_nothing() -> None:
    stuck = replace(preset("subject3"), faults=Faults(stuck_probability=1.0))
    sweep = isiw.RotatingTapper(Tapper(lambda _: Answer(), stuck)).answer(Stimulus(0, 50.0))
    assert np.ptp(sweep.channels["angle"].values) < 3


def test_strokes_differ_and_the_same_seed_gives_the_same(robot: isiw.RotatingTapper) -> None:
    first, second = (robot.answer(Stimulus(trial, 50.0)).channels["angle"].values for trial in (0, 1))
    again = robot.answer(Stimulus(0, 50.0)).channels["angle"].values
    assert (first == again).all()
    assert np.abs(first[:1500] - second[:1500]).max() > 2


def test_a_session_logs_the_rotation(tmp_path: pytest.TempPathFactory) -> None:
    device = SimulatedDevice(isiw.RotatingTapper(tapper()))
    path = Session(device, scripted_strategy(2, space=SPACE), log=f"{tmp_path}/s.mcap").run().log
    assert isiw.read_session(path).sweep(1)["angle"].values.max() > 175


@pytest.mark.parametrize(("wait_ms", "seed", "said"), [(10.0, 0, "wait_ms"), (60.0, -1, "seed")])
def test_a_rotation_while_the_mep_is_measured_is_refused(wait_ms: float, seed: int, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        isiw.RotatingTapper(tapper(), wait_ms=wait_ms, seed=seed)
