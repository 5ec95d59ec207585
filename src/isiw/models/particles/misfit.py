"""The model's own doubt: bets against its law, paid by what each amplitude's predictive distribution says of it.

Where the law is right, the probability of a smaller amplitude is uniform, whatever came before, and no bet on another
distribution can be expected to win. The mean of several bets is then a nonnegative martingale that starts at 1: it
ever reaches 1 / a with probability a at most, whenever a session stops [Ville1939; Shafer2021].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from isiw.models.particles.mixture import log_sum
from isiw.models.shared.history import COUNTS, SHIFT, History
from isiw.types import FloatArray

STAKED: Final = np.array([0.25, 0.8])
"""Shares of a stake that are bet, the rest being kept: of a law that is a little wrong, and of one that is far off."""

LARGEST: Final = 20.0
"""Log of the largest factor that is told."""

NARROWEST: Final = 1e-3
"""A probability of a smaller amplitude is known to this: particles have no finer tails."""

NEAR_PCT_RMT: Final = 4.0
"""Pulses given alone that are no further from the pairs' intensity are compared with them [% RMT]."""

LEAST_GIVEN, LEAST_SINCE = 5, 8
"""Fewer pulses given alone, or amplitudes of the session, are not compared."""

OF_GIVEN, OF_SESSION = 1 / 3, 1 / 4
"""Which shares of both are compared, the smallest; that of the session is less, since many pairs are in a window."""

SAME_SD, OTHER_SD, LEAST_SD = 0.15, 1.0, 0.2
"""By how much levels differ where nothing was moved, and otherwise, and the smallest SD of single amplitudes; logs."""


def _laws(below: FloatArray) -> FloatArray:
    """Distributions that are bet on, in amplitudes larger, smaller, less and more alike than expected, (..., 4)."""
    square, spread = below * below, 2.0 / math.pi * np.arcsin(np.sqrt(below))
    return np.stack((square, 2.0 * below - square, spread, square * (3.0 - 2.0 * below)), axis=-1)


@dataclass(frozen=True, eq=False)
class Bets:
    """The bets against the law of b people: what was foretold of each amplitude, and what became of the stakes."""

    foretold: tuple[FloatArray, ...] = ()  # probabilities of less than its lower end, and than its upper one, (b, 2)

    def after(self, below: FloatArray) -> Bets:
        """After one more amplitude of each person, of which this was foretold."""
        return Bets((*self.foretold, below))

    @cached_property
    def log_won(self) -> FloatArray:
        """Log of what each stake has become after each amplitude, (n, b, k)."""
        below = np.array(self.foretold)
        half = np.maximum(0.5 * (below[..., 1] - below[..., 0]), 0.5 * NARROWEST)
        middle = np.minimum(np.maximum(0.5 * (below[..., 0] + below[..., 1]), half), 1.0 - half)
        low, high = _laws(np.stack((middle - half, middle + half)))
        paid = (high - low) / (2.0 * half[..., np.newaxis])  # (n, b, 4)
        kept = 1.0 + STAKED[:, np.newaxis] * (paid[..., np.newaxis, :] - 1.0)
        won: FloatArray = np.log(np.maximum(kept, NARROWEST)).reshape(*below.shape[:2], -1).cumsum(0)
        return won

    @cached_property
    def most(self) -> FloatArray:
        """Log of the largest mean of them so far, (b,)."""
        most: FloatArray = (log_sum(self.log_won) - math.log(self.log_won.shape[-1])).max(0, initial=0.0)
        return most

    def worth(self, person: int) -> float:
        """What a bet of 1 against one person's law has been worth at most."""
        return math.exp(min(self.most[person], LARGEST)) if self.foretold else 1.0


def against_level(history: History, row: int) -> float | None:
    """The Bayes factor of pulses given alone first that are of a higher level than the session, over the same level.

    A tap makes no amplitude smaller. So at the pairs' intensity the smallest amplitudes of the session are those of TMS
    alone, or what a sweep has without a response, and those of pulses given alone have to be alike (decision 53).

    Args:
        history: the trials.
        row: whose, of those that learn from pulses given alone.

    Returns:
        None where too few were given at about the pairs' intensity, or the session is too short.
    """
    columns = history.columns[row].astype(float)
    given, shift_pct_rmt = columns[:, COUNTS] < 1.0, columns[:, SHIFT]
    middle = columns[:, 2:4].mean(1)
    sizes = np.where(np.isfinite(middle), middle, np.where(np.isfinite(columns[:, 2]), *columns[:, 2:4].T))
    before, since = sizes[given & (np.abs(shift_pct_rmt) <= NEAR_PCT_RMT)], sizes[~given & (shift_pct_rmt == 0.0)]
    if len(before) < LEAST_GIVEN or len(since) < LEAST_SINCE:
        return None
    smallest = (before, OF_GIVEN), (since, OF_SESSION)
    parts = [np.sort(each)[: math.ceil(share * len(each))] for each, share in smallest]
    squares = sum(float(((part - part.mean()) ** 2).sum()) for part in parts)
    variance = max(LEAST_SD**2, squares / (len(parts[0]) + len(parts[1]) - 2))
    same = SAME_SD**2 + variance * sum(1.0 / len(part) for part in parts)
    other, larger = same + OTHER_SD**2, max(0.0, float(parts[0].mean() - parts[1].mean()))
    return 2.0 * math.sqrt(same / other) * math.exp(min(LARGEST, 0.5 * larger**2 * (1.0 / same - 1.0 / other)))
