"""Modes of a posterior by quasi-Newton ascent from many starts at once, and draws by adaptive importance sampling.

A mixture begins with a Student t at each mode, of the curvature there, and with the standard normal prior, which stays
in it [Hesterberg1995]. If its draws are worth too little, it is fitted to them by their weights (population Monte
Carlo [Cappe2008]) and draws again: what the modes miss, the weights correct.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from isiw.checks import Checked, Count, Positive, whole
from isiw.lazy import torch
from isiw.models.parametric.normal import log_standard
from isiw.models.parametric.tensors import Tensor

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
    """The distinct modes of a density, best first."""

    points: Tensor  # (k, d)
    log_evidence: Tensor  # by Laplace's method and but for a constant [nat], (k,)
    covariances: Tensor  # inverse curvatures, (k, d, d)


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
        # Steps of at most two of the prior's SDs.
        step: Tensor = direction / (0.5 * direction.norm(dim=-1, keepdim=True)).clamp_min(1.0)
        tried = points.unsqueeze(1) + direction.new_tensor(STEP_LENGTHS).unsqueeze(-1) * step.unsqueeze(1)
        # The slopes of all lengths at once cost less than those of the best one by themselves.
        reached, there = _gradient(log_density, tried.flatten(0, 1))
        best = reached.view(len(points), -1).argmax(-1) + len(STEP_LENGTHS) * torch.arange(len(points))
        better = (reached[best] > values).unsqueeze(-1)
        moved = torch.where(better, tried.flatten(0, 1)[best], points)
        new_values = torch.where(better.squeeze(-1), reached[best], values)
        new_slopes = torch.where(better, there[best], slopes)
        if float((new_values - values).max()) < SMALL_GAIN_NATS:
            return moved
        # Where no length was better, the next step follows the plain slope.
        inverse = torch.where(better.unsqueeze(-1), _updated(inverse, moved - points, slopes - new_slopes), 0.3 * plain)
        points, values, slopes = moved, new_values, new_slopes
    return points


def _updated(inverse: Tensor, step: Tensor, bend: Tensor) -> Tensor:
    """The BFGS update of inverse curvatures (k, d, d), left out if the curvature along the step is not positive."""
    along = (step * bend).sum(-1)
    fine = along > 1e-10
    rho = torch.where(fine, along, 1.0).reciprocal()[:, None, None]
    identity = torch.eye(step.shape[-1], dtype=step.dtype)
    left = identity - rho * step.unsqueeze(-1) * bend.unsqueeze(-2)
    updated: Tensor = left @ inverse @ left.mT + rho * step.unsqueeze(-1) * step.unsqueeze(-2)
    return torch.where(fine[:, None, None], updated, inverse)


T_DEGREES: Final = 6.0
"""Degrees of freedom of the components: tails heavier than a normal's."""

PRIOR_SHARE: Final = 0.1
"""Least share of the prior in the mixture."""

SCOUTED_SHARE: Final = 0.25
"""Share of what was scouted in the mixture to begin with."""

GOOD_SHARE: Final = 0.25
"""A mixture will do when its first draws are worth this share of their number."""

TOO_HEAVY: Final = 0.1
"""A draw that weighs more is looked into."""


@dataclass(frozen=True)
class Effort(Checked):
    """The work that goes into a sample.

    Args:
        scouts: draws that show where to climb from.
        starts: ascents.
        steps: quasi-Newton steps of each.
        draws: draws of the mixture in each round.
        fits: the mixture is fitted at most this many times.
        enough: further draws of the last mixture make all of them worth as many independent ones as this.
    """

    scouts: Count = 512
    starts: Count = 12
    steps: Count = 12
    draws: Count = 500
    fits: Count = 10
    enough: Positive = 400.0

    def __post_init__(self) -> None:
        super().__post_init__()
        whole("Effort.scouts", self.scouts, least=self.starts)  # every start needs one


