"""The hot spot: where the threshold is lowest; the effect of a pulse falls off from there as a Gaussian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np

from isiw.checks import Checked, Count, Positive
from isiw.decision import StopDecision, StopKind
from isiw.lazy import scipy
from isiw.strategy.threshold.bayes import DISTANCES_PCT, RecruitmentPrior, log_likelihood
from isiw.strategy.threshold.estimate import IntensityRange, ThresholdEstimate
from isiw.strategy.threshold.pulses import Pulse
from isiw.types import FloatArray

INTENSITIES_PCT: Final = (95.0, 105.0, 115.0, 125.0, 135.0, 150.0)
"""What the intensity may be at the hot spot [% of the threshold there], which nobody knows yet."""

SPREADS_MM: Final = (18.0, 24.0, 30.0, 37.0)
"""SDs of the fall-off that are possible [mm]."""

_USEFUL_PCT: Final = (-25.0, 30.0)  # beyond these distances from the threshold an MEP says little


@dataclass(frozen=True)
class BayesHotSpot(Checked):
    """A posterior of places, spreads, intensities and recruitment curves; it asks where the effect is least known.

    Args:
        half_width_mm: half of the searched square's side [mm].
        step_mm: from one possible place to the next [mm].
        curves: the possible recruitment curves.
        stop_sd_mm: stop when the hot spot is known to this [mm].
        max_pulses: stop after so many pulses in any case.
    """

    half_width_mm: Positive = 25.0
    step_mm: Positive = 5.0
    curves: RecruitmentPrior = field(default_factory=RecruitmentPrior)
    stop_sd_mm: Positive = 4.0
    max_pulses: Count = 30

    @property
    def places_mm(self) -> FloatArray:
        """All places of the square, row by row [mm], shape (p, 2)."""
        steps = int(self.half_width_mm / self.step_mm + 1e-9)
        axis = self.step_mm * np.arange(-steps, steps + 1)
        return np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)

    def posterior(self, pulses: Sequence[Pulse]) -> FloatArray:
        """Probabilities by place, and by what else is unknown: spread and intensity, shape (t, c)."""
        log = sum((_log_likelihood(self, pulse) for pulse in pulses), start=np.zeros((1, 1, 1)))
        shape = (len(self.places_mm), len(SPREADS_MM) * len(INTENSITIES_PCT))
        return np.asarray(scipy.special.softmax(np.broadcast_to(log, (*shape, log.shape[-1]))).sum(axis=-1))

    def ask(self, _: Sequence[Pulse], space: IntensityRange) -> float:
        """The highest intensity of the range."""
        return space.high_pct_mso

    def place_mm(self, pulses: Sequence[Pulse]) -> tuple[float, float]:
        """The next place of the coil [mm]."""
        posterior = self.posterior(pulses)
        acting = np.clip(_distances(self, self.places_mm), *_USEFUL_PCT)
        mean = np.einsum("tc,ptc->p", posterior, acting)
        variance = np.einsum("tc,ptc->p", posterior, acting**2) - mean**2
        x_mm, y_mm = self.places_mm[int(np.argmax(variance))].tolist()
        return x_mm, y_mm

    def estimate(self, pulses: Sequence[Pulse], _: IntensityRange) -> ThresholdEstimate:
        """The posterior's mean, and how far from it the hot spot may be, once a pulse evoked an MEP."""
        if not any(pulse.responded for pulse in pulses):
            return ThresholdEstimate(None, reason="No pulse evoked an MEP yet, so the hot spot is not known either.")
        weights = self.posterior(pulses).sum(axis=1)
        mean = weights @ self.places_mm
        sd_mm = float(np.sqrt(weights @ ((self.places_mm - mean) ** 2).sum(axis=1)))
        return ThresholdEstimate(None, hot_spot_mm=(float(mean[0]), float(mean[1])), hot_spot_sd_mm=sd_mm)

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        """Stop when the place is known well, or the budget is used up."""
        sd_mm = self.estimate(pulses, space).hot_spot_sd_mm
        if sd_mm is not None and sd_mm <= self.stop_sd_mm:
            return StopKind.THRESHOLD.stop(f"The hot spot is known to {sd_mm:.1f} mm.")
        if len(pulses) >= self.max_pulses:
            higher = "" if sd_mm is not None else " Search with a higher intensity, or in another area."
            return StopKind.BUDGET.stop(f"The budget of {self.max_pulses} pulses is used up.{higher}")
        known = "No pulse evoked an MEP yet" if sd_mm is None else f"The hot spot is known to {sd_mm:.1f} mm"
        return StopKind.THRESHOLD.go_on(f"{known}; {self.stop_sd_mm:g} mm are wanted.")


def _distances(settings: BayesHotSpot, coil: FloatArray) -> FloatArray:
    """Distances from the threshold [% of it] by the coil's place, the hot spot's, and what else is unknown."""
    squared = ((coil[:, None] - settings.places_mm) ** 2).sum(axis=-1)
    acting = np.exp(-0.5 * squared[..., None] / np.square(SPREADS_MM))
    return np.asarray(acting[..., None] * np.array(INTENSITIES_PCT) - 100).reshape(*squared.shape, -1)


@lru_cache(maxsize=64)  # a megabyte each
def _log_likelihood(settings: BayesHotSpot, pulse: Pulse) -> FloatArray:
    """Log-likelihood of a pulse by the hot spot's place, what else is unknown, and recruitment curve."""
    table = log_likelihood(settings.curves, pulse.mep_mv, responded=pulse.responded)
    distances = _distances(settings, np.array([pulse.place_mm]))[0]
    rows = np.clip(np.rint(distances - DISTANCES_PCT[0]).astype(int), 0, len(DISTANCES_PCT) - 1)
    return np.asarray(table[rows])
