import math
from typing import Any

import pytest
import torch
from scipy.stats import kstest

from isiw.design import VALVE_SPACE
from isiw.excess import EDGE_LEVEL
from isiw.models.parametric.law import (
    Likelihood,
    Unknowns,
    WindowPrior,
    draw_log_mep,
    latent_names,
    levels,
    log_likelihood,
)
from known import known

LIKELIHOODS: tuple[Likelihood, ...] = ("gamma", "log-normal", "input-noise")
LEVELS = torch.tensor([0.0, 0.1, 0.5, 1.0], dtype=torch.double)
GRID = torch.linspace(math.log(1e-6), math.log(1e3), 20_001, dtype=torch.double)


def people(likelihood: Likelihood, n: int = 5, spread: float = 0.5, **prior: Any) -> Unknowns:
    generator = torch.Generator().manual_seed(3)
    latents = spread * torch.randn((n, len(latent_names(likelihood))), generator=generator, dtype=torch.double)
    return WindowPrior(**prior).unknowns(latents, likelihood, VALVE_SPACE)


def points(log_mep: torch.Tensor) -> torch.Tensor:
    return torch.stack((log_mep, log_mep), dim=-1)


def on_grid(unknowns: Unknowns, likelihood: Likelihood, grid: torch.Tensor = GRID) -> torch.Tensor:
    """Density of the log MEP on a grid at each of the levels, shape (m, levels, grid)."""
    each = Unknowns(*(field.unsqueeze(-1) for field in unknowns))
    return log_likelihood(each, LEVELS.unsqueeze(-1), points(grid), likelihood).exp()


@pytest.mark.slow
def test_the_edges_of_a_window_have_the_share_that_defines_them() -> None:
    unknowns = people("gamma")
    for edge_ms in (unknowns.start_ms, unknowns.start_ms + unknowns.width_ms):
        at_edge = torch.stack([levels(unknowns, isi_ms.reshape(1))[k, 0] for k, isi_ms in enumerate(edge_ms)])
        torch.testing.assert_close(at_edge, torch.full_like(at_edge, EDGE_LEVEL), atol=5e-4, rtol=0.0)


def test_tms_alone_has_no_excess_and_leaves_gradients_finite() -> None:
    unknowns = people("gamma")
    width_ms = unknowns.width_ms.clone().requires_grad_()
    level = levels(unknowns._replace(width_ms=width_ms), torch.tensor([math.nan, 250.0], dtype=torch.double))
    assert (level[:, 0] == 0).all()
    torch.autograd.backward(level.sum())
    assert known(width_ms.grad).isfinite().all()


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_a_density_integrates_to_one(likelihood: Likelihood) -> None:
    total = torch.trapezoid(on_grid(people(likelihood), likelihood), GRID, dim=-1)
    torch.testing.assert_close(total, torch.ones_like(total), atol=1e-5, rtol=0.0)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_without_outliers_the_expected_mep_is_the_baseline_and_the_share_of_the_amplitude(
    likelihood: Likelihood,
) -> None:
    # The nodes reach to 2.6 SDs: with noise on the input the expectation is off by less than 2 %.
    unknowns = people(likelihood, outliers=(-30.0, 0.1))
    mean_mv = torch.trapezoid(on_grid(unknowns, likelihood) * GRID.exp(), GRID, dim=-1)
    expected_mv = unknowns.baseline_mv.unsqueeze(-1) + unknowns.amplitude_mv.unsqueeze(-1) * LEVELS
    torch.testing.assert_close(mean_mv, expected_mv, rtol=0.02 if likelihood == "input-noise" else 1e-4, atol=0.0)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_the_probability_of_an_interval_is_the_integral_of_the_density(likelihood: Likelihood) -> None:
    # Wilson and Hilferty's distribution function of the gamma is off by up to half a per cent.
    unknowns = people(likelihood)
    for low, high in ((-math.inf, math.log(0.005)), (math.log(0.02), math.inf), (-math.inf, math.log(0.02))):
        grid = torch.linspace(max(low, GRID[0].item()), min(high, GRID[-1].item()), 5001, dtype=torch.double)
        expected = torch.trapezoid(on_grid(unknowns, likelihood, grid), grid, dim=-1)
        interval = torch.tensor([[low, high]], dtype=torch.double).expand(len(LEVELS), -1)
        got = log_likelihood(unknowns, LEVELS.expand(len(expected), -1), interval, likelihood).exp()
        torch.testing.assert_close(got, expected, atol=0.005 if likelihood == "gamma" else 1e-4, rtol=0.0)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_draws_have_the_distribution_that_the_likelihood_is_of(likelihood: Likelihood) -> None:
    unknowns = people(likelihood, 2000, 1.0)
    level = torch.linspace(0.0, 1.0, 2000, dtype=torch.double).unsqueeze(-1)
    log_mep = draw_log_mep(unknowns, level, likelihood, torch.Generator().manual_seed(1))
    intervals = torch.stack((torch.full_like(log_mep, -math.inf), log_mep), dim=-1)
    below = log_likelihood(unknowns, level, intervals, likelihood)
    assert kstest(below.exp().flatten().numpy(), "uniform").pvalue > 0.01


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
@pytest.mark.parametrize("mep_mv", [1e-4, 0.01, 50.0])
def test_however_odd_a_mep_its_likelihood_and_its_gradient_are_finite(likelihood: Likelihood, mep_mv: float) -> None:
    generator = torch.Generator().manual_seed(5)
    latents = 3.0 * torch.randn((200, len(latent_names(likelihood))), generator=generator, dtype=torch.double)
    latents.requires_grad_()
    unknowns = WindowPrior().unknowns(latents, likelihood, VALVE_SPACE)
    level = levels(unknowns, torch.tensor([250.0, math.nan], dtype=torch.double))
    log_mep = torch.full((2,), math.log(mep_mv), dtype=torch.double)
    total = log_likelihood(unknowns, level, points(log_mep), likelihood)
    torch.autograd.backward(total.sum())
    assert total.isfinite().all()
    assert known(latents.grad).isfinite().all()


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_an_mep_is_seen_or_not(likelihood: Likelihood) -> None:
    least = math.log(0.02)
    both = torch.tensor([[-math.inf, least], [least, math.inf]], dtype=torch.double)
    for level in (0.0, 0.3, 1.0):
        shares = log_likelihood(people(likelihood, 300, spread=1.0), torch.full((1, 2), level), both, likelihood).exp()
        torch.testing.assert_close(shares.sum(-1), torch.ones(300, dtype=torch.double), atol=1e-9, rtol=0.0)
