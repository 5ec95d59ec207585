"""Minutes on the table, from trials: one-second trials and the rests of 4.2.1."""

from __future__ import annotations

from typing import Final

__all__ = ["BREAKS_OF_A_FULL_SWEEP", "minutes"]

TRIAL_S: Final = 1.0
BLOCK: Final = 12
REST_S: Final = 120.0
BREAK_S: Final = 600.0
"""The text has breaks of five minutes, but its sum of 130 minutes has ten (4.2.1)."""

BREAKS_OF_A_FULL_SWEEP: Final = 2
"""Long breaks of a conventional sweep (4.2.1)."""


def minutes(trials: float, breaks: int = 0) -> float:
    """How long some trials take [min]: two minutes of rest after every twelve, and breaks.

    Args:
        trials: how many.
        breaks: of ten minutes.
    """
    seconds = trials * TRIAL_S + trials // BLOCK * REST_S + breaks * BREAK_S
    return seconds / 60.0
