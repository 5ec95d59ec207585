"""Artefacts that would be measured as MEPs, and sweeps that come twice, pause a session."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from found import doubt_of, fault_of
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.findings import Finding, Kind, Severity
from isiw.session.stated import require_signals
from isiw.signals import SignalLimits, judge
from isiw.signals.watch import Watch
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus, TrialTable
from isiw.types import FloatArray

SPACE, LIMITS = DesignSpace(0, 320, reference="impact"), SignalLimits()
RATE_HZ, BEFORE_MS = 5000.0, 600.0
SINCE_PULSE_MS = np.arange(-BEFORE_MS, 115.0, 1000 / RATE_HZ)

Change = Callable[[FloatArray, np.random.Generator], FloatArray]


def sweep_of(trial: int, change: Change = lambda emg, _: emg, pulse_ms: float = 0.0) -> tuple[Stimulus, Sweep]:
    """A sweep with an MEP at 25 ms and the pulse's artefact, changed, whose pulse is reported at another time."""
    rng = np.random.default_rng(trial)
    mep_mv = 0.1 * rng.gamma(4.0, 0.25) * np.exp(-0.5 * ((SINCE_PULSE_MS - 25.0) / 2.0) ** 2)
    artefact_mv = 0.3 * (np.abs(SINCE_PULSE_MS) < 0.3)
    emg_mv = change(mep_mv + artefact_mv + 0.002 * rng.standard_normal(SINCE_PULSE_MS.size), rng)
    stimulus = Stimulus(trial, 40.0 + 20.0 * trial)
    channel = Channel(emg_mv, RATE_HZ, "mV", t0_ms=-BEFORE_MS)
    return stimulus, Sweep({"emg": channel}, t_tms_ms=pulse_ms, t_hit_ms=pulse_ms - 40.0 - 20.0 * trial)


def pauses(sweeps: list[tuple[Stimulus, Sweep]]) -> list[Finding]:
    """What a session would have paused for after some of these sweeps."""
    watch, found = Watch(SPACE, LIMITS, 3), []
    for stimulus, sweep in sweeps:
        watch = watch.after(judge(sweep, stimulus, SPACE), sweep)
        if watch.pause is not None:
            found.append(watch.pause)
            watch = watch.seen()
    return found


def test_right_sweeps_are_not_doubted() -> None:
    assert pauses([sweep_of(trial) for trial in range(10)]) == []


@pytest.mark.parametrize("late_ms", [14.0, 20.0, 28.0])
def test_a_pulse_that_is_reported_too_early_shows_by_its_artefact(late_ms: float) -> None:
    stimulus, sweep = sweep_of(2, pulse_ms=-late_ms)
    fault = fault_of(sweep, judge(sweep, stimulus, SPACE))
    assert fault is not None
    assert (fault.kind, fault.severity) == (Kind.STRAY_EDGE, Severity.NOTE)


@pytest.mark.parametrize("lasting_ms", [6.0, 10.0])
def test_an_artefact_that_lasts_into_the_window_is_doubted_once(lasting_ms: float) -> None:
    def decaying(emg_mv: FloatArray, rng: np.random.Generator) -> FloatArray:
        since_ms = np.maximum(SINCE_PULSE_MS, 0.0)
        size_mv = 5.0 * (1.0 + 0.1 * rng.standard_normal())
        return np.asarray(emg_mv + size_mv * np.exp(-since_ms / lasting_ms) * (SINCE_PULSE_MS >= 0))

    found = pauses([sweep_of(trial, decaying) for trial in range(8)])
    assert [finding.severity for finding in found if finding.kind is Kind.ARTEFACT] == [Severity.DOUBT]


@pytest.mark.parametrize("lasting_ms", [20.0, 60.0])
def test_an_artefact_that_decays_slowly_is_doubted_where_there_is_no_mep(lasting_ms: float) -> None:
    def decaying(emg_mv: FloatArray, rng: np.random.Generator) -> FloatArray:
        size_mv = np.exp(0.3 * rng.standard_normal())
        noise_mv = 0.003 * rng.standard_normal(emg_mv.size)
        return np.asarray(noise_mv + size_mv * np.exp(-SINCE_PULSE_MS / lasting_ms) * (SINCE_PULSE_MS >= 0.6))

    found = pauses([sweep_of(trial, decaying) for trial in range(8)])
    assert [finding.kind for finding in found].count(Kind.ARTEFACT) == 1


@pytest.mark.parametrize("lasting_ms", [0.5, 1.5])
def test_an_artefact_that_ends_before_the_window_is_none(lasting_ms: float) -> None:
    def decaying(emg_mv: FloatArray, rng: np.random.Generator) -> FloatArray:
        del rng
        return np.asarray(emg_mv + 5.0 * np.exp(-np.maximum(SINCE_PULSE_MS, 0.0) / lasting_ms) * (SINCE_PULSE_MS >= 0))

    assert pauses([sweep_of(trial, decaying) for trial in range(10)]) == []


