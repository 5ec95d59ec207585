"""Pairs of several intensities in one session: which of the named ones the next pair has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from isiw.checks import Checked, Flag, can
from isiw.models.protocol import ForeseesIntensities, Posterior
from isiw.strategy.choice import Choice


@dataclass(frozen=True)
class Intensities(Checked):
    """The intensities of the pairs, which an operator has named.

    Args:
        named_pct_rmt: the intensities that pairs may have [% RMT]; none for the usual one alone.
        chosen: whether the acquisition function chooses among them; else pairs have them in turn.
        usual_pct_rmt: the usual one, at which the window is [% RMT].
    """

    named_pct_rmt: tuple[float, ...] = ()
    chosen: Flag = False
    usual_pct_rmt: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.named_pct_rmt)

    def of(self, choice: Choice | None) -> float | None:
        """The intensity of a pair that was chosen [% RMT]; None where all pairs have the usual one."""
        if not self:
            return None
        own = None if choice is None else choice.intensity_pct_rmt
        return self.usual_pct_rmt if own is None else own

    def of_turn(self, pairs: int) -> tuple[float, ...]:
        """Those among which the next pair's is chosen, after so many pairs [% RMT]."""
        if self.chosen:
            return self.named_pct_rmt
        return (self.named_pct_rmt[pairs % len(self.named_pct_rmt)],)

    def in_turn(self, choice: Choice, pairs: int) -> Choice:
        """An ISI that stands already, with the intensity whose turn it is."""
        if not self:
            return choice
        return self._with(choice, self.named_pct_rmt[pairs % len(self.named_pct_rmt)])

    def best(self, posterior: Posterior, pairs: int, choose: Callable[[Posterior], Choice]) -> Choice:
        """The ISI and the intensity of one person's next pair that score best together.

        Args:
            posterior: what ISIs are chosen by.
            pairs: how many pairs came before.
            choose: the best ISI at one intensity, with its scores.
        """
        found: list[tuple[float, Choice]] = []
        for pct_rmt in self.of_turn(pairs):
            there, share = posterior, 1.0
            if pct_rmt != self.usual_pct_rmt and can(posterior, ForeseesIntensities):
                there, share = posterior.at_intensity(pct_rmt - self.usual_pct_rmt)
            choice = choose(there)
            score = -np.inf if choice.scores is None or choice.fallback else share * float(np.nanmax(choice.scores))
            found.append((score, self._with(choice, pct_rmt)))
        return max(found, key=lambda scored: scored[0])[1]

    def _with(self, choice: Choice, pct_rmt: float) -> Choice:
        return replace(choice, intensity_pct_rmt=None if pct_rmt == self.usual_pct_rmt else pct_rmt)


NONE: Final = Intensities()
"""Of pairs that all have the usual intensity."""
