import math

import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal, multivariate_t

from isiw.models.parametric.importance import (
    T_DEGREES,
    Effort,
    Modes,
    Proposal,
    WeightedDraws,
    importance_sample,
    worth,
)
from isiw.models.parametric.tensors import Tensor
from isiw.types import ArrayLike

DIMENSIONS = 4


def tensor(values: ArrayLike) -> Tensor:
    return torch.as_tensor(np.asarray(values), dtype=torch.double)


def two_modes(points: Tensor) -> Tensor:
    """Prior times two narrow Gaussian likelihoods of the first two latents, far from each other."""
    prior = -0.5 * points.square().sum(-1) - 0.5 * DIMENSIONS * math.log(2 * math.pi)
    places = tensor([[2.0, 1.0], [-1.5, 0.0]])
    off = points[:, None, :2] - places
    return prior + torch.logsumexp(-0.5 * off.square().sum(-1) / 0.04 + tensor([1.0, 0.0]), dim=-1)


def exact() -> tuple[float, float]:
    """Log evidence, and the share of the first mode: Gaussians times Gaussians."""
    parts = [
        height + math.log(2 * math.pi * 0.04) + multivariate_normal(np.zeros(2), 1.04 * np.eye(2)).logpdf(place)
        for height, place in ((1.0, (2.0, 1.0)), (0.0, (-1.5, 0.0)))
    ]
    return float(np.logaddexp(parts[0], parts[1])), float(1.0 / (1.0 + math.exp(parts[1] - parts[0])))


def sample(seed: int, effort: Effort = Effort()) -> WeightedDraws:  # noqa: B008 - a frozen value
    return importance_sample(two_modes, Proposal.prior(DIMENSIONS), torch.Generator().manual_seed(seed), effort)


def test_the_density_of_a_mixture_is_that_of_its_parts() -> None:
    generator = np.random.default_rng(0)
    scale = np.array([[2.0, 0.5], [0.5, 1.0]])
    mixture = Proposal(tensor([0.3, 0.7]), tensor([[1.0, -1.0]]), torch.linalg.cholesky(tensor(scale)).unsqueeze(0))
    points = generator.normal(size=(20, 2))
    expected = np.stack(
        [
            math.log(0.3) + multivariate_normal(np.zeros(2), np.eye(2)).logpdf(points),
            math.log(0.7) + multivariate_t([1.0, -1.0], scale, df=int(T_DEGREES)).logpdf(points),
        ]
    )
    np.testing.assert_allclose(mixture.log_parts(tensor(points)).numpy(), expected)


def test_draws_of_a_mixture_have_its_density() -> None:
    # E_q[f/q] = 1 for any density f that q covers, here a normal one around the component.
    mixture = Proposal.at(Modes(tensor([[1.0, 0.0]]), tensor([0.0]), 0.5 * torch.eye(2, dtype=torch.double)[None]))
    points = mixture.draw(20_000, torch.Generator().manual_seed(1))
    target = multivariate_normal([1.0, 0.0], 0.4 * np.eye(2)).logpdf(points.numpy())
    ratio = np.exp(target - torch.logsumexp(mixture.log_parts(points), dim=0).numpy())
    assert abs(ratio.mean() - 1.0) < 4 * ratio.std() / math.sqrt(len(ratio))


def test_both_modes_are_sampled_in_their_shares_and_the_evidence_is_right() -> None:
    log_evidence, share = exact()
    drawn = [sample(seed) for seed in range(20)]
    assert all(worth(d.log_weights) > 200 for d in drawn)
    errors = np.array([d.log_evidence - log_evidence for d in drawn])
    shares = np.array([d.log_weights.exp()[d.points[:, 0] > 0].sum() for d in drawn])
    # Within three standard errors of 20 repetitions: neither is biased.
    assert abs(errors.mean()) < 3 * errors.std() / math.sqrt(20) + 1e-3
    assert abs(shares.mean() - share) < 3 * shares.std() / math.sqrt(20) + 1e-3
    assert errors.std() < 0.1


def test_a_mode_that_the_ascents_missed_is_found_by_its_heavy_draw() -> None:
    log_evidence, share = exact()
    found = [sample(seed, Effort(scouts=8, starts=1)) for seed in range(5)]
    shares = [float(d.log_weights.exp()[d.points[:, 0] > 0].sum()) for d in found if len(d.modes.points) == 1]
    assert len(shares) >= 3
    assert np.median(shares) == pytest.approx(share, abs=0.1)
    assert np.median([d.log_evidence for d in found]) == pytest.approx(log_evidence, abs=0.2)


def test_the_same_seed_gives_the_same_draws() -> None:
    assert torch.equal(sample(3).points, sample(3).points)
    assert not torch.equal(sample(3).points, sample(4).points)


def test_a_fit_keeps_the_prior_in_the_mixture_and_its_components_proper() -> None:
    mixture = Proposal.prior(DIMENSIONS)
    points = mixture.draw(200, torch.Generator().manual_seed(1))
    one_counts = torch.full((200,), -torch.inf, dtype=torch.double)
    one_counts[0] = 0.0
    fitted = mixture.fitted(points, one_counts)
    assert fitted.shares[0] >= 0.1
    assert fitted.shares.sum().item() == pytest.approx(1.0)
    assert (fitted.factors.diagonal(dim1=-2, dim2=-1) > 0.5).all()
