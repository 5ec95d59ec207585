"""Threshold hunting by maximum likelihood: each pulse is given at the best estimate so far [Awiszus2003]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np

from isiw.checks import check_numbers, check_wholes
from isiw.lazy import scipy
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.pulses import IntensityRange, Pulse, ThresholdEstimate
from isiw.types import FloatArray

_DROP: Final = 0.5 * NormalDist().inv_cdf(0.95) ** 2  # of the log-likelihood at the ends of a 90 % interval


@dataclass(frozen=True)
class MaximumLikelihood:
    """Uses only whether there was a response, whose probability is a cumulative normal of the intensity.

    When it asks it takes a response at the highest intensity and none at the lowest for granted, so that there is a
    maximum from the first pulse on; when it estimates it does not.

    Args:
        relative_spread: SD of the cumulative normal, as a share of the threshold.
        pulses: stop after so many; usual are 12 to 20.

    Raises:
        InvalidValueError: a spread that is not positive, or no pulse.
    """

    relative_spread: float = 0.07
    pulses: int = 17

    def __post_init__(self) -> None:
        check_numbers(self, "relative_spread", above=0, most=1)
        check_wholes(self, "pulses", least=1)

    @property
    def budget(self) -> int:
        """How many pulses; see `HasPulseBudget`."""
        return self.pulses

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:
        """The most likely threshold, on the grid."""
        granted = [Pulse(space.low_pct_mso, response=False), Pulse(space.high_pct_mso, response=True)]
        return space.snap(_best(*self._log_likelihood([*granted, *pulses])))

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        """The most likely threshold, and what the likelihood ratio does not exclude."""
        thresholds, log_likelihood = self._log_likelihood(pulses)
        likely = thresholds[log_likelihood >= log_likelihood.max() - _DROP]
        best = _best(thresholds, log_likelihood)
        return ThresholdEstimate(best, float(likely[0]), float(likely[-1])).within(space)

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        """Stop after a fixed number of pulses."""
        del space
        reason = f"{len(pulses)} of {self.pulses} pulses are given."
        return StopDecision(len(pulses) >= self.pulses, reason, StopKind.BUDGET)

    def _log_likelihood(self, pulses: Sequence[Pulse]) -> tuple[FloatArray, FloatArray]:
        """Thresholds [% MSO], also some beyond any stimulator, and the logarithm of their likelihoods."""
        thresholds = np.arange(10.0, 130.05, 0.1)
        intensity = np.array([pulse.intensity_pct_mso for pulse in pulses])[:, None]
        side = np.where([pulse.responded for pulse in pulses], 1.0, -1.0)[:, None]
        z = (intensity - thresholds) / (self.relative_spread * thresholds)
        return thresholds, np.asarray(scipy.special.log_ndtr(side * z).sum(axis=0))


def _best(thresholds: FloatArray, log_likelihood: FloatArray) -> float:
    """The maximum; where it is flat, its middle."""
    best = thresholds[log_likelihood >= log_likelihood.max() - 1e-9]
    return float(best.mean())
