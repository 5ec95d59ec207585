"""One and two steps ahead: what each value of the next MEP would make of the samples, and the best one after it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from isiw.acquisition.protocol import ForeseesWindows
from isiw.checks import Checked, Count
from isiw.lazy import torch
from isiw.models.protocol import PredictsOutcomes, SamplesWindows, Tensor


class Lookahead(NamedTuple):
    """Expectations after the next MEP."""

    probability: Tensor  # of each value of the next MEP, (b, t, y)
    mean: Tensor  # of each quantity given that value, (b, t, y, g)


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
    """Expected reduction of summed variances by the next MEP: by the law of total variance that of means after it."""
    mean = values.mean(dim=1, keepdim=True) if weights is None else weights.unsqueeze(1) @ values
    # Centred, so that a small reduction is not the difference of two large numbers.
    ahead = lookahead(mass, values - mean, weights)
    return (ahead.probability * ahead.mean.square().sum(-1)).sum(-1)


@dataclass(frozen=True)
class TwoStep(Checked):
    """Expected reduction of the uncertainty about membership by the next MEP and the best choice after it.

    The `WindowGain` of two trials, the second chosen in the light of the first. To be affordable, only the candidates
    with the largest gain of their own are followed to a second trial, with their outcomes in a few equally probable
    groups, and of the second trial only some candidates are scored. The first gain is that of the outcome itself, the
    second one that after its group alone, which is somewhat too large the fewer groups there are.

    Args:
        shortlist: how many candidates are followed to a second trial.
        groups: into how many groups the first outcome falls.
        stride: every `stride`-th candidate is considered for the second trial.
    """

    shortlist: Count = 8
    groups: Count = 5
    stride: Count = 3
    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: ForeseesWindows, isi_ms: Tensor) -> Tensor:
        """Expected reduction of the summed variance of membership, shape (b, t); by one trial off the shortlist."""
        mass, masks = posterior.outcome_mass(isi_ms), posterior.window_masks(isi_ms)
        gain = expected_variance_reduction(mass, masks)
        second, total = mass[:, :, :: self.stride], gain.clone()
        for candidate in gain.topk(min(self.shortlist, gain.shape[-1]), dim=-1).indices.unbind(-1):
            index = candidate[:, None, None, None].expand(-1, mass.shape[1], 1, mass.shape[-1])
            by_group = _grouped(mass.gather(2, index).squeeze(2), self.groups)
            behind = torch.stack([_best_gain(second, masks, weights) for weights in by_group.unbind(-1)], dim=-1)
            column = candidate.unsqueeze(-1)
            total.scatter_add_(1, column, (by_group.mean(dim=1) * behind).sum(-1, keepdim=True))
        return total


def _grouped(mass: Tensor, groups: int) -> Tensor:
    """Probability of each group of outcomes given each sample, from that of each outcome (b, s, y), shape (b, s, g)."""
    predicted = mass.mean(dim=1)
    middle = predicted.cumsum(-1) - 0.5 * predicted
    group = (middle * groups).long().clamp(0, groups - 1)
    return mass @ torch.nn.functional.one_hot(group, groups).to(mass.dtype)


def _best_gain(mass: Tensor, masks: Tensor, weights: Tensor) -> Tensor:
    """The largest gain of any candidate among samples of given weights (b, s), shape (b,)."""
    share = weights / weights.sum(dim=1, keepdim=True).clamp_min(1e-12)
    return expected_variance_reduction(mass, masks, share).amax(-1)
