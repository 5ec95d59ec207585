"""How the examination of b people goes on: what is asked of each next, and what a stopping rule looks back on.

A `Course` never changes: telling it a trial gives the next one. One person's `Strategy` and a batch of people wrap the
same course, so that both follow the same rules.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Literal, TypeAlias

from isiw.acquisition.batch import own_plan
from isiw.acquisition.fixed import golden_index
from isiw.acquisition.protocol import AcquisitionFunction, FollowsPlan, best_candidate, require_scores
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.lazy import torch
from isiw.models.protocol import (
    ExpectsTheUsual,
    NotesChanges,
    Observation,
    Posterior,
    ProposesIsi,
    ResponseModel,
    Tensor,
)
from isiw.strategy.stopping import Progress, StopDecision, StoppingRule, looks_back

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


@cache
def candidate_isis(space: DesignSpace) -> Tensor:
    """Evenly spaced ISIs of the design grid to score [ms], both ends included, shape (t,); at most `MAX_CANDIDATES`.

    One tensor for all callers, who leave it as it is.
    """
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


@dataclass(frozen=True)
class Method:
    """How people are examined.

    Args:
        space: the ISIs that may be asked.
        model: the model of a person's responses.
        acquisition: what scores candidate ISIs.
        stopping: the rule that says when to stop.
        initial_ms: ISIs to ask for first [ms], on the grid, whatever the responses.
        cost: is taken off the scores.
    """

    space: DesignSpace
    model: ResponseModel
    acquisition: AcquisitionFunction
    stopping: StoppingRule
    initial_ms: tuple[float, ...] = ()
    cost: Cost | None = None

    def begin(self, seed: int, people: int = 1) -> Course:
        """The course before the first trial."""
        posterior = self.model.begin(self.space, seed, people)
        return Course(self, posterior, people, Belief(posterior, 0))


@dataclass(frozen=True, eq=False)
class Belief:
    """What is believed of b people after some trials; a window is estimated once, and only where somebody asks.

    Args:
        posterior: what is believed; None where all estimates are made.
        pairs: how many pairs of stimuli each person was told of.
        estimates: those made so far, by person.
        first: what was believed before the first trial; None where it is that.
    """

    posterior: Posterior | None
    pairs: int
    estimates: dict[int, WindowEstimate] = field(default_factory=dict)
    first: Belief | None = None

    def estimate(self, person: int) -> WindowEstimate:
        """What is believed about the window of one person."""
        if person not in self.estimates and self.posterior is not None:
            estimate = self.posterior.estimate(person)
            knows = self.first is not None and estimate.probability is not None
            before = self.first.estimate(person).probability if self.first is not None and knows else None
            self.estimates[person] = estimate.noting(pairs=self.pairs, beforehand=before)
        return self.estimates[person]

    def looked_back_on(self, people: int) -> Belief:
        """The same, without a posterior where the estimates of all people are made."""
        done = self.posterior is None or len(self.estimates) < people
        return self if done else replace(self, posterior=None)


@dataclass(frozen=True, eq=False)
class Course:
    """What was told of b people, what is believed of them, and what is asked of each next.

    Args:
        method: how they are examined.
        posterior: what is believed.
        people: how many there are.
        first: what was believed before the first trial.
        told: trials told of each.
        alone: how many of those were TMS alone.
        earlier: what was believed before the last trial, as far as the stopping rule looks back on it.
        paired: whether the last trial was a pair of stimuli.
        known: pairs that were learnt of each before the first ask; no plan and no budget counts them.
        known_told: trials that were, those with TMS alone among them.
    """

    method: Method
    posterior: Posterior
    people: int
    first: Belief
    told: int = 0
    alone: int = 0
    earlier: tuple[Belief, ...] = ()
    paired: bool = False
    known: int = 0
    known_told: int = 0

    def begun_here(self) -> Course:
        """The course whose first trial is the next one, whatever was learnt before."""
        known, told = self.known + self.paired_trials, self.known_told + self.told
        return replace(self, told=0, alone=0, earlier=(), paired=False, known=known, known_told=told)

    def again(self, seed: int, observations: Iterable[Observation | None]) -> Course:
        """The course of the same people after some trials from the beginning; None is a change."""
        course = self.method.begin(seed, self.people)
        for observation in observations:
            course = course.noting_change() if observation is None else course.after(observation)
        told, alone = course.told - self.known_told, course.alone - (self.known_told - self.known)
        return replace(course, told=told, alone=alone, known=self.known, known_told=self.known_told)

    def after(self, observation: Observation) -> Course:
        """The course after one more trial of each person; all of them pairs of stimuli, or all TMS alone."""
        alone = bool(observation.isi_ms.isnan().all())
        return replace(
            self,
            posterior=self.method.model.update(self.posterior, observation),
            told=self.told + 1,
            alone=self.alone + alone,
            earlier=tuple(belief.looked_back_on(self.people) for belief in self.past),
            paired=not alone,
        )

    def noting_change(self) -> Course:
        """The course where something changes now that bears on all MEPs; the same where the model knows no changes."""
        posterior = self.posterior
        return replace(self, posterior=posterior.noting_change()) if isinstance(posterior, NotesChanges) else self

    @property
    def paired_trials(self) -> int:
        """How many pairs of stimuli were told of each person."""
        return self.told - self.alone

    @cached_property
    def belief(self) -> Belief:
        """What is believed now."""
        return Belief(self.posterior, self.known + self.paired_trials, first=self.first)

    @cached_property
    def past(self) -> tuple[Belief, ...]:
        """What the stopping rule looks back on, the first after the last initial ISI."""
        kept = looks_back(self.method.stopping)
        if not kept or not self.paired or self.paired_trials < len(self.method.initial_ms):
            return self.earlier
        return (*self.earlier, self.belief)[-kept:]

    @property
    def initial_left(self) -> tuple[float, ...]:
        """What is left of the initial ISIs [ms]."""
        return self.method.initial_ms[self.paired_trials :]

    def ahead_ms(self, n: int) -> list[float]:
        """The next ISIs [ms] of one person that stand already, whatever will be told; at most n of a design's."""
        acquisition, space, left = self.method.acquisition, self.method.space, self.initial_left
        if isinstance(acquisition, FollowsPlan):
            pairs = range(self.paired_trials + len(left), self.paired_trials + n)
            return [*left, *(acquisition.planned_isi_ms(space, pair) for pair in pairs)]
        return [*left, *map(space.snap, own_plan(self.posterior, acquisition))]

    @property
    def plans_ahead(self) -> bool:
        """True if the model or the design has a plan of ISIs, so that a lost one is asked again."""
        acquisition = self.method.acquisition
        proposes = ProposesIsi in acquisition.needs and isinstance(self.posterior, ProposesIsi)
        return proposes or isinstance(acquisition, FollowsPlan)

    @cached_property
    def planned(self) -> tuple[Choice, ...] | None:
        """What is asked of each person where that stands already; None where the acquisition function chooses."""
        if self.initial_left:
            return (Choice(self.initial_left[0], by="initial"),) * self.people
        if isinstance(acquisition := self.method.acquisition, FollowsPlan):
            isi_ms = acquisition.planned_isi_ms(self.method.space, self.paired_trials)
            return (Choice(isi_ms, by="plan"),) * self.people
        if self.plans_ahead and isinstance(self.posterior, ProposesIsi):
            wanted_ms = self.posterior.proposed_isis_ms()[:, 0].tolist()
            return tuple(Choice(self.method.space.snap(isi_ms), by="plan") for isi_ms in wanted_ms)
        return None

    @cached_property
    def choices(self) -> tuple[Choice, ...]:
        """What is asked of each person next."""
        return self.planned or self.chosen(self.posterior)

    def chosen(self, posterior: Posterior) -> tuple[Choice, ...]:
        """What the acquisition function chooses for each person, whatever is planned."""
        if isinstance(posterior, ExpectsTheUsual):
            posterior = posterior.as_usual
        method = self.method
        return best_choices(
            posterior, method.acquisition, method.space, told=self.told, people=self.people, cost=method.cost
        )

    def estimate(self, person: int = 0) -> WindowEstimate:
        """What is believed about the window of one person."""
        return self.belief.estimate(person)

    def decision(self, person: int = 0, mistrials: int = 0, *, silent: bool = False) -> StopDecision:
        """The decision to stop with one person or not, with its reason."""
        past = tuple(belief.estimate(person) for belief in self.past)
        estimate = self.estimate(person).noting(silent=silent)
        progress = Progress(self.paired_trials + mistrials, self.paired_trials, estimate, past=past)
        return self.method.stopping(progress)
