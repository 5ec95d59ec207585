"""Samples of a posterior with several modes: modes by quasi-Newton ascent, then adaptive importance sampling.

The prior is a standard normal of the latents. Some draws of it show where to climb from; at each distinct mode a
Student t with the curvature's covariance begins a mixture, and the prior itself stays in it (Hesterberg, Technometrics
37, 1995). Draws are weighted by the exact density over the mixture of all proposals so far, and the mixture is fitted
to the weighted draws, until they are worth enough (population Monte Carlo: Cappé et al., Stat. Comput. 18, 2008;
Cornuet et al., Scand. J. Stat. 39, 2012). So the modes need only be near: what they miss, the weights correct.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import torch

from isiw.models.protocol import Tensor

__all__ = ["Effort", "Mixture", "WeightedDraws", "find_modes", "importance_sample", "standard_normal", "worth"]

LogDensity = Callable[[Tensor], Tensor]
"""Unnormalised log density of latents (m, d), shape (m,)."""

T_DEGREES: Final = 6.0
PRIOR_SHARE: Final = 0.1
"""Least share of the prior in the mixture."""

SIMPLER_SHARE: Final = 0.25
"""Share of a simpler model's modes in the mixture to begin with."""

SAME_MODE: Final = 1.0
"""Modes closer than this many SDs are one."""

NEGLIGIBLE_NATS: Final = 9.0
"""A mode is left out where its evidence is smaller than the best one's by more."""


@dataclass(frozen=True)
class Effort:
    """How much work a sample is worth.

    Args:
        scouts: draws of the prior, which also show where to climb from.
        starts: ascents.
        steps: quasi-Newton steps of each.
        draws: draws of the mixture in each round.
        rounds: at most this many rounds.
        enough: stop when the draws are worth as many independent ones as this.
    """

    scouts: int = 512
    starts: int = 12
    steps: int = 20
    draws: int = 600
    rounds: int = 10
    enough: float = 400.0


@dataclass(frozen=True, eq=False)
class WeightedDraws:
    """Weighted draws of a posterior.

    Args:
        points: latents, shape (m, d).
        log_weights: normalised, shape (m,).
        log_evidence: log of the density's integral [nat].
        modes: the mixture to begin with, its components at the distinct modes.
    """

    points: Tensor
    log_weights: Tensor
    log_evidence: float
    modes: Mixture


@dataclass(frozen=True, eq=False)
class Mixture:
    """The standard normal prior, and multivariate Student t components.

    Args:
        shares: of the prior, then of the components, shape (k + 1,).
        means: shape (k, d).
        factors: lower Cholesky factors of their scale matrices, shape (k, d, d).
    """

    shares: Tensor
    means: Tensor
    factors: Tensor

    def log_parts(self, points: Tensor) -> Tensor:
        """Log density of each part times its share, shape (k + 1, m)."""
        d = points.shape[-1]
        off = torch.linalg.solve_triangular(self.factors, (points - self.means.unsqueeze(1)).mT, upper=False)
        squared = off.square().sum(1)
        log_det = self.factors.diagonal(dim1=-2, dim2=-1).log().sum(-1, keepdim=True)
        constant = (
            math.lgamma(0.5 * (T_DEGREES + d)) - math.lgamma(0.5 * T_DEGREES) - 0.5 * d * math.log(T_DEGREES * math.pi)
        )
        student = constant - log_det - 0.5 * (T_DEGREES + d) * torch.log1p(squared / T_DEGREES)
        return torch.cat((standard_normal(points).unsqueeze(0), student)) + self.shares.log().unsqueeze(-1)

    def joined(self, other: Mixture, share: float) -> Mixture:
        """This mixture and the components of another one.

        Args:
            other: the other mixture; its prior is left out, for there is one already.
            share: of the other's components in all.
        """
        theirs = other.shares[1:] / other.shares[1:].sum()
        shares = torch.cat(((1.0 - share) * self.shares, share * theirs))
        return Mixture(shares, torch.cat((self.means, other.means)), torch.cat((self.factors, other.factors)))

    def draw(self, size: int, generator: torch.Generator) -> Tensor:
        """Draws, each part in proportion to its share, shape (size, d)."""
        d = self.means.shape[-1]
        ends = (self.shares.cumsum(0) / self.shares.sum() * size).round().long()
        part = torch.searchsorted(ends, torch.arange(size), right=True).clamp_max(len(self.means))
        normal = torch.randn((size, d), generator=generator, dtype=self.means.dtype)
        shape = torch.full((size,), 0.5 * T_DEGREES, dtype=self.means.dtype)
        stretch = torch.sqrt(0.5 * T_DEGREES / torch._standard_gamma(shape, generator=generator))  # noqa: SLF001
        own = (part - 1).clamp_min(0)
        student = self.means[own] + stretch.unsqueeze(-1) * (self.factors[own] @ normal.unsqueeze(-1)).squeeze(-1)
        return torch.where((part == 0).unsqueeze(-1), normal, student)

    def fitted(self, points: Tensor, log_weights: Tensor) -> Mixture:
        """The mixture after one step towards the weighted points, its scatter held to what they can tell."""
        d = points.shape[-1]
        belongs = torch.softmax(self.log_parts(points), dim=0) * log_weights.exp()
        shares = belongs.sum(-1)
        own = belongs[1:] / shares[1:].clamp_min(1e-12).unsqueeze(-1)
        worth = own.square().sum(-1).clamp_min(1e-12).reciprocal()
        trust = (worth / (worth + 2.0 * d))[:, None, None]
        means = self.means + trust[..., 0] * (own @ points - self.means)
        off = points - means.unsqueeze(1)
        scatter = torch.einsum("km,kmi,kmj->kij", own, off, off)
        scales = trust * scatter + (1.0 - trust) * (self.factors @ self.factors.mT)
        ridge = 1e-6 * torch.eye(d, dtype=points.dtype)
        return Mixture(_defensive(shares), means, torch.linalg.cholesky(scales + ridge))


