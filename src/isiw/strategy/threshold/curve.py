"""Pulses over the recruitment curve: the intensities and numbers that an operator names, and no others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, Count, Natural, numbers
from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.strategy.threshold.bayes import BayesThreshold
from isiw.strategy.threshold.estimate import IntensityRange, ThresholdEstimate
from isiw.strategy.threshold.pulses import Pulse

_OF_THE_ORDER: Final = 45
"""Its randomness is no other one of the same seed."""


@dataclass(frozen=True)
class NamedPulses(Checked):
    """Pulses of TMS alone over the recruitment curve, in no order.

    Args:
        at_pct_mso: the intensities [% MSO].
        each: how many pulses at each of them.

    Raises:
        InvalidValueError: no intensity, or one that is named twice.
    """

    at_pct_mso: Annotated[tuple[float, ...], partial(numbers, above=0)] = ()
    each: Count = 5

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.at_pct_mso or len(set(self.at_pct_mso)) < len(self.at_pct_mso):
            raise InvalidValueError(
                "pulses over the curve need the intensities at which they may be given, each once",
                got=self.at_pct_mso,
                remedy="Name them: --at 45 --at 55 (at_pct_mso in Python).",
            )

    @property
    def budget(self) -> int:
        """Number of pulses; see `ThresholdMethod`."""
        return self.each * len(self.at_pct_mso)


@dataclass(frozen=True)
class CurvePulses(NamedPulses):
    """Asks for the intensities that were named, each so often, in an order that the seed draws.

    A pulse that was lost is asked for again; there is no pulse beyond those named.

    Args:
        at_pct_mso: as of `NamedPulses`.
        each: as of `NamedPulses`.
        seed: of the order.
    """

    seed: Natural = 0

    def require_within(self, space: IntensityRange) -> None:
        """Raise if an intensity is beyond the range, or off its grid."""
        for intensity in self.at_pct_mso:
            space.require(intensity)

    def left(self, pulses: Sequence[Pulse]) -> list[float]:
        """The intensities that are still to be given [% MSO], in order."""
        order = np.random.default_rng([self.seed, _OF_THE_ORDER]).permutation(np.repeat(self.at_pct_mso, self.each))
        given, left = Counter(pulse.intensity_pct_mso for pulse in pulses), []
        for intensity in order.tolist():
            if given[intensity]:
                given[intensity] -= 1
            else:
                left.append(intensity)
        return left

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:  # noqa: ARG002 - they were named within it
        """The next of those named; see `ThresholdMethod`.

        Raises:
            LimitExceededError: all of them were given.
        """
        left = self.left(pulses)
        if not left:
            raise LimitExceededError("all pulses that were named have been given", got=f"{len(pulses)} pulses")
        return left[0]

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        """The threshold by these pulses, as `BayesThreshold` has it."""
        return BayesThreshold().estimate(pulses, space)

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:  # noqa: ARG002 - likewise
        """Stop when all were given."""
        left = len(self.left(pulses))
        if left:
            return StopKind.BUDGET.go_on(f"{left} of {self.budget} pulses over the curve are left.")
        return StopKind.BUDGET.stop(f"All {self.budget} pulses over the curve were given.")
