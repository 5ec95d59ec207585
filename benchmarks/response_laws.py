"""How probable recorded single pulses are under each kind of noise of the default: its law, written in NumPy.

    mep / floor = floor noise + ratio * sigmoid(drive + input noise) * output noise

as in `docs/model.md`, for pulses of known intensity. Recruitment curves say what an intensity does. The kinds without a
curve know facilitation alone: for them a pulse stands for a pair whose shift is the intensity less 90 % RMT, so that
their level is `((x - 90) / 30) ** bend`. The bend is unknown, as the width of a window is, since a power of a Gaussian
profile is a narrower or wider one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.special import expit, logit, logsumexp

from benchmarks.recorded_people import PAIRS_PCT_RMT, Bank
from isiw.types import FloatArray

MOST_PCT_RMT: Final = 120.0
"""The strongest shift of a pair that is recorded, to which pulses are used."""

OUTLIERS: Final = 0.03
OUTLIER_LOGS: Final = (np.log(2.0), np.log(200.0))

_FLOOR: Final = ("log_floor", "log_floor_sd")
_CURVE: Final = (*_FLOOR, "log_ratio", "log_slope", "log_input_sd", "log_sigma_y", "rest")
NAMES: Final[Mapping[str, tuple[str, ...]]] = {
    "constant_cv": (*_FLOOR, "log_ratio", "log_cv", "log_bend"),
    "missing": (*_FLOOR, "log_ratio", "log_cv", "log_bend", "reliability"),
    "recruitment": _CURVE,
    "all_or_none": (*_FLOOR, "log_ratio", "log_cv", "log_bend", "switched_on", "switched_off"),
    "rectified": (*_CURVE, "log_onset"),
}
"""What the numbers of a law are called, by kind of noise; `rest` is the input at 90 % RMT [% RMT]."""

_REACH, _COUNT = 2.6, 8
_BETWEEN: Final = 0.8 * _REACH / (_COUNT - 1)
_ON: Final = np.sqrt(1.0 - _BETWEEN**2)
_NODES: Final = np.linspace(-_REACH, _REACH, _COUNT) * _ON
_WEIGHTS: Final = np.exp(-0.5 * (_NODES / _ON) ** 2) / np.exp(-0.5 * (_NODES / _ON) ** 2).sum()
"""Nodes of the input noise; what lies between two of them varies by `_BETWEEN` SDs, as in the default's law."""


class Evoked(NamedTuple):
    """What pulses of one intensity evoke under n laws, at q nodes of the input noise."""

    ratio: FloatArray  # over the floor, (n, q)
    variance: FloatArray  # of its log, (n, q)
    probability: FloatArray  # that anything is evoked, (n, 1)


def pulses_of(bank: Bank) -> list[tuple[float, FloatArray]]:
    """Intensities up to `MOST_PCT_RMT` [% RMT], and the amplitudes of each [mV]."""
    levels = zip(bank.levels_pct_rmt.tolist(), bank.amplitudes_mv, strict=True)
    return [(level, amplitudes) for level, amplitudes in levels if level <= MOST_PCT_RMT]


def evoked(kind: str, laws: FloatArray, intensity_pct_rmt: float) -> Evoked:
    """What a pulse evokes.

    Args:
        kind: of the noise.
        laws: numbers in the order of `NAMES`, shape (n, d).
        intensity_pct_rmt: of the pulse [% RMT].
    """
    z = {name: column[:, None] for name, column in zip(NAMES[kind], laws.T, strict=True)}
    above = intensity_pct_rmt - PAIRS_PCT_RMT
    return _of_curve(z, above) if "rest" in z else _of_gain(kind, z, above / (MOST_PCT_RMT - PAIRS_PCT_RMT))


