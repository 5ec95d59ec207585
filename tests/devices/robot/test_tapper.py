from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.devices.protocol import Device, HasMemory
from isiw.devices.robot.mechanism import Faults, Geometry
from isiw.devices.robot.tapper import Evoked, Tapper, TapperSettings, Trigger, preset
from isiw.devices.simulated import SimulatedDevice
from isiw.errors import DeviceError, InvalidValueError
from isiw.findings import Kind
from isiw.signals import impact_time, judge
from isiw.subjects.cohorts import cohort
from isiw.subjects.subject import Response
from isiw.sweeps import Sweep
from isiw.testing import check_device
from isiw.trials import Stimulus
from isiw.types import Reference
from known import instance, known

IMPACT = DesignSpace(0, 320, reference="impact")
VALVE = DesignSpace(0, 500, reference="valve")


@dataclass(frozen=True)
class Answer:
    mep_mv: float = 0.1


@dataclass
class Listener:
    """Answers with one amplitude, and remembers the ISIs [ms] that came about."""

    mep_mv: float = 0.1
    heard_ms: list[float | None] = field(default_factory=list)

    def __call__(self, isi_ms: float | None) -> Answer:
        self.heard_ms.append(isi_ms)
        return Answer(self.mep_mv)


def realised_ms(sweep: Sweep) -> float:
    """From the impact in the waveform to the pulse."""
    return known(sweep.t_tms_ms) - known(impact_time(sweep.channels["acceleration"].values, 5000.0))


def tapper(
    geometry: str | Geometry = "subject2",
    *,
    respond: Callable[[float | None], Evoked] | None = None,
    seed: int = 0,
    **settings: Any,
) -> SimulatedDevice:
    device = SimulatedDevice(Tapper(respond or Listener(), geometry, TapperSettings(**settings), seed=seed))
    device.stage()
    return device


def deliver(device: SimulatedDevice, isi_ms: float | None, n: int = 1) -> list[Sweep]:
    return [instance(Sweep, device.deliver(Stimulus(trial, isi_ms), 1.0)) for trial in range(n)]


def test_it_is_a_device_with_a_memory() -> None:
    device = tapper()
    assert isinstance(device, Device)
    assert isinstance(device, HasMemory)
    assert device.describe().simulated


@pytest.mark.slow
@pytest.mark.parametrize(("trigger", "accelerometer"), [("open-loop", True), ("open-loop", False), ("impact", True)])
def test_it_keeps_what_every_device_promises(trigger: Trigger, *, accelerometer: bool) -> None:
    def made(reference: Reference) -> SimulatedDevice:
        subject = cohort("recruitment", 1, 0)[0].begin(1)
        settings = TapperSettings(reference=reference, trigger=trigger, accelerometer=accelerometer)
        return SimulatedDevice(Tapper(lambda isi_ms: subject.respond(isi_ms, "impact"), "subject3", settings))

    if accelerometer:
        check_device(lambda: made("impact"), DesignSpace(5, 320, reference="impact"))
    check_device(lambda: made("valve"), DesignSpace(200, 500, reference="valve"))


def test_its_sweep_has_the_channels_and_units_that_it_describes() -> None:
    for geometry, accelerometer in itertools.product(("bench", "subject1"), (True, False)):
        device = tapper(geometry, accelerometer=accelerometer, reference="valve")
        sweep = deliver(device, 230.0)[0]
        assert {name: channel.unit for name, channel in sweep.channels.items()} == device.describe().channels
        assert all(channel.values.size == 5000 for channel in sweep.channels.values())


def test_a_late_pulse_makes_the_sweep_longer() -> None:
    sweep = deliver(tapper(reference="valve"), 500.0)[0]
    assert judge(sweep, Stimulus(0, 500.0), VALVE).reason is None


@pytest.mark.parametrize("trigger", ["open-loop", "impact"])
@pytest.mark.parametrize("reference", ["impact", "valve"])
def test_the_person_answers_the_isi_that_truly_came_about(reference: Reference, trigger: Trigger) -> None:
    person = Listener()
    device = tapper(reference=reference, trigger=trigger, respond=person)
    sweeps = deliver(device, 60.0 if reference == "impact" else 240.0, n=10)
    assert person.heard_ms == pytest.approx([realised_ms(sweep) for sweep in sweeps], abs=0.2)


