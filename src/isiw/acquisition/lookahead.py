"""One step ahead: what each value of the next MEP would make of the posterior samples."""

from __future__ import annotations

from typing import NamedTuple

from isiw.models.protocol import Tensor


class Lookahead(NamedTuple):
    """Expectations after the next MEP.

    Args:
        probability: of each value of the next MEP, shape (b, t, y).
        mean: expectation of each quantity given that value, shape (b, t, y, g).
    """

    probability: Tensor
    mean: Tensor


def lookahead(mass: Tensor, values: Tensor, weights: Tensor | None = None) -> Lookahead:
    """Expectations of some quantities after each value of the next MEP."""
    people, samples, candidates, outcomes = mass.shape
    share = 1.0 / samples if weights is None else weights.unsqueeze(1)
    joint = mass.flatten(2).transpose(1, 2) * share
    probability = joint.sum(-1, keepdim=True).clamp_min(1e-12)
    mean = (joint @ values) / probability
    return Lookahead(
        probability.view(people, candidates, outcomes), mean.view(people, candidates, outcomes, values.shape[-1])
    )


def expected_variance_reduction(mass: Tensor, values: Tensor, weights: Tensor | None = None) -> Tensor:
    """By how much the next MEP is expected to reduce the summed variance of some quantities.

    By the law of total variance it is the variance of their means after the next MEP.
    """
    mean = values.mean(dim=1, keepdim=True) if weights is None else weights.unsqueeze(1) @ values
    # Centred, so that a small reduction is not the difference of two large numbers.
    ahead = lookahead(mass, values - mean, weights)
    return (ahead.probability * ahead.mean.square().sum(-1)).sum(-1)
