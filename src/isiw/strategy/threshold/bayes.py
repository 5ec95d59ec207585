"""Methods for the motor threshold: by likelihood, by counting, and as a posterior that uses amplitudes, too.

An amplitude says how far an intensity is from the threshold, not only on which side. The MEP is that of [Goetz2014]:
`A / (1 + exp(-k (x + sigma_x z1 - x50))) exp(sigma_y z2)` above an EMG floor, with x in % of the threshold. A, k and
sigma_x are not known; each is one of a few values, whose sources are in `docs/threshold.md`. x50 follows from them, as
half of the MEPs at the threshold exceed 50 µV.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from statistics import NormalDist
from typing import Annotated, Final, TypeAlias

import numpy as np

from isiw.checks import Checked, Count, Positive, ascending, number, whole
from isiw.decision import StopDecision, StopKind
from isiw.lazy import scipy
from isiw.strategy.threshold.estimate import IntensityRange, ThresholdEstimate
from isiw.strategy.threshold.pulses import Pulse
from isiw.trials import RESPONSE_MV
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
        """Number of pulses; see `ThresholdMethod`."""
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
    """The maximum; if it is flat, its middle."""
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
        """The next intensity, and whether another pulse is needed."""
        verdicts = self._verdicts(pulses)
        enough = min((at for at, suffices in verdicts.items() if suffices), default=None)
        short = max((at for at in verdicts if not verdicts[at] and (enough is None or at < enough)), default=None)
        if enough is None:
            return self._upwards(short, space)
        if enough == space.low_pct_mso:
            return enough, StopKind.THRESHOLD.stop(
                f"{enough:g} % MSO is high enough (at least {self.enough} of {self.of} pulses evoke an MEP), "
                "and it is the lowest intensity of the range: begin a new search lower."
            )
        if short is None:
            lower = space.snap(enough - max(self.large_step_pct_mso, space.step_pct_mso))
            return lower, StopKind.THRESHOLD.go_on(f"{enough:g} % MSO is high enough.")
        if enough - short > 1.5 * space.step_pct_mso:
            between = f"The threshold is between {short:g} and {enough:g} % MSO."
            return space.snap(enough - space.step_pct_mso), StopKind.THRESHOLD.go_on(between)
        return enough, StopKind.THRESHOLD.stop(f"{enough:g} % MSO is high enough, and {short:g} % MSO is not.")

    def _upwards(self, short: float | None, space: IntensityRange) -> tuple[float, StopDecision]:
        if short is None:
            none = "No intensity tested so far is high enough."
            return space.snap(self.start_pct_mso), StopKind.THRESHOLD.go_on(none)
        if short == space.high_pct_mso:
            highest = f"{short:g} % MSO, the highest intensity of the range, is not high enough."
            return short, StopKind.THRESHOLD.stop(highest)
        higher = space.snap(short + max(self.large_step_pct_mso, space.step_pct_mso))
        return higher, StopKind.THRESHOLD.go_on(f"{short:g} % MSO is not high enough.")


DISTANCES_PCT: Final = np.arange(-70.0, 91.0)
"""Of an intensity from the threshold [% of it]; beyond these ends nothing changes any more."""

ODD: Final = 0.02
"""Share of pulses whose MEP says nothing: a slip, a movement, an artefact."""

_ODD_DENSITY: Final = 0.2  # what says nothing lies anywhere within a factor of 150
_INPUTS_PCT: Final = np.arange(-120.0, 121.0)  # above x50
_FLOOR_Z, _FLOOR_WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
_FLOOR_WEIGHTS = _FLOOR_WEIGHTS / _FLOOR_WEIGHTS.sum()

_Possible: TypeAlias = Annotated[tuple[float, ...], partial(ascending, above=0)]


@dataclass(frozen=True)
class RecruitmentPrior(Checked):
    """The possible recruitment curves before the first pulse; all combinations are equally likely.

    Args:
        slopes_per_pct: k [1 / % of the threshold].
        sigmas_x_pct: SD of the input noise [% of the threshold].
        amplitudes_mv: A, the largest MEP [mV].
        sigma_y: SD of the output noise, natural log.
        floor_mv: median amplitude of a sweep without a response [mV].
        floor_log_sd: its SD over people and trials, natural log.
        visible_mv: a smaller amplitude may be the floor, and says no more than that [mV].

    Raises:
        InvalidValueError: values that are not positive, or do not ascend.
    """

    slopes_per_pct: _Possible = (0.20, 0.27, 0.36)
    sigmas_x_pct: _Possible = (5.0, 8.0, 12.0)
    amplitudes_mv: _Possible = (0.1, 0.18, 0.4, 1.0, 2.5)
    sigma_y: Positive = 0.4
    floor_mv: Positive = 0.010
    floor_log_sd: Positive = 0.3
    visible_mv: Annotated[float, partial(number, above=0, most=RESPONSE_MV)] = 0.030


@lru_cache(maxsize=256)
def log_likelihood(prior: RecruitmentPrior, mep_mv: float | None, *, responded: bool) -> FloatArray:
    """Logarithm of the probability of what came of a pulse, by `DISTANCES_PCT` and recruitment curve, shape (t, c)."""
    if mep_mv is not None and mep_mv >= prior.visible_mv:
        density = _with_input_noise(prior, _density(prior, mep_mv))
        return np.asarray(np.log((1 - ODD) * density + ODD * _ODD_DENSITY))
    larger = _with_input_noise(prior, _exceeding(prior, RESPONSE_MV if mep_mv is None else prior.visible_mv))
    return np.asarray(np.log((1 - ODD) * (larger if responded else 1 - larger) + 0.5 * ODD))


def _log_evoked(prior: RecruitmentPrior) -> FloatArray:
    """Logarithm of the MEP without noise, by input, slope and amplitude."""
    log_share = scipy.special.log_expit(np.array(prior.slopes_per_pct) * _INPUTS_PCT[:, None])
    return np.asarray(log_share[..., None] + np.log(prior.amplitudes_mv))


def _above_floor(prior: RecruitmentPrior, amplitude_mv: float) -> FloatArray:
    """Excess of an amplitude above the floor, by the floor's nodes [mV]."""
    return np.maximum(amplitude_mv - prior.floor_mv * np.exp(prior.floor_log_sd * _FLOOR_Z), 1e-3)


