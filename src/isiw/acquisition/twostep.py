"""One and two steps ahead: what each value of the next MEP would make of the samples, and the best one after it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from isiw.acquisition.protocol import ForeseesWindows
from isiw.checks import Checked, Count
from isiw.models.protocol import PredictsOutcomes, SamplesWindows
from isiw.types import Array


class Lookahead(NamedTuple):
    """Expectations after the next MEP."""

    probability: Array  # of each value of the next MEP, (b, t, y)
    mean: Array  # of each quantity given that value, (b, t, y, g)


def lookahead(mass: Array, values: Array, weights: Array | None = None) -> Lookahead:
    """Expectations of some quantities after each value of the next MEP."""
    people, samples, candidates, outcomes = mass.shape
    share = 1.0 / samples if weights is None else weights[:, None]
    joint = mass.reshape(people, samples, -1).swapaxes(1, 2) * share
    probability = np.maximum(joint.sum(-1, keepdims=True), 1e-12)
    mean = (joint @ values) / probability
    return Lookahead(
        probability.reshape(people, candidates, outcomes), mean.reshape(people, candidates, outcomes, values.shape[-1])
    )


def expected_variance_reduction(mass: Array, values: Array, weights: Array | None = None) -> Array:
    """Expected reduction of summed variances by the next MEP: by the law of total variance that of means after it."""
    mean = values.mean(axis=1, keepdims=True) if weights is None else weights[:, None] @ values
    # Centred, so that a small reduction is not the difference of two large numbers.
    ahead = lookahead(mass, values - mean, weights)
    reduction: Array = (ahead.probability * np.square(ahead.mean).sum(-1)).sum(-1)
    return reduction


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

    def __call__(self, posterior: ForeseesWindows, isi_ms: Array) -> Array:
        """Expected reduction of the summed variance of membership, shape (b, t); by one trial off the shortlist."""
        mass, masks = posterior.outcome_mass(isi_ms), posterior.window_masks(isi_ms)
        gain = expected_variance_reduction(mass, masks)
        second, total, people = mass[:, :, :: self.stride], gain.copy(), np.arange(len(gain))
        for candidate in np.argsort(-gain, axis=-1, kind="stable")[:, : self.shortlist].T:
            by_group = _grouped(mass[people, :, candidate], self.groups)
            behind = [_best_gain(second, masks, by_group[..., group]) for group in range(self.groups)]
            total[people, candidate] += (by_group.mean(axis=1) * np.stack(behind, axis=-1)).sum(-1)
        return total


def _grouped(mass: Array, groups: int) -> Array:
    """Probability of each group of outcomes given each sample, from that of each outcome (b, s, y), shape (b, s, g)."""
    predicted = mass.mean(axis=1)
    middle = predicted.cumsum(-1) - 0.5 * predicted
    group = (middle * groups).astype(int).clip(0, groups - 1)
    by_group: Array = mass @ np.eye(groups, dtype=mass.dtype)[group]
    return by_group


def _best_gain(mass: Array, masks: Array, weights: Array) -> Array:
    """The largest gain of any candidate among samples of given weights (b, s), shape (b,)."""
    share = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    gain: Array = expected_variance_reduction(mass, masks, share).max(-1)
    return gain