@dataclass(frozen=True, eq=False)
class WeightedDraws:
    """Weighted draws of a posterior."""

    points: Tensor  # (m, d)
    log_weights: Tensor  # normalised, (m,)
    log_evidence: float  # log of the density's integral [nat]
    modes: Modes


@dataclass(frozen=True, eq=False)
class Proposal:
    """The standard normal prior, and k multivariate Student t components."""

    shares: Tensor  # of the prior, then of the components, (k + 1,)
    means: Tensor
    factors: Tensor  # lower Cholesky factors of the scale matrices, (k, d, d)

    @classmethod
    def at(cls, modes: Modes) -> Proposal:
        """The prior and a component at each mode, whose evidence is trusted less, as Laplace's method is rough."""
        prior = torch.full((1,), PRIOR_SHARE, dtype=torch.double)
        shares = torch.cat((prior, torch.softmax(0.7 * modes.log_evidence, dim=0)))
        return cls(_defensive(shares), modes.points, torch.linalg.cholesky(modes.covariances))

    @classmethod
    def prior(cls, latents: int) -> Proposal:
        """The prior, half of it with the heavier tails of the components."""
        half, centre = torch.full((2,), 0.5, dtype=torch.double), torch.zeros((1, latents), dtype=torch.double)
        return cls(half, centre, torch.diag_embed(1.0 + centre))

    def log_parts(self, points: Tensor) -> Tensor:
        """Log density of each part times its share, shape (k + 1, m)."""
        d = points.shape[-1]
        off = torch.linalg.solve_triangular(self.factors, (points - self.means.unsqueeze(1)).mT, upper=False)
        squared = off.square().sum(1)
        log_det = self.factors.diagonal(dim1=-2, dim2=-1).log().sum(-1, keepdim=True)
        gammas = math.lgamma(0.5 * (T_DEGREES + d)) - math.lgamma(0.5 * T_DEGREES)
        constant = gammas - 0.5 * d * math.log(T_DEGREES * math.pi)
        student = constant - log_det - 0.5 * (T_DEGREES + d) * torch.log1p(squared / T_DEGREES)
        return torch.cat((log_standard(points).unsqueeze(0), student)) + self.shares.log().unsqueeze(-1)

    def joined(self, other: Proposal, share: float) -> Proposal:
        """This mixture and the components of another one."""
        theirs = other.shares[1:] / other.shares[1:].sum()
        shares = torch.cat(((1.0 - share) * self.shares, share * theirs))
        return Proposal(shares, torch.cat((self.means, other.means)), torch.cat((self.factors, other.factors)))

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

    def fitted(self, points: Tensor, log_weights: Tensor) -> Proposal:
        """The mixture after one step towards the weighted points, its scatter held to what they can tell."""
        d = points.shape[-1]
        belongs = torch.softmax(self.log_parts(points), dim=0) * log_weights.exp()
        shares = belongs.sum(-1)
        own = belongs[1:] / shares[1:].clamp_min(1e-12).unsqueeze(-1)
        draws = own.square().sum(-1).clamp_min(1e-12).reciprocal()
        trust = (draws / (draws + 2.0 * d))[:, None, None]
        means = self.means + trust[..., 0] * (own @ points - self.means)
        off = points - means.unsqueeze(1)
        scatter = torch.einsum("km,kmi,kmj->kij", own, off, off)
        scales = trust * scatter + (1.0 - trust) * (self.factors @ self.factors.mT)
        ridge = 1e-6 * torch.eye(d, dtype=points.dtype)
        return Proposal(_defensive(shares), means, torch.linalg.cholesky(scales + ridge))


class _Round(NamedTuple):
    """Points, their log densities, and what they were drawn from."""

    points: Tensor
    log_density: Tensor
    proposal: Proposal


def worth(log_weights: Tensor) -> float:
    """Effective sample size: how many independent draws weighted ones are worth."""
    return float(torch.exp(-torch.logsumexp(2.0 * log_weights, dim=0)))


