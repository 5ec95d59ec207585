"""Support vector regression beside scikit-learn's own, and its committee."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sklearn.svm import SVR

from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.dissertation.regression import FittedCurve, RegressionModel, SupportVectorRegression
from isiw.errors import InvalidValueError
from isiw.testing import check_model
from known import known
from models.told_trials import bell_mv, told, trials_of

ISI_MS = np.linspace(0.0, 500.0, 25)
MEP_MV = bell_mv(ISI_MS) + 0.01 * np.random.default_rng(5).standard_normal(25)


def fit(seed: int = 0, **settings: Any) -> FittedCurve:
    return SupportVectorRegression(**settings).fit(ISI_MS, MEP_MV, VALVE_SPACE, np.random.default_rng(seed))


def test_the_curve_is_scikit_learns() -> None:
    scale = np.abs(MEP_MV).max()
    svr = SVR(C=3.0, epsilon=0.05, gamma=1 / (2 * 40.0**2)).fit(ISI_MS[:, None], MEP_MV / scale)
    curve = fit(c=3.0, epsilon=0.05, length_ms=40.0)
    assert curve.mean_mv == pytest.approx(scale * svr.predict(VALVE_SPACE.grid_ms[:, None]), abs=1e-9)


def test_each_member_of_the_committee_has_its_own_bootstrap() -> None:
    scale = np.abs(MEP_MV).max()
    picks = np.random.default_rng(4).integers(25, size=(10, 25))[7]
    svr = SVR(gamma=1 / (2 * 50.0**2)).fit(ISI_MS[picks, None], MEP_MV[picks] / scale)
    curve = fit(seed=4)
    assert curve.samples_mv[7] == pytest.approx(scale * svr.predict(VALVE_SPACE.grid_ms[:, None]), abs=1e-9)
    assert curve.sd_mv == pytest.approx(curve.samples_mv.std(axis=0))


@pytest.mark.slow
def test_the_window_is_near_the_true_one() -> None:
    window = told(RegressionModel(SupportVectorRegression()), trials_of(bell_mv)).estimate().window
    assert window.start_ms == pytest.approx(213.0, abs=15.0)
    assert window.end_ms == pytest.approx(313.0, abs=15.0)


def test_without_trials_a_flat_curve_stands_in() -> None:
    posterior = RegressionModel(SupportVectorRegression()).begin(VALVE_SPACE, 1)
    assert "no trials" in known(posterior.trouble)
    assert posterior.estimate().window is None


@pytest.mark.slow
def test_the_model_conforms() -> None:
    check_model(lambda: RegressionModel(SupportVectorRegression(committee=3)), IMPACT_SPACE, order_tolerance_ms=1.0)


@pytest.mark.parametrize(
    "settings", [{"c": 0.0}, {"length_ms": 0.0}, {"epsilon": -0.1}, {"committee": 1}, {"committee": 2.5}]
)
def test_an_invalid_setting_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"c must|length_ms|epsilon|committee"):
        SupportVectorRegression(**settings)
