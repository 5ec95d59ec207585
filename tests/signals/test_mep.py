from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.devices.robot.waveforms import mep_shape
from isiw.errors import InvalidValueError
from isiw.signals import background_rms, mep_amplitude, mep_amplitudes, mep_onset, mep_onsets, mep_present
from isiw.types import FloatArray

RATE_HZ = 5000.0
TIME_MS = np.arange(1500) / 5


def emg_with_mep(amplitude_mv: float, n: int = 1, noise_mv: float = 0.001, seed: int = 0) -> np.ndarray:
    """Sweeps of 300 ms with a pulse at 150 ms."""
    rng = np.random.default_rng(seed)
    return amplitude_mv * mep_shape(TIME_MS - 150) + noise_mv * rng.standard_normal((n, 1500))


@pytest.mark.parametrize("amplitude_mv", [0.03, 0.1, 1.0])
def test_the_amplitude_is_that_of_the_mep(amplitude_mv: float) -> None:
    measured = mep_amplitudes(emg_with_mep(amplitude_mv, n=50, noise_mv=0.0005), RATE_HZ, 150.0)
    np.testing.assert_allclose(measured, amplitude_mv, atol=0.005)


@given(offset=st.floats(-5, 5), gain=st.floats(0.1, 10), sign=st.sampled_from((-1, 1)))
def test_offset_and_polarity_do_not_matter_and_gain_is_proportional(offset: float, gain: float, sign: float) -> None:
    emg = emg_with_mep(0.1)[0]
    expected = gain * mep_amplitude(emg, RATE_HZ, 150.0)
    assert mep_amplitude(sign * gain * emg + offset, RATE_HZ, 150.0) == pytest.approx(expected, rel=1e-6)


def test_only_the_window_counts_and_both_its_ends_do() -> None:
    emg = np.zeros(1500)
    emg[[round(5 * (150 + at)) for at in (15, 35)]] = 0.1, -0.1
    assert mep_amplitude(emg, RATE_HZ, 150.0) == pytest.approx(0.2)
    emg[:] = 0.0
    emg[[round(5 * (150 + at)) for at in (14, 36)]] = 0.1, -0.1
    assert mep_amplitude(emg, RATE_HZ, 150.0) == 0.0


def test_what_is_blanked_does_not_count() -> None:
    emg = emg_with_mep(0.1, n=2)
    emg[:, 5 * 168 : 5 * 170] += 1.0
    spans = (np.array([167.0, np.nan]), np.array([171.0, np.nan]))
    blanked, open_ = mep_amplitudes(emg, RATE_HZ, 150.0, blank_ms=spans)
    assert blanked == pytest.approx(0.1, abs=0.01)
    assert open_ > 1.0


def test_a_window_that_is_blanked_altogether_gives_no_number() -> None:
    assert np.isnan(mep_amplitudes(emg_with_mep(0.1), RATE_HZ, 150.0, blank_ms=(160.0, 190.0))).all()


def test_each_sweep_of_a_batch_has_its_own_pulse() -> None:
    emg = emg_with_mep(0.1, n=3)
    shifted = np.stack([np.roll(row, shift) for row, shift in zip(emg, (0, 50, -50), strict=True)])
    pulses = np.array([150.0, 160.0, 140.0])
    np.testing.assert_allclose(
        mep_amplitudes(shifted, RATE_HZ, pulses), mep_amplitudes(emg, RATE_HZ, 150.0), rtol=1e-12
    )


@pytest.mark.parametrize("amplitude_mv", [0.1, 0.5, 2.0])
def test_the_onset_of_a_forearm_mep_is_near_17_and_a_half_ms(amplitude_mv: float) -> None:
    onsets = mep_onsets(emg_with_mep(amplitude_mv, n=100), RATE_HZ, 150.0)
    assert np.mean(np.abs(onsets - 17.5) <= 1.5) >= 0.95


def test_noise_alone_has_neither_onset_nor_mep() -> None:
    noise = emg_with_mep(0.0, n=200, noise_mv=0.003)
    assert np.mean(~np.isnan(mep_onsets(noise, RATE_HZ, 150.0))) <= 0.02
    assert not mep_present(noise, RATE_HZ, 150.0).any()
    assert mep_onset(noise[0], RATE_HZ, 150.0) is None


def test_a_small_mep_is_present_only_where_less_is_asked_for() -> None:
    emg = emg_with_mep(0.04, n=20, noise_mv=0.0005)
    assert not mep_present(emg, RATE_HZ, 150.0).any()
    assert mep_present(emg, RATE_HZ, 150.0, least_mv=0.03).all()


def test_the_background_is_that_of_the_last_100_ms_before_the_pulse() -> None:
    emg = emg_with_mep(0.1, n=20, noise_mv=0.004)
    emg[:, : 5 * 45] += 3.0
    np.testing.assert_allclose(background_rms(emg, RATE_HZ, 150.0), 0.004, rtol=0.15)


def test_the_background_leaves_out_the_artefact_of_the_tap() -> None:
    emg = emg_with_mep(0.1, n=20, noise_mv=0.004)
    emg[:, 5 * 110 : 5 * 118] += 1.0
    assert (background_rms(emg, RATE_HZ, 150.0) > 0.1).all()
    np.testing.assert_allclose(background_rms(emg, RATE_HZ, 150.0, 90.0), 0.004, rtol=0.15)


def test_too_little_rest_is_an_error() -> None:
    with pytest.raises(InvalidValueError, match="background"):
        background_rms(emg_with_mep(0.1), RATE_HZ, 30.0)


@pytest.mark.parametrize("pulse_ms", [1010.0, 1200.0, [500.0, 1200.0]])
def test_a_pulse_beyond_the_sweep_has_no_background(pulse_ms: float) -> None:
    emg = 0.004 * np.random.default_rng(3).standard_normal((2, 5000))
    with pytest.raises(InvalidValueError, match="ends before the pulse"):
        background_rms(emg, 5000.0, pulse_ms)
    np.testing.assert_allclose(background_rms(emg, 5000.0, 1000.0), 0.004, rtol=0.15)


@pytest.mark.parametrize(
    ("emg", "rate_hz", "pulse_ms", "what"),
    [
        (np.empty(0), RATE_HZ, 150.0, "empty"),
        (np.zeros(1500), RATE_HZ, 150.0, "constant"),
        (np.full(1500, np.nan), RATE_HZ, 150.0, "not finite"),
        (np.arange(1500.0), 5.0, 150.0, "rate"),
        (np.arange(1500.0), RATE_HZ, 280.0, "window"),
        (np.arange(1500.0), RATE_HZ, np.nan, "window"),
        (np.ones((2, 1500)), RATE_HZ, 150.0, "vector"),
    ],
)
def test_what_is_not_a_recording_is_an_error_and_never_a_number(
    emg: FloatArray, rate_hz: float, pulse_ms: float, what: str
) -> None:
    with pytest.raises(InvalidValueError, match=what):
        mep_amplitude(emg, rate_hz, pulse_ms)
    with pytest.raises(InvalidValueError, match=what):
        mep_onset(emg, rate_hz, pulse_ms)


def test_an_empty_window_is_an_error() -> None:
    with pytest.raises(InvalidValueError, match="window is empty"):
        mep_amplitude(np.arange(1500.0), RATE_HZ, 150.0, (35.0, 15.0))
