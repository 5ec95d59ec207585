"""BoTorch's acquisition functions on our Gaussian process."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from botorch.acquisition.active_learning import qNegIntegratedPosteriorVariance
from botorch.acquisition.analytic import AnalyticAcquisitionFunction, LogExpectedImprovement
from botorch.acquisition.max_value_entropy_search import qMaxValueEntropy

from isiw.acquisition.botorch import BotorchAcquisition
from isiw.design import VALVE_SPACE
from isiw.errors import StrategyError
from isiw.models.gp import GaussianProcess, GaussianProcessPosterior
from isiw.models.particles import ParticleModel
from isiw.models.protocol import Observation
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.testing import check_acquisition, check_strategy
from known import known

CANDIDATES = np.linspace(0.0, 500.0, 101, dtype=np.float32)
GRID_MS = torch.linspace(0.0, 500.0, 101, dtype=torch.float64).unsqueeze(-1)


class BotorchStraddle(AnalyticAcquisitionFunction):
    """Bryan et al. 2005, on the standardised MEP: how far its interval reaches across a level."""

    def __init__(self, model: Any, level: float) -> None:
        super().__init__(model=model)
        self.level = level

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        mean, sd = self._mean_and_sigma(x)
        return (1.96 * known(sd) - (mean - self.level).abs()).reshape(len(x))


def reduced_variance(model: Any) -> qNegIntegratedPosteriorVariance:
    return qNegIntegratedPosteriorVariance(model, mc_points=GRID_MS)


def after(isis_ms: list[float], meps_mv: list[float], people: int = 1) -> GaussianProcessPosterior:
    model = GaussianProcess(samples=32)
    posterior = model.begin(VALVE_SPACE, 1, people)
    for isi_ms, mep_mv in zip(isis_ms, meps_mv, strict=True):
        posterior = model.update(posterior, Observation.of([isi_ms] * people, [mep_mv] * people))
    return posterior


def one_peak(n: int) -> GaussianProcessPosterior:
    isis_ms = np.linspace(0, 500, n)
    return after(isis_ms.tolist(), (0.01 + 0.1 * np.exp(-0.5 * ((isis_ms - 250) / 40) ** 2)).tolist())


@pytest.mark.slow
@pytest.mark.parametrize("people", [1, 2])
def test_it_conforms(people: int) -> None:
    check_acquisition(BotorchAcquisition(reduced_variance), after([100.0, 250.0], [0.01, 0.1], people), VALVE_SPACE)


def test_it_scores_before_the_first_trial() -> None:
    assert np.isfinite(BotorchAcquisition(reduced_variance)(after([], []), CANDIDATES)).all()


def test_integrated_variance_is_reduced_most_in_the_gap() -> None:
    isis_ms = [0.0, 50.0, 100.0, 150.0, 350.0, 400.0, 450.0, 500.0]
    scores = BotorchAcquisition(reduced_variance)(after(isis_ms, [0.01, 0.02] * 4), CANDIDATES)[0]
    assert 200 <= CANDIDATES[scores.argmax()] <= 300
    assert scores[50] > scores[10]


def test_the_straddle_is_on_both_flanks_of_a_peak() -> None:
    scores = BotorchAcquisition(lambda model: BotorchStraddle(model, level=0.5))(one_peak(26), CANDIDATES)[0]
    before, behind = (float(CANDIDATES[half][scores[half].argmax()]) for half in (slice(0, 50), slice(51, 101)))
    assert 130 < before < 230
    assert 270 < behind < 370
    assert scores[50] < scores.max()
    assert scores[5] < scores.max()


def test_expected_improvement_is_at_the_peak() -> None:
    def improvement(model: Any) -> LogExpectedImprovement:
        return LogExpectedImprovement(model, best_f=model.train_targets.max())

    scores = BotorchAcquisition(improvement)(one_peak(26), CANDIDATES)[0]
    assert 200 <= CANDIDATES[scores.argmax()] <= 300


def test_what_botorch_draws_is_the_same_each_time_and_disturbs_nobody() -> None:
    acquisition = BotorchAcquisition(lambda model: qMaxValueEntropy(model, GRID_MS))
    posterior, state = one_peak(12), torch.get_rng_state()
    np.testing.assert_array_equal(acquisition(posterior, CANDIDATES), acquisition(posterior, CANDIDATES))
    assert torch.equal(torch.get_rng_state(), state)


@pytest.mark.slow
def test_a_strategy_asks_by_it() -> None:
    def make() -> Strategy:
        acquisition = BotorchAcquisition(reduced_variance)
        return Strategy(VALVE_SPACE, GaussianProcess(samples=32), acquisition, Budget(20), initial_ms=(100.0, 400.0))

    check_strategy(make, trials=8)


def test_a_model_that_has_nothing_for_botorch_is_refused() -> None:
    with pytest.raises(StrategyError, match="HasBotorchModel"):
        Strategy(VALVE_SPACE, ParticleModel(particles=20), BotorchAcquisition(reduced_variance), Budget(20))
