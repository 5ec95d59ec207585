"""Processes that leave their constant within a window, which lies where the rig and people let it lie."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

import isiw
from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.errors import InvalidValueError
from isiw.models.gp.fit import LEVEL_SD, Fit, fit, leave_one_out
from isiw.models.gp.model import GaussianProcess, draw_paths
from isiw.models.gp.places import WindowsPrior
from isiw.models.gp.prior import FixedProcess, ProcessSettings, Standardisation
from isiw.models.protocol import Observation
from isiw.models.shared.history import PersonTrials
from isiw.models.shared.start import StartPrior
from isiw.testing import check_model
from known import known

PRIOR = WindowsPrior(start=StartPrior(hit_delay_ms=(180.0, 6.0), p_anywhere=0.0), stray=0.0, ensemble=64)
SETTINGS = ProcessSettings("rbf", profile="window", windows=PRIOR)
SCALE = Standardisation("log", 0.005, math.log(0.012), 1.0)
MODEL = GaussianProcess(replace(SETTINGS, kernel="matern"), samples=64)


def trials(n: int = 30, alone: int = 3, isi_sd_ms: float = 0.0) -> PersonTrials:
    """Trials of a person with a window from 200 to 300 ms."""
    rng = np.random.default_rng(0)
    isi_ms = rng.uniform(0, 500, n)
    expected_mv = 0.01 + 0.08 * np.exp(-0.5 * ((isi_ms - 250) / 25) ** 2)
    meps_mv = expected_mv * rng.lognormal(0, 0.5, n), 0.01 * rng.lognormal(0, 0.5, alone)
    return PersonTrials(isi_ms, *meps_mv, np.full(n, isi_sd_ms))


def joint(found: Fit, which: int, isi_ms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance by hand of the trials with a tap, those of TMS alone, and paths at some ISIs, in this order.

    The last value is the constant; noise is on the trials only.
    """
    told, process = found.told, [float(column[which]) for column in found.processes]
    length_ms, deviation, noise = process
    place = known(found.places)
    middle, sd, rise, rise_sd, growth = (float(column[which]) for column in place)
    n, m = len(told.isi_ms), len(told.baseline_mv)
    at_ms = np.concatenate((told.isi_ms, np.full(m, 1e9), isi_ms, [1e9]))
    share = np.exp(-0.5 * ((at_ms - middle) / sd) ** 2)
    correlation = np.exp(-0.5 * ((at_ms[:, None] - at_ms) / length_ms) ** 2)
    covariance = LEVEL_SD**2 + np.outer(share, share) * (rise_sd**2 + deviation**2 * correlation)
    slope = -rise * share[:n] * (told.isi_ms - middle) / sd**2
    own = (noise * np.exp(growth * np.sqrt(share[: n + m]))) ** 2
    own[:n] += (slope * known(told.isi_sd_ms)) ** 2
    covariance[range(n + m), range(n + m)] += own
    return rise * share, covariance


def test_windows_cannot_lie_before_the_hit() -> None:
    # MEPs long before the hit, at 180 ms, are large by chance.
    told = [(30.0, 0.012), (60.0, 0.1), (65.0, 0.05), (70.0, 0.03), (80.0, 0.12), (100.0, 0.012), (110.0, 0.01)]
    told += [(200.0, 0.012), (240.0, 0.02), (280.0, 0.011), (340.0, 0.009), (420.0, 0.01)]
    for name in ("gp-straddle", "gp-variance", "gp-ei"):
        model = isiw.make_strategy(name, VALVE_SPACE, hit_delay_ms=(180.0, 6.0)).model
        posterior = model.begin(VALVE_SPACE, 1)
        for isi_ms, mep_mv in told:
            posterior = model.update(posterior, Observation.of([isi_ms], [mep_mv]))
        found = posterior.estimate().window
        assert found is None or found.start_ms > 140.0


def test_the_marginal_likelihood_is_that_of_the_joint_gaussian() -> None:
    told = trials(isi_sd_ms=4.0)
    found = fit(SETTINGS, SCALE, told, VALVE_SPACE)
    values = np.log(np.maximum(np.concatenate((told.mep_mv, told.baseline_mv)), 0.005)) - SCALE.centre
    for which in (0, 17):
        mean, covariance = joint(found, which, np.empty(0))
        centre, spread = torch.as_tensor(mean[:-1]), torch.as_tensor(covariance[:-1, :-1])
        law = torch.distributions.MultivariateNormal(centre, spread)
        log_marginal = (found.log_joint - found.log_prior)[which].item()
        # Functions that are left out, and straight lines between the points of a grid, cost less than this.
        assert log_marginal == pytest.approx(law.log_prob(torch.as_tensor(values)).item(), abs=1e-3)


def test_residuals_are_what_all_other_trials_leave() -> None:
    found = fit(SETTINGS, SCALE, trials(12), VALVE_SPACE)
    mean, covariance = joint(found, found.best, np.empty(0))
    told = np.log(np.maximum(np.concatenate((found.told.mep_mv, found.told.baseline_mv)), 0.005)) - SCALE.centre
    expected = leave_one_out(torch.as_tensor(covariance[:-1, :-1]), torch.as_tensor(told - mean[:-1]))
    surprise = found.surprise(torch.zeros(12, dtype=torch.float64))
    np.testing.assert_allclose(surprise, expected[:12], rtol=0, atol=1e-3)