_Round = tuple[Tensor, Tensor, Mixture]
"""Points, their log densities, and what they were drawn from."""


def worth(log_weights: Tensor) -> float:
    """Effective sample size: how many independent draws weighted ones are worth.

    Args:
        log_weights: normalised, shape (m,).
    """
    return float(torch.exp(-torch.logsumexp(2.0 * log_weights, dim=0)))


def standard_normal(points: Tensor) -> Tensor:
    """Log density of the standard normal, shape (...) for points (..., d)."""
    return -0.5 * points.square().sum(-1) - 0.5 * points.shape[-1] * math.log(2.0 * math.pi)


def _defensive(shares: Tensor) -> Tensor:
    """Shares of which the first is not below the prior's least."""
    rest = shares[1:].clamp_min(1e-4)
    prior = shares[0].clamp(PRIOR_SHARE, 0.9)
    return torch.cat((prior.unsqueeze(0), (1.0 - prior) * rest / rest.sum()))


def importance_sample(
    log_density: LogDensity,
    latents: int,
    generator: torch.Generator,
    effort: Effort,
    simpler: Mixture | None = None,
) -> WeightedDraws:
    """Sample a posterior whose prior is a standard normal.

    Args:
        log_density: log of prior times likelihood.
        latents: their number, d; the first is the one that modes may differ in most.
        generator: source of randomness.
        effort: how much work it is worth.
        simpler: modes of a simpler model inside this one, near which this one may do as well.
    """
    scouts = _scouts(effort.scouts, latents, generator)
    found = log_density(scouts)
    modes = find_modes(log_density, _best_of_each_part(scouts, found, effort.starts), effort.steps)
    mixture = modes if simpler is None else modes.joined(simpler, SIMPLER_SHARE)
    rounds = [(scouts, found, _prior_only(mixture))]
    log_weights, log_evidence = _weighted(rounds)
    for _ in range(effort.rounds):
        points = mixture.draw(effort.draws, generator)
        rounds.append((points, log_density(points), mixture))
        log_weights, log_evidence = _weighted(rounds)
        if worth(log_weights) >= effort.enough:
            break
        mixture = mixture.fitted(_points(rounds), log_weights)
    return WeightedDraws(_points(rounds), log_weights, log_evidence, modes)


def _scouts(size: int, latents: int, generator: torch.Generator) -> Tensor:
    """Standard normal draws, the first latent spread evenly."""
    draws = torch.randn((size, latents), generator=generator, dtype=torch.double)
    even = torch.arange(size) + torch.rand(size, generator=generator, dtype=torch.double)
    draws[:, 0] = torch.special.ndtri(even / size)
    return draws


