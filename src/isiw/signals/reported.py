"""Whether the realised ISIs that a lab's own loop reports are those of the trials that it was asked for.

A loop that reports one ISI again and again, that of the trial before, or a fraction of it, is far off in most trials. A
right rig is not: its ISIs scatter by a few ms about those asked, are all some ms longer, or are rounded to what it can
deliver.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from isiw.design import DesignSpace
from isiw.errors import IsiwError
from isiw.findings import Finding, Kind, Severity, refused

FAR_MS: Final = 20.0
"""Farther from the ISI that was asked than jitter, a constant delay and rounding to 10 ms bring a right rig [ms]."""

TOLERANCES: Final = 2
"""A space whose tolerance is wider has a rig of that kind: so many tolerances are far, if that is more."""

OF_THE_RANGE, LEAST_FAR_MS = 1 / 3, 5.0
"""In a narrow space less is far: this share of its range, and at least so much [ms]."""

SDS: Final = 3.0
"""An ISI that is not measured is far if it is so many more of its SDs away."""

FAR_ONES, AMONG = 3, 5
"""So many far ones among so many trials in a row are in doubt: single ones may be a fault of the rig."""


def far_ms(space: DesignSpace) -> float:
    """The distance from the ISI that was asked beyond which a realised one is far [ms]."""
    narrow_ms = max(LEAST_FAR_MS, OF_THE_RANGE * (space.high_ms - space.low_ms))
    return min(max(FAR_MS, TOLERANCES * space.tolerance_ms), narrow_ms)


def is_far(off_ms: float, space: DesignSpace, isi_sd_ms: float = 0.0) -> bool:
    """Whether a realised ISI is far from the one that was asked, by their difference [ms]."""
    return abs(off_ms) > far_ms(space) + SDS * isi_sd_ms


def doubtful_from(far: Sequence[bool]) -> int | None:
    """The first of some trials that is in doubt, and with it all after it, by which of them are far; None if none is.

    Those between the far ones are in doubt, too: a wrong ISI may be near the right one by chance.
    """
    for first, is_first in enumerate(far):
        if is_first and sum(far[first : first + AMONG]) >= FAR_ONES:
            return first
    return None


def unconfirmed(doubted: Collection[int], space: DesignSpace, instead: str) -> IsiwError:
    """The error if an outcome is reported while realised ISIs are in doubt.

    Args:
        doubted: the numbers of the trials in doubt.
        space: the space that was asked from.
        instead: what to do where they are wrong, as a clause.
    """
    found = Finding(
        Kind.ISIS_FAR,
        Severity.REFUSED,
        "realised ISIs are far from those that were asked for, and are not confirmed",
        "Does your loop report the ISI that was delivered in this very trial, in ms, and from the event that ISIs "
        "count from? If they are right, report this outcome with confirm=True, and they count. If they are wrong, "
        f"{instead}.",
    )
    numbers = ", ".join(map(str, sorted(doubted)))
    return refused(
        found, f"trials in doubt: {numbers}", f"ISIs within {far_ms(space):g} ms of those that were asked for"
    )
