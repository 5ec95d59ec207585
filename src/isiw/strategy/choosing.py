"""How a strategy goes on: what it asks next, and what its stopping rule looks back on, for b people side by side.

Plain functions of what is believed, so that one person's `Strategy` and a batch of people follow one law.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch

from isiw.acquisition.fixed import golden_index
from isiw.acquisition.protocol import AcquisitionFunction, best_candidate
from isiw.design import DesignSpace
from isiw.models.protocol import Posterior, ProposesIsi, Tensor
from isiw.strategy.stopping import StoppingRule, looks_back
from isiw.window import WindowEstimate

__all__ = ["Choice", "Cost", "best_choices", "candidate_isis", "evenly_spaced", "planned_choices", "remembered"]

MAX_CANDIDATES = 101

Cost = Callable[[Tensor], Tensor]
"""What each of some ISIs [ms] (shape (t,)) costs, in the unit of the scores, shape (t,)."""


@dataclass(frozen=True)
class Choice:
    """What is asked of one person next.

    Args:
        isi_ms: the ISI [ms], on the grid.
        fallback: why it is not the acquisition function's choice; None where it is.
    """

    isi_ms: float
    fallback: str | None = None


def candidate_isis(space: DesignSpace, max_candidates: int = MAX_CANDIDATES) -> Tensor:
    """Evenly spaced ISIs of the design grid to score [ms], both ends included, shape (t,).

    Args:
        space: the design space.
        max_candidates: at most this many, so that the cost of an ask does not grow with the range.
    """
    grid = space.grid_ms
    stride = max(1, math.ceil((len(grid) - 1) / (max_candidates - 1)))
    picked = sorted({*range(0, len(grid), stride), len(grid) - 1})
    return torch.as_tensor(grid[picked], dtype=torch.float32)


def planned_choices(
    posterior: Posterior,
    acquisition: AcquisitionFunction,
    space: DesignSpace,
    initial_ms: Sequence[float] = (),
    people: int = 1,
) -> list[Choice]:
    """The next ISI of each person where it stands already; none where the acquisition function chooses.

    Args:
        posterior: what is believed.
        acquisition: the acquisition function; it may leave the choice to the method's own plan.
        space: the design space.
        initial_ms: what is left of the initial ISIs [ms]; they come first.
        people: how many there are.
    """
    if initial_ms:
        return [Choice(initial_ms[0])] * people
    if ProposesIsi in acquisition.needs and isinstance(posterior, ProposesIsi):
        return [Choice(space.snap(isi_ms)) for isi_ms in posterior.proposed_isis_ms()[:, 0].tolist()]
    return []


def best_choices(
    posterior: Posterior,
    acquisition: AcquisitionFunction,
    space: DesignSpace,
    *,
    told: int,
    people: int = 1,
    cost: Cost | None = None,
) -> list[Choice]:
    """The ISI of each person that the acquisition function scores best; an evenly spaced one where it scores none.

    Args:
        posterior: what is believed.
        acquisition: the acquisition function.
        space: the design space.
        told: trials told of each person.
        people: how many there are.
        cost: is taken off the scores.
    """
    candidates = candidate_isis(space)
    scores = acquisition(posterior, candidates).cpu().expand(people, -1)
    best = best_candidate(scores, None if cost is None else cost(candidates), first=golden_index(told, len(candidates)))
    nothing = f"{type(acquisition).__name__} gives no ISI a finite score: an evenly spaced one instead."
    scored = scores.isfinite().any(-1)
    return [
        Choice(space.snap(isi_ms), None if found else nothing)
        for isi_ms, found in zip(candidates[best].tolist(), scored.tolist(), strict=True)
    ]


def evenly_spaced(space: DesignSpace, told: int) -> float:
    """The ISI [ms] of this trial in an order that fills the range, whatever is believed."""
    candidates = candidate_isis(space)
    return space.snap(float(candidates[golden_index(told, len(candidates))]))


def remembered(
    past: tuple[WindowEstimate, ...],
    estimate: Callable[[], WindowEstimate],
    stopping: StoppingRule,
    pairs_since_initial: int,
) -> tuple[WindowEstimate, ...]:
    """The past estimates that a stopping rule looks back on, after one more pair of stimuli was told.

    Args:
        past: those before it.
        estimate: gives the present one; called only where it is needed.
        stopping: the rule.
        pairs_since_initial: pairs told after the initial ISIs, negative before; the first estimate is that at 0.
    """
    kept = looks_back(stopping)
    return (*past, estimate())[-kept:] if kept and pairs_since_initial >= 0 else past
