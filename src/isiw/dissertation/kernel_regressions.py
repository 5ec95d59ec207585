"""Regressions with kernels, the dissertation's GPR and SVMR [Kim2020, 4.3]: one noise for all ISIs, or support vectors.

`isiw.models.gp` is what one would choose today.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, partial
from typing import Annotated, Any, Final

import numpy as np
from threadpoolctl import ThreadpoolController

from isiw.checks import Checked, Count, NonNegative, Number, Positive, number, whole
from isiw.design import DesignSpace
from isiw.dissertation.regression import FittedCurve
from isiw.lazy import scipy, sklearn
from isiw.types import FloatArray

LEAST_SCALE_MV = 1e-3
"""Amplitudes are fitted in units of the largest excess, or of this if that is smaller [mV]."""

SUPPORT_MS = 5.0
"""Distance of the ISIs at which curves are drawn; the kernel is smooth in between."""


@dataclass(frozen=True)
class GaussianProcessRegression(Checked):
    """scikit-learn's Gaussian process with a squared-exponential kernel and white noise, about the floor.

    The text gives neither kernel nor hyperparameters, only that the covariance is near 1 for close ISIs and 0 for
    distant ones, which the kernel is. Signal and noise variance, and the length, maximise the marginal likelihood.

    Args:
        length_ms: the kernel's length where the search for it starts [ms].
        min_length_ms: shortest length that is searched [ms].
        max_length_ms: longest length that is searched [ms].
        noise: noise SD where the search starts, as a share of the largest excess.
        max_fit_iterations: iterations after which the search gives up.
        samples: how many curves are drawn.
    """

    length_ms: Number = 40.0
    min_length_ms: Positive = 25.0
    max_length_ms: Number = 100.0
    noise: Annotated[float, partial(number, above=0, below=1)] = 0.3
    max_fit_iterations: Count = 40
    samples: Annotated[int, partial(whole, least=2)] = 64

    def __post_init__(self) -> None:
        super().__post_init__()
        number("GaussianProcessRegression.length_ms", self.length_ms, least=self.min_length_ms)
        number("GaussianProcessRegression.max_length_ms", self.max_length_ms, least=self.length_ms)

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the Gaussian process; see `RegressionMethod`."""
        scale_mv = max(float(np.abs(excess_mv).max(initial=0.0)), LEAST_SCALE_MV)
        grid = space.grid_ms
        support = np.linspace(space.low_ms, space.high_ms, round((space.high_ms - space.low_ms) / SUPPORT_MS) + 1)
        # Matrices this small gain nothing from several threads, and lose a lot if the machine is busy.
        with _blas().limit(limits=1, user_api="blas"):
            process, noise, trouble = self._process(isi_ms[:, None], excess_mv / scale_mv)
            mean, covariance = process.predict(support[:, None], return_cov=True)
            values, vectors = np.linalg.eigh(covariance - noise**2 * np.eye(len(support)))
            drawn = mean + rng.standard_normal((self.samples, len(support))) @ (vectors * np.sqrt(values.clip(0.0))).T
            mean, sd = process.predict(grid[:, None], return_std=True)
        return FittedCurve(
            grid_ms=grid,
            mean_mv=mean * scale_mv,
            sd_mv=np.sqrt((sd**2 - noise**2).clip(0.0)) * scale_mv,
            samples_mv=np.stack([np.interp(grid, support, curve) for curve in drawn]) * scale_mv,
            noise_sd_mv=noise * scale_mv,
            trouble=trouble,
            fitted=len(isi_ms) > 0,
        )

    def _process(self, isi: FloatArray, scaled: FloatArray) -> tuple[Any, float, str | None]:
        """The process at its best hyperparameters, its noise SD, and what went wrong."""
        signal = sklearn.gaussian_process.kernels.ConstantKernel(1.0, (0.01, 10.0))
        kernel = signal * sklearn.gaussian_process.kernels.RBF(
            self.length_ms, (self.min_length_ms, self.max_length_ms)
        ) + sklearn.gaussian_process.kernels.WhiteKernel(self.noise**2, (1e-4, 1.0))
        process = sklearn.gaussian_process.GaussianProcessRegressor(kernel, optimizer=None)
        if not len(isi):
            return process, self.noise, "There are no trials to fit yet: the Gaussian process before any stands in."
        process.fit(isi, scaled)
        found = scipy.optimize.minimize(
            partial(_cost, process),
            kernel.theta,
            jac=True,
            method="L-BFGS-B",
            bounds=kernel.bounds,
            options={"maxiter": self.max_fit_iterations, "ftol": 1e-5},
        )
        process = sklearn.gaussian_process.GaussianProcessRegressor(
            kernel.clone_with_theta(found.x), optimizer=None
        ).fit(isi, scaled)
        gave_up = f"The kernel did not converge in {self.max_fit_iterations} iterations: its best parameters stand in."
        return process, math.exp(0.5 * found.x[-1]), None if found.success else gave_up


_blas: Final = cache(ThreadpoolController)
"""The controller of the libraries that are loaded at its first call; looking for them takes longer than a fit."""


def _cost(process: Any, theta: FloatArray) -> tuple[float, FloatArray]:
    value, gradient = process.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False)
    return -float(value), -gradient


@dataclass(frozen=True)
class SupportVectorRegression(Checked):
    """scikit-learn's SVR, and a committee of it on bootstrapped trials.

    A support vector regression has no uncertainty of its own: the spread of the committee stands in for it. The text
    gives no hyperparameters.

    Args:
        c: cost of a residual, per MEP.
        epsilon: residual that costs nothing, as a share of the largest excess.
        length_ms: SD of the kernel [ms]; scikit-learn's gamma is 1 / (2 length²).
        committee: how many regressions on bootstrapped trials.
    """

    c: Positive = 1.0
    epsilon: NonNegative = 0.1
    length_ms: Positive = 50.0
    committee: Annotated[int, partial(whole, least=2)] = 10

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the regression and its committee; see `RegressionMethod`."""
        grid = space.grid_ms
        if not len(isi_ms):
            flat = np.zeros(len(grid))
            trouble = "There are no trials to fit yet: a flat curve stands in."
            return FittedCurve(grid, flat, flat, np.tile(flat, (self.committee, 1)), 0.0, trouble=trouble, fitted=False)
        scale_mv = max(float(np.abs(excess_mv).max()), LEAST_SCALE_MV)
        regression = sklearn.svm.SVR(C=self.c, epsilon=self.epsilon, gamma=0.5 / self.length_ms**2)
        isi, scaled = isi_ms[:, None], excess_mv / scale_mv
        picks = rng.integers(len(isi), size=(self.committee, len(isi)))
        members_mv = np.stack([regression.fit(isi[i], scaled[i]).predict(grid[:, None]) for i in picks]) * scale_mv
        regression.fit(isi, scaled)
        return FittedCurve(
            grid_ms=grid,
            mean_mv=regression.predict(grid[:, None]) * scale_mv,
            sd_mv=members_mv.std(axis=0),
            samples_mv=members_mv,
            noise_sd_mv=float(np.sqrt(np.mean((regression.predict(isi) - scaled) ** 2))) * scale_mv,
        )
