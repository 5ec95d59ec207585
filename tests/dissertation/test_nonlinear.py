"""Nonlinear regression: what it recovers, how sure it is, and what it says when it fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import curve_fit

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.dissertation.nonlinear import NonlinearRegression, Start, gaussians_mv, gradient_mv
from isiw.dissertation.regression import FittedCurve, RegressionModel
from isiw.errors import InvalidValueError
from isiw.models.shared.history import FloorTreatment
from isiw.testing import check_model
from isiw.types import FloatArray
from isiw.window import Window
from models.told_trials import bell_mv, told, trials_of

NR = RegressionModel(NonlinearRegression())
FLOOR_MV = 0.02


def fit(isi_ms: FloatArray, mep_mv: FloatArray, **settings: Any) -> FittedCurve:
    return NonlinearRegression(**settings).fit(isi_ms, mep_mv, VALVE_SPACE, np.random.default_rng(0))


@pytest.mark.parametrize("floor_mv", [0.0, 0.005, FLOOR_MV])
def test_the_window_of_a_gaussian_without_noise_is_recovered_to_the_grid_step(floor_mv: float) -> None:
    posterior = told(NR, trials_of(lambda isi_ms: floor_mv + bell_mv(isi_ms)))
    assert posterior.trouble is None
    assert posterior.estimate().window == Window(213.0, 313.0)


def test_a_floor_above_the_edges_level_hides_them_unless_it_is_subtracted() -> None:
    assert FLOOR_MV > 0.135 * (FLOOR_MV + 0.1)
    trials = trials_of(lambda isi_ms: FLOOR_MV + bell_mv(isi_ms))
    windows = {
        kind: told(RegressionModel(NR.method, FloorTreatment(kind)), trials).estimate().window
        for kind in ("raw", "subtracted")
    }
    assert windows["subtracted"] == Window(213.0, 313.0)
    assert windows["raw"].width_ms > 120.0


@pytest.mark.slow
def test_two_gaussians_are_recovered_with_both_segments() -> None:
    def profile(isi_ms: FloatArray) -> FloatArray:
        return np.asarray(bell_mv(isi_ms, mean_ms=210.0, sd_ms=15.0) + bell_mv(isi_ms, 0.06, mean_ms=320.0, sd_ms=20.0))

    two = RegressionModel(NonlinearRegression(peaks=2), segments="all")
    window = told(two, trials_of(profile, every_ms=10.0)).estimate().window
    truth = profile(VALVE_SPACE.grid_ms)
    assert window == Window.from_mask(VALVE_SPACE.grid_ms, truth >= 0.135 * truth.max())
    assert len(window.segments) == 2


def test_the_smaller_of_two_gaussians_vanishes_where_there_is_one() -> None:
    rng = np.random.default_rng(3)
    isi_ms = np.arange(0.0, 500.0, 10.0)
    curve = fit(isi_ms, bell_mv(isi_ms) + 0.005 * rng.standard_normal(len(isi_ms)), peaks=2)
    assert np.abs(curve.mean_mv - bell_mv(curve.grid_ms)).max() < 0.01


def test_the_gradient_is_the_derivative() -> None:
    isi_ms, parameters = np.array([200.0, 260.0, 300.0]), np.array([0.1, 263.0, 25.0, 0.05, 150.0, 40.0])
    for k, step in enumerate(1e-5 * parameters):
        moved = [gaussians_mv(isi_ms, parameters + sign * step * np.eye(6)[k]) for sign in (1, -1)]
        assert gradient_mv(isi_ms, parameters)[:, k] == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-4)


def test_standard_errors_are_those_of_the_delta_method() -> None:
    rng = np.random.default_rng(1)
    isi_ms = np.linspace(0.0, 500.0, 30)
    mep_mv = bell_mv(isi_ms) + 0.01 * rng.standard_normal(30)
    curve = fit(isi_ms, mep_mv)
    model = lambda t, a, m, s: gaussians_mv(t, np.array([a, m, s]))  # noqa: E731 - what curve_fit wants
    found, covariance = curve_fit(model, isi_ms, mep_mv, p0=(0.1, 250.0, 27.0))
    gradient = gradient_mv(curve.grid_ms, found)
    assert curve.mean_mv == pytest.approx(gaussians_mv(curve.grid_ms, found), abs=1e-5)
    assert curve.sd_mv == pytest.approx(np.sqrt(np.einsum("ti,ij,tj->t", gradient, covariance, gradient)), abs=1e-5)
    assert curve.dof == 27


@pytest.mark.slow
def test_the_prediction_interval_holds_the_next_mep_as_often_as_it_says() -> None:
    rng = np.random.default_rng(7)
    isi_ms = np.linspace(0.0, 500.0, 40)
    held = 0
    for _ in range(300):
        low, high = fit(isi_ms, bell_mv(isi_ms) + 0.01 * rng.standard_normal(40)).prediction_mv(0.95)
        at = int(rng.integers(501))
        held += low[at] <= bell_mv(float(at)) + 0.01 * rng.standard_normal() <= high[at]
    # 95 % of 300 is 285; fewer than 270 or more than 297 comes less than once in a thousand seeds.
    assert 270 <= held <= 297


def test_sampled_curves_scatter_as_the_standard_errors_say() -> None:
    rng = np.random.default_rng(2)
    isi_ms = np.linspace(0.0, 500.0, 60)
    curve = fit(isi_ms, bell_mv(isi_ms) + 0.005 * rng.standard_normal(60), samples=2000)
    inside = slice(220, 307)
    assert curve.samples_mv.std(axis=0)[inside] == pytest.approx(curve.sd_mv[inside], rel=0.15)


@pytest.mark.parametrize("trials", [0, 1, 2, 3])
def test_three_trials_are_too_few_and_a_flat_curve_stands_in(trials: int) -> None:
    posterior = told(NR, [(250.0, 0.1), (0.0, 0.01), (500.0, 0.01)][:trials])
    assert "too few" in posterior.trouble or "do not determine 3 parameters" in posterior.trouble
    assert "flat curve stands in" in posterior.trouble
    assert posterior.estimate().window is None


def test_before_the_fit_is_possible_the_sampled_curves_are_those_of_prior_knowledge() -> None:
    samples_mv = NR.begin(VALVE_SPACE, 1).curves[0].samples_mv
    peaks_ms = samples_mv.argmax(axis=-1)
    assert samples_mv.min() >= 0.0
    assert samples_mv.max() > 0.05
    assert peaks_ms.std() > 80.0


def test_a_response_at_one_isi_only_does_not_determine_the_curve() -> None:
    posterior = told(NR, [(0.0, 0.01), (100.0, 0.01), (200.0, 0.01), (260.0, 0.2), (400.0, 0.01), (500.0, 0.01)])
    assert "do not determine every parameter" in posterior.trouble
    assert posterior.estimate().window is not None
    assert np.isfinite(posterior.curves[0].samples_mv).all()


def test_a_search_that_gives_up_says_so_and_its_best_curve_stands_in() -> None:
    model = RegressionModel(NonlinearRegression(max_evaluations=1))
    posterior = told(model, trials_of(bell_mv))
    assert "did not converge in 1 evaluations" in posterior.trouble
    assert posterior.estimate().window is not None


@pytest.mark.slow
@pytest.mark.parametrize(("space", "peaks"), [(VALVE_SPACE, 1), (IMPACT_SPACE, 2)], ids=["one peak", "two peaks"])
def test_the_model_conforms(space: DesignSpace, peaks: int) -> None:
    check_model(lambda: RegressionModel(NonlinearRegression(peaks=peaks, samples=16)), space, order_tolerance_ms=1.0)


@pytest.mark.parametrize("scale", [10.0, 1.0, 0.03])
def test_where_no_amplitude_is_known_beforehand_it_starts_from_the_largest_mep(scale: float) -> None:
    unknown = RegressionModel(NonlinearRegression(amplitude_mv=0.0))
    assert told(unknown, trials_of(lambda isi_ms: scale * bell_mv(isi_ms))).estimate().window == Window(213.0, 313.0)


@pytest.mark.parametrize(
    "settings",
    [
        {"peaks": 3},
        {"peaks": 1.0},
        {"width_ms": 30.0},
        {"min_width_ms": 0.0},
        {"max_width_ms": math.inf},
        {"amplitude_mv": -1.0},
        {"max_evaluations": 0},
        {"samples": 1},
        {"start": "odd"},
    ],
)
def test_an_invalid_setting_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"peaks|width_ms|amplitude_mv|evaluations|samples|start"):
        NonlinearRegression(**settings)


def test_a_fit_of_two_gaussians_tells_their_amplitudes_largest_first() -> None:
    isi_ms = np.linspace(0.0, 500.0, 51)
    mep_mv = gaussians_mv(isi_ms, np.array([0.03, 150.0, 20.0, 0.08, 320.0, 25.0]))
    curve = fit(isi_ms, mep_mv, peaks=2, amplitude_mv=0.0)
    assert curve.amplitudes_mv == pytest.approx((0.08, 0.03), rel=0.01)


def test_two_clear_gaussians_are_found_from_even_and_unequal_starts_and_from_some_random_ones() -> None:
    isi_ms, rng = np.linspace(0.0, 500.0, 51), np.random.default_rng(0)
    mep_mv = np.asarray(bell_mv(isi_ms, mean_ms=200.0) + bell_mv(isi_ms, 0.05, mean_ms=310.0))

    def found(start: Start) -> bool:
        curve = NonlinearRegression(peaks=2, start=start).fit(isi_ms, mep_mv, VALVE_SPACE, rng)
        return curve.amplitudes_mv == pytest.approx((0.1, 0.05), rel=0.01)

    assert found("even")
    assert found("unequal")
    assert {found("random") for _ in range(20)} == {True, False}  # the second Gaussian can vanish


def test_starts_differ_and_only_a_random_one_differs_from_fit_to_fit() -> None:
    def starts(start: Start, peaks: int, seed: int) -> list[list[float]]:
        method = NonlinearRegression(peaks=peaks, start=start)
        return method.starts(VALVE_SPACE, 0.1, np.random.default_rng(seed))

    assert starts("even", 2, 0) == starts("even", 2, 1) == [[0.1, 223.0, 27.0], [0.1, 277.0, 27.0]]
    assert starts("unequal", 2, 0) == [[0.1, 250.0, 27.0], [pytest.approx(0.01), 277.0, 27.0]]
    assert starts("unequal", 1, 0) == starts("even", 1, 0) == [[0.1, 250.0, 27.0]]
    assert starts("random", 1, 0) != starts("random", 1, 1)


def test_one_gaussian_needs_no_second_amplitude() -> None:
    isi_ms = np.linspace(0.0, 500.0, 51)
    assert fit(isi_ms, bell_mv(isi_ms)).amplitudes_mv == pytest.approx((float(bell_mv(isi_ms).max()),), rel=0.05)


@pytest.mark.parametrize("high_ms", [5.0, 20.0, 50.0])
def test_two_gaussians_are_fitted_in_a_range_that_is_narrower_than_a_window(high_ms: Any) -> None:
    space, rng = DesignSpace(0, high_ms, 1.0, reference="impact"), np.random.default_rng(2)
    isi_ms = np.linspace(0, high_ms, 12)
    mep_mv = 0.01 + 0.05 * np.exp(-0.5 * ((isi_ms - high_ms / 2) / 5) ** 2) + 0.002 * rng.standard_normal(12)
    curve = NonlinearRegression(peaks=2).fit(isi_ms, mep_mv, space, rng)
    assert np.isfinite(curve.mean_mv).all()
    assert np.isfinite(curve.samples_mv).all()
