"""The modes of a density, found by quasi-Newton ascent from many starts at once, each with its curvature."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from isiw.lazy import torch
from isiw.models.protocol import Tensor

LogDensity = Callable[[Tensor], Tensor]
"""Unnormalised log density of latents (m, d), shape (m,)."""

SAME_MODE: Final = 1.0
"""Modes closer than this many SDs are one."""

NEGLIGIBLE_NATS: Final = 9.0
"""A mode is left out if its evidence is smaller than the best one's by more."""

LEAST_CURVATURE: Final = 0.25
"""A standard normal prior has a curvature of 1; along a ridge that bends upwards the likelihood can take it away."""

STEP: Final = 1e-4
"""Of the differences that give a curvature, in standard normal latents."""

STEP_LENGTHS: Final = (1.0, 0.3, 0.05)
SMALL_GAIN_NATS: Final = 0.1


class Modes(NamedTuple):
    """The distinct modes of a density, best first.

    Args:
        points: where they are, shape (k, d).
        log_evidence: of each, by Laplace's method and but for a constant [nat], shape (k,).
        covariances: inverse curvatures, shape (k, d, d).
    """

    points: Tensor
    log_evidence: Tensor
    covariances: Tensor


def find_modes(log_density: LogDensity, starts: Tensor, steps: int) -> Modes:
    """Climb from each start."""
    tops = _climb(log_density, starts, steps)
    heights, curvatures = _curvatures(log_density, tops)
    eigenvalues, vectors = torch.linalg.eigh(curvatures)
    eigenvalues = eigenvalues.clamp_min(LEAST_CURVATURE)
    evidence = heights - 0.5 * eigenvalues.log().sum(-1)
    kept = _distinct(tops, (vectors * eigenvalues.unsqueeze(-2)) @ vectors.mT, evidence)
    covariances = (vectors / eigenvalues.unsqueeze(-2)) @ vectors.mT
    return Modes(tops[kept], evidence[kept], covariances[kept])


def _distinct(tops: Tensor, precisions: Tensor, evidence: Tensor) -> Tensor:
    """Indices of modes that are neither another one again nor negligible, best first."""
    kept: list[int] = []
    for k in evidence.argsort(descending=True).tolist():
        if kept and float(evidence[kept[0]] - evidence[k]) > NEGLIGIBLE_NATS:
            break
        off = tops[k] - tops[kept]
        apart: Tensor = torch.einsum("ki,kij,kj->k", off, precisions[kept], off)
        if not kept or float(apart.min()) > SAME_MODE**2:
            kept.append(k)
    return torch.tensor(kept)


def _gradient(log_density: LogDensity, points: Tensor) -> tuple[Tensor, Tensor]:
    points = points.detach().requires_grad_()
    values = log_density(points)
    (slopes,) = torch.autograd.grad(values.sum(), points)
    return values.detach(), slopes.detach()


def _curvatures(log_density: LogDensity, points: Tensor) -> tuple[Tensor, Tensor]:
    """Log density and negative Hessian by central differences of the gradient, shapes (k,) and (k, d, d)."""
    k, d = points.shape
    shifts = STEP * torch.eye(d, dtype=points.dtype)
    around = torch.cat((points.unsqueeze(1) + shifts, points.unsqueeze(1) - shifts), dim=1)
    values, slopes = _gradient(log_density, around.flatten(0, 1))
    up, down = slopes.view(k, 2, d, d).unbind(1)
    hessian = (down - up) / (2.0 * STEP)
    known = hessian.isfinite().flatten(1).all(-1)[:, None, None]
    hessian = torch.where(known, hessian, torch.eye(d, dtype=points.dtype))
    # At a top the values around it are as good as its own.
    return values.view(k, -1).mean(-1), 0.5 * (hessian + hessian.mT)


def _climb(log_density: LogDensity, starts: Tensor, steps: int) -> Tensor:
    """BFGS ascent of all starts at once, with a backtracking search; where they get to, shape (k, d)."""
    points = starts
    values, slopes = _gradient(log_density, points)
    plain = torch.eye(starts.shape[-1], dtype=starts.dtype).expand(len(starts), -1, -1)
    inverse = plain
    for _ in range(steps):
        direction = (inverse @ slopes.unsqueeze(-1)).squeeze(-1)
        tried = points.unsqueeze(1) + direction.new_tensor(STEP_LENGTHS).unsqueeze(-1) * _shortened(
            direction
        ).unsqueeze(1)
        with torch.no_grad():
            reached, best = log_density(tried.flatten(0, 1)).view(len(points), -1).max(-1)
        better = (reached > values).unsqueeze(-1)
        moved = torch.where(better, tried[torch.arange(len(points)), best], points)
        new_values, new_slopes = _gradient(log_density, moved)
        if float((new_values - values).max()) < SMALL_GAIN_NATS:
            return moved
        # Where no length was better, the next step follows the plain slope.
        inverse = torch.where(better.unsqueeze(-1), _updated(inverse, moved - points, slopes - new_slopes), 0.3 * plain)
        points, values, slopes = moved, new_values, new_slopes
    return points


def _shortened(direction: Tensor) -> Tensor:
    """Steps of at most two of the prior's SDs."""
    shortened: Tensor = direction / (0.5 * direction.norm(dim=-1, keepdim=True)).clamp_min(1.0)
    return shortened


def _updated(inverse: Tensor, step: Tensor, bend: Tensor) -> Tensor:
    """The BFGS update of inverse curvatures (k, d, d), left out if the curvature along the step is not positive."""
    along = (step * bend).sum(-1)
    fine = along > 1e-10
    rho = torch.where(fine, along, 1.0).reciprocal()[:, None, None]
    identity = torch.eye(step.shape[-1], dtype=step.dtype)
    left = identity - rho * step.unsqueeze(-1) * bend.unsqueeze(-2)
    updated: Tensor = left @ inverse @ left.mT + rho * step.unsqueeze(-1) * step.unsqueeze(-2)
    return torch.where(fine[:, None, None], updated, inverse)
