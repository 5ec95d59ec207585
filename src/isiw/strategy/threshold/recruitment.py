"""What one MEP says about how far an intensity is from the threshold, whatever the person's recruitment curve.

The MEP is that of [Goetz2014]: `A / (1 + exp(-k (x + sigma_x z1 - x50))) exp(sigma_y z2)` above an EMG floor, with x in
% of the threshold. A, k and sigma_x are not known; each is one of a few values, whose sources are in
`docs/threshold.md`. x50 follows from them, since half of the MEPs at the threshold exceed 50 µV.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, Positive, ascending, number
from isiw.lazy import scipy
from isiw.trials import RESPONSE_MV
from isiw.types import FloatArray

DISTANCES_PCT: Final = np.arange(-70.0, 91.0)
"""Of an intensity from the threshold [% of it]; beyond these ends nothing changes any more."""

ODD: Final = 0.02
"""Share of pulses whose MEP says nothing: a slip, a movement, an artefact."""

_ODD_DENSITY: Final = 0.2  # what says nothing lies anywhere within a factor of 150
_INPUTS_PCT: Final = np.arange(-120.0, 121.0)  # above x50
_FLOOR_Z, _FLOOR_WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
_FLOOR_WEIGHTS = _FLOOR_WEIGHTS / _FLOOR_WEIGHTS.sum()


@dataclass(frozen=True)
class RecruitmentBelief(Checked):
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

    slopes_per_pct: tuple[float, ...] = (0.20, 0.27, 0.36)
    sigmas_x_pct: tuple[float, ...] = (5.0, 8.0, 12.0)
    amplitudes_mv: tuple[float, ...] = (0.1, 0.18, 0.4, 1.0, 2.5)
    sigma_y: Positive = 0.4
    floor_mv: Positive = 0.010
    floor_log_sd: Positive = 0.3
    visible_mv: Annotated[float, partial(number, above=0, most=RESPONSE_MV)] = 0.030

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("slopes_per_pct", "sigmas_x_pct", "amplitudes_mv"):
            object.__setattr__(self, name, ascending(name, getattr(self, name), above=0))


@lru_cache(maxsize=256)
def log_likelihood(belief: RecruitmentBelief, mep_mv: float | None, *, responded: bool) -> FloatArray:
    """Logarithm of the probability of what came of a pulse, by `DISTANCES_PCT` and recruitment curve, shape (t, c)."""
    if mep_mv is not None and mep_mv >= belief.visible_mv:
        density = _with_input_noise(belief, _density(belief, mep_mv))
        return np.asarray(np.log((1 - ODD) * density + ODD * _ODD_DENSITY))
    larger = _with_input_noise(belief, _exceeding(belief, RESPONSE_MV if mep_mv is None else belief.visible_mv))
    return np.asarray(np.log((1 - ODD) * (larger if responded else 1 - larger) + 0.5 * ODD))


def _log_evoked(belief: RecruitmentBelief) -> FloatArray:
    """Logarithm of the MEP without noise, by input, slope and amplitude."""
    log_share = scipy.special.log_expit(np.array(belief.slopes_per_pct) * _INPUTS_PCT[:, None])
    return np.asarray(log_share[..., None] + np.log(belief.amplitudes_mv))


def _above_floor(belief: RecruitmentBelief, amplitude_mv: float) -> FloatArray:
    """What an amplitude has above the floor, by the floor's nodes [mV]."""
    return np.maximum(amplitude_mv - belief.floor_mv * np.exp(belief.floor_log_sd * _FLOOR_Z), 1e-3)


def _exceeding(belief: RecruitmentBelief, amplitude_mv: float) -> FloatArray:
    """Probability of a larger MEP without input noise, by input, slope and amplitude."""
    z = (_log_evoked(belief)[..., None] - np.log(_above_floor(belief, amplitude_mv))) / belief.sigma_y
    return np.asarray(scipy.special.ndtr(z) @ _FLOOR_WEIGHTS)


def _density(belief: RecruitmentBelief, amplitude_mv: float) -> FloatArray:
    """Density of an MEP by its logarithm without input noise, by input, slope and amplitude."""
    evoked_mv = _above_floor(belief, amplitude_mv)
    z = (_log_evoked(belief)[..., None] - np.log(evoked_mv)) / belief.sigma_y
    return np.asarray(scipy.stats.norm.pdf(z) / belief.sigma_y @ (_FLOOR_WEIGHTS * amplitude_mv / evoked_mv))


def _with_input_noise(belief: RecruitmentBelief, by_input: FloatArray) -> FloatArray:
    """The same by distance and recruitment curve, whose order is input noise, slope, amplitude."""
    inputs_last = np.moveaxis(by_input, 0, -1)[..., None]
    by_curve = (_input_noise(belief) @ inputs_last)[..., 0]
    return np.moveaxis(by_curve, -1, 0).reshape(len(DISTANCES_PCT), -1)


@lru_cache(maxsize=4)
def _input_noise(belief: RecruitmentBelief) -> FloatArray:
    """How likely each input is, by input noise, slope, amplitude and distance."""
    sigmas, centres = np.array(belief.sigmas_x_pct), _INPUTS_PCT[::4]
    larger = np.einsum("stx,xka->skat", _weights(centres, sigmas[:, None]), _exceeding(belief, RESPONSE_MV))
    thresholds = np.array([np.interp(0.5, curve, centres) for curve in larger.reshape(-1, len(centres))])
    return _weights(thresholds.reshape(larger.shape[:-1])[..., None] + DISTANCES_PCT, sigmas[:, None, None, None])


def _weights(centres: FloatArray, sigmas: FloatArray) -> FloatArray:
    """Normal weights of the inputs about some centres; the inputs are the last axis."""
    z = (_INPUTS_PCT - centres[..., None]) / sigmas[..., None]
    weights = np.exp(-0.5 * z * z)
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))
