"""A change in the course of a session, as an estimate has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

LIKELY_CHANGE: Final = 0.6
"""Probability from which on an estimate names a change; at 0.5, more than 3 % of sessions would name one wrongly."""

SURE_OF_A_CHANGE: Final = 0.9
"""Probability from which on a change during the session is said."""


MOST_NOTED: Final = 20
"""At most so many noted changes are learnt in a session, several at one trial as one; more are remarks."""


@dataclass(frozen=True)
class Change:
    """A likely change in the course of a session, whatever the ISI.

    Args:
        kind: what changed: amplitudes, the intensity as far as MEPs show it, or the enhancement from trial to trial.
        probability: that amplitudes or the intensity have changed, or the enhancement has.
        size: by which factor amplitudes changed, or the enhancement since the first trial; by how much the intensity
            did [% RMT].
        low: lower end of its 90 % interval.
        high: upper end.
        trial: how many trials that count came before it; None for an enhancement.
    """

    kind: Literal["amplitudes", "intensity", "enhancement"]
    probability: float
    size: float
    low: float
    high: float
    trial: int | None = None

    @property
    def is_sure(self) -> bool:
        """True if it is said outright."""
        return self.probability >= SURE_OF_A_CHANGE
