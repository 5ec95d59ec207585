"""Fitted curves: the window of a curve, and its intervals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from isiw.dissertation.regression import FittedCurve, curve_masks
from isiw.excess import window_from_excess
from isiw.window import Window

GRID = np.arange(0.0, 501.0)


@given(st.lists(st.floats(-0.01, 0.1), min_size=3, max_size=20), st.floats(0.0, 0.05))
def test_all_segments_of_a_curve_are_the_window_of_the_rule(curve_mv: list[float], floor_mv: float) -> None:
    curve = np.array(curve_mv)
    mask = curve_masks(curve[None], floor_mv, "all")[0]
    assert Window.from_mask(np.arange(len(curve)), mask) == window_from_excess(np.arange(len(curve)), curve, floor_mv)


@given(st.lists(st.floats(-0.01, 0.1), min_size=3, max_size=20))
def test_the_peaks_segment_is_the_one_of_all_that_holds_the_peak(curve_mv: list[float]) -> None:
    curve = np.array(curve_mv)
    window = window_from_excess(np.arange(len(curve)), curve, 0.0)
    mask = curve_masks(curve[None], 0.0, "peak")[0]
    if window is None:
        assert not mask.any()
    else:
        start, end = next((a, b) for a, b in window.segments if a <= curve.argmax() <= b)
        assert np.flatnonzero(mask).tolist() == list(range(int(start), int(end) + 1))


def test_each_of_several_curves_has_its_own_window() -> None:
    curves = np.array([[0.0, 0.1, 0.0, 0.05], [0.1, 0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 0.001]])
    assert curve_masks(curves, 0.0).astype(int).tolist() == [[0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 0]]


def test_intervals_have_the_quantiles_of_students_distribution() -> None:
    curve = FittedCurve(GRID[:1], np.array([0.1]), np.array([0.03]), np.zeros((2, 1)), noise_sd_mv=0.04, dof=5.0)
    reach = stats.t(5).ppf(0.975)
    assert np.concatenate(curve.confidence_mv(0.95)).tolist() == pytest.approx([0.1 - 0.03 * reach, 0.1 + 0.03 * reach])
    assert np.concatenate(curve.prediction_mv(0.95)).tolist() == pytest.approx([0.1 - 0.05 * reach, 0.1 + 0.05 * reach])


def test_without_degrees_of_freedom_the_intervals_are_gaussian() -> None:
    curve = FittedCurve(GRID[:1], np.array([0.1]), np.array([0.03]), np.zeros((2, 1)), noise_sd_mv=0.0)
    assert float(curve.prediction_mv(0.95)[1][0]) == pytest.approx(0.1 + 0.03 * 1.959964)
