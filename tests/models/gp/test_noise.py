"""Noise that depends on the ISI is found, and equal noise is left alone."""

from __future__ import annotations

import numpy as np
import torch

from isiw.models.gp.fit import MAX_LOG_VARIANCE, equal_noise, leave_one_out, noise_profile

ISIS_MS = torch.linspace(0.0, 500.0, 80, dtype=torch.float64)


def profile_of(residuals: torch.Tensor) -> torch.Tensor:
    """Relative log variances found from residuals about a mean that is known, at the trials."""
    found = noise_profile(ISIS_MS, lambda log_variance: residuals * torch.exp(-0.5 * log_variance))
    return found.log_variance(ISIS_MS)


def residuals(log_sd: torch.Tensor, seed: int = 0) -> torch.Tensor:
    return torch.exp(log_sd) * torch.as_tensor(np.random.default_rng(seed).standard_normal(len(log_sd)))


def test_isis_with_more_noise_are_found() -> None:
    # The noise SD is three times as large in the second half, a log variance higher by 2.2; half of it is found.
    found = profile_of(residuals(torch.where(ISIS_MS > 250, np.log(3.0), 0.0)))
    assert found[60:].mean() - found[:20].mean() > 1.1


def test_equal_noise_stays_nearly_equal() -> None:
    spread = [profile_of(residuals(torch.zeros(80), seed)).std().item() for seed in range(10)]
    assert np.mean(spread) < 0.3


def test_only_ratios_of_noise_are_learnt() -> None:
    loud, quiet = (profile_of(scale * residuals(torch.zeros(80).double())) for scale in (10.0, 0.1))
    assert abs(loud.mean().item()) < 1e-9
    torch.testing.assert_close(loud, quiet, rtol=0, atol=0.1)


def test_residuals_that_break_things_give_finite_profiles() -> None:
    equal = torch.zeros(80, dtype=torch.float64)
    for values in (equal, equal + 1e6 * (torch.arange(80) == 3)):
        found = profile_of(values)
        assert torch.isfinite(found).all()
        assert found.abs().max() <= MAX_LOG_VARIANCE


def test_equal_noise_is_equal() -> None:
    assert equal_noise().log_variance(ISIS_MS).abs().max() == 0


def test_leave_one_out_residuals_are_those_of_leaving_one_out() -> None:
    rng = np.random.default_rng(5)
    root = torch.as_tensor(rng.standard_normal((6, 6)))
    covariance, values = root @ root.T + torch.eye(6), torch.as_tensor(rng.standard_normal(6))
    others = torch.arange(6) != 2
    weights = torch.linalg.solve(covariance[others][:, others], covariance[others, 2])
    variance = covariance[2, 2] - weights @ covariance[others, 2]
    expected = (values[2] - weights @ values[others]) / variance.sqrt()
    torch.testing.assert_close(leave_one_out(covariance, values)[2], expected)
