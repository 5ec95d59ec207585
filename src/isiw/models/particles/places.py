"""Places: windows that earlier sessions lead one to expect, of the same person or of other people of the same lab."""

from __future__ import annotations

from dataclasses import dataclass

from isiw.checks import Checked, MeanAndSd, Share
from isiw.models.shared.scales import AnyLaw, PositiveLaw
from isiw.types import Conditioning, Reference

MOST_APART_MS = 10.0
"""Hit delays of one rig are not further apart from one measurement to the next."""


@dataclass(frozen=True)
class Place(Checked):
    """A law of the window's start and width together.

    Args:
        share: probability of this law.
        start_ms: the start on the clock of the reference [ms].
        width_ms: the width [ms].
        reference: the event that the start counts from.
        hit_delay_ms: mean and SD of the hit delay of the rig that it was learnt with [ms]; None where nobody stated it.
        conditioning: the conditioning stimulus that it was learnt with.
    """

    share: Share
    start_ms: AnyLaw
    width_ms: PositiveLaw
    reference: Reference = "valve"
    hit_delay_ms: MeanAndSd | None = None
    conditioning: Conditioning = "tap"

    def is_of_rig(self, hit_delay_ms: tuple[float, float] | None) -> bool:
        """Whether it can be of a rig: from the valve command, starts are as late as its taps."""
        if self.reference != "valve" or self.hit_delay_ms is None or hit_delay_ms is None:
            return True
        return abs(self.hit_delay_ms[0] - hit_delay_ms[0]) <= MOST_APART_MS
