"""What is wrong with a rig is named from a single sweep, and a right one is not accused."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from found import fault_of
from isiw.design import DesignSpace
from isiw.devices.simulated import SimulatedDevice
from isiw.findings import MISTRIALS, REMEDIES, Finding, Kind, Severity
from isiw.signals import judge
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus, Trial
from known import instance
from wrong_rigs import KINDS, SPACE, WRONG, WrongRig, doubled, rig

ISIS_MS = (40.0, 150.0, 300.0)


def faults_of(device: SimulatedDevice, isis_ms: Sequence[float | None] = ISIS_MS) -> list[Finding | None]:
    device.stage()
    stimuli = [Stimulus(trial, isi_ms) for trial, isi_ms in enumerate(isis_ms)]
    sweeps = [instance(Sweep, device.deliver(stimulus, 1.0)) for stimulus in stimuli]
    space = replace(SPACE, reference=device.describe().reference)
    return [fault_of(sweep, judge(sweep, stimulus, space)) for sweep, stimulus in zip(sweeps, stimuli, strict=True)]


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_wrong_rig_is_named_from_each_sweep(wrong: str, seed: int) -> None:
    assert all(fault is not None and fault.kind in KINDS[wrong] for fault in faults_of(rig(wrong, seed)))


@pytest.mark.parametrize("accelerometer", [True, False])
def test_a_right_rig_is_not_accused(*, accelerometer: bool) -> None:
    assert faults_of(rig(seed=3, accelerometer=accelerometer), (*ISIS_MS, None)) == [None] * 4


@pytest.mark.parametrize("gap_ms", [-100.0, -12.0, 5.0, 45.0])
def test_a_stimulator_that_gives_two_pulses_is_named(gap_ms: float) -> None:
    device = SimulatedDevice(WrongRig(doubled(gap_ms), seed=1))
    found = [fault for fault in faults_of(device, (250.0, 280.0, 310.0, None)) if fault is not None]
    assert [fault.kind for fault in found] == [Kind.DOUBLE_PULSE] * 4
    assert all(f" {abs(gap_ms):.0f} ms " in fault.text for fault in found)


@pytest.mark.parametrize("blanked_ms", [2.0, 6.0, 12.0])
def test_the_end_of_a_blanked_artefact_is_no_second_pulse(blanked_ms: float) -> None:
    def blanked(sweep: Sweep) -> Sweep:
        emg = sweep.channels["emg"]
        times_ms = emg.t0_ms + np.arange(emg.values.size) * 1000 / emg.rate_hz - (sweep.t_tms_ms or 0.0)
        held = np.where((times_ms >= 0.4) & (times_ms < blanked_ms), 0.5, emg.values)
        return replace(sweep, channels={**sweep.channels, "emg": replace(emg, values=held)})

    found = faults_of(SimulatedDevice(WrongRig(blanked, seed=1)), (250.0, 280.0, None))
    assert Kind.DOUBLE_PULSE not in [fault.kind for fault in found if fault is not None]


def test_a_wrong_rate_shows_where_no_impact_is_measured() -> None:
    device = rig("wrong rate", accelerometer=False)
    (fault,) = faults_of(device, (None,))
    assert fault is not None
    assert (fault.kind, fault.severity) == (Kind.STRAY_EDGE, Severity.NOTE)


def test_samples_that_are_no_numbers_are_told_from_a_flat_line() -> None:
    stimulus = Stimulus(0, 100.0)
    answer = instance(Sweep, rig().simulation.answer(stimulus))
    answer.channels["emg"].values[7] = math.inf
    fault = fault_of(answer, judge(answer, stimulus, SPACE))
    assert fault is not None
    assert (fault.kind, fault.severity) == (Kind.NOT_NUMBERS, Severity.MISTRIAL)


def test_a_sweep_without_the_time_of_the_hit_is_told_from_one_without_emg() -> None:
    stimulus = Stimulus(0, 100.0)
    answer = replace(instance(Sweep, rig(accelerometer=False).simulation.answer(stimulus)), t_hit_ms=None)
    space = replace(SPACE, reference="impact")
    fault = fault_of(answer, judge(answer, stimulus, space))
    assert fault is not None
    assert fault.kind is Kind.NO_ORIGIN


@pytest.mark.parametrize(
    ("described", "factor", "kind", "likely"),
    [
        ("V", 1.0, Kind.LOUD, "mV"),
        ("V", 1e3, Kind.LOUD, "µV"),
        ("mV", 1e3, Kind.LOUD, "µV"),
        ("mV", 1e-3, Kind.QUIET, "V"),
        ("uV", 1.0, Kind.QUIET, "mV"),
        ("µV", 1e-3, Kind.QUIET, "V"),
        ("uV", 1e6, Kind.LOUD, None),
        ("V", 1e-6, Kind.QUIET, None),
    ],
)
def test_a_wrong_unit_is_told_by_the_one_described_and_the_likely_one(
    described: str, factor: float, kind: Kind, likely: str | None
) -> None:
    emg_mv = 0.0015 * np.random.default_rng(0).standard_normal(3500)
    sweep = Sweep({"emg": Channel(factor * emg_mv, 5000.0, described, t0_ms=-600.0)}, t_tms_ms=0.0)
    fault = fault_of(sweep, judge(sweep, Stimulus(0, None), SPACE))
    assert fault is not None
    assert fault.kind is kind
    asked = f"Is it in {likely}, and described as {described}?"
    assert fault.remedy.startswith("Correct the gain" if likely is None else asked)


def test_of_a_device_that_measures_by_itself_no_channel_is_accused() -> None:
    loud = Trial(0, Status.ACCEPTED, 40.0, isi_ms=40.0, mep_mv=0.1, background_rms_uv=2900.0)
    fault = fault_of(Measurement(0.1, 40.0, background_rms_uv=2900.0), loud)
    assert fault is not None
    assert fault.kind is Kind.LOUD
    assert "channel" not in fault.remedy


def test_every_reason_of_a_mistrial_has_a_remedy() -> None:
    assert all(REMEDIES[reason].endswith(".") for reason in MISTRIALS)


def test_a_mistrial_without_a_sign_is_told_by_its_reason_and_figure() -> None:
    trial = Trial(0, Status.MISTRIAL, 40.0, Kind.ISI_OFF, isi_ms=90.0)
    fault = fault_of(Measurement(0.1, 90.0), trial)
    assert fault is not None
    assert (fault.kind, fault.severity) == (Kind.ISI_OFF, Severity.MISTRIAL)
    assert "90 ms" in fault.text


def test_the_reflex_of_a_tap_whose_impact_nobody_measures_is_no_fault() -> None:
    times_ms, valve_ms, pulse_ms = np.arange(8000) / 5.0, 1000.0, 1200.0
    emg_mv = 0.0015 * np.random.default_rng(0).standard_normal(8000)
    for at_ms, size_mv, period_ms in ((valve_ms + 160.0, 0.6, 6.0), (pulse_ms + 18.0, 0.06, 14.0)):
        since_ms = times_ms - at_ms
        emg_mv += size_mv * np.sin(2 * np.pi * since_ms / period_ms) * ((since_ms > 0) & (since_ms < period_ms))
    sweep = Sweep({"emg": Channel(emg_mv, 5000.0, "mV")}, t_tms_ms=pulse_ms, t_valve_ms=valve_ms)
    trial = judge(sweep, Stimulus(0, 200.0), DesignSpace(0, 500, reference="valve"))
    assert trial.reason is None
    assert fault_of(sweep, trial) is None


@pytest.mark.parametrize(("at_ms", "accused"), [(400.0, False), (412.0, False), (550.0, False), (300.0, True)])
def test_the_click_of_the_valve_is_not_taken_for_the_pulse(at_ms: float, *, accused: bool) -> None:
    times_ms = np.arange(4500) / 5.0
    emg_mv = 0.0015 * np.random.default_rng(1).standard_normal(4500)
    emg_mv += 0.1 * np.sin(2 * np.pi * (times_ms - 650) / 10) * ((times_ms > 650) & (times_ms < 660))
    emg_mv[round(5 * at_ms) :][:3] += [0.1, -0.1, 0.05]
    sweep = Sweep({"emg": Channel(emg_mv, 5000.0, "mV")}, t_valve_ms=400.0, t_hit_ms=580.0, t_tms_ms=630.0)
    trial = judge(sweep, Stimulus(0, 50.0), DesignSpace(0, 200, reference="impact"))
    assert trial.reason is None
    fault = fault_of(sweep, trial)
    assert (fault is not None and fault.kind is Kind.STRAY_EDGE) == accused
