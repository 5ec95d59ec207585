"""The processes agree with scikit-learn's, which shares no code with them."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern

from isiw.models.gp.places import Hyperparameters
from isiw.models.gp.prior import KernelName, correlations, regression

RNG = np.random.default_rng(3)
ISIS_MS = RNG.uniform(0, 500, 40)
VALUES = np.sin(ISIS_MS / 60) + 0.4 * RNG.standard_normal(40)
GRID_MS = np.linspace(-10, 510, 261)
LENGTH_MS, AMPLITUDE, NOISE = 45.0, 1.3, 0.5


def process(
    *, lengths_ms: tuple[float, ...] = (LENGTH_MS,)
) -> tuple[Hyperparameters, tuple[torch.Tensor, torch.Tensor]]:
    """Processes about a constant of mean 0 and variance 1."""
    amplitude, noise, mean, variance = (
        torch.full((len(lengths_ms),), value, dtype=torch.float64) for value in (AMPLITUDE, NOISE, 0.0, 1.0)
    )
    return Hyperparameters(torch.tensor(lengths_ms, dtype=torch.float64), amplitude, noise), (mean, variance)


def reference(kernel: KernelName, relative_variance: np.ndarray) -> GaussianProcessRegressor:
    shape = Matern(LENGTH_MS, nu=2.5) if kernel == "matern" else RBF(LENGTH_MS)
    covariance = ConstantKernel(AMPLITUDE**2) * shape + ConstantKernel(1.0)
    fitted = GaussianProcessRegressor(covariance, alpha=NOISE**2 * relative_variance, optimizer=None)
    return fitted.fit(ISIS_MS[:, None], VALUES)


@pytest.mark.parametrize("kernel", ["rbf", "matern"])
@pytest.mark.parametrize("ratio", [1.0, 4.0])
def test_mean_and_sd_are_those_of_scikit_learn(kernel: KernelName, ratio: float) -> None:
    relative = np.where(ISIS_MS > 250, ratio, 1.0)
    mean, sd = reference(kernel, relative).predict(GRID_MS[:, None], return_std=True)
    data = (torch.as_tensor(x) for x in (ISIS_MS, VALUES, relative))
    with torch.no_grad():
        posterior = regression(kernel, *process(), *data).posterior(torch.as_tensor(GRID_MS)[:, None])
    np.testing.assert_allclose(posterior.mean[0, :, 0], mean, rtol=0, atol=1e-6)
    np.testing.assert_allclose(posterior.variance[0, :, 0].sqrt(), sd, rtol=0, atol=1e-6)


def test_processes_in_one_batch_do_not_see_each_other() -> None:
    grid = torch.as_tensor(GRID_MS)[:, None]
    data = [torch.as_tensor(x) for x in (ISIS_MS, VALUES, np.ones(40))]
    with torch.no_grad():
        alone = regression("rbf", *process(), *data).posterior(grid).mean[0]
        beside = regression("rbf", *process(lengths_ms=(20.0, LENGTH_MS, 90.0)), *data).posterior(grid).mean[1]
    torch.testing.assert_close(beside, alone, rtol=0, atol=1e-10)


def test_without_trials_the_process_is_its_prior() -> None:
    nothing = torch.empty(0, dtype=torch.float64)
    with torch.no_grad():
        posterior = regression("rbf", *process(), nothing, nothing, nothing).posterior(torch.tensor([[100.0]]).double())
    assert posterior.mean.item() == 0.0
    assert posterior.variance.item() == pytest.approx(AMPLITUDE**2 + 1.0)


def test_correlations_fall_with_the_distance_in_lengths() -> None:
    isi_ms = torch.tensor([0.0, 30.0, 60.0], dtype=torch.float64)
    short, long = correlations("rbf", torch.tensor([30.0, 60.0]).double(), isi_ms)
    np.testing.assert_allclose(short[0], np.exp([0, -0.5, -2.0]), rtol=1e-12)
    np.testing.assert_allclose(long[0], np.exp([0, -0.125, -0.5]), rtol=1e-12)
