"""The prior of the hyperparameters: its grid is a grid of it, and nonsense is refused."""

from __future__ import annotations

import math
from typing import Any

import pytest
import torch

from isiw.errors import InvalidValueError
from isiw.models.gp.prior import FixedProcess, HyperparameterPrior


def test_the_grid_has_the_medians_and_spreads_of_the_prior() -> None:
    prior = HyperparameterPrior()
    processes, log_prior = prior.grid()
    weights = log_prior.exp() * (processes.amplitude > 0)
    assert weights.sum().item() == pytest.approx(prior.p_window)
    weights = weights / weights.sum()
    for values, (median, log_sd, _) in ((processes.length_ms, prior.length_ms), (processes.noise, prior.noise)):
        mean = (weights * values.log()).sum()
        assert mean.exp().item() == pytest.approx(median)
        # A grid that ends at 2.25 SDs has a little less spread.
        spread = (weights * (values.log() - mean).square()).sum().sqrt().item()
        assert 0.85 * log_sd < spread <= log_sd


def test_hyperparameters_there_and_back() -> None:
    prior = HyperparameterPrior()
    z = torch.tensor([[0.5, -1.0, 2.0], [0.0, 0.0, 0.0]], dtype=torch.float64)
    torch.testing.assert_close(prior.z(prior.at(z)), z)


@pytest.mark.parametrize(
    ("settings", "what"),
    [
        ({"length_ms": (0.0, 0.5)}, "length_ms"),
        ({"amplitude": (1.0, -0.5)}, "amplitude"),
        ({"noise": (0.6, math.nan)}, "noise"),
        ({"noise": (0.6,)}, "noise"),
        ({"noise": (0.02, 0.5)}, "singular"),
        ({"p_window": 0.0}, "p_window"),
        ({"p_window": 1.1}, "p_window"),
    ],
)
def test_an_invalid_prior_is_refused(settings: dict[str, Any], what: str) -> None:
    with pytest.raises(InvalidValueError, match=what):
        HyperparameterPrior(**settings)


@pytest.mark.parametrize(
    "changed", [{"length_ms": 0.0}, {"noise": -1.0}, {"noise": 0.001}, {"centre": math.inf}, {"unit": 0.0}]
)
def test_an_invalid_process_is_refused(changed: dict[str, float]) -> None:
    usual = {"length_ms": 40.0, "amplitude": 1.0, "noise": 0.3, "centre": -4.0, "unit": 0.8}
    with pytest.raises(InvalidValueError):
        FixedProcess(**{**usual, **changed})
