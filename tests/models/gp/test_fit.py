"""Marginal likelihoods agree with scikit-learn's, and a fit that fails says so and has a stand-in."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

from isiw.models.gp.fit import Fit, fit
from isiw.models.gp.places import Hyperparameters
from isiw.models.gp.prior import (
    FixedProcess,
    HyperparameterPrior,
    ProcessSettings,
    Standardisation,
    Transform,
    scale_of,
)
from isiw.models.shared.history import PersonTrials
from known import known

PRIOR = HyperparameterPrior()
FIXED = FixedProcess(length_ms=40.0, amplitude=1.1, noise=0.6, centre=-3.8, unit=0.9)
NOBODY = np.empty(0)


def trials(n: int = 30, seed: int = 0, alone: int = 0) -> PersonTrials:
    """Trials of a person with a Gaussian profile from 200 to 300 ms and log-normal noise."""
    rng = np.random.default_rng(seed)
    isis_ms = rng.uniform(0, 500, n)
    expected_mv = 0.01 + 0.08 * np.exp(-0.5 * ((isis_ms - 250) / 25) ** 2)
    return PersonTrials(isis_ms, expected_mv * rng.lognormal(0, 0.5, n), 0.01 * rng.lognormal(0, 0.5, alone))


def fitted(told: PersonTrials, **options: Any) -> Fit:
    settings = ProcessSettings("rbf", **{"prior": PRIOR, **options})
    return fit(settings, scale_of(told.mep_mv, "log", 0.005), told)


def test_the_marginal_likelihood_is_that_of_scikit_learn() -> None:
    told = trials()
    scale = Standardisation("log", 0.005, FIXED.centre, FIXED.unit)
    values = (np.log(told.mep_mv) - FIXED.centre) / FIXED.unit
    kernel = ConstantKernel(FIXED.amplitude**2) * RBF(FIXED.length_ms) + ConstantKernel(1.0)
    reference = GaussianProcessRegressor(kernel, alpha=FIXED.noise**2, optimizer=None).fit(told.isi_ms[:, None], values)
    got = fit(ProcessSettings("rbf", prior=PRIOR, fixed=FIXED), scale, told)
    log_marginal = (got.log_joint - got.log_prior)[0].item()
    assert log_marginal == pytest.approx(reference.log_marginal_likelihood_value_, abs=1e-6)


def test_trials_of_tms_alone_are_the_constant_and_noise() -> None:
    told = trials(8, alone=3)
    scale = Standardisation("log", 0.005, FIXED.centre, FIXED.unit)
    values = torch.cat([scale.standardised(x) for x in (told.mep_mv, told.baseline_mv)])
    steps = torch.as_tensor((told.isi_ms[:, None] - told.isi_ms) / FIXED.length_ms)
    covariance = torch.ones((11, 11), dtype=torch.float64) + FIXED.noise**2 * torch.eye(11).double()
    covariance[:8, :8] += FIXED.amplitude**2 * torch.exp(-0.5 * steps.square())
    expected = torch.distributions.MultivariateNormal(torch.zeros(11).double(), covariance).log_prob(values)
    got = fit(ProcessSettings("rbf", prior=PRIOR, fixed=FIXED), scale, told)
    assert (got.log_joint - got.log_prior)[0].item() == pytest.approx(expected.item(), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("transform", ["log", "sqrt", "none"])
def test_the_evidence_is_a_density_of_log_amplitudes(transform: Transform) -> None:
    # Summed over all amplitudes that the next trial may have, the predictive density is 1.
    centre, unit = {"log": (-3.0, 0.3), "sqrt": (0.3, 0.02), "none": (0.09, 0.005)}[transform]
    fixed = replace(FIXED, centre=centre, unit=unit)
    scale, log_meps = Standardisation(transform, 1e-6, centre, unit), np.linspace(-7.0, 1.0, 161)
    told = [PersonTrials(np.array([250.0]), np.array([math.exp(x)]), NOBODY) for x in log_meps]
    densities = np.exp([fit(ProcessSettings("rbf", prior=PRIOR, fixed=fixed), scale, one).log_evidence for one in told])
    assert densities.sum() * (log_meps[1] - log_meps[0]) == pytest.approx(1.0, abs=1e-3)


def test_a_profile_is_believed_and_a_flat_one_is_not() -> None:
    told = trials()
    flat = replace(told, mep_mv=0.01 * np.random.default_rng(1).lognormal(0, 0.5, 30))
    odds = [float(fitted(x).log_totals[0] - fitted(x).log_totals[1]) for x in (told, flat)]
    assert odds[0] > math.log(100)
    assert odds[1] < 0


@pytest.mark.slow
def test_the_most_likely_process_is_more_likely_than_all_of_the_grid() -> None:
    told = trials()
    grid, most_likely = fitted(told), fitted(told, hyperparameters="map")
    within = grid.processes.picked(torch.tensor([grid.best]))
    zs = [PRIOR.z(x)[0].square().sum() for x in (within, most_likely.processes.picked(torch.tensor([0])))]
    no_noise = torch.zeros(30, dtype=torch.float64)
    likelihoods = [f.log_marginal(f.processes, no_noise)[f.best] for f in (grid, most_likely)]
    assert likelihoods[1] - 0.5 * zs[1] >= likelihoods[0] - 0.5 * zs[0]
    assert most_likely.trouble is None
    torch.testing.assert_close(most_likely.log_totals, grid.log_totals)


def test_noise_by_isi_leaves_the_odds_of_a_profile_as_they_are() -> None:
    told = trials()
    torch.testing.assert_close(fitted(told, noise="by-isi").log_totals, fitted(told).log_totals)


def test_where_nothing_is_impossible_it_stays_so() -> None:
    told = trials()
    certain = replace(PRIOR, p_window=1.0)
    for options in ({}, {"hyperparameters": "map"}, {"noise": "by-isi"}):
        got = fitted(told, prior=certain, **options)
        assert got.log_joint[got.processes.amplitude == 0].exp().sum() == 0


def test_a_singular_covariance_is_told_and_answered_by_the_medians() -> None:
    told = PersonTrials(np.full(10, 250.0), np.linspace(0.01, 0.1, 10), NOBODY)
    scale = Standardisation("log", 0.005, FIXED.centre, FIXED.unit)
    sound = fit(ProcessSettings("rbf", prior=PRIOR, fixed=FIXED), scale, told)
    assert sound.trouble is None
    noiseless = Hyperparameters(*(torch.tensor([value], dtype=torch.float64) for value in (40.0, 1.0, 0.0)))
    singular = replace(sound, processes=noiseless, log_prior=torch.zeros(1)).conditioned(told)
    assert "singular" in known(singular.trouble)
    assert "medians" in known(singular.trouble)
    assert singular.processes.noise.tolist() == [PRIOR.noise[0]] * 2
    assert torch.isfinite(singular.log_joint).all()


def test_a_search_that_does_not_end_is_told() -> None:
    got = fitted(trials(), hyperparameters="map", max_evaluations=5)
    assert "has not ended after 5 evaluations" in known(got.trouble)
    assert torch.isfinite(got.log_joint).all()
