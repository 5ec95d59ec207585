"""How much is run: the whole report, or a quick look at all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["FULL", "QUICK", "Size"]


@dataclass(frozen=True)
class Size:
    """How many sessions each part has; sessions of the eleven of `kim11` and `kim11-measured` are noise seeds.

    Args:
        kim: sessions of either eleven in the main comparison.
        kim_default: how many of those of `kim11-measured` the default plays too, which takes longer than all others.
        people: people of `recruitment` in the main comparison.
        people_default: how many of them, and of `kim11`, the default plays too.
        headline: people of each cohort of the headline, with every method.
        sweep: sessions for each number of initial observations or particles.
        readings: sessions for each reading.
        horizon: trials of the default's learning curve in the headline.
        online: sessions on waveforms with each of two people.
    """

    kim: int
    kim_default: int
    people: int
    people_default: int
    headline: int
    sweep: int
    readings: int
    horizon: int
    online: int


FULL: Final = Size(
    kim=33,
    kim_default=11,
    people=66,
    people_default=11,
    headline=44,
    sweep=11,
    readings=11,
    horizon=40,
    online=3,
)
QUICK: Final = Size(
    kim=11,
    kim_default=2,
    people=4,
    people_default=1,
    headline=4,
    sweep=3,
    readings=3,
    horizon=12,
    online=1,
)
