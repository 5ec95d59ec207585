"""Excitability that paired pulses change: what is measured changes who is measured [Kim2020, 4.5, 5.4.1].

The text saw its profiles change with every pair that was delivered within the window, and gives no size. Here a
person's gain moves towards a limit with the dose: every pair counts by its facilitation, TMS alone and pairs outside
the window by nothing. Within a session nothing of it is lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from isiw.checks import check_numbers


@dataclass(frozen=True)
class Plasticity:
    """How a person's gain depends on the pairs that they have had.

    Args:
        limit: change of the log gain after very many pairs, natural log; above 0 the MEPs grow, below 0 they shrink.
        pairs: after so many pairs at the best ISI, 63 % of the change has come.

    Raises:
        InvalidValueError: a limit that is not finite, or pairs that are not positive.
    """

    limit: float
    pairs: float = 100.0

    def __post_init__(self) -> None:
        check_numbers(self, "limit")
        check_numbers(self, "pairs", above=0)

    def log_gain(self, dose: float) -> float:
        """What is added to the log gain.

        Args:
            dose: the facilitation, in 0–1, of all pairs so far, summed.
        """
        return -self.limit * math.expm1(-dose / self.pairs)
