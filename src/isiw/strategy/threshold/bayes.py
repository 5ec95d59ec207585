"""The threshold as a posterior on a grid: amplitudes tell how far an intensity is from it, not only on which side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np

from isiw.checks import check_numbers, check_wholes
from isiw.lazy import scipy
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.pulses import IntensityRange, Pulse, ThresholdEstimate
from isiw.strategy.threshold.recruitment import DISTANCES_PCT, RecruitmentBelief, log_likelihood
from isiw.types import FloatArray

THRESHOLDS_PCT_MSO: Final = np.arange(10.0, 130.5, 0.5)
"""Thresholds that are believed possible; those above 100 are beyond any stimulator."""


@dataclass(frozen=True)
class BayesThreshold:
    """Asks at the posterior's median, and stops when its SD is small [Qi2011], with amplitudes where there are any.

    Args:
        prior_mean_pct_mso: of the threshold, before the first pulse [% MSO].
        prior_sd_pct_mso: its SD [% MSO].
        stop_sd_pct_mso: stop when the posterior's SD is at most this [% MSO].
        max_pulses: stop after so many pulses in any case.
        curves: which recruitment curves are believed in.

    Raises:
        InvalidValueError: a mean outside the thresholds that are possible, an SD that is not positive, or no pulse.
    """

    prior_mean_pct_mso: float = 55.0
    prior_sd_pct_mso: float = 18.0
    stop_sd_pct_mso: float = 2.0
    max_pulses: int = 40
    curves: RecruitmentBelief = field(default_factory=RecruitmentBelief)

    def __post_init__(self) -> None:
        check_numbers(self, "prior_mean_pct_mso", least=10, most=130)
        check_numbers(self, "prior_sd_pct_mso", "stop_sd_pct_mso", above=0)
        check_wholes(self, "max_pulses", least=1)

    @property
    def budget(self) -> int:
        """How many pulses at most; see `HasPulseBudget`."""
        return self.max_pulses

    def posterior(self, pulses: Sequence[Pulse]) -> FloatArray:
        """Probability of each of `THRESHOLDS_PCT_MSO`.

        Args:
            pulses: what was told so far.
        """
        told = sum((_told(self.curves, pulse) for pulse in pulses), start=np.zeros((1, 1)))
        prior = scipy.stats.norm.logpdf(THRESHOLDS_PCT_MSO, self.prior_mean_pct_mso, self.prior_sd_pct_mso)
        log = prior + scipy.special.logsumexp(told, axis=1)
        return np.asarray(np.exp(log - scipy.special.logsumexp(log)))

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:
        """The intensity that is nearest to the posterior's median."""
        return space.snap(_quantile(self.posterior(pulses), 0.5))

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        """The posterior's median, and its central 90 %."""
        posterior = self.posterior(pulses)
        low, median, high = (_quantile(posterior, level) for level in (0.05, 0.5, 0.95))
        return ThresholdEstimate(median, low, high, _sd(posterior)).within(space)

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        """Stop at a small SD, or when the whole interval is beyond the range."""
        posterior = self.posterior(pulses)
        sides = {space.beyond(_quantile(posterior, level)) for level in (0.05, 0.95)}
        if len(sides) == 1 and (side := sides.pop()):
            return StopKind.THRESHOLD.stop(f"The whole 90 % interval of the threshold is {side}.")
        sd = _sd(posterior)
        if sd <= self.stop_sd_pct_mso:
            return StopKind.THRESHOLD.stop(f"The threshold is known to ± {sd:.1f} % MSO (SD).")
        if len(pulses) >= self.max_pulses:
            return StopKind.BUDGET.stop(f"The budget of {self.max_pulses} pulses is used up.")
        known = f"The threshold is known to ± {sd:.1f} % MSO (SD)"
        return StopKind.THRESHOLD.go_on(f"{known}; {self.stop_sd_pct_mso:g} is wanted.")


@lru_cache(maxsize=256)
def _told(curves: RecruitmentBelief, pulse: Pulse) -> FloatArray:
    """Log-likelihood of a pulse by threshold and recruitment curve."""
    at_distance = log_likelihood(curves, pulse.mep_mv, responded=pulse.responded)
    distances = np.clip(100 * (pulse.intensity_pct_mso / THRESHOLDS_PCT_MSO - 1), DISTANCES_PCT[0], DISTANCES_PCT[-1])
    below = np.minimum((distances - DISTANCES_PCT[0]).astype(int), len(DISTANCES_PCT) - 2)
    share = (distances - DISTANCES_PCT[below])[:, None]  # the distances are whole percents apart
    return np.asarray((1 - share) * at_distance[below] + share * at_distance[below + 1])


def _quantile(posterior: FloatArray, level: float) -> float:
    return float(np.interp(level, np.cumsum(posterior) - 0.5 * posterior, THRESHOLDS_PCT_MSO))


def _sd(posterior: FloatArray) -> float:
    mean = posterior @ THRESHOLDS_PCT_MSO
    return float(np.sqrt(posterior @ (THRESHOLDS_PCT_MSO - mean) ** 2))
