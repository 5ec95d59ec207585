"""The level of a person's MEPs in each block: its law, and its posterior from pulses of TMS alone.

The level is the log of the largest MEP. Before the intervention it is m, after it m + c + e (the change, and what a
block has of its own), plus a drift that keeps .97 a stimulus, as in the default's law. The drift has one of a few
sizes, whose probabilities the pulses change. Levels are those of stretches of at most ten pulses, in which a drift
hardly moves. Given a size the posterior of the levels, and of the person's curve, noise and floor, is taken as normal
about its mode (Laplace); that of the change is then a mixture of normal laws.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, NamedTuple

import numpy as np

from isiw.checks import Checked, Positive, number
from isiw.lazy import scipy
from isiw.models.shared.scales import AnyLaw, PositiveLaw, Scale
from isiw.pairing.law import LATENTS, Pulses, Scores, curvatures, scores
from isiw.types import FloatArray, IntArray

STRETCH: Final = 10
"""Pulses that are taken to have one level."""

_STEPS, _TOLERANCE = 60, 1e-3
_CURVE: Final = len(LATENTS) - 1


@dataclass(frozen=True)
class LevelPrior(Checked):
    """What is known of people before the first pulse, and of what may change them.

    Args:
        floor_mv: EMG floor, peak to peak [mV].
        floor_log_sd: its SD from pulse to pulse, natural log.
        x50_pct_rmt: intensity of the half-maximal MEP [% RMT].
        slope_per_pct: slope of the recruitment curve [1 / % RMT].
        input_sd_pct: SD of the noise on its input [% RMT].
        output_log_sd: SD of the noise on its output, natural log.
        largest_mv: the largest MEP [mV].
        change_log_sd: SD of the change, natural log.
        block_log_sd: SD of what each block after the intervention has of its own, natural log.
        drifts: sizes of the drift (SD, natural log), and the probability of each.
        persistence: share of the drift that is kept from stimulus to stimulus.
    """

    floor_mv: PositiveLaw = Scale(0.010, 0.45)
    floor_log_sd: PositiveLaw = Scale(0.2, 0.35)
    x50_pct_rmt: AnyLaw = Scale(111.0, 8.0)
    slope_per_pct: PositiveLaw = Scale(0.26, 0.25)
    input_sd_pct: PositiveLaw = Scale(7.2, 0.25)
    output_log_sd: PositiveLaw = Scale(0.38, 0.22)
    largest_mv: PositiveLaw = Scale(0.6, 1.2)
    change_log_sd: Positive = 1.0
    block_log_sd: Positive = 0.2
    drifts: tuple[tuple[float, float], ...] = ((0.03, 0.6), (0.15, 0.16), (0.3, 0.16), (0.6, 0.08))
    persistence: Annotated[float, partial(number, least=0, below=1)] = 0.97

    @property
    def curve(self) -> tuple[FloatArray, FloatArray]:
        """Means and SDs of the latents of a curve, in the order of `LATENTS`, without the level."""
        laws = (
            self.floor_mv.log_law,
            self.floor_log_sd.log_law,
            self.x50_pct_rmt.law,
            self.slope_per_pct.log_law,
            self.input_sd_pct.log_law,
            self.output_log_sd.log_law,
        )
        return np.array([mean for mean, _ in laws]), np.array([sd for _, sd in laws])


class Stretches(NamedTuple):
    """Which pulses have one level, and where each is in the course of the visit."""

    of_pulse: IntArray  # (n,)
    block: IntArray  # of each stretch, 0 before, from 1 on after, (s,)
    at: FloatArray  # numbers of its first and last stimulus, (s, 2)


class Posterior(NamedTuple):
    """The change of each block, and their mean last: a mixture over sizes of the drift."""

    weights: FloatArray  # of the sizes, (d,)
    means: FloatArray  # of changes, natural log, (d, blocks + 1)
    sds: FloatArray  # (d, blocks + 1)
    latents: FloatArray  # the mode: the curve's, then the levels of the stretches
    drift: float  # expected SD of the drift, natural log

    def interval(self, which: int, mass: float) -> tuple[float, float]:
        """The central interval of one change."""
        tail = (1.0 - mass) / 2.0
        return self._quantile(which, tail), self._quantile(which, 1.0 - tail)

    def median(self, which: int) -> float:
        """The median of one change."""
        return self._quantile(which, 0.5)

    def below(self, which: int, change: float) -> float:
        """The probability that one change is below a value."""
        return float(self.weights @ scipy.special.ndtr((change - self.means[:, which]) / self.sds[:, which]))

    def _quantile(self, which: int, p: float) -> float:
        ends = self.means[:, which] + np.array([[-9.0], [9.0]]) * self.sds[:, which]
        return float(scipy.optimize.brentq(lambda x: self.below(which, x) - p, ends.min(), ends.max(), xtol=1e-6))


class _LevelLaw(NamedTuple):
    """The prior of the levels of stretches, and what they have to do with the changes."""

    covariance: FloatArray  # of the levels, (s, s)
    with_changes: FloatArray  # of changes with levels, (blocks + 1, s)
    of_changes: FloatArray  # variances of the changes, (blocks + 1,)


def _level_law(prior: LevelPrior, stretches: Stretches, drift: float) -> _LevelLaw:
    block = stretches.block
    blocks = int(block.max())
    own = (block[:, None] == np.arange(1, blocks + 1)).astype(float)
    after = (block > 0).astype(float)
    shared, alone = prior.change_log_sd**2, prior.block_log_sd**2
    covariance = prior.largest_mv.sd**2 + shared * np.outer(after, after) + alone * own @ own.T
    covariance = covariance + drift**2 * _kept(prior.persistence, stretches.at)
    of_block = shared * np.outer(np.ones(blocks), after) + alone * own.T
    pooled = of_block.mean(axis=0)
    variances = np.append(np.full(blocks, shared + alone), shared + alone / blocks)
    return _LevelLaw(covariance + 1e-6 * np.eye(len(block)), np.vstack((of_block, pooled)), variances)


def _kept(persistence: float, at: FloatArray) -> FloatArray:
    """Correlations of the means of a drift over stretches."""
    nodes = np.linspace(0.0, 1.0, 5)
    places = at[:, :1] + nodes * (at[:, 1:] - at[:, :1])
    apart = np.abs(places[:, None, :, None] - places[None, :, None, :])
    kept: FloatArray = (persistence**apart).mean(axis=(2, 3))
    return kept


def posterior(pulses: Pulses, stretches: Stretches, prior: LevelPrior) -> Posterior:
    """The posterior of the changes from n pulses."""
    drifts, chances = np.array(prior.drifts).T
    laws = [_level_law(prior, stretches, drift) for drift in drifts]
    usual = int(np.argmax(np.isclose(drifts, 0.3))) if np.isclose(drifts, 0.3).any() else len(drifts) // 2
    mode, precision = _mode(pulses, stretches, prior, laws[usual])
    return _mixed(prior, laws, (drifts, chances), mode, precision)


class _Mode(NamedTuple):
    at: FloatArray
    gradient: FloatArray  # of the log likelihood there
    value: float


def _mode(pulses: Pulses, stretches: Stretches, prior: LevelPrior, law: _LevelLaw) -> tuple[_Mode, FloatArray]:
    """The mode of curve and levels, and the negative curvature of the log likelihood there."""
    mean, sd = prior.curve
    centre = np.concatenate((mean, np.full(len(stretches.block), prior.largest_mv.log_law[0])))
    inverse = np.zeros((len(centre), len(centre)))
    inverse[:_CURVE, :_CURVE] = np.diag(sd**-2.0)
    inverse[_CURVE:, _CURVE:] = np.linalg.inv(law.covariance)
    indices = np.concatenate(
        (np.tile(np.arange(_CURVE), (len(pulses.log_mep), 1)), _CURVE + stretches.of_pulse[:, None]), axis=1
    )

    def found(at: FloatArray) -> Scores:
        return scores(pulses, at[indices])

    def log_prior(at: FloatArray) -> float:
        away = at - centre
        return float(-0.5 * away @ inverse @ away)

    at = centre.copy()
    at[_CURVE:] = _first_levels(pulses, stretches, prior)
    now = found(at)
    value = float(now.value.sum()) + log_prior(at)
    damping = 1.0
    for _ in range(_STEPS):
        each = np.zeros((len(pulses.log_mep), len(at)))
        np.put_along_axis(each, indices, now.gradient, axis=1)
        slope = each.sum(axis=0) - inverse @ (at - centre)
        step = np.linalg.solve(each.T @ each + inverse, slope)
        if slope @ step < _TOLERANCE:
            break
        damping = min(1.0, 2.0 * damping)
        while damping > 1e-3:
            tried = at + damping * step
            then = found(tried)
            reached = float(then.value.sum()) + log_prior(tried)
            if reached > value:
                break
            damping /= 2.0
        else:
            break
        at, now, value = tried, then, reached
    curved = curvatures(pulses, at[indices])
    precision = np.zeros((len(at), len(at)))
    np.add.at(precision, (indices[:, :, None], indices[:, None, :]), -curved)
    values, vectors = np.linalg.eigh(precision)
    precision = vectors * np.maximum(values, 0.0) @ vectors.T
    gradient = np.zeros(len(at))
    np.add.at(gradient, indices, now.gradient)
    return _Mode(at, gradient, float(now.value.sum())), precision


def _first_levels(pulses: Pulses, stretches: Stretches, prior: LevelPrior) -> FloatArray:
    """Levels to begin from: the mean log MEP of a stretch, less what the usual curve has at its intensities."""
    slope, x50 = prior.slope_per_pct.median, prior.x50_pct_rmt.median
    log_share = -np.log1p(np.exp(-slope * (pulses.intensity_pct - x50)))
    count = np.bincount(stretches.of_pulse)
    return np.bincount(stretches.of_pulse, pulses.log_mep - log_share) / count


def _mixed(
    prior: LevelPrior,
    laws: list[_LevelLaw],
    sizes: tuple[FloatArray, FloatArray],
    mode: _Mode,
    precision: FloatArray,
) -> Posterior:
    """The mixture over sizes of the drift, the log likelihood taken as quadratic about the mode."""
    mean, sd = prior.curve
    centre = np.concatenate((mean, np.full(len(mode.at) - _CURVE, prior.largest_mv.log_law[0])))
    weights, means, sds = [], [], []
    for law, chance in zip(laws, sizes[1], strict=True):
        inverse = np.zeros_like(precision)
        inverse[:_CURVE, :_CURVE] = np.diag(sd**-2.0)
        levels = np.linalg.inv(law.covariance)
        inverse[_CURVE:, _CURVE:] = levels
        both = precision + inverse
        linear = mode.gradient + precision @ mode.at + inverse @ centre
        covariance = np.linalg.inv(both)
        at = covariance @ linear
        sign, log_det = np.linalg.slogdet(both)
        away, off = at - mode.at, at - centre
        fit = mode.value + mode.gradient @ away - 0.5 * away @ precision @ away - 0.5 * off @ inverse @ off
        log_prior_det = np.linalg.slogdet(law.covariance)[1]
        weights.append(np.log(chance) + fit - 0.5 * (log_det + log_prior_det) if sign > 0 else -np.inf)
        gain = law.with_changes @ levels
        means.append(gain @ (at[_CURVE:] - centre[_CURVE:]))
        left = law.of_changes - np.einsum("bs,bs->b", gain, law.with_changes)
        known = np.einsum("bs,st,bt->b", gain, covariance[_CURVE:, _CURVE:], gain)
        sds.append(np.sqrt(left + known))
    chances = np.exp(np.array(weights) - max(weights))
    chances /= chances.sum()
    return Posterior(chances, np.array(means), np.array(sds), mode.at, float(chances @ sizes[0]))
