"""How the noise of a Gaussian process depends on the ISI: the most likely log variance.

A second Gaussian process describes the log variance [Kersting2007]. It is fitted to squared leave-one-out residuals by
Newton's method on their Gaussian likelihood, which is concave in the log variance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from isiw.lazy import torch
from isiw.models.protocol import Tensor

LOG_VARIANCE_SD = 0.6
"""Prior SD of the log variance about its mean: the noise SD varies by a factor of e^0.3 either way."""

LENGTH_MS = 80.0
"""Over which the log variance varies [ms]; longer than profiles do, since variances are harder to learn than means."""

MEAN_SD = 3.0
"""Prior SD of the mean log variance, which is practically unknown."""

MAX_LOG_VARIANCE = 4.0
"""The relative log variance stays within this, so that no trial is ignored and none is trusted completely."""

LEAST_SQUARE = 1e-3
"""Squared residuals are at least this share of their mean."""

NEWTON_STEPS = 12
MAX_STEP = 2.0
ROUNDS = 3
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class NoiseProfile:
    """Relative noise variance by ISI; its logarithm has mean 0 over the trials.

    Args:
        isi_ms: ISIs that it was learnt at [ms], shape (n,).
        pull: by how much each of them raises the log variance, shape (n,).
    """

    isi_ms: Tensor
    pull: Tensor

    def log_variance(self, isi_ms: Tensor) -> Tensor:
        """Relative log variance at some ISIs [ms], same shape (t,)."""
        if not len(self.isi_ms):
            return torch.zeros_like(isi_ms)
        mean = (_covariance(self.isi_ms, self.isi_ms) @ self.pull).mean()
        log_variance = _covariance(isi_ms, self.isi_ms) @ self.pull - mean
        return log_variance.clamp(-MAX_LOG_VARIANCE, MAX_LOG_VARIANCE)


def equal_noise() -> NoiseProfile:
    """The same noise everywhere."""
    nothing = torch.empty(0, dtype=torch.float64)
    return NoiseProfile(nothing, nothing)


def _covariance(one: Tensor, other: Tensor) -> Tensor:
    steps = (one.unsqueeze(-1) - other) / LENGTH_MS
    return MEAN_SD**2 + LOG_VARIANCE_SD**2 * torch.exp(-0.5 * steps.square())


def leave_one_out(covariance: Tensor, residuals: Tensor) -> Tensor:
    """How far each value is from what all others predict, in SDs of that prediction, shape (n,).

    [Rasmussen2006, equations 5.10–5.12]
    """
    inverse = torch.cholesky_inverse(torch.linalg.cholesky(covariance))
    return (inverse @ residuals) / inverse.diagonal().sqrt()


def noise_profile(isi_ms: Tensor, surprise_at: Callable[[Tensor], Tensor]) -> NoiseProfile:
    """The most likely noise profile, found in turns with the leave-one-out residuals that it leads to."""
    covariance = _covariance(isi_ms, isi_ms)
    profile = NoiseProfile(isi_ms, torch.zeros_like(isi_ms))
    for _ in range(ROUNDS):
        log_variance = profile.log_variance(isi_ms)
        squares = surprise_at(log_variance).square() * log_variance.exp()
        profile = NoiseProfile(isi_ms, _most_likely_pull(covariance, squares))
    return profile


def _most_likely_pull(covariance: Tensor, squares: Tensor) -> Tensor:
    """Where likelihood and prior of the log variance balance, as covariance times this, shape (n,)."""
    pull = torch.zeros_like(squares)
    identity = torch.eye(len(squares), dtype=squares.dtype)
    # Only ratios are learnt, and no residual is so small that its logarithm would matter more than all others.
    relative = (squares / squares.mean().clamp_min(TINY)).clamp_min(LEAST_SQUARE)
    for _ in range(NEWTON_STEPS):
        log_variance = covariance @ pull
        curvature = 0.5 * relative * torch.exp(-log_variance)
        target = torch.linalg.solve(
            identity + curvature.unsqueeze(-1) * covariance, curvature * (1.0 + log_variance) - 0.5
        )
        change = target - pull
        # Far from the balance a full step would overshoot.
        pull = pull + change * (MAX_STEP / (covariance @ change).abs().amax().clamp_min(TINY)).clamp_max(1.0)
    return pull