def _best_of_each_part(scouts: Tensor, found: Tensor, parts: int) -> Tensor:
    """The best scout of each part of the first latent's range, shape (parts, d)."""
    order = scouts[:, 0].argsort()
    chunks = order[: len(order) // parts * parts].view(parts, -1)
    best = found[chunks].argmax(-1, keepdim=True)
    return scouts[chunks.gather(1, best).squeeze(1)]


def _prior_only(mixture: Mixture) -> Mixture:
    shares = torch.zeros_like(mixture.shares)
    shares[0] = 1.0
    return Mixture(shares, mixture.means, mixture.factors)


def _points(rounds: list[_Round]) -> Tensor:
    return torch.cat([points for points, _, _ in rounds])


def _weighted(rounds: list[_Round]) -> tuple[Tensor, float]:
    """Log weights of all draws so far, each as a draw of the average proposal, and the log evidence."""
    points = _points(rounds)
    proposals = [
        torch.logsumexp(mixture.log_parts(points), dim=0) + math.log(len(own) / len(points))
        for own, _, mixture in rounds
    ]
    log_weights = torch.cat([density for _, density, _ in rounds]) - torch.logsumexp(torch.stack(proposals), dim=0)
    log_sum = torch.logsumexp(log_weights, dim=0)
    return log_weights - log_sum, float(log_sum) - math.log(len(points))


def find_modes(log_density: LogDensity, starts: Tensor, steps: int) -> Mixture:
    """Climb from each start; the prior and a Student t at each distinct mode.

    Args:
        log_density: log of prior times likelihood.
        starts: shape (k, d).
        steps: quasi-Newton steps.
    """
    tops, _, _ = _climb(log_density, starts, steps)
    heights, curvatures = _curvatures(log_density, tops)
    eigenvalues, vectors = torch.linalg.eigh(curvatures)
    # The prior alone has a curvature of 1; along a ridge that bends upwards the likelihood can take it away.
    eigenvalues = eigenvalues.clamp_min(0.25)
    evidence = heights - 0.5 * eigenvalues.log().sum(-1)
    kept = _distinct(tops, (vectors * eigenvalues.unsqueeze(-2)) @ vectors.mT, evidence)
    scales = (vectors / eigenvalues.unsqueeze(-2)) @ vectors.mT
    shares = torch.cat((torch.full((1,), PRIOR_SHARE, dtype=tops.dtype), 0.9 * torch.softmax(0.7 * evidence[kept], 0)))
    return Mixture(_defensive(shares), tops[kept], torch.linalg.cholesky(scales[kept]))


def _distinct(tops: Tensor, precisions: Tensor, evidence: Tensor) -> Tensor:
    """Indices of modes that are neither another one again nor negligible, best first."""
    kept: list[int] = []
    for k in evidence.argsort(descending=True).tolist():
        if kept and float(evidence[kept[0]] - evidence[k]) > NEGLIGIBLE_NATS:
            break
        off = tops[k] - tops[kept]
        apart = torch.einsum("ki,kij,kj->k", off, precisions[kept], off)
        if not kept or float(apart.min()) > SAME_MODE**2:
            kept.append(k)
    return torch.tensor(kept)


def _gradient(log_density: LogDensity, points: Tensor) -> tuple[Tensor, Tensor]:
    points = points.detach().requires_grad_()
    values = log_density(points)
    (slopes,) = torch.autograd.grad(values.sum(), points)
    return values.detach(), slopes.detach()


def _curvatures(log_density: LogDensity, points: Tensor, step: float = 1e-4) -> tuple[Tensor, Tensor]:
    """Log density and negative Hessian by central differences of the gradient, shapes (k,) and (k, d, d)."""
    k, d = points.shape
    shifts = step * torch.eye(d, dtype=points.dtype)
    around = torch.cat((points.unsqueeze(1) + shifts, points.unsqueeze(1) - shifts), dim=1)
    values, slopes = _gradient(log_density, around.flatten(0, 1))
    up, down = slopes.view(k, 2, d, d).unbind(1)
    hessian = (down - up) / (2.0 * step)
    # At a top the values around it are as good as its own.
    return values.view(k, -1).mean(-1), 0.5 * (hessian + hessian.mT)


def _climb(log_density: LogDensity, starts: Tensor, steps: int) -> tuple[Tensor, Tensor, Tensor]:
    """BFGS ascent of all starts at once, with a backtracking search; tops, their heights and slopes."""
    k, d = starts.shape
    points = starts
    values, slopes = _gradient(log_density, points)
    inverse = torch.eye(d, dtype=starts.dtype).expand(k, d, d).clone()
    lengths = torch.tensor([1.0, 0.3, 0.05], dtype=starts.dtype)
    for _ in range(steps):
        direction = (inverse @ slopes.unsqueeze(-1)).squeeze(-1)
        # In the prior's SDs: no step leaves its bulk.
        direction = direction / (direction.norm(dim=-1, keepdim=True) / 2.0).clamp_min(1.0)
        tried = points.unsqueeze(1) + lengths.view(1, -1, 1) * direction.unsqueeze(1)
        with torch.no_grad():
            reached = log_density(tried.flatten(0, 1)).view(k, -1)
        best = reached.argmax(-1, keepdim=True)
        better = reached.gather(1, best).squeeze(1) > values
        moved = torch.where(
            better.unsqueeze(-1), tried.gather(1, best.unsqueeze(-1).expand(-1, -1, d)).squeeze(1), points
        )
        values, new_slopes = _gradient(log_density, moved)
        inverse = _updated(inverse, moved - points, slopes - new_slopes)
        # Where no length was better, the next step follows the plain slope.
        inverse = torch.where(better[:, None, None], inverse, 0.3 * torch.eye(d, dtype=starts.dtype))
        points, slopes = moved, new_slopes
    return points, values, slopes


def _updated(inverse: Tensor, step: Tensor, bend: Tensor) -> Tensor:
    """The BFGS update of inverse curvatures (k, d, d), left out where the curvature along the step is not positive."""
    along = (step * bend).sum(-1)
    fine = along > 1e-10
    rho = torch.where(fine, along, 1.0).reciprocal()[:, None, None]
    identity = torch.eye(step.shape[-1], dtype=step.dtype)
    left = identity - rho * step.unsqueeze(-1) * bend.unsqueeze(-2)
    updated = left @ inverse @ left.mT + rho * step.unsqueeze(-1) * step.unsqueeze(-2)
    return torch.where(fine[:, None, None], updated, inverse)
