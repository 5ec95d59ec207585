"""Responses outside the MEP window are doubted where they are the MEP's, and only there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.devices.simulated import RecordedPerson, Simulation, load_recordings
from isiw.findings import Finding, Kind
from isiw.signals import SignalLimits, judge
from isiw.signals.plausible import Counted
from isiw.signals.rig import Evidence
from isiw.signals.watch import findings, shown_by
from isiw.subjects.cohorts import cohort
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus
from isiw.types import Reference
from known import instance
from wrong_rigs import SPACE, tapper

LIMITS = SignalLimits()
ISIS_MS: Sequence[float | None] = (70.0, 90.0, 120.0, 200.0)


def sweep(
    trial: int,
    isi_ms: float | None,
    *,
    late_ms: float,
    size_mv: float | None = None,
    artefact_mv: float = 0.0,
    decay_ms: float = 0.2,
    known: bool = True,
) -> Sweep:
    """EMG whose MEP comes late: without that its turns are 25 and 30 ms after the pulse, which is at 0 ms."""
    rng = np.random.default_rng(trial)
    since_ms = np.arange(-600, 100, 0.2)
    size_mv = rng.uniform(0.05, 0.5) if size_mv is None else size_mv
    turns = (np.exp(-0.5 * ((since_ms - at_ms - late_ms) / 2) ** 2) for at_ms in (25.0, 30.0))
    emg_mv = 0.0015 * rng.standard_normal(since_ms.size) + size_mv * (next(turns) - next(turns))
    emg_mv += artefact_mv * np.exp(-np.clip(since_ms, 0.0, None) / decay_ms) * (since_ms >= 0)
    times = {} if isi_ms is None else {"t_hit_ms": -isi_ms} if known else {"t_valve_ms": -isi_ms}
    return Sweep({"emg": Channel(1e3 * emg_mv, 5000.0, "uV", t0_ms=-600.0)}, t_tms_ms=0.0, **times)


def after(
    sweeps: Iterable[Sweep], isis_ms: Sequence[float | None] = ISIS_MS, reference: Reference = "impact"
) -> list[Counted]:
    """These trials, each of which counts, as the checks look at them."""
    space = DesignSpace(0, 500, reference=reference)
    told = []
    for trial, (one, isi_ms) in enumerate(zip(sweeps, isis_ms, strict=True)):
        judged = judge(one, Stimulus(trial, isi_ms), space, LIMITS)
        assert judged.told
        told.append(shown_by(one, judged, LIMITS))
    return told


def outside(told: Iterable[Counted]) -> int:
    """How many of some trials have a response outside the window."""
    return sum(one.outside is not None for one in told)


def doubt_after(sweeps: Iterable[Sweep], isis_ms: Sequence[float | None] = ISIS_MS) -> Finding | None:
    return next(findings(Evidence(limits=LIMITS, told=after(sweeps, isis_ms))), None)


@pytest.mark.parametrize(("late_ms", "seen_ms"), [(20.0, "47 ms"), (-22.0, "7 ms"), (45.0, "72 ms")])
@pytest.mark.parametrize("isis_ms", [ISIS_MS, (None, 120.0, 121.0, 122.0)])
def test_an_mep_outside_its_window_is_doubted(late_ms: float, seen_ms: str, isis_ms: Sequence[float | None]) -> None:
    sweeps = [sweep(trial, isi_ms, late_ms=late_ms) for trial, isi_ms in enumerate(isis_ms)]
    doubt = doubt_after(sweeps, isis_ms)
    assert doubt is not None
    assert doubt.kind is Kind.MISPLACED
    assert seen_ms in doubt.text
    assert doubt_after(sweeps[:3], isis_ms[:3]) is None


def test_an_mep_within_the_window_begins_the_count_anew_and_a_quiet_trial_does_not() -> None:
    sizes_mv = (0.1, 0.3, 0.0, 0.2)
    late = [sweep(trial, 60.0 + 30 * trial, late_ms=20.0, size_mv=size_mv) for trial, size_mv in enumerate(sizes_mv)]
    isis_ms = (60.0, 90.0, 120.0, 150.0)
    assert outside(after(late, isis_ms)) == 3
    more, more_ms = sweep(4, 130.0, late_ms=20.0), (*isis_ms, 130.0)
    assert doubt_after([*late, more], more_ms) is not None
    within, within_ms = sweep(4, 100.0, late_ms=0.0), (*isis_ms, 100.0)
    assert doubt_after([*late, within, more], (*within_ms, 130.0)) is None


def test_the_late_wave_of_an_mep_is_not_counted() -> None:
    both = sweep(0, 90.0, late_ms=20.0).channels["emg"].values + sweep(1, 90.0, late_ms=0.0).channels["emg"].values
    one = Sweep({"emg": Channel(both, 5000.0, "uV", t0_ms=-600.0)}, t_tms_ms=0.0, t_hit_ms=-90.0)
    assert outside(after([one] * 4, (90.0,) * 4)) == 0


def test_at_one_isi_it_may_be_the_reflex_of_the_tap() -> None:
    isis_ms = (98.0, 100.0, 102.0, 104.0)
    assert doubt_after([sweep(trial, isi_ms, late_ms=20.0) for trial, isi_ms in enumerate(isis_ms)], isis_ms) is None


def test_activity_at_any_time_after_the_pulse_is_not_doubted() -> None:
    lates_ms = (20.0, 30.0, 25.0, 45.0)
    sweeps = [sweep(trial, isi, late_ms=late) for trial, (isi, late) in enumerate(zip(ISIS_MS, lates_ms, strict=True))]
    assert outside(after(sweeps)) == 4
    assert doubt_after(sweeps) is None


@pytest.mark.parametrize(("artefact_mv", "decay_ms"), [(0.8, 1.5), (0.3, 2.0), (5.0, 1.0)])
def test_the_end_of_a_long_artefact_is_not_taken_for_a_response(artefact_mv: float, decay_ms: float) -> None:
    sweeps = [
        sweep(trial, isi_ms, late_ms=0.0, size_mv=0.0, artefact_mv=artefact_mv, decay_ms=decay_ms)
        for trial, isi_ms in enumerate(ISIS_MS)
    ]
    assert outside(after(sweeps)) == 0


def test_what_comes_before_the_window_and_is_always_alike_is_not_doubted() -> None:
    sweeps = [sweep(trial, isi_ms, late_ms=-22.0, size_mv=0.2) for trial, isi_ms in enumerate(ISIS_MS)]
    assert outside(after(sweeps)) == 4
    assert doubt_after(sweeps) is None


@pytest.mark.parametrize(
    ("known", "isi_ms", "counted"), [(True, 5.0, 0), (True, 90.0, 1), (False, 200.0, 0), (False, 400.0, 1)]
)
def test_what_may_be_the_taps_is_not_counted(isi_ms: float, counted: int, *, known: bool) -> None:
    reflex = sweep(0, isi_ms, late_ms=15.0, size_mv=0.02, known=known)
    assert outside(after([reflex], (isi_ms,), "impact" if known else "valve")) == counted


@pytest.mark.parametrize("late_ms", [10.0, 12.0, 14.0])
def test_meps_that_the_window_cuts_off_are_doubted_and_a_wider_window_is_proposed(late_ms: float) -> None:
    sweeps = [sweep(trial, isi_ms, late_ms=late_ms, size_mv=0.3) for trial, isi_ms in enumerate(ISIS_MS)]
    doubt = doubt_after(sweeps)
    assert doubt is not None
    assert doubt.kind is Kind.CUT_OFF
    begin_ms, end_ms = map(float, doubt.remedy.partition("[")[2].partition("]")[0].split(", "))
    assert begin_ms <= 15.0
    assert end_ms >= 30.0 + late_ms + 4.0  # two SDs behind the last turn
    assert doubt_after(sweeps[:3], ISIS_MS[:3]) is None


def test_in_the_proposed_window_the_amplitude_is_whole() -> None:
    leg = sweep(0, 90.0, late_ms=12.0, size_mv=0.3)
    space, stimulus = DesignSpace(0, 500, reference="impact"), Stimulus(0, 90.0)
    cut, whole = (
        judge(leg, stimulus, space, SignalLimits(mep_window_ms=span)).mep_mv for span in ((15.0, 35.0), (15.0, 50.0))
    )
    assert instance(float, cut) < 0.5 * instance(float, whole)


def test_a_response_behind_the_window_at_one_isi_may_be_the_reflex_of_the_tap() -> None:
    isis_ms = (90.0, 91.0, 92.0, 93.0)
    assert doubt_after([sweep(trial, isi_ms, late_ms=12.0) for trial, isi_ms in enumerate(isis_ms)], isis_ms) is None


def misplaced_of(simulation: Simulation, space: DesignSpace, trials: int, limits: SignalLimits) -> int:
    """How many of a simulation's trials have a response outside the window."""
    rng, found = np.random.default_rng(0), 0
    for trial in range(trials):
        isi_ms = None if trial % 6 == 5 else float(rng.uniform(space.low_ms + 5, space.high_ms - 5))
        one, stimulus = instance(Sweep, simulation.answer(Stimulus(trial, isi_ms))), Stimulus(trial, isi_ms)
        judged = judge(one, stimulus, space, limits)
        told = shown_by(one, judged, limits) if judged.told else None
        found += told is not None and (told.outside is not None or told.cut_ms is not None)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("accelerometer", [True, False])
@pytest.mark.parametrize("name", ["gaussian", "recruitment"])
def test_no_sweep_of_the_simulated_robot_has_a_response_elsewhere(name: str, *, accelerometer: bool) -> None:
    robot = tapper(1, accelerometer=accelerometer, name=name)
    assert misplaced_of(robot, SPACE, 30, LIMITS) == 0


def test_no_recorded_sweep_has_a_response_elsewhere(recordings_folder: Path) -> None:
    person = cohort("recruitment", 1, 11)[0].begin(0)
    recorded = RecordedPerson(
        lambda isi_ms: person.respond(isi_ms, "impact"), "impact", load_recordings(recordings_folder)
    )
    assert misplaced_of(recorded, SPACE, 60, SignalLimits(background_uv=50.0)) == 0