def _defensive(shares: Tensor) -> Tensor:
    """Shares of which the first is not below the prior's least."""
    rest = shares[1:].clamp_min(1e-4)
    prior = shares[0].clamp(PRIOR_SHARE, 0.9)
    return torch.cat((prior.unsqueeze(0), (1.0 - prior) * rest / rest.sum()))


def importance_sample(
    log_density: LogDensity, scouting: Proposal, generator: torch.Generator, effort: Effort
) -> WeightedDraws:
    """Sample a posterior whose prior is a standard normal."""
    scouts = _drawn(log_density, scouting, effort.scouts, generator)
    modes = find_modes(log_density, _best_of_each_part(scouts, effort.starts), effort.steps)
    mixture = Proposal.at(modes).joined(scouting, SCOUTED_SHARE)
    earlier = [scouts]
    for _ in range(effort.fits):
        rounds = _rounds(log_density, mixture, generator, effort)
        if worth(_weighted(rounds)[0]) >= 0.5 * effort.enough:
            break
        # Draws that the mixture was fitted to would be weighted too low: they count no more.
        earlier += rounds
        mixture = _improved(log_density, mixture, earlier, effort)
    log_weights, log_evidence = _weighted(rounds)
    return WeightedDraws(_points(rounds), log_weights, log_evidence, modes)


def _rounds(log_density: LogDensity, mixture: Proposal, generator: torch.Generator, effort: Effort) -> list[_Round]:
    """One round of draws, and as many more as it takes if it shows that the mixture will do."""
    first = _drawn(log_density, mixture, effort.draws, generator)
    of_one = worth(_weighted([first])[0])
    more = math.ceil(effort.enough / of_one) - 1 if of_one >= GOOD_SHARE * effort.draws else 0
    return [first, *(_drawn(log_density, mixture, effort.draws, generator) for _ in range(more))]


def _improved(log_density: LogDensity, mixture: Proposal, rounds: list[_Round], effort: Effort) -> Proposal:
    points, (log_weights, _) = _points(rounds), _weighted(rounds)
    heaviest = log_weights.argmax()
    fitted = mixture.fitted(points, log_weights)
    if log_weights[heaviest] < math.log(TOO_HEAVY):
        return fitted
    # One draw that weighs so much comes from a place that the mixture misses.
    missed = find_modes(log_density, points[heaviest].unsqueeze(0), effort.steps)
    return fitted.joined(Proposal.at(missed), SCOUTED_SHARE)


def _drawn(log_density: LogDensity, proposal: Proposal, size: int, generator: torch.Generator) -> _Round:
    points = proposal.draw(size, generator)
    return _Round(points, log_density(points).nan_to_num(nan=-torch.inf), proposal)


def _best_of_each_part(scouts: _Round, parts: int) -> Tensor:
    """The best scout of each part of the first latent's range, shape (parts, d)."""
    order = scouts.points[:, 0].argsort()
    chunks = order[: len(order) // parts * parts].view(parts, -1)
    best = scouts.log_density[chunks].argmax(-1, keepdim=True)
    return scouts.points[chunks.gather(1, best).squeeze(1)]


def _points(rounds: list[_Round]) -> Tensor:
    return torch.cat([each.points for each in rounds])


def _weighted(rounds: list[_Round]) -> tuple[Tensor, float]:
    """Log weights of the draws of all rounds, each as a draw of the average proposal, and the log evidence."""
    points = _points(rounds)
    proposals = [
        torch.logsumexp(each.proposal.log_parts(points), dim=0) + math.log(len(each.points) / len(points))
        for each in rounds
    ]
    log_density = torch.cat([each.log_density for each in rounds])
    log_weights = log_density - torch.logsumexp(torch.stack(proposals), dim=0)
    log_sum = torch.logsumexp(log_weights, dim=0)
    return log_weights - log_sum, float(log_sum) - math.log(len(points))
