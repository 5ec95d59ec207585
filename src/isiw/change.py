"""A change in the course of a session, as an estimate has it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

LIKELY_CHANGE: Final = 0.6
"""Probability from which on an estimate names a change; at 0.5, more than 3 % of sessions would name one wrongly."""

SURE_OF_A_CHANGE: Final = 0.9
"""Probability from which on a change during the session is said."""


_BLUR: Final = 2
"""By so many trials the place of a change may be off."""

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
        trial: how many trials of the session that count came before it, 0 where the pulses given before do not fit it;
            None for an enhancement.
    """

    kind: Literal["amplitudes", "intensity", "enhancement"]
    probability: float
    size: float
    low: float
    high: float
    trial: int | None = None

    def counted_from(self, first: int) -> Change | None:
        """The same change by the trials of a session that began with so many already learnt.

        At trial 0 it is one between these and the session; None if it was before the last of them.
        """
        if self.trial is None or not first:
            return self
        trial = self.trial - first
        return None if trial < -_BLUR else replace(self, trial=max(0, trial))

    @property
    def is_sure(self) -> bool:
        """True if it is said outright."""
        return self.probability >= SURE_OF_A_CHANGE
