"""The hot spot: where the threshold is lowest; the effect of a pulse falls off from there as a Gaussian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from isiw.checks import Amplitude, Checked, Count, Number, Positive
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.bayes import DISTANCES_PCT, RecruitmentBelief, log_likelihood
from isiw.strategy.threshold.pulses import IntensityRange, Pulse, ThresholdEstimate
from isiw.trials import RESPONSE_MV
from isiw.types import FloatArray

INTENSITIES_PCT: Final = (95.0, 105.0, 115.0, 125.0, 135.0, 150.0)
"""What the intensity may be at the hot spot [% of the threshold there], which nobody knows yet."""

SPREADS_MM: Final = (18.0, 24.0, 30.0, 37.0)
"""SDs of the fall-off that are possible [mm]."""

_USEFUL_PCT: Final = (-25.0, 30.0)  # beyond these distances from the threshold an MEP says little


@dataclass(frozen=True)
class CoilPulse(Checked):
    """One pulse by the coil's place from the middle of the searched area [mm], and its MEP's amplitude [mV]."""

    x_mm: Number
    y_mm: Number
    mep_mv: Amplitude


class HotSpotEstimate(NamedTuple):
    """The estimated place of the hot spot, and the root mean square of the distance from there, if known [mm]."""

    x_mm: float
    y_mm: float
    sd_mm: float | None


def _require_a_response(pulses: Sequence[CoilPulse]) -> None:
    if not any(pulse.mep_mv > RESPONSE_MV for pulse in pulses):
        raise InvalidValueError(
            "no pulse evoked an MEP, so the hot spot is unknown",
            got=len(pulses),
            expected=f"at least one MEP above {1000 * RESPONSE_MV:g} µV",
            remedy="Search with a higher intensity, or in another area.",
        )


@dataclass(frozen=True)
class WalkedHotSpot(Checked):
    """The classical way: `repeats` pulses at every place of a grid; the largest mean MEP is the hot spot."""

    half_width_mm: Positive = 25.0
    step_mm: Positive = 10.0
    repeats: Count = 3

    @property
    def pulses(self) -> int:
        """Number of pulses that it takes."""
        return self.repeats * len(_places(self.half_width_mm, self.step_mm))

    def ask(self, pulses: Sequence[CoilPulse]) -> tuple[float, float]:
        """The next place of the coil [mm]."""
        places = _places(self.half_width_mm, self.step_mm)
        x_mm, y_mm = places[len(pulses) // self.repeats % len(places)].tolist()
        return x_mm, y_mm

    def estimate(self, pulses: Sequence[CoilPulse]) -> HotSpotEstimate:
        """The place with the largest mean MEP."""
        _require_a_response(pulses)
        by_place: dict[tuple[float, float], list[float]] = {}
        for pulse in pulses:
            by_place.setdefault((pulse.x_mm, pulse.y_mm), []).append(pulse.mep_mv)
        return HotSpotEstimate(*max(by_place, key=lambda place: float(np.mean(by_place[place]))), None)


@dataclass(frozen=True)
class BayesHotSpot(Checked):
    """A posterior of places, spreads, intensities and recruitment curves; it asks where the effect is least known."""

    half_width_mm: Positive = 25.0
    step_mm: Positive = 5.0
    curves: RecruitmentBelief = field(default_factory=RecruitmentBelief)

    def posterior(self, pulses: Sequence[CoilPulse]) -> FloatArray:
        """Probabilities by place, and by what else is unknown: spread and intensity, shape (t, c)."""
        log = sum((_told(self, pulse) for pulse in pulses), start=np.zeros((1, 1, 1)))
        shape = (len(_places(self.half_width_mm, self.step_mm)), len(SPREADS_MM) * len(INTENSITIES_PCT))
        return np.asarray(scipy.special.softmax(np.broadcast_to(log, (*shape, log.shape[-1]))).sum(axis=-1))

    def ask(self, pulses: Sequence[CoilPulse]) -> tuple[float, float]:
        """The next place of the coil [mm]."""
        places, posterior = _places(self.half_width_mm, self.step_mm), self.posterior(pulses)
        acting = np.clip(_distances(self, places), *_USEFUL_PCT)
        mean = np.einsum("tc,ptc->p", posterior, acting)
        variance = np.einsum("tc,ptc->p", posterior, acting**2) - mean**2
        x_mm, y_mm = places[int(np.argmax(variance))].tolist()
        return x_mm, y_mm

    def estimate(self, pulses: Sequence[CoilPulse]) -> HotSpotEstimate:
        """The posterior's mean, and how far from it the hot spot may be."""
        _require_a_response(pulses)
        places, belief = _places(self.half_width_mm, self.step_mm), self.posterior(pulses).sum(axis=1)
        mean = belief @ places
        sd_mm = float(np.sqrt(belief @ ((places - mean) ** 2).sum(axis=1)))
        return HotSpotEstimate(float(mean[0]), float(mean[1]), sd_mm)


