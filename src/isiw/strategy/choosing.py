"""Which ISI an acquisition function chooses for each person next."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from isiw.acquisition.fixed import golden_index
from isiw.acquisition.protocol import AcquisitionFunction, best_candidate, require_scores
from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.protocol import Posterior, Tensor

ASKED_AGAIN = 2
"""So often a lost trial is asked again at the same ISI; then another ISI stands in for it."""

MAX_CANDIDATES = 101
"""At most so many ISIs are scored, so that the cost of an ask does not grow with the range."""

Cost = Callable[[Tensor], Tensor]
"""What each of some ISIs [ms] (shape (t,)) costs, in the unit of the scores, shape (t,)."""

ChosenBy: TypeAlias = Literal["initial", "plan", "acquisition", "fallback", "again"]
"""What chose an ISI: it is an initial one, in a plan of the model or the design, of the highest score, stands in for
that one, or is asked again because its trial was lost."""


@dataclass(frozen=True)
class Choice:
    """What is asked of one person next.

    Args:
        isi_ms: the ISI [ms], on the grid.
        fallback: why it is not the acquisition function's choice; None where it is.
        by: what it was chosen by.
        scores: of `candidate_isis`, less their cost, shape (t,); None where none were worked out.
    """

    isi_ms: float
    fallback: str | None = None
    by: ChosenBy = field(default="acquisition", compare=False)
    scores: Tensor | None = field(default=None, compare=False, repr=False)


def candidate_isis(space: DesignSpace) -> Tensor:
    """Evenly spaced ISIs of the design grid to score [ms], both ends included, shape (t,); at most `MAX_CANDIDATES`."""
    grid = space.grid_ms
    stride = max(1, math.ceil((len(grid) - 1) / (MAX_CANDIDATES - 1)))
    picked = sorted({*range(0, len(grid), stride), len(grid) - 1})
    return torch.as_tensor(grid[picked], dtype=torch.float32)


def best_choices(
    posterior: Posterior,
    acquisition: AcquisitionFunction,
    space: DesignSpace,
    *,
    told: int,
    people: int = 1,
    cost: Cost | None = None,
) -> tuple[Choice, ...]:
    """The ISI of each person that the acquisition function scores best; an evenly spaced one where it scores none."""
    candidates = candidate_isis(space)
    given = require_scores(acquisition, acquisition(posterior, candidates), len(candidates), people)
    scores = given.cpu().expand(people, -1)
    costs = None if cost is None else cost(candidates)
    best = best_candidate(scores, costs, first=golden_index(told, len(candidates)))
    nothing = f"{type(acquisition).__name__} gives no ISI a finite score: an evenly spaced one instead."
    scored, net = scores.isfinite().any(-1), scores if costs is None else scores - costs
    return tuple(
        Choice(space.snap(isi_ms), scores=own) if found else Choice(space.snap(isi_ms), nothing, by="fallback")
        for isi_ms, found, own in zip(candidates[best].tolist(), scored.tolist(), net, strict=True)
    )


def evenly_spaced(space: DesignSpace, told: int) -> float:
    """The ISI [ms] of this trial in an order that fills the range, whatever is believed."""
    candidates = candidate_isis(space)
    return space.snap(float(candidates[golden_index(told, len(candidates))]))


def instead_of_lost(space: DesignSpace, lost: int, delivered: int) -> Choice | None:
    """What is asked instead of an ISI that was lost again and again; None where it is asked once more."""
    if lost <= ASKED_AGAIN:
        return None
    reason = f"The trial was lost {lost} times in a row: an evenly spaced ISI instead."
    return Choice(evenly_spaced(space, delivered), reason, by="fallback")