@pytest.mark.slow
def test_open_loop_the_isi_varies_with_the_hit_and_triggered_it_does_not() -> None:
    def errors(trigger: Trigger) -> list[float]:
        sweeps = deliver(tapper("subject1", trigger=trigger), 60.0, n=40)
        return [realised_ms(sweep) - 60.0 for sweep in sweeps]

    assert np.std(errors("open-loop")[5:]) == pytest.approx(4.0, rel=0.3)
    assert np.max(np.abs(errors("impact"))) <= 0.2


@pytest.mark.slow
@pytest.mark.parametrize("trigger", ["open-loop", "impact"])
def test_jitter_moves_the_pulse_and_its_recorded_time_and_no_tap(trigger: Trigger) -> None:
    def pulses_and_hits(jitter_ms: float) -> tuple[np.ndarray, np.ndarray]:
        device = tapper("subject4", trigger=trigger, pulse_jitter_ms=jitter_ms)
        sweeps = deliver(device, 60.0, n=40)
        pulses = np.array([known(sweep.t_tms_ms) for sweep in sweeps])
        return pulses, pulses - [realised_ms(sweep) for sweep in sweeps]

    (still, hits), (moved, same_hits) = pulses_and_hits(0.0), pulses_and_hits(5.0)
    assert np.std(moved - still) == pytest.approx(5.0, rel=0.25)
    assert np.abs(same_hits - hits).max() < 1.0


@pytest.mark.slow
def test_the_command_is_corrected_by_the_measured_hits() -> None:
    robot = Tapper(Listener(), "subject2", TapperSettings(expected_hit_ms=190.0))
    for trial in range(20):
        robot.answer(Stimulus(trial, 60.0))
    assert robot.hit_delay_ms == pytest.approx(172.0, abs=1.0)
    later = [robot.answer(Stimulus(trial, 60.0)) for trial in range(20, 60)]
    error = [known(judge(sweep, Stimulus(0, 60.0), IMPACT).isi_ms) - 60.0 for sweep in later]
    assert np.mean(error) == pytest.approx(0.0, abs=0.8)


def test_a_few_late_valves_do_not_move_the_expected_hit_delay() -> None:
    usual, late = preset("subject2"), Faults(late_probability=0.15, late_ms=(15.0, 20.0))
    robots = [Tapper(Listener(), geometry) for geometry in (usual, replace(usual, faults=late))]
    for robot, trial in product(robots, range(15)):
        robot.answer(Stimulus(trial, 60.0))
    assert robots[1].hit_delay_ms != robots[0].hit_delay_ms  # some came late
    assert robots[1].hit_delay_ms == pytest.approx(robots[0].hit_delay_ms, abs=1.0)


def test_an_isi_shorter_than_the_detection_is_refused_before_anything_happens() -> None:
    person = Listener()
    device = tapper(trigger="impact", respond=person)
    with pytest.raises(DeviceError, match="so soon"):
        deliver(device, 3.0)
    assert person.heard_ms == []
    deliver(device, 5.0)
    from_valve = tapper(reference="valve", trigger="impact")
    with pytest.raises(DeviceError, match="so soon"):
        deliver(from_valve, 150.0)


def test_without_an_accelerometer_the_uncertainty_of_the_isi_is_stated() -> None:
    from_valve = deliver(tapper(accelerometer=False, reference="valve"), 240.0)[0]
    judged = judge(from_valve, Stimulus(0, 240.0), VALVE)
    assert (judged.isi_ms, judged.isi_sd_ms) == pytest.approx((240.0, 2.5))


def test_the_stated_uncertainty_is_what_varies_from_trial_to_trial() -> None:
    off_ms = list[float]()
    for name in ("subject1", "subject2", "subject3", "subject4"):
        person = Listener()
        deliver(tapper(name, accelerometer=False, reference="valve", respond=person), 240.0, n=20)
        heard_ms = np.array(person.heard_ms, dtype=float)
        off_ms.extend(heard_ms - heard_ms.mean())
    assert np.mean(np.abs(off_ms) <= 2 * 2.5) >= 0.9


