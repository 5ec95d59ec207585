"""Places: windows that earlier sessions lead one to expect, of the same person or of other people of the same lab."""

from __future__ import annotations

from dataclasses import dataclass

from isiw.checks import Checked, Share, mean_and_sd
from isiw.models.shared.scales import Scale, check_scales
from isiw.types import Conditioning, Reference

MOST_APART_MS = 10.0
"""Hit delays of one rig are not further apart from one measurement to the next."""


@dataclass(frozen=True)
class Place(Checked):
    """A law of the window's start and width together.

    Args:
        share: its probability.
        start_ms: the start on the clock of the reference [ms].
        width_ms: the width [ms].
        reference: the event that the start counts from.
        hit_delay_ms: mean and SD of the hit delay of the rig that it was learnt with [ms]; None where nobody stated it.
        conditioning: the conditioning stimulus that it was learnt with.
    """

    share: Share
    start_ms: Scale
    width_ms: Scale
    reference: Reference = "valve"
    hit_delay_ms: tuple[float, float] | None = None
    conditioning: Conditioning = "tap"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_scales(self, "start_ms", positive=False, tailed=False)
        check_scales(self, "width_ms", tailed=False)
        if self.hit_delay_ms is not None:
            object.__setattr__(self, "hit_delay_ms", mean_and_sd("Place.hit_delay_ms", self.hit_delay_ms))

    def is_of_rig(self, hit_delay_ms: tuple[float, float] | None) -> bool:
        """Whether it can be of a rig: from the valve command, starts are as late as its taps."""
        if self.reference != "valve" or self.hit_delay_ms is None or hit_delay_ms is None:
            return True
        return abs(self.hit_delay_ms[0] - hit_delay_ms[0]) <= MOST_APART_MS
