"""The choice of the next ISI, by scores or instead of them, and what was asked for and not learnt yet."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Literal, TypeAlias

import numpy as np

from isiw.acquisition.protocol import AcquisitionFunction, best_candidate, golden_index, require_scores
from isiw.design import DesignSpace
from isiw.models.protocol import Posterior
from isiw.signals.plausible import off_by
from isiw.types import Array, Singles

ASKED_AGAIN = 2
"""So often a lost trial is asked again at the same ISI; then another ISI stands in for it."""

MAX_CANDIDATES = 101
"""At most so many ISIs are scored, so that the cost of an ask does not grow with the range."""

Cost = Callable[[Array], Array]
"""What each of some ISIs [ms] (shape (t,)) costs, in the unit of the scores, shape (t,)."""

ChosenBy: TypeAlias = Literal["initial", "plan", "acquisition", "fallback", "again"]
"""What chose an ISI: it is an initial one, in a plan of the model or the design, of the highest score, stands in for
that one, or is asked again because its trial was lost."""


@dataclass(frozen=True)
class Choice:
    """The next ISI of one person, on the grid; scores are of `candidate_isis`, less their cost, shape (t,)."""

    isi_ms: float
    fallback: str | None = None
    by: ChosenBy = field(default="acquisition", compare=False)
    intensity_pct_rmt: float | None = None  # that was chosen with it; None for the usual one
    scores: Array | None = field(default=None, compare=False, repr=False)

    def at_least(self, least_ms: float, space: DesignSpace, reason: str) -> Choice:
        """The first ISI of the grid that is so long [ms], unless this one stands whatever the responses, or is."""
        longer = space.grid_ms[space.grid_ms >= least_ms]
        if self.by in {"initial", "plan"} or self.isi_ms >= least_ms or not longer.size:
            return self
        return Choice(float(longer[0]), reason, by="fallback", intensity_pct_rmt=self.intensity_pct_rmt)


@cache
def candidate_isis(space: DesignSpace) -> Singles:
    """Evenly spaced ISIs to score [ms], both ends included, shape (t,); one array for all, so that nobody may write."""
    grid = space.grid_ms
    stride = max(1, math.ceil((len(grid) - 1) / (MAX_CANDIDATES - 1)))
    picked = sorted({*range(0, len(grid), stride), len(grid) - 1})
    return grid[picked].astype(np.float32)


def best_choices(
    posterior: Posterior,
    acquisition: AcquisitionFunction,
    space: DesignSpace,
    *,
    told: int,
    people: int = 1,
    cost: Cost | None = None,
) -> tuple[Choice, ...]:
    """The ISI of each person that the acquisition function scores best; an evenly spaced one if it scores none."""
    candidates = candidate_isis(space)
    given = require_scores(acquisition, acquisition(posterior, candidates.copy()), len(candidates), people)
    scores = np.broadcast_to(given, (people, len(candidates)))
    net = scores if cost is None else scores - cost(candidates)
    best = best_candidate(net, first=golden_index(told, len(candidates)))
    nothing = f"{type(acquisition).__name__} gives no ISI a finite score: an evenly spaced one instead."
    return tuple(
        Choice(space.snap(float(candidates[index])), scores=own)
        if math.isfinite(own[index])
        else Choice(space.snap(float(candidates[index])), nothing, by="fallback")
        for index, own in zip(best.tolist(), net, strict=True)
    )


def evenly_spaced(space: DesignSpace, told: int) -> float:
    """The ISI [ms] of this trial in an order that fills the range, whatever the responses."""
    candidates = candidate_isis(space)
    return space.snap(float(candidates[golden_index(told, len(candidates))]))


def instead_of_lost(space: DesignSpace, lost: int, delivered: int) -> Choice | None:
    """The ISI instead of one that was lost again and again; None if it is asked once more."""
    if lost <= ASKED_AGAIN:
        return None
    reason = f"The trial was lost {lost} times in a row: an evenly spaced ISI instead."
    return Choice(evenly_spaced(space, delivered), reason, by="fallback")


@dataclass(frozen=True)
class Asked:
    """The ISIs that were asked for and not learnt yet: the next one, and the rest of a batch [ms]."""

    choice: Choice | None = None
    fallback: str | None = None
    batch_ms: tuple[float, ...] = ()

    def noting(self, choice: Choice) -> Asked:
        """The same with the reason of a choice, if it is the first that has one."""
        return replace(self, fallback=self.fallback or choice.fallback)

    def again(self) -> Asked:
        """The same before the next ISI is chosen once more."""
        return Asked(batch_ms=self.batch_ms)

    def meant_ms(self, isi_ms: float, mep_mv: float | None, space: DesignSpace) -> float | None:
        """The ISI that a trial is of [ms], be it given in seconds or swapped; None if none was asked."""
        asked_ms = self.batch_ms if self.choice is None else (self.choice.isi_ms, *self.batch_ms)
        if not asked_ms:
            return None
        readings = (isi_ms, isi_ms if mep_mv is None else max(isi_ms, mep_mv), 1000 * isi_ms)
        near_ms = [_nearest(asked_ms, value) for value in readings]
        meant = (near for near, value in zip(near_ms, readings, strict=True) if not off_by(value, near, space))
        return next(meant, near_ms[0])

    def after(self, isi_ms: float | None) -> Asked:
        """The same after a trial; nothing is left of the batch if the ISI is one that was asked since."""
        if isi_ms is None or not self.batch_ms:
            return self.again()
        reported_ms = _nearest(self.batch_ms, isi_ms)
        if self.choice is not None and _nearest((reported_ms, self.choice.isi_ms), isi_ms) != reported_ms:
            return Asked()
        index = self.batch_ms.index(reported_ms)
        return Asked(batch_ms=(*self.batch_ms[:index], *self.batch_ms[index + 1 :]))


def _nearest(asked_ms: Sequence[float], value: float) -> float:
    return min(asked_ms, key=lambda isi_ms: abs(isi_ms - value))