@dataclass(frozen=True)
class HotSpotSearch(Checked):
    """Seeks the hot spot at the highest intensity of the range: the coil goes where its effect is least known."""

    half_width_mm: Positive = 25.0
    stop_sd_mm: Positive = 4.0
    max_pulses: Count = 30

    def ask(self, _: Sequence[Pulse], space: IntensityRange) -> float:
        """The highest intensity."""
        return space.high_pct_mso

    def place_mm(self, pulses: Sequence[Pulse]) -> tuple[float, float]:
        """The next place of the coil; see `PlacesCoil`."""
        return BayesHotSpot(self.half_width_mm).ask(_by_place(pulses))

    def estimate(self, pulses: Sequence[Pulse], _: IntensityRange) -> ThresholdEstimate:
        """The hot spot, once a pulse evoked an MEP."""
        if not any(pulse.responded for pulse in pulses):
            return ThresholdEstimate(None, reason="No pulse evoked an MEP yet, so the hot spot is not known either.")
        x_mm, y_mm, sd_mm = BayesHotSpot(self.half_width_mm).estimate(_by_place(pulses))
        return ThresholdEstimate(None, hot_spot_mm=(x_mm, y_mm), hot_spot_sd_mm=sd_mm)

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


def _by_place(pulses: Sequence[Pulse]) -> list[CoilPulse]:
    return [CoilPulse(*each.place_mm, each.mep_mv) for each in pulses if each.place_mm and each.mep_mv is not None]


def _places(half_width_mm: float, step_mm: float) -> FloatArray:
    """All places of a square, row by row [mm], shape (p, 2)."""
    steps = int(half_width_mm / step_mm + 1e-9)
    axis = step_mm * np.arange(-steps, steps + 1)
    return np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)


def _distances(settings: BayesHotSpot, coil: FloatArray) -> FloatArray:
    """Distances from the threshold [% of it] by the coil's place, the hot spot's, and what else is unknown."""
    spots = _places(settings.half_width_mm, settings.step_mm)
    squared = ((coil[:, None] - spots) ** 2).sum(axis=-1)
    acting = np.exp(-0.5 * squared[..., None] / np.square(SPREADS_MM))
    return np.asarray(acting[..., None] * np.array(INTENSITIES_PCT) - 100).reshape(*squared.shape, -1)


@lru_cache(maxsize=64)  # a megabyte each
def _told(settings: BayesHotSpot, pulse: CoilPulse) -> FloatArray:
    """Log-likelihood of a pulse by the hot spot's place, what else is unknown, and recruitment curve."""
    table = log_likelihood(settings.curves, pulse.mep_mv, responded=pulse.mep_mv > RESPONSE_MV)
    distances = _distances(settings, np.array([[pulse.x_mm, pulse.y_mm]]))[0]
    rows = np.clip(np.rint(distances - DISTANCES_PCT[0]).astype(int), 0, len(DISTANCES_PCT) - 1)
    return np.asarray(table[rows])
