"""Rules of when to stop: one answers a `Progress` with a decision; those of isiw are in `stopping`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from isiw.checks import can
from isiw.decision import StopDecision
from isiw.estimate import WindowEstimate


@dataclass(frozen=True)
class Progress:
    """A session's delivered pairs, mistrials included, those learnt, and the estimates now and before.

    `given` is how many pulses over the recruitment curve were learnt before the first pair.
    """

    delivered: int
    told: int
    estimate: WindowEstimate
    past: tuple[WindowEstimate, ...] = ()
    given: int = 0


class StoppingRule(Protocol):
    """A rule: from progress to a decision.

    One that needs past estimates says how many by an attribute `looks_back`; `HasBudget` is what it may say besides.
    """

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""


@runtime_checkable
class HasBudget(Protocol):
    """Capability: a rule that stops after so many stimuli at the latest."""

    def stimuli_left(self, delivered: int) -> int | None:
        """Number that it still allows after so many; None if it sets no budget after all."""


def stimuli_left(rule: StoppingRule, delivered: int) -> int | None:
    """Number of stimuli that a rule's budget still allows; None if it sets none."""
    return rule.stimuli_left(delivered) if can(rule, HasBudget) else None


def looks_back(rule: StoppingRule) -> int:
    """Number of past estimates that a rule needs."""
    past: int = getattr(rule, "looks_back", 0)
    return past
