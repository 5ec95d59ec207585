"""What every detector needs of a waveform."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.signals.waveforms import (
    as_waveforms,
    crossing_before,
    cut,
    first_true,
    is_recording,
    per_waveform,
    rest_level,
)

RAMP = np.arange(10.0)[None]


def test_one_waveform_becomes_a_row_and_stacked_ones_are_flattened() -> None:
    assert as_waveforms([0, 1, 2], 3000.0).shape == (1, 3)
    assert as_waveforms(np.random.default_rng(0).random((2, 3, 5)), 3000.0).shape == (6, 5)


@pytest.mark.parametrize(
    ("values", "rate_hz", "message"),
    [
        ([0.0, 1.0], 3.0, "Is it in kHz"),
        ([0.0, 1.0], np.nan, "sampling rate is too low"),
        ([], 3000.0, "EMG is empty"),
        ([0.0, np.inf], 3000.0, "not finite"),
        ([[0.0, 1.0], [2.0, 2.0]], 3000.0, "EMG is constant; got 0.0. Check that the sensor is connected"),
    ],
)
def test_what_was_not_recorded_is_refused_by_name(values: Any, rate_hz: float, message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        as_waveforms(values, rate_hz, "EMG")


@pytest.mark.parametrize(("values", "recorded"), [([0.0, 1.0], True), ([1.0, 1.0], False), ([0.0, np.nan], False)])
def test_a_flat_line_and_gaps_are_no_recording(values: list[float], *, recorded: bool) -> None:
    assert is_recording(np.array(values)) is recorded


def test_a_number_may_be_given_for_all_waveforms_for_each_or_for_none() -> None:
    waves = np.zeros((3, 4))
    assert per_waveform(2.0, waves).tolist() == [2.0] * 3
    assert per_waveform([1.0, 2.0, 3.0], waves).tolist() == [1.0, 2.0, 3.0]
    assert np.isnan(per_waveform(None, waves)).all()


def test_level_and_noise_at_rest_are_those_of_the_signal_whatever_a_few_outliers_do() -> None:
    rng = np.random.default_rng(1)
    waves = 5.0 + 2.0 * rng.standard_normal((4, 3000))
    waves[:, ::100] = 500.0
    level, noise = rest_level(waves, 2500, 5000.0)
    assert level.shape == noise.shape == (4, 1)
    np.testing.assert_allclose(level, 5.0, atol=0.3)
    assert (noise < 50.0).all()


def test_the_noise_of_a_coarse_converter_is_not_zero() -> None:
    wave = np.zeros((1, 1000))
    wave[0, ::10] = 1.0
    _, noise = rest_level(wave, 1000, 5000.0)
    assert noise.item() == pytest.approx(np.sqrt(0.1))


def test_a_glitch_in_an_otherwise_constant_rest_is_no_converters_step() -> None:
    wave = np.zeros((1, 1000))
    wave[0, 500] = 50.0
    _, noise = rest_level(wave, 1000, 5000.0)
    assert noise.item() == pytest.approx(0.25 * 50.0 / np.sqrt(1000))


def test_the_rest_that_is_read_is_the_last_200_ms_before_the_stimulus() -> None:
    wave = np.concatenate([np.full(1000, 100.0), np.zeros(1000), np.full(500, 7.0)])[None]
    level, _ = rest_level(wave + 1e-9 * np.arange(2500), 2000, 5000.0)
    assert level.item() == pytest.approx(0.0, abs=1e-5)


def test_less_than_20_ms_of_rest_is_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"got '19.8 ms'"):
        rest_level(np.zeros((1, 1000)), 99, 5000.0)


def test_each_waveform_is_cut_from_its_own_sample_and_held_at_its_ends() -> None:
    waves = np.vstack([RAMP, 10 * RAMP])
    assert cut(waves, np.array([-1, 7]), 4).tolist() == [[0, 0, 1, 2], [70, 80, 90, 90]]


def test_the_first_true_sample_is_found_or_there_is_none() -> None:
    assert first_true(np.array([[False, True, True], [False] * 3])).tolist() == [1, -1]


def test_a_crossing_is_interpolated_and_nan_where_there_is_none() -> None:
    waves = np.vstack([RAMP, RAMP, RAMP + 50.0])
    crossings = crossing_before(waves, np.full((3, 1), 3.25), np.array([8, -1, 8]))
    assert crossings[0] == pytest.approx(3.25)
    assert np.isnan(crossings[1:]).all()