def test_paths_and_their_constant_are_those_of_the_joint_gaussian() -> None:
    # One process alone; 20,000 paths: means within 5 and variances within 8 standard errors.
    told, isi_ms = trials(8), np.linspace(150.0, 350.0, 5)
    found = fit(SETTINGS, SCALE, told, VALVE_SPACE)
    only = found.log_prior + torch.where(torch.arange(len(found.log_prior)) == found.best, 0.0, -torch.inf)
    paths = draw_paths(replace(found, log_prior=only), torch.as_tensor(isi_ms), 20_000, np.random.default_rng(1))
    mean, covariance = joint(found, found.best, isi_ms)
    n = 8 + 3
    values = np.log(np.maximum(np.concatenate((told.mep_mv, told.baseline_mv)), 0.005)) - SCALE.centre
    gain = np.linalg.solve(covariance[:n, :n], covariance[:n, n:]).T
    expected = SCALE.centre + mean[n:] + gain @ (values - mean[:n])
    left = covariance[n:, n:] - gain @ covariance[:n, n:]
    drawn = np.column_stack((paths.level, paths.alone))
    sd = left.diagonal() ** 0.5
    assert (np.abs(drawn.mean(0) - expected) < 5 * sd / 20_000**0.5).all()
    assert (np.abs(np.cov(drawn.T) - left) < 8 * np.outer(sd, sd) / 20_000**0.5).all()


def test_botorch_gets_the_most_believable_process() -> None:
    told, isi_ms = trials(12, alone=0), np.linspace(0.0, 500.0, 26)
    found = fit(SETTINGS, SCALE, told, VALVE_SPACE)
    mean, covariance = joint(found, found.best, isi_ms)
    gain = np.linalg.solve(covariance[:12, :12], covariance[:12, 12:-1]).T
    expected = mean[12:-1] + gain @ (np.log(np.maximum(told.mep_mv, 0.005)) - SCALE.centre - mean[:12])
    with torch.no_grad():
        posterior = found.regression(torch.tensor(found.best)).posterior(torch.as_tensor(isi_ms)[:, None])
    np.testing.assert_allclose(posterior.mean[:, 0], expected, rtol=0, atol=1e-6)
    left = (covariance[12:-1, 12:-1] - gain @ covariance[:12, 12:-1]).diagonal()
    np.testing.assert_allclose(posterior.variance[:, 0], left, rtol=0, atol=1e-6)


def test_windows_of_the_ensemble_have_the_law_of_the_prior() -> None:
    prior = replace(PRIOR, ensemble=4096)
    processes, places, log_prior = prior.processes(VALVE_SPACE)
    rising = places.sd_ms.isfinite()
    start_ms = (places.middle_ms - 2.0 * places.sd_ms)[rising].numpy()
    knots = prior.start.knots(VALVE_SPACE)
    for share in (0.1, 0.5, 0.9):
        assert np.quantile(start_ms, share) == pytest.approx(np.interp(share, knots.below, knots.start_ms), abs=1.0)
    assert float((4.0 * places.sd_ms[rising]).median()) == pytest.approx(100.0, rel=0.01)
    assert float(processes.noise[rising].log().std()) == pytest.approx(prior.noise.sd, rel=0.03)
    assert float(log_prior[rising].logsumexp(0).exp()) == pytest.approx(prior.p_window)
    assert float(log_prior.logsumexp(0).exp()) == pytest.approx(1.0)


def test_an_isi_that_is_not_known_exactly_counts_less_on_the_flanks() -> None:
    exact, blurred = (fit(SETTINGS, SCALE, trials(isi_sd_ms=sd), VALVE_SPACE) for sd in (0.0, 20.0))
    picks = torch.tensor(exact.best)
    isi_ms = torch.tensor([[220.0], [280.0]], dtype=torch.float64)
    with torch.no_grad():
        sds = [each.regression(picks).posterior(isi_ms).variance.sum() for each in (exact, blurred)]
    assert sds[1] > 1.05 * sds[0]


@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_it_conforms(space: isiw.DesignSpace) -> None:
    check_model(lambda: replace(MODEL, samples=16), space)


@pytest.mark.parametrize(
    "learnt", [{"hyperparameters": "map"}, {"fixed": FixedProcess(40.0, 1.1, 0.6, -3.8)}], ids=["most likely", "fixed"]
)
def test_the_hyperparameters_of_windows_are_averaged_over(learnt: dict[str, Any]) -> None:
    anywhere = ProcessSettings(**learnt)
    with pytest.raises(InvalidValueError, match="averaged over"):
        replace(anywhere, profile="window")


def test_windows_are_of_the_log_mep() -> None:
    with pytest.raises(InvalidValueError, match="log MEP"):
        replace(MODEL, transform="sqrt")
