"""How much is run: the whole report, or little of all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["FEW", "FULL", "Size"]


@dataclass(frozen=True)
class Size:
    """How many sessions each part has; sessions of the eleven of `kim11` and `kim11-measured` are noise seeds.

    Args:
        kim: sessions of the eleven of `kim11-measured` in the main comparison.
        kim_default: how many of those the default plays too, which takes longer than all others.
        people: sessions of `kim11`, and people of `recruitment`, in the main comparison.
        people_default: how many of them the default plays too.
        sweep: sessions for each number of initial observations or particles.
        readings: sessions for each reading.
        online: sessions on waveforms with each of two people.
        default: settings of the default; none of its own where everything is run.
    """

    kim: int
    kim_default: int
    people: int
    people_default: int
    sweep: int
    readings: int
    online: int
    default: tuple[tuple[str, int], ...] = ()


FULL: Final = Size(kim=88, kim_default=0, people=11, people_default=0, sweep=6, readings=11, online=1)
FEW: Final = Size(
    kim=2, kim_default=2, people=2, people_default=2, sweep=2, readings=1, online=1, default=(("max_trials", 6),)
)
"""So few that little can be concluded."""