def test_what_was_asked_before_a_session_was_resumed_is_not_asked_again() -> None:
    def lasting(emg_mv: FloatArray, rng: np.random.Generator) -> FloatArray:
        size_mv = 5.0 * (1.0 + 0.1 * rng.standard_normal())
        return np.asarray(emg_mv + size_mv * np.exp(-np.maximum(SINCE_PULSE_MS, 0.0) / 8.0) * (SINCE_PULSE_MS >= 0))

    sweeps = [sweep_of(trial, lasting) for trial in range(8)]
    asked = [finding.kind for finding in pauses(sweeps)]
    watch = Watch(SPACE, LIMITS, 3).resumed(TrialTable(()), asked)
    for stimulus, sweep in sweeps:
        watch = watch.after(judge(sweep, stimulus, SPACE), sweep)
        assert watch.pause is None


@pytest.mark.parametrize("rate_hz", [2000.0, 2048.0, 4000.0, 5000.0])
@pytest.mark.parametrize("between_peaks_ms", [2.4, 4.0])
def test_a_short_mep_is_no_artefact(rate_hz: float, between_peaks_ms: float) -> None:
    since_ms = np.arange(-600.0, 115.0, 1000 / rate_hz)
    sd_ms, rng = 0.5 * between_peaks_ms, np.random.default_rng(2)
    biphasic = -(since_ms - 20.0) / sd_ms * np.exp(0.5 - 0.5 * ((since_ms - 20.0) / sd_ms) ** 2)
    emg = Channel(0.3 * biphasic + 0.002 * rng.standard_normal(since_ms.size), rate_hz, "mV", t0_ms=-600.0)
    sweep, stimulus = Sweep({"emg": emg}, t_tms_ms=0.0, t_hit_ms=-100.0), Stimulus(0, 100.0)
    assert fault_of(sweep, judge(sweep, stimulus, SPACE)) is None


def test_a_buffer_that_is_filled_again_and_again_is_no_repetition() -> None:
    buffer, watch = np.zeros(SINCE_PULSE_MS.size), Watch(SPACE, LIMITS, 3)
    for trial in range(6):
        stimulus, sweep = sweep_of(trial)
        buffer[:] = sweep.channels["emg"].values
        in_place = replace(sweep, channels={"emg": Channel(buffer, RATE_HZ, "mV", t0_ms=-BEFORE_MS)})
        watch = watch.after(judge(in_place, stimulus, SPACE), in_place)
        assert watch.pause is None


def test_a_sweep_that_comes_twice_is_doubted_once() -> None:
    sweeps = [sweep_of(trial) for trial in range(6)]
    again = [
        (stimulus, replace(sweep, channels=sweeps[stimulus.trial // 2 * 2][1].channels)) for stimulus, sweep in sweeps
    ]
    assert [finding.kind for finding in pauses(again)] == [Kind.REPEATED]


def test_amplitudes_that_hardly_vary_are_doubted() -> None:
    rng = np.random.default_rng(1)
    steady_mv = (0.3 * (1.0 + 0.03 * rng.uniform(-1, 1, 8))).tolist()
    assert doubt_of(steady_mv[:7]) is None
    doubt = doubt_of(steady_mv)
    assert doubt is not None
    assert doubt.kind is Kind.EQUAL
    assert doubt_of((0.3 * (1.0 + 0.3 * rng.standard_normal(8))).tolist()) is None


@pytest.mark.parametrize(
    ("stated", "says"),
    [
        ({"mep_window_ms": (0.0, 50.0)}, "the pulse's artefact"),
        ({"mep_window_ms": (0.015, 35.0)}, "the pulse's artefact"),
        ({"isi_tolerance_ms": 20.0}, "would have no effect"),
    ],
)
def test_a_window_in_the_pulses_artefact_and_a_tolerance_without_effect_are_refused_where_they_are_stated(
    stated: dict[str, Any], says: str
) -> None:
    with pytest.raises(InvalidValueError, match=says):
        require_signals(SignalLimits(**stated), SPACE)
    require_signals(LIMITS, SPACE)


@pytest.mark.parametrize("values", [["1,5", "2,5"], [[1.0, 2.0], [1.0]], [1j, 2j]])
def test_samples_that_are_no_real_numbers_are_refused(values: object) -> None:
    with pytest.raises(InvalidValueError, match="samples of a channel"):
        Channel(values, RATE_HZ, "mV")  # type: ignore[arg-type]  # which is what is tested


def test_a_sweep_without_channels_by_name_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="channels by name"):
        Sweep(None, t_tms_ms=0.0)  # type: ignore[arg-type]  # which is what is tested