def test_a_hammer_that_sticks_gives_no_impact_open_loop_and_no_pulse_triggered() -> None:
    stuck = replace(preset("subject1"), faults=Faults(stuck_probability=1.0))
    person = Listener()
    open_loop = deliver(tapper(stuck, respond=person), 60.0)[0]
    assert judge(open_loop, Stimulus(0, 60.0), IMPACT).reason is Kind.NO_IMPACT
    assert person.heard_ms == [None]
    triggered = deliver(tapper(stuck, trigger="impact"), 60.0)[0]
    assert judge(triggered, Stimulus(0, 60.0), IMPACT).reason is Kind.NO_PULSE


@pytest.mark.parametrize("reference", ["impact", "valve"])
def test_tms_alone_taps_nobody(reference: Reference) -> None:
    person = Listener(0.05)
    device = tapper(reference=reference, respond=person)
    sweep = deliver(device, None)[0]
    assert person.heard_ms == [None]
    assert impact_time(sweep.channels["acceleration"].values, 5000.0) is None
    judged = judge(sweep, Stimulus(0, None), IMPACT if reference == "impact" else VALVE)
    assert judged.isi_ms is None
    assert judged.mep_mv == pytest.approx(0.05, abs=0.006)


@pytest.mark.parametrize("mep_mv", [0.0, 0.02, 0.1, 1.0])
def test_the_judged_amplitude_is_the_one_that_the_person_gave(mep_mv: float) -> None:
    device = tapper("subject2", respond=Listener(mep_mv))
    judged = [judge(sweep, Stimulus(0, 80.0), IMPACT) for sweep in deliver(device, 80.0, n=15)]
    measured = [each.mep_mv for each in judged if each.mep_mv is not None]
    assert len(measured) >= 13
    if mep_mv == 0:  # 1 µV RMS of EMG at rest has 3 to 9 µV of its own
        assert 0.003 < min(measured) < max(measured) < 0.009
    else:
        np.testing.assert_allclose(measured, mep_mv, rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("reference", "trigger"), [("impact", "open-loop"), ("valve", "impact")])
def test_the_emg_floor_of_a_person_counts_once(reference: Reference, trigger: Trigger) -> None:
    person, answers = cohort("nonresponder", 2, 0)[1].begin(1), list[Response]()

    def respond(isi_ms: float | None) -> Response:
        answers.append(person.respond(isi_ms, "impact"))
        return answers[-1]

    device = tapper(reference=reference, trigger=trigger, respond=respond)
    isi_ms, space = (100.0, IMPACT) if reference == "impact" else (280.0, VALVE)
    judged = [judge(sweep, Stimulus(0, isi_ms), space) for sweep in deliver(device, isi_ms, n=40)]
    told, given = np.array([(j.mep_mv, a.mep_mv) for j, a in zip(judged, answers, strict=True) if j.mep_mv]).T
    assert len(told) >= 36
    np.testing.assert_allclose(np.log(told / given).mean(), 0.0, atol=0.01)


def test_a_trial_depends_on_the_seed_and_its_own_number() -> None:
    first, again, other = (deliver(tapper(seed=seed), 60.0)[0] for seed in (1, 1, 2))
    emg = [sweep.channels["emg"].values for sweep in (first, again, other)]
    assert (emg[0] == emg[1]).all()
    assert (emg[0] != emg[2]).any()


def test_it_comes_into_the_state_after_stimuli_of_an_earlier_run() -> None:
    stimuli = [Stimulus(trial, 40.0 + trial) for trial in range(8)]
    through, resumed = tapper(seed=4), tapper(seed=4)
    for stimulus in stimuli:
        through.deliver(stimulus, 1.0)
    resumed.resume_after(stimuli)
    last = Stimulus(8, 60.0)
    assert instance(Sweep, resumed.deliver(last, 1.0)).t_tms_ms == instance(Sweep, through.deliver(last, 1.0)).t_tms_ms


@pytest.mark.parametrize(
    "wrong",
    [
        {"reference": "tap"},
        {"trigger": "never"},
        {"rate_hz": 0.0},
        {"trigger": "impact", "accelerometer": False},
        {"reference": "impact", "accelerometer": False},
        {"pulse_jitter_ms": -1.0},
    ],
)
def test_settings_that_cannot_be_are_errors(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        TapperSettings(**wrong)
