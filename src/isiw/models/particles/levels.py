"""A law of responses by levels: what pulses alone have evoked at a few intensities, with no curve through them.

The amplitudes of a level are log-normal, with unknown mean and variance; each particle has a draw of both from their
posterior, for normal data with a conjugate prior of the variance [Gelman2013, 3.3]. Between two levels the law is a
mixture of both, the nearer one the more. A recruitment curve that was recorded is smooth only within the noise on its
input, and its means lie .3 (log) off the best logistic curve (decision 60).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from isiw.models.particles.records import FLOOR_SD, LOG_FLOOR, LOG_RATIO, ONSET, OUTPUT_SD, REST, SLOPE, SPREAD
from isiw.models.shared.history import COUNTS, SHIFT, History
from isiw.native.engine import RESPONSE_LEVELS
from isiw.types import FloatArray, Singles

CARRIED: Final = 3 * RESPONSE_LEVELS
"""Numbers that a particle carries along: place, mean and SD of each level."""

LEAST_APART_PCT_RMT, MOST_APART_PCT_RMT = 3.0, 6.0
"""Levels that are closer are one, and those that are further apart never are [% RMT]."""

LEAST_PULSES, LEAST_LEVELS = 3, 3
"""A level with fewer pulses is one with the next, or left out; fewer levels are no law."""

FROM_PCT_RMT, UP_TO_PCT_RMT = 5.0, 25.0
"""The lowest level is at most so far above the pairs' intensity, and the highest one at least so far, as taps may shift
the input: beyond the levels nothing is known [% RMT]."""

USUAL_SD, AS_MANY = 0.3, 2.0
"""What is known of the SD of a level before: as if so many amplitudes had shown it; natural log."""

BEYOND_PCT_RMT: Final = 1000.0
"""How far apart places are that no level is at."""

SATURATED, LEAST_PCT_RMT, LEAST_SD = 2.5, 15.0, 0.05
"""Up to where levels are taken along a curve [logits], over how much at least [% RMT], and their smallest SD."""


class Level(NamedTuple):
    """Pulses of one level."""

    shifts_pct_rmt: FloatArray  # by how much they were stronger than the pairs', ascending, (n,)
    log_mep: FloatArray  # natural log of the amplitudes [log mV], (n,)

    def joined(self, other: Level) -> Level:
        """The pulses of this and the next level as those of one."""
        return Level._make(np.concatenate(both) for both in zip(self, other, strict=True))


def levels_of(history: History, row: int) -> list[Level]:
    """The levels of the pulses that were given alone first; empty where they are too few, or too far away.

    Args:
        history: the trials.
        row: whose, of those that learn from such pulses.
    """
    columns = history.columns[row].astype(float)
    columns = columns[columns[:, COUNTS] < 1.0]
    if not len(columns):
        return []
    low, high = columns[:, 2:4].T
    log_mep = np.where(np.isfinite(low + high), 0.5 * (low + high), np.where(np.isfinite(low), low, high))
    order = np.argsort(columns[:, SHIFT], kind="stable")
    pulses = Level(columns[order, SHIFT], log_mep[order])
    _, first = np.unique(pulses.shifts_pct_rmt, return_index=True)
    levels = [Level(*own) for own in zip(*(np.split(each, first[1:]) for each in pulses), strict=True)]
    while (at := _not_apart(levels)) is not None:
        levels[at : at + 2] = [levels[at].joined(levels[at + 1])]
    levels = [level for level in levels if len(level.log_mep) >= LEAST_PULSES]
    places = _places(levels)
    enough = len(levels) >= LEAST_LEVELS and places[0] <= FROM_PCT_RMT and places[-1] >= UP_TO_PCT_RMT
    return levels if enough else []


def _places(levels: list[Level]) -> FloatArray:
    return np.array([level.shifts_pct_rmt.mean() for level in levels])


def _not_apart(levels: list[Level]) -> int | None:
    """Which level is one with the next: the closest two, or one with too few pulses; None where all are apart."""
    apart, counts = np.diff(_places(levels)), np.array([len(level.log_mep) for level in levels])
    if apart.size and (apart.min() < LEAST_APART_PCT_RMT or len(levels) > RESPONSE_LEVELS):
        return int(apart.argmin())
    few = np.minimum(counts[:-1], counts[1:]) < LEAST_PULSES
    wanted = np.where(few & (apart <= MOST_APART_PCT_RMT), apart, np.inf)
    return int(wanted.argmin()) if np.isfinite(wanted).any() else None


def foretold(levels: list[Level]) -> float:
    """Log density of the pulses of levels, each as the others of its level foretell it, summed [nat]."""
    found = 0.0
    for _, log_mep in levels:
        count = len(log_mep) - 1
        others = np.array([np.delete(log_mep, at) for at in range(count + 1)])
        degrees = AS_MANY + count
        variance = (AS_MANY * USUAL_SD**2 + count * others.var(1)) / degrees * (1.0 + 1.0 / count)
        at = (log_mep - others.mean(1)) ** 2 / variance  # of Student's t, which mean and variance come to
        constant = math.lgamma(0.5 * (degrees + 1.0)) - math.lgamma(0.5 * degrees) - 0.5 * math.log(math.pi * degrees)
        found += float((constant - 0.5 * np.log(variance) - 0.5 * (degrees + 1.0) * np.log1p(at / degrees)).sum())
    return found


def drawn(levels: list[Level], particles: int, rng: np.random.Generator) -> Singles:
    """What so many particles carry of the levels of pulses, (p, CARRIED)."""
    counts = np.array([len(level.log_mep) for level in levels])
    means = np.array([level.log_mep.mean() for level in levels])
    squares = np.array([level.log_mep.var() for level in levels]) * counts
    variances = (AS_MANY * USUAL_SD**2 + squares) / rng.chisquare(AS_MANY + counts, (particles, len(levels)))
    laws = means + rng.standard_normal(variances.shape) * np.sqrt(variances / counts), np.sqrt(variances)
    missing = RESPONSE_LEVELS - len(levels)
    places = np.append(_places(levels), _places(levels)[-1] + BEYOND_PCT_RMT * np.arange(1, missing + 1))
    return _carried(
        np.tile(places, (particles, 1)), *(np.pad(law, ((0, 0), (0, missing)), mode="edge") for law in laws)
    )


def along_curves(fields: Singles) -> Singles:
    """What particles carry of levels along their recruitment curves, (p, CARRIED).

    Means and SDs of log MEPs at each place are those of the curve with all of its noise.

    Args:
        fields: what particles mean that have a curve, with a threshold or without, (p, fields).
    """
    rest, slope, spread, log_ratio, onset, log_floor, floor_sd, output_sd = (
        fields[:, field, np.newaxis, np.newaxis].astype(float)
        for field in (REST, SLOPE, SPREAD, LOG_RATIO, ONSET, LOG_FLOOR, FLOOR_SD, OUTPUT_SD)
    )
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    span = np.maximum(LEAST_PCT_RMT, (SATURATED - rest) / slope)
    places = np.linspace(0.0, 1.0, RESPONSE_LEVELS)[:, np.newaxis] * span
    sigmoid = 1.0 / (1.0 + np.exp(-(rest + slope * places + spread * nodes)))
    evoked = np.exp(log_ratio) * np.maximum(sigmoid - onset, 0.0) / (1.0 - onset)
    log_mep = log_floor + np.log1p(evoked)
    variance = (floor_sd**2 + (evoked * output_sd) ** 2) / (1.0 + evoked) ** 2
    means, squares = ((each * weights).sum(-1) / weights.sum() for each in (log_mep, variance + log_mep**2))
    return _carried(places[..., 0], means, np.sqrt(np.maximum(squares - means**2, LEAST_SD**2)))


def _carried(places: FloatArray, means: FloatArray, sds: FloatArray) -> Singles:
    return np.hstack([places, means, sds]).astype(np.float32)
