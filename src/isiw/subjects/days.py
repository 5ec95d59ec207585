"""The same person another day: the window may have moved, and the electrodes lie elsewhere."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from isiw.subjects.profiles import PeakProfile
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject

P_STAYS: Final = 0.7
"""How often the window is the one of the day before, moved as a whole."""

SHIFT_SD_MS: Final = 12.0
AMPLITUDE_LOG_SD: Final = 0.4
X50_SD_PCT: Final = 3.0


def another_day(person: SimulatedSubject, stranger: SimulatedSubject, rng: np.random.Generator) -> SimulatedSubject:
    """The same person another day (dissertation, appendix B: the window can move a lot).

    Args:
        person: with a profile of one peak and a recruitment curve.
        stranger: whose window the person has where it was drawn anew.
        rng: source of randomness.

    Raises:
        TypeError: another kind of profile or response.
    """
    if not (isinstance(person.profile, PeakProfile) and isinstance(person.response, RecruitmentResponse)):
        raise TypeError(person)
    stays = rng.random() < P_STAYS
    shift, amplitude, x50 = rng.standard_normal(3)
    moved = replace(person.profile, start_ms=float(person.profile.start_ms + SHIFT_SD_MS * shift))
    response = replace(
        person.response,
        amplitude_mv=float(person.response.amplitude_mv * np.exp(AMPLITUDE_LOG_SD * amplitude)),
        x50_pct_rmt=float(person.response.x50_pct_rmt + X50_SD_PCT * x50),
    )
    return replace(person, profile=moved if stays else stranger.profile, response=response)
