"""Gaussian process regression beside scikit-learn's own."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from isiw.design import VALVE_SPACE
from isiw.dissertation.regression import FittedCurve, GaussianProcessRegression, RegressionModel
from isiw.errors import InvalidValueError
from isiw.testing import check_model
from known import known
from models.told_trials import bell_mv

ISI_MS = np.linspace(0.0, 500.0, 40)
MEP_MV = bell_mv(ISI_MS) + 0.015 * np.random.default_rng(5).standard_normal(40)


def fit(**settings: Any) -> FittedCurve:
    return GaussianProcessRegression(**settings).fit(ISI_MS, MEP_MV, VALVE_SPACE, np.random.default_rng(0))


def reference() -> tuple[GaussianProcessRegressor, float]:
    scale = float(np.abs(MEP_MV).max())
    kernel = ConstantKernel(1.0, (0.01, 10.0)) * RBF(40.0, (25.0, 100.0)) + WhiteKernel(0.09, (1e-4, 1.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of parameters at their bounds
        return GaussianProcessRegressor(kernel).fit(ISI_MS[:, None], MEP_MV / scale), scale


def test_the_curve_and_its_95_percent_prediction_interval_are_scikit_learns() -> None:
    process, scale = reference()
    mean, sd = process.predict(VALVE_SPACE.grid_ms[:, None], return_std=True)
    curve = fit()
    low, high = curve.prediction_mv(0.95)
    assert curve.trouble is None
    assert curve.mean_mv == pytest.approx(scale * mean, abs=5e-4)
    assert 0.5 * (high - low) == pytest.approx(1.959964 * scale * sd, abs=1e-3)


def test_sampled_curves_scatter_about_the_mean_as_the_process_does() -> None:
    curve = fit(samples=4000)
    assert curve.samples_mv.mean(axis=0) == pytest.approx(curve.mean_mv, abs=0.1 * curve.sd_mv.max())
    assert curve.samples_mv.std(axis=0) == pytest.approx(curve.sd_mv, rel=0.1)


def test_without_trials_the_prior_stands_in() -> None:
    posterior = RegressionModel(GaussianProcessRegression()).begin(VALVE_SPACE, 1)
    assert "no trials" in known(posterior.trouble)
    assert posterior.estimate().window is None
    assert posterior.curves[0].samples_mv.std() > 0


def test_a_search_that_gives_up_says_so_and_its_best_parameters_stand_in() -> None:
    assert "did not converge in 1 iterations" in known(fit(max_fit_iterations=1).trouble)


@pytest.mark.slow
def test_the_model_conforms() -> None:
    check_model(
        lambda: RegressionModel(GaussianProcessRegression(samples=16, max_fit_iterations=10)),
        VALVE_SPACE,
        order_tolerance_ms=1.0,
    )


@pytest.mark.parametrize(
    "settings", [{"length_ms": 10.0}, {"min_length_ms": 0.0}, {"noise": 0.0}, {"max_fit_iterations": 0}, {"samples": 1}]
)
def test_an_invalid_setting_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"length_ms|noise|iterations|samples"):
        GaussianProcessRegression(**settings)