def _exceeding(prior: RecruitmentPrior, amplitude_mv: float) -> FloatArray:
    """Probability of a larger MEP without input noise, by input, slope and amplitude."""
    z = (_log_evoked(prior)[..., None] - np.log(_above_floor(prior, amplitude_mv))) / prior.sigma_y
    return np.asarray(scipy.special.ndtr(z) @ _FLOOR_WEIGHTS)


def _density(prior: RecruitmentPrior, amplitude_mv: float) -> FloatArray:
    """Density of an MEP by its logarithm without input noise, by input, slope and amplitude."""
    evoked_mv = _above_floor(prior, amplitude_mv)
    z = (_log_evoked(prior)[..., None] - np.log(evoked_mv)) / prior.sigma_y
    return np.asarray(scipy.stats.norm.pdf(z) / prior.sigma_y @ (_FLOOR_WEIGHTS * amplitude_mv / evoked_mv))


def _with_input_noise(prior: RecruitmentPrior, by_input: FloatArray) -> FloatArray:
    """The same by distance and recruitment curve, whose order is input noise, slope, amplitude."""
    inputs_last = np.moveaxis(by_input, 0, -1)[..., None]
    by_curve = (_input_noise(prior) @ inputs_last)[..., 0]
    return np.moveaxis(by_curve, -1, 0).reshape(len(DISTANCES_PCT), -1)


@lru_cache(maxsize=4)
def _input_noise(prior: RecruitmentPrior) -> FloatArray:
    """Weights of the inputs, by input noise, slope, amplitude and distance."""
    sigmas, centres = np.array(prior.sigmas_x_pct), _INPUTS_PCT[::4]
    larger = np.einsum("stx,xka->skat", _weights(centres, sigmas[:, None]), _exceeding(prior, RESPONSE_MV))
    thresholds = np.array([np.interp(0.5, curve, centres) for curve in larger.reshape(-1, len(centres))])
    return _weights(thresholds.reshape(larger.shape[:-1])[..., None] + DISTANCES_PCT, sigmas[:, None, None, None])


def _weights(centres: FloatArray, sigmas: FloatArray) -> FloatArray:
    """Normal weights of the inputs about some centres; the inputs are the last axis."""
    z = (_INPUTS_PCT - centres[..., None]) / sigmas[..., None]
    weights = np.exp(-0.5 * z * z)
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


THRESHOLDS_PCT_MSO: Final = np.arange(10.0, 130.5, 0.5)
"""Possible thresholds; those above 100 are beyond any stimulator."""


@dataclass(frozen=True)
class BayesThreshold(Checked):
    """Asks at the posterior's median, and stops when its SD is small [Qi2011], with amplitudes if there are any.

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
    curves: RecruitmentPrior = field(default_factory=RecruitmentPrior)

    @property
    def budget(self) -> int:
        """Largest number of pulses; see `ThresholdMethod`."""
        return self.max_pulses

    def posterior(self, pulses: Sequence[Pulse]) -> FloatArray:
        """Probability of each of `THRESHOLDS_PCT_MSO` after some pulses."""
        told = sum((_log_likelihood(self.curves, pulse) for pulse in pulses), start=np.zeros((1, 1)))
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
        if sd <= self.stop_sd_pct_mso and (side := space.beyond(_quantile(posterior, 0.5))):
            wider = "Begin a new search with a wider range, if that is safe for this person."
            return StopKind.THRESHOLD.stop(f"The threshold is probably {side}, to ± {sd:.1f} % MSO (SD). {wider}")
        if sd <= self.stop_sd_pct_mso:
            return StopKind.THRESHOLD.stop(f"The threshold is known to ± {sd:.1f} % MSO (SD).")
        if len(pulses) >= self.max_pulses:
            return StopKind.BUDGET.stop(f"The budget of {self.max_pulses} pulses is used up.")
        known = f"The threshold is known to ± {sd:.1f} % MSO (SD)"
        return StopKind.THRESHOLD.go_on(f"{known}; {self.stop_sd_pct_mso:g} is wanted.")


@lru_cache(maxsize=256)
def _log_likelihood(curves: RecruitmentPrior, pulse: Pulse) -> FloatArray:
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
