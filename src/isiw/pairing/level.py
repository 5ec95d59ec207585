"""The level of a person's MEPs in each block: its law, and its posterior from pulses of TMS alone.

The level is the log of the largest MEP. Before the intervention it is m, after it m + c + e (the change, and what a
block has of its own), plus a drift that keeps .97 a stimulus, as in the default's law. The drift has one of a few
sizes, whose probabilities the pulses change. Levels are those of stretches of at most ten pulses, in which a drift
hardly moves. Given a size the posterior of the levels, and of the person's curve, noise and floor, is taken as normal
about its mode (Laplace); that of the change is then a mixture of normal laws.

What the pulses say counts less than the likelihood has it, by `_worth`: at the mode the noise is smaller than it is, as
levels were fitted to it, and noise on the input is a little alike in two pulses in a row.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, NamedTuple

import numpy as np

from isiw.checks import Checked, Positive, number
from isiw.lazy import scipy
from isiw.models.shared.scales import AnyLaw, PositiveLaw, Scale
from isiw.pairing.law import LATENTS, Pulses, curvatures, scores
from isiw.types import FloatArray, IntArray

STRETCH: Final = 10
"""Pulses that are taken to have one level."""

_MOST_STEPS, _TOLERANCE, _LEAST_SHARE = 60, 1e-3, 1e-3
_CURVE: Final = len(LATENTS) - 1

_ALIKE, _ALIKE_SD, _MOST_ALIKE = 0.06, 0.06, 0.5
"""Correlation of what two pulses in a row say of the level: mean and SD over people, of whose noise on the input it is
.1 (docs/physiology.md) while that on the output hides a part; and the most that is assumed."""


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
        drifts: sizes of the drift (SD, natural log), and the probability of each; most of the one nearest to that of
            recordings, .26.
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
    drifts: tuple[tuple[float, float], ...] = ((0.03, 0.15), (0.15, 0.25), (0.3, 0.4), (0.6, 0.2))
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
    pulse_log_sd: float  # with which one pulse shows the level, natural log

    def interval(self, which: int, mass: float) -> tuple[float, float, float]:
        """The median of one change, and the ends of its central interval."""
        tail = (1.0 - mass) / 2.0
        return self._quantile(which, 0.5), self._quantile(which, tail), self._quantile(which, 1.0 - tail)

    def below(self, which: int, change: float) -> float:
        """The probability that one change is below a value."""
        return float(self.weights @ scipy.special.ndtr((change - self.means[:, which]) / self.sds[:, which]))

    def given(self, size: int) -> Posterior:
        """The posterior if the drift has one of the sizes."""
        return Posterior(np.ones(1), self.means[[size]], self.sds[[size]], self.pulse_log_sd)

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


class _Quadratic(NamedTuple):
    """The log likelihood about a point."""

    at: FloatArray
    value: float
    gradient: FloatArray
    precision: FloatArray  # its negative curvature

    def times(self, share: float) -> _Quadratic:
        """That of pulses which say only this share of it."""
        return _Quadratic(self.at, share * self.value, share * self.gradient, share * self.precision)


def posterior(pulses: Pulses, stretches: Stretches, prior: LevelPrior) -> Posterior:
    """The posterior of the changes from one person's pulses."""
    laws = [_level_law(prior, stretches, size) for size, _ in prior.drifts]
    centre = np.concatenate((prior.curve[0], np.full(len(stretches.block), prior.largest_mv.log_law[0])))
    likelihood = _Likelihood(pulses, stretches, len(centre))
    # The middle size is near enough to each of the others for one point to expand about.
    start = np.concatenate((centre[:_CURVE], _first_levels(pulses, stretches, prior)))
    inverse = _inverse(prior, laws[len(laws) // 2])
    about = likelihood.about(_mode(likelihood, centre, inverse, start))
    about = about.times(_worth(likelihood, about, inverse, stretches, prior))
    found = [_given(about, centre, prior, law) for law in laws]
    logs = np.array([log_evidence for log_evidence, _, _ in found]) + np.log([chance for _, chance in prior.drifts])
    weights = np.exp(logs - logs.max())
    shown = about.precision[_CURVE:, _CURVE:].trace() / len(pulses.log_mep)
    means, sds = (np.array([one[part] for one in found]) for part in (1, 2))
    return Posterior(weights / weights.sum(), means, sds, float(1.0 / np.sqrt(max(shown, 1e-3))))


class _Likelihood:
    """The log likelihood of pulses by the curve's latents and the levels of the stretches."""

    def __init__(self, pulses: Pulses, stretches: Stretches, size: int) -> None:
        self._pulses, self.size = pulses, size
        curve = np.tile(np.arange(_CURVE), (len(pulses.log_mep), 1))
        self._indices = np.concatenate((curve, _CURVE + stretches.of_pulse[:, None]), axis=1)

    def scores(self, at: FloatArray) -> tuple[float, FloatArray]:
        """The log likelihood, and each pulse's derivatives, (n, size)."""
        found = scores(self._pulses, at[self._indices])
        each = np.zeros((len(self._indices), self.size))
        np.put_along_axis(each, self._indices, found.gradient, axis=1)
        return float(found.value.sum()), each

    def about(self, at: FloatArray) -> _Quadratic:
        """The quadratic that it is near a point; where it curves upwards it is taken as flat."""
        value, each = self.scores(at)
        precision = np.zeros((self.size, self.size))
        np.add.at(
            precision,
            (self._indices[:, :, None], self._indices[:, None, :]),
            -curvatures(self._pulses, at[self._indices]),
        )
        values, vectors = np.linalg.eigh(precision)
        return _Quadratic(at, value, each.sum(axis=0), vectors * np.maximum(values, 0.0) @ vectors.T)


def _mode(likelihood: _Likelihood, centre: FloatArray, inverse: FloatArray, start: FloatArray) -> FloatArray:
    """The mode of the posterior, by steps with the outer product of the scores for the curvature [Berndt1974]."""

    def found(at: FloatArray) -> tuple[float, FloatArray]:
        value, each = likelihood.scores(at)
        return value - 0.5 * float((at - centre) @ inverse @ (at - centre)), each

    at, (value, each), share = start, found(start), 1.0
    for _ in range(_MOST_STEPS):
        slope = each.sum(axis=0) - inverse @ (at - centre)
        step = np.linalg.solve(each.T @ each + inverse, slope)
        if slope @ step < _TOLERANCE:
            break
        share = min(1.0, 2.0 * share)
        reached, scored = found(at + share * step)
        while reached <= value and share > _LEAST_SHARE:
            share /= 2.0
            reached, scored = found(at + share * step)
        if reached <= value:
            break
        at, value, each = at + share * step, reached, scored
    return at


def _worth(
    likelihood: _Likelihood, about: _Quadratic, inverse: FloatArray, stretches: Stretches, prior: LevelPrior
) -> float:
    """The share of what the likelihood says that the pulses are worth.

    Of n pulses p went into what was fitted, so that the variance about it is too small by (n - p) / n; the prior of the
    noise counts as further pulses. And n pulses whose neighbours correlate by r say as much as n (1 - r) / (1 + r).
    """
    by_level = likelihood.scores(about.at)[1][:, _CURVE:].sum(axis=1)
    n, block = len(by_level), stretches.block[stretches.of_pulse]
    fitted = float(np.trace(np.linalg.solve(about.precision + inverse, about.precision)))
    known = 0.5 / float(prior.curve[1][LATENTS.index("log_output_sd")]) ** 2
    neighbours = block[1:] == block[:-1]
    pairs = max(1, int(neighbours.sum()))
    alike = (by_level[1:] * by_level[:-1])[neighbours].sum() / pairs / max(float((by_level**2).mean()), 1e-12)
    learnt = _ALIKE_SD**2 / (_ALIKE_SD**2 + 1.0 / pairs)
    alike = _ALIKE + learnt * (alike + fitted / n - _ALIKE)  # what was fitted makes neighbours look opposed, by p / n
    alike = float(np.clip(alike, 0.0, _MOST_ALIKE))
    return (max(n - fitted, 1.0) + known) / (n + known) * (1.0 - alike) / (1.0 + alike)


def _first_levels(pulses: Pulses, stretches: Stretches, prior: LevelPrior) -> FloatArray:
    """Levels to begin from: the mean log MEP of a stretch, less what the usual curve has at its intensities."""
    slope, x50 = prior.slope_per_pct.median, prior.x50_pct_rmt.median
    log_share = -np.logaddexp(0.0, -slope * (pulses.intensity_pct - x50))
    return np.bincount(stretches.of_pulse, pulses.log_mep - log_share) / np.bincount(stretches.of_pulse)


def _inverse(prior: LevelPrior, law: _LevelLaw) -> FloatArray:
    """The inverse covariance of curve and levels."""
    size = _CURVE + len(law.covariance)
    inverse = np.zeros((size, size))
    inverse[:_CURVE, :_CURVE] = np.diag(prior.curve[1] ** -2.0)
    inverse[_CURVE:, _CURVE:] = np.linalg.inv(law.covariance)
    return inverse


def _given(
    about: _Quadratic, centre: FloatArray, prior: LevelPrior, law: _LevelLaw
) -> tuple[float, FloatArray, FloatArray]:
    """With one size of the drift: the log evidence, but for what all sizes share, means and SDs of the changes."""
    inverse = _inverse(prior, law)
    covariance = np.linalg.inv(about.precision + inverse)
    at = covariance @ (about.gradient + about.precision @ about.at + inverse @ centre)
    away, off = at - about.at, at - centre
    fit = about.value + about.gradient @ away - 0.5 * (away @ about.precision @ away + off @ inverse @ off)
    spread = np.linalg.slogdet(covariance)[1] - np.linalg.slogdet(law.covariance)[1]
    gain = law.with_changes @ inverse[_CURVE:, _CURVE:]
    left = law.of_changes - np.einsum("bs,bs->b", gain, law.with_changes)
    known = np.einsum("bs,st,bt->b", gain, covariance[_CURVE:, _CURVE:], gain)
    return float(fit + 0.5 * spread), gain @ off[_CURVE:], np.sqrt(left + known)
