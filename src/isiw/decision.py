"""The decision to stop or not, of a strategy, a threshold search or a plan, and what it rests on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class StopKind(StrEnum):
    """The grounds of a decision."""

    BUDGET = "budget"
    LIMIT = "limit"
    KNOWN = "window known"
    ABSENT = "no window"
    SMALL_GAIN = "small gain"
    SETTLED = "settled"
    TOO_LITTLE = "too little measured"
    PAUSED = "paused"
    THRESHOLD = "threshold"
    PLAN = "plan"
    OWN = "a user's own rule"

    def stop(self, reason: str) -> StopDecision:
        """The decision to stop, for this reason."""
        return StopDecision(stop=True, reason=reason, kind=self)

    def go_on(self, reason: str) -> StopDecision:
        """The decision to continue, for this reason."""
        return StopDecision(stop=False, reason=reason, kind=self)


OF_THE_WINDOW: Final = frozenset(
    {StopKind.KNOWN, StopKind.ABSENT, StopKind.SMALL_GAIN, StopKind.SETTLED, StopKind.TOO_LITTLE}
)
"""Decisions that say something about the window; they mean nothing if too little was measured."""


@dataclass(frozen=True)
class StopDecision:
    """The decision to stop or not, with its reason.

    Args:
        stop: whether to stop.
        reason: why, or why not, in full sentences.
        kind: what it rests on.
    """

    stop: bool
    reason: str
    kind: StopKind = StopKind.OWN
