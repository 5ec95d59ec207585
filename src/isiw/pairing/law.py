"""The law of an MEP after TMS alone, as the default has it: recruitment, noise on input and output, EMG floor.

With the level L (log of the largest MEP), the intensity x and standard normal z, e1, e2:

    mep = f exp(s e1) + exp(L) logistic(k (x - x50 + sigma_x z)) exp(sigma_y e2)

The noise on the input is integrated out on eight nodes; what lies between two nodes is passed on to the output along
the slope of the curve; at a node the log MEP is normal, its variance that of both parts by their shares of the sum
(docs/model.md, "Likelihood"; [Goetz2014]). Three per cent are artefacts, log-uniform from 2 to 200 floors.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from isiw.lazy import scipy
from isiw.types import BoolArray, FloatArray

_NODES, _REACH = 8, 2.6
_BETWEEN: Final = 0.4 * 2.0 * _REACH / (_NODES - 1)
_AT: Final = np.linspace(-_REACH, _REACH, _NODES)
_INPUT: Final = math.sqrt(1.0 - _BETWEEN**2) * _AT
_LOG_WEIGHTS: Final = -0.5 * _AT**2 - np.log(np.exp(-0.5 * _AT**2).sum())
_OUTLIERS, _OUTLIER_LOG_RANGE = 0.03, (math.log(2.0), math.log(200.0))
_BLUR: Final = 0.1
"""Of the ends of that range, natural log, so that the density has derivatives there."""

_LOG_ROOT_2PI: Final = 0.5 * math.log(2.0 * math.pi)

LATENTS: Final = ("log_floor", "log_floor_sd", "x50_pct", "log_slope", "log_input_sd", "log_output_sd", "level")
"""What the law of one pulse depends on; the level is the last."""


class Pulses(NamedTuple):
    """Pulses of one person as the law reads them."""

    log_mep: FloatArray  # [log mV]; of an MEP of 0 that of the detection limit, (n,)
    censored: BoolArray  # True where the MEP was below the detection limit, (n,)
    intensity_pct: FloatArray  # [% RMT], (n,)


class Scores(NamedTuple):
    """Log densities of pulses at some latents, and their derivatives by these."""

    value: FloatArray  # (n,)
    gradient: FloatArray  # (n, 7)


def scores(pulses: Pulses, latents: FloatArray) -> Scores:
    """Log densities of log MEPs, or log probabilities of those below the limit, with their derivatives.

    Latents are those of each of the n pulses, in the order of `LATENTS`, shape (n, 7).
    """
    log_floor, floor_sd, x50, log_slope, input_sd, output_sd, level = latents.T[:, :, None]
    slope = np.exp(log_slope)
    spread, floor_var, output_var = slope * np.exp(input_sd), np.exp(2.0 * floor_sd), np.exp(2.0 * output_sd)
    drive = slope * (pulses.intensity_pct[:, None] - x50) + spread * _INPUT
    rest = scipy.special.expit(-drive)
    ratio = level - np.logaddexp(0.0, -drive) - log_floor  # log of what is evoked, in floors
    share, other = scipy.special.expit(ratio), scipy.special.expit(-ratio)
    between = (_BETWEEN * spread * rest) ** 2
    variance = other**2 * floor_var + share**2 * (output_var + between)
    sd = np.sqrt(variance)
    off = (pulses.log_mep[:, None] - log_floor - np.logaddexp(0.0, ratio)) / sd
    terms = _LOG_WEIGHTS - 0.5 * off**2 - np.log(sd) - _LOG_ROOT_2PI
    by_middle, by_variance = off / sd, 0.5 * (off**2 - 1.0) / variance
    if pulses.censored.any():
        below = scipy.special.log_ndtr(off)
        steep = -np.exp(-0.5 * off**2 - _LOG_ROOT_2PI - below)
        hidden = pulses.censored[:, None]
        terms = np.where(hidden, _LOG_WEIGHTS + below, terms)
        by_middle = np.where(hidden, steep / sd, by_middle)
        by_variance = np.where(hidden, 0.5 * steep * off / variance, by_variance)
    # The chain of derivatives: of what is evoked [log], of its share, and of the drive.
    by_share = by_variance * 2.0 * (share * (output_var + between) - other * floor_var)
    by_evoked = by_middle * share + by_share * share * other
    by_between = 2.0 * by_variance * share**2 * between
    by_drive = by_evoked * rest - by_between * (1.0 - rest)
    parts = (
        by_middle * other - by_share * share * other,
        2.0 * by_variance * other**2 * floor_var,
        -slope * by_drive,
        drive * by_drive + by_between,
        spread * _INPUT * by_drive + by_between,
        2.0 * by_variance * share**2 * output_var,
        by_evoked,
    )
    return _with_artefacts(pulses, terms, np.stack(parts, axis=-1), log_floor[:, 0])


def _with_artefacts(pulses: Pulses, terms: FloatArray, parts: FloatArray, log_floor: FloatArray) -> Scores:
    """The scores of the mixture over nodes and artefacts."""
    top = terms.max(axis=-1)
    weights = np.exp(terms - top[:, None])
    total = weights.sum(axis=-1)
    low, high = _OUTLIER_LOG_RANGE
    away = pulses.log_mep - log_floor
    above, within = (scipy.special.expit((away - end) / _BLUR) for end in (low, high))
    inside = np.where(pulses.censored, 0.0, above - within)
    usual = top + np.log(total) + math.log1p(-_OUTLIERS)
    with np.errstate(divide="ignore"):
        rare = np.log(inside) + math.log(_OUTLIERS) - math.log(high - low)
    value = np.logaddexp(usual, rare)
    gradient = np.einsum("nj,njk->nk", weights / total[:, None], parts) * np.exp(usual - value)[:, None]
    edges = (within * (1.0 - within) - above * (1.0 - above)) / _BLUR
    gradient[:, 0] += np.where(pulses.censored, 0.0, edges * _OUTLIERS / (high - low) * np.exp(-value))
    return Scores(value, gradient)


_STEPS: Final = np.array([1e-4, 1e-4, 1e-3, 1e-4, 1e-4, 1e-4, 1e-4])
"""Of finite differences of the derivatives, in the units of `LATENTS`."""


def curvatures(pulses: Pulses, latents: FloatArray) -> FloatArray:
    """Second derivatives of each pulse's log density by its latents, (n, 7, 7)."""
    n, number = latents.shape
    moved = latents[None] + np.concatenate((np.diag(_STEPS), -np.diag(_STEPS)))[:, None, :]
    times = 2 * number
    again = Pulses(
        np.tile(pulses.log_mep, times), np.tile(pulses.censored, times), np.tile(pulses.intensity_pct, times)
    )
    gradient = scores(again, moved.reshape(-1, number)).gradient.reshape(2, number, n, number)
    found = np.moveaxis((gradient[0] - gradient[1]) / (2.0 * _STEPS[:, None, None]), 0, 1)
    both: FloatArray = 0.5 * (found + np.swapaxes(found, 1, 2))
    return both