def _of_curve(z: Mapping[str, FloatArray], above_pct_rmt: float) -> Evoked:
    slope, spread = np.exp(z["log_slope"]), np.exp(z["log_input_sd"])
    onset = np.minimum(np.exp(z["log_onset"]), 0.9) if "log_onset" in z else np.zeros_like(slope)
    at_threshold = logit(onset) if "log_onset" in z else 0.0
    share = expit(slope * (z["rest"] + above_pct_rmt) + at_threshold + spread * _NODES)
    varies = (_BETWEEN * spread * (1.0 - share)) ** 2
    if "log_onset" in z:  # what lies between the nodes rounds the corner
        over, absolute = share - onset, varies * share**2
        reach = np.maximum(over**2 + 0.05 * absolute, 1e-12)
        share, varies = 0.5 * (np.sqrt(reach) + over) / (1.0 - onset), absolute / reach
    return Evoked(np.exp(z["log_ratio"]) * share, varies + np.exp(2.0 * z["log_sigma_y"]), np.ones_like(slope))


def _of_gain(kind: str, z: Mapping[str, FloatArray], share_of_shift: float) -> Evoked:
    cv, level = np.exp(np.minimum(z["log_cv"], 1.0)), share_of_shift ** np.exp(z["log_bend"])
    root = 1.0 - cv**2 / 9.0 + _NODES * cv / 3.0  # Wilson and Hilferty's gamma noise
    logs, slope = 3.0 * np.log(np.maximum(root, 0.02)), cv / np.maximum(root, 0.2)
    varies = (_BETWEEN * slope) ** 2
    mean = np.exp(logs + 0.5 * varies) @ _WEIGHTS[:, None]
    probability = np.ones_like(level)
    if kind == "missing":
        probability = expit(z["reliability"]) * np.sqrt(level)
    if kind == "all_or_none":
        most, least = expit(z["switched_on"]), expit(z["switched_off"])
        probability, level = least + (most - least) * level, np.ones_like(level)
    return Evoked(np.exp(z["log_ratio"] + logs) * level / mean, varies, probability)


def log_likelihood(kind: str, laws: FloatArray, pulses: list[tuple[float, FloatArray]]) -> FloatArray:
    """Log density of the log amplitudes of some pulses under laws of a kind, shape (n,).

    Args:
        kind: of the noise.
        laws: numbers in the order of `NAMES`, shape (n, d).
        pulses: intensities [% RMT], and the amplitudes of each [mV].
    """
    log_floor, floor_sd = laws[:, :1], np.exp(laws[:, 1:2])
    total = np.zeros(len(laws))
    for intensity_pct_rmt, amplitudes_mv in pulses:
        ratio, variance, probability = evoked(kind, laws, intensity_pct_rmt)
        relative = np.log(amplitudes_mv) - log_floor
        sd = np.sqrt(ratio**2 * variance + floor_sd**2) / (1.0 + ratio)
        responding = _normal(relative[:, None, :] - np.log1p(ratio)[..., None], sd[..., None])
        density = probability * (_WEIGHTS @ responding) + (1.0 - probability) * _normal(relative, floor_sd)
        low, high = OUTLIER_LOGS
        outlier = ((relative > low) & (relative < high)) / (high - low) + 1e-6
        total += np.log((1.0 - OUTLIERS) * density + OUTLIERS * outlier).sum(1)
    return total


def _normal(distance: FloatArray, sd: FloatArray) -> FloatArray:
    return np.exp(-0.5 * (distance / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of normal laws with independent numbers.

    Args:
        shares: of the components, shape (k,).
        means: of the numbers in each, shape (k, d).
        sds: likewise.
    """

    shares: FloatArray
    means: FloatArray
    sds: FloatArray

    def log_density(self, laws: FloatArray) -> FloatArray:
        """Log density at laws (n, d), shape (n,)."""
        z = (laws[:, None, :] - self.means) / self.sds
        scale = np.log(self.sds).sum(1) + 0.5 * np.log(2.0 * np.pi) * self.means.shape[1]
        return np.asarray(logsumexp(np.log(self.shares) - scale - 0.5 * (z**2).sum(2), axis=1))

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Laws, shape (count, d)."""
        which = rng.choice(len(self.shares), size=count, p=self.shares / self.shares.sum())
        return self.means[which] + self.sds[which] * rng.standard_normal((count, self.means.shape[1]))
