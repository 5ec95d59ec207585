"""The threshold as a posterior on a grid: amplitudes tell how far an intensity is from it, not only on which side."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from statistics import NormalDist
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, Count, Positive, number, whole
from isiw.lazy import scipy
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.pulses import IntensityRange, Pulse, ThresholdEstimate
from isiw.strategy.threshold.recruitment import DISTANCES_PCT, RecruitmentBelief, log_likelihood
from isiw.types import FloatArray

_DROP: Final = 0.5 * NormalDist().inv_cdf(0.95) ** 2  # of the log-likelihood at the ends of a 90 % interval


@dataclass(frozen=True)
class MaximumLikelihood(Checked):
    """Uses only whether there was a response, whose probability is a cumulative normal of the intensity.

    When it asks it takes a response at the highest intensity and none at the lowest for granted, so that there is a
    maximum from the first pulse on; when it estimates it does not.

    Args:
        relative_spread: SD of the cumulative normal, as a share of the threshold.
        pulses: stop after so many; usual are 12 to 20.
    """

    relative_spread: Annotated[float, partial(number, above=0, most=1)] = 0.07
    pulses: Count = 17

    @property
    def budget(self) -> int:
        """Number of pulses; see `HasPulseBudget`."""
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


@dataclass(frozen=True)
class FiveOfTen(Checked):
    """Goes in large steps until one intensity suffices and the next lower one does not, then down in single steps.

    At each intensity it goes on until the verdict is certain: with five responses, or six pulses without one. Once no
    pulse is needed any more, it asks for the threshold again.

    Args:
        start_pct_mso: the first intensity [% MSO].
        large_step_pct_mso: the large step [% MSO]; the small one is that of the range, which it is never below.
        of: pulses at each intensity.
        enough: responses that suffice.

    Raises:
        InvalidValueError: steps that are not positive, or more responses than pulses.
    """

    start_pct_mso: Annotated[float, partial(number, above=0, most=100)] = 40.0
    large_step_pct_mso: Positive = 5.0
    of: Count = 10
    enough: Count = 5

    def __post_init__(self) -> None:
        super().__post_init__()
        whole("FiveOfTen.enough", self.enough, most=self.of)

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:
        """The intensity whose verdict is still open."""
        return self._course(pulses, space)[0]

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        """The lowest intensity that suffices, once the next lower one does not; there is no interval."""
        asked, decision = self._course(pulses, space)
        if not decision.stop or self._verdicts(pulses).get(asked) is not True or asked == space.low_pct_mso:
            return ThresholdEstimate(None, reason=decision.reason)
        return ThresholdEstimate(asked)

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        """Stop when the threshold is found, or the range has no more intensities."""
        return self._course(pulses, space)[1]

    def _verdicts(self, pulses: Sequence[Pulse]) -> dict[float, bool]:
        """True if an intensity suffices, for those whose verdict is certain."""
        told = Counter((pulse.intensity_pct_mso, pulse.responded) for pulse in pulses)
        suffices = {at: True for (at, responded), n in told.items() if responded and n >= self.enough}
        return suffices | {at: False for (at, yes), n in told.items() if not yes and n > self.of - self.enough}

    def _course(self, pulses: Sequence[Pulse], space: IntensityRange) -> tuple[float, StopDecision]:
        """What is asked next, and whether that is needed."""
        verdicts = self._verdicts(pulses)
        enough = min((at for at, suffices in verdicts.items() if suffices), default=None)
        short = max((at for at in verdicts if not verdicts[at] and (enough is None or at < enough)), default=None)
        if enough is None:
            return self._upwards(short, space)
        if enough == space.low_pct_mso:
            return enough, _over(
                f"{enough:g} % MSO is high enough (at least {self.enough} of {self.of} pulses evoke an MEP), "
                "and it is the lowest intensity of the range: begin a new search lower."
            )
        if short is None:
            return space.snap(enough - max(self.large_step_pct_mso, space.step_pct_mso)), _on(
                f"{enough:g} % MSO is high enough."
            )
        if enough - short > 1.5 * space.step_pct_mso:
            return space.snap(enough - space.step_pct_mso), _on(
                f"The threshold is between {short:g} and {enough:g} % MSO."
            )
        return enough, _over(f"{enough:g} % MSO is high enough, and {short:g} % MSO is not.")

    def _upwards(self, short: float | None, space: IntensityRange) -> tuple[float, StopDecision]:
        if short is None:
            return space.snap(self.start_pct_mso), _on("No intensity tested so far is high enough.")
        if short == space.high_pct_mso:
            return short, _over(f"{short:g} % MSO, the highest intensity of the range, is not high enough.")
        return space.snap(short + max(self.large_step_pct_mso, space.step_pct_mso)), _on(
            f"{short:g} % MSO is not high enough."
        )


def _over(reason: str) -> StopDecision:
    return StopKind.THRESHOLD.stop(reason)


def _on(reason: str) -> StopDecision:
    return StopKind.THRESHOLD.go_on(reason)


THRESHOLDS_PCT_MSO: Final = np.arange(10.0, 130.5, 0.5)
"""Possible thresholds; those above 100 are beyond any stimulator."""


@dataclass(frozen=True)
class BayesThreshold(Checked):
    """Asks at the posterior's median, and stops when its SD is small [Qi2011], with amplitudes where there are any.

    Args:
        prior_mean_pct_mso: of the threshold, before the first pulse [% MSO].
        prior_sd_pct_mso: its SD [% MSO].
        stop_sd_pct_mso: stop when the posterior's SD is at most this [% MSO].
        max_pulses: stop after so many pulses in any case.
        curves: the possible recruitment curves.
    """

    prior_mean_pct_mso: Annotated[float, partial(number, least=10, most=130)] = 55.0
    prior_sd_pct_mso: Positive = 18.0
    stop_sd_pct_mso: Positive = 2.0
    max_pulses: Count = 40
    curves: RecruitmentBelief = field(default_factory=RecruitmentBelief)

    @property
    def budget(self) -> int:
        """Largest number of pulses; see `HasPulseBudget`."""
        return self.max_pulses

    def posterior(self, pulses: Sequence[Pulse]) -> FloatArray:
        """Probability of each of `THRESHOLDS_PCT_MSO`.

        Args:
            pulses: the pulses so far.
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
