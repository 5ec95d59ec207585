"""Places: windows that earlier sessions lead one to expect, of the same person or of other people of the same lab."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import get_args

from isiw.checks import check_choice, check_probabilities
from isiw.models.particles.mixture import Mixture
from isiw.models.shared.scales import Scale, check_scales
from isiw.types import Reference

__all__ = ["Place", "mixture_of"]


@dataclass(frozen=True)
class Place:
    """A law of the window's start and width together.

    Args:
        share: its probability.
        start_ms: the start on the clock of the reference [ms].
        width_ms: the width [ms].
        reference: the event that the start counts from.

    Raises:
        InvalidValueError: an invalid share, scale or reference.
    """

    share: float
    start_ms: Scale
    width_ms: Scale
    reference: Reference = "valve"

    def __post_init__(self) -> None:
        check_probabilities(self, "share")
        check_scales(self, "start_ms", positive=False, tailed=False)
        check_scales(self, "width_ms", tailed=False)
        check_choice(self, "reference", get_args(Reference))


def mixture_of(places: tuple[Place, ...]) -> Mixture:
    """The places as a mixture over start and log width."""
    latents = [
        (p.share, [(p.start_ms.median, p.start_ms.sd), (math.log(p.width_ms.median), p.width_ms.sd)]) for p in places
    ]
    return Mixture.of(latents, "cpu")
