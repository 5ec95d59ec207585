"""What an acquisition function is, and how its scores become the next ISI."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import torch

from isiw.design import DesignSpace
from isiw.models.protocol import PredictsOutcomes, SamplesProfiles, SamplesWindows, Tensor

__all__ = ["AcquisitionFunction", "FollowsPlan", "ForeseesProfiles", "ForeseesWindows", "best_candidate"]


class ForeseesProfiles(PredictsOutcomes, SamplesProfiles, Protocol):
    """A posterior of profiles that predicts the next MEP."""


class ForeseesWindows(PredictsOutcomes, SamplesWindows, Protocol):
    """A posterior of windows that predicts the next MEP."""


@runtime_checkable
class AcquisitionFunction(Protocol):
    """A settings object that scores candidate ISIs under a posterior; higher is better."""

    @property
    def needs(self) -> tuple[type, ...]:
        """The capability protocols that a posterior must have."""

    def __call__(self, posterior: Any, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs [ms], shape (t,), for each person, shape (b, t)."""


@runtime_checkable
class FollowsPlan(Protocol):
    """An acquisition function whose choice is known beforehand, on the grid of the space, whatever is believed."""

    def planned_isi_ms(self, space: DesignSpace, pairs: int) -> float:
        """The ISI [ms] of the pair of stimuli after so many pairs.

        Args:
            space: the ISIs that may be asked.
            pairs: how many pairs were told; TMS alone is none.
        """


def best_candidate(scores: Tensor, cost: Tensor | None = None, first: int = 0) -> Tensor:
    """Index of the best candidate for each person, shape (b,); a score that is not finite loses.

    Args:
        scores: shape (b, t).
        cost: what each candidate costs, in the unit of the scores, shape (t,).
        first: a tie goes to this candidate, or to the next one behind it, in a circle.
    """
    net = scores if cost is None else scores - cost
    net = torch.where(torch.isfinite(net), net, -torch.inf).roll(-first, dims=-1)
    return (net.argmax(dim=-1) + first) % scores.shape[-1]
