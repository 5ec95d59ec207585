"""What an estimate says against its own law: a change in the course of a session, and that the law does not fit."""

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


AGAINST_A_LAW: Final = 100.0
"""What a bet of 1 against the law of responses must have been worth for the law to be doubted."""

AGAINST_A_CURVE: Final = 50.0
"""The Bayes factor from which on pulses given alone and pairs are said not to fit; both are wrong in .03 at most."""


@dataclass(frozen=True)
class Misfit:
    """What amplitudes say against the law of responses that an estimate rests on.

    Args:
        law: what a bet of 1 against it has been worth at most; where the law is right, it ever reaches x with
            probability 1 / x at most.
        curve: the Bayes factor of pulses given alone first that are of a higher level than the session over the same
            level; None where too few were given at about the pairs' intensity.
    """

    law: float
    curve: float | None = None

    @property
    def of_law(self) -> bool:
        """True if the law is doubted."""
        return self.law >= AGAINST_A_LAW

    @property
    def of_curve(self) -> bool:
        """True if pulses given alone and pairs do not fit each other."""
        return self.curve is not None and self.curve >= AGAINST_A_CURVE
