"""Acquisition functions from information: what the next MEP is expected to say.

`mutual_information` is with all unknowns of the model (Houlsby et al., arXiv:1112.5745, BALD). `window_gain` is about
the window alone: how much the next MEP is expected to reduce the variance of each ISI's membership in the window
(stepwise uncertainty reduction for excursion sets: Bect et al., Stat. Comput. 22, 2012; Chevalier et al., Technometrics
56, 2014).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import torch

from isiw.models.protocol import Posterior, PredictsOutcomes, SamplesWindows, Tensor

__all__ = ["Alternating", "MutualInformation", "WindowGain", "mutual_information", "window_gain"]


class _WindowPosterior(Posterior, PredictsOutcomes, SamplesWindows, Protocol):
    """A posterior that has all that is needed here."""


def _entropy(mass: Tensor) -> Tensor:
    entropy: Tensor = -torch.special.xlogy(mass, mass).sum(-1)
    return entropy


def mutual_information(weights: Tensor, mass: Tensor) -> Tensor:
    """Mutual information of the next MEP and all unknowns [nat].

    Args:
        weights: of the posterior samples, shape (b, s).
        mass: probability of each value of the next MEP given each sample, shape (b, s, t, y).

    Returns:
        Shape (b, t).
    """
    mixture = torch.einsum("bs,bsty->bty", weights, mass)
    return _entropy(mixture) - torch.einsum("bs,bst->bt", weights, _entropy(mass))


def window_gain(weights: Tensor, mass: Tensor, masks: Tensor) -> Tensor:
    """Expected reduction of the summed variance of membership in the window.

    Args:
        weights: of the posterior samples, shape (b, s).
        mass: probability of each value of the next MEP given each sample, shape (b, s, t, y).
        masks: the samples' windows on a grid, shape (b, s, g).

    Returns:
        Shape (b, t).
    """
    people, _, candidates, outcomes = mass.shape
    joint = (weights[..., None, None] * mass).flatten(2).transpose(1, 2)
    probability = joint.sum(-1).clamp_min(1e-12)
    inside = joint @ masks
    # Summed over outcomes, P(y) m(1 - m) is P(in) - sum of P(y, in)^2 / P(y): only the second part depends on the ISI.
    sharpness = (inside.square() / probability.unsqueeze(-1)).sum(-1).view(people, candidates, outcomes).sum(-1)
    prior = torch.einsum("bs,bsg->bg", weights, masks).square().sum(-1, keepdim=True)
    return sharpness - prior


@dataclass(frozen=True)
class MutualInformation:
    """Mutual information of the next MEP and all unknowns."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes,)

    def __call__(self, posterior: PredictsOutcomes, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        return mutual_information(*posterior.outcome_mass(isi_ms))


@dataclass(frozen=True)
class WindowGain:
    """Expected reduction of the uncertainty about which ISIs are in the window."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: _WindowPosterior, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        weights, mass = posterior.outcome_mass(isi_ms)
        return window_gain(weights, mass, posterior.window_masks(isi_ms))


@dataclass(frozen=True)
class Alternating:
    """The window on one trial, all unknowns on the next.

    What is not known of a person's responses costs certainty about the window later on, but never enough on any one
    trial for `WindowGain` to ask for it; `MutualInformation` asks for little else.
    """

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: _WindowPosterior, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        return MutualInformation()(posterior, isi_ms) if posterior.trials % 2 else WindowGain()(posterior, isi_ms)
