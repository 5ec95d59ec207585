"""BoTorch's acquisition functions on our Gaussian process, as strategies that a study knows by their names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import torch
from botorch.acquisition.active_learning import qNegIntegratedPosteriorVariance
from botorch.acquisition.analytic import LogExpectedImprovement
from botorch.acquisition.joint_entropy_search import qJointEntropySearch

import isiw
from isiw.acquisition import BotorchAcquisition

GRID_MS: Final = torch.linspace(0.0, 500.0, 101, dtype=torch.float64).unsqueeze(-1)
OPTIMA: Final = 16
"""Sampled profiles whose maxima joint entropy search looks at."""


def expected_improvement(model: Any) -> LogExpectedImprovement:
    """Log expected improvement over the largest posterior mean."""
    return LogExpectedImprovement(model, best_f=model.posterior(GRID_MS).mean.max())


def integrated_variance(model: Any) -> qNegIntegratedPosteriorVariance:
    """Negative integrated posterior variance (NIPV), over the whole range."""
    return qNegIntegratedPosteriorVariance(model, mc_points=GRID_MS)


def joint_entropy(model: Any) -> qJointEntropySearch:
    """Joint entropy search (JES): of the best ISI and its MEP, from maxima of sampled profiles on a grid."""
    profiles = model.posterior(GRID_MS).rsample(torch.Size([OPTIMA]))
    best, where = profiles.max(dim=1)
    return qJointEntropySearch(model, optimal_inputs=GRID_MS[where[:, 0]], optimal_outputs=best)


FUNCTIONS: Final[Mapping[str, Callable[[Any], Callable[[Any], Any]]]] = {
    "ei": expected_improvement,
    "nipv": integrated_variance,
    "jes": joint_entropy,
}


def gaussian_process(space: isiw.DesignSpace, seed: int, function: str) -> isiw.Strategy:
    """Our Gaussian process, asked by a function of BoTorch's.

    Args:
        space: the ISIs that may be asked.
        seed: of the strategy.
        function: one of `FUNCTIONS`.
    """
    usual = isiw.make_strategy("gp-straddle", space, seed)
    asked = BotorchAcquisition(FUNCTIONS[function])
    return isiw.Strategy(space, usual.model, asked, usual.stopping, initial_ms=usual.initial_ms, seed=seed)
