"""The form of an ISI–MEP profile: how many Gaussians it is made of, and whether its values are normal [Kim2020, 8.1.3].

Figure 8.2 draws sums of one to five Gaussians and a smoothing spline, and leaves the choice open; here the corrected
information criterion of Akaike chooses [Hurvich1989].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from isiw.checks import number, whole
from isiw.dissertation.nonlinear import gaussians_mv, gradient_mv
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.text.sanitize import counted
from isiw.types import ArrayLike, FloatArray

MOST_GAUSSIANS: Final = 5
"""As many Gaussians as Figure 8.2 tries."""

LEAST_ISIS: Final = 5
"""A smoothing spline needs as many ISIs."""

_STIFFNESSES: Final = np.geomspace(1e-2, 1e7, 19)
_START_SDS_MS: Final = (3.0, 6.0, 12.0, 24.0)


@dataclass(frozen=True, eq=False)
class ProfileFit:
    """A curve through the mean MEPs of a profile, with its information criteria, of which the smallest is best."""

    name: str
    parameters: float  # the noise among them; of a spline the effective number
    aicc: float  # infinite with too few ISIs
    rms_mv: float
    gaussians: FloatArray  # amplitude [mV], mean [ms] and SD [ms] of each, (k, 3); negative if it is depressed
    _curve: Callable[[FloatArray], FloatArray] = field(repr=False)

    def mean_mv(self, isi_ms: ArrayLike) -> FloatArray:
        """The curve at some ISIs [ms], of the same shape [mV]."""
        return np.asarray(self._curve(np.asarray(isi_ms, dtype=np.float64)))


class Normality(NamedTuple):
    """W, p-value and result of a test of Shapiro and Wilk."""

    statistic: float
    p_value: float
    normal: bool


def normality(values: ArrayLike, level: float = 0.05) -> Normality:
    """Could the values come from a normal law? By the test of Shapiro and Wilk [Kim2020, Tables 4.1 and 8.1]."""
    level = number("the level of the test", level, above=0, below=1)
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1 or len(sample) < 3:
        raise InvalidValueError("a test of normality needs at least three values", got=sample.shape, expected="(n,)")
    if not np.isfinite(sample).all():
        raise InvalidValueError("the values must be finite", remedy="Leave mistrials out.")
    if np.ptp(sample) == 0.0:
        raise InvalidValueError("values that are all the same have no law to be tested", got=float(sample[0]))
    found = scipy.stats.shapiro(sample)
    return Normality(float(found.statistic), float(found.pvalue), bool(found.pvalue >= level))


def paired(isi_ms: ArrayLike, mep_mv: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The ISI [ms] and the MEP [mV] of each trial, both finite, shape (n,) each."""
    isi, mep = np.asarray(isi_ms, dtype=np.float64), np.asarray(mep_mv, dtype=np.float64)
    if isi.shape != mep.shape or isi.ndim != 1:
        raise InvalidValueError("each trial has one ISI and one MEP", got=(isi.shape, mep.shape))
    if not (np.isfinite(isi).all() and np.isfinite(mep).all()):
        raise InvalidValueError("ISIs and MEPs must be finite", remedy="Leave mistrials out.")
    return isi, mep


def profile_fits(isi_ms: ArrayLike, mep_mv: ArrayLike, most: int = MOST_GAUSSIANS) -> tuple[ProfileFit, ...]:
    """Sums of one and more Gaussians on a baseline, and a smoothing spline, through the mean MEP at each ISI."""
    most = whole("the number of Gaussians", most, least=1, most=20)
    isi, mep = paired(isi_ms, mep_mv)
    at_ms, which, trials = np.unique(isi, return_inverse=True, return_counts=True)
    if len(at_ms) < LEAST_ISIS:
        raise InvalidValueError("too few ISIs for a profile", got=len(at_ms), expected=f"at least {LEAST_ISIS}")
    profile = _Profile(at_ms, np.bincount(which, mep) / trials, trials / trials.mean())
    fits, parameters = [], np.array([np.average(profile.mep_mv, weights=profile.weights)])
    for _ in range(most):
        parameters = _with_one_more(profile, parameters)
        gaussians, curve = parameters[1:].reshape(-1, 3), partial(_mean_mv, parameters)
        fits.append(_scored(counted(len(gaussians), "Gaussian"), profile, curve, len(parameters) + 1.0, gaussians))
    return (*fits, _spline(profile))


def best_fit(fits: tuple[ProfileFit, ...]) -> ProfileFit:
    """The curve for which the profile speaks most: the one of the smallest AICc."""
    return min(fits, key=lambda fit: fit.aicc)


class _Profile(NamedTuple):
    """Mean MEP at each ISI, and its weight, with mean 1; each of shape (t,)."""

    isi_ms: FloatArray
    mep_mv: FloatArray
    weights: FloatArray


def _mean_mv(parameters: FloatArray, isi_ms: FloatArray) -> FloatArray:
    """Baseline and Gaussians, (1 + 3 k,)."""
    return np.asarray(parameters[0] + gaussians_mv(isi_ms, parameters[1:]))


def _residuals(parameters: FloatArray, profile: _Profile) -> FloatArray:
    return np.asarray((_mean_mv(parameters, profile.isi_ms) - profile.mep_mv) * np.sqrt(profile.weights))


def _jacobian(parameters: FloatArray, profile: _Profile) -> FloatArray:
    gradient = np.hstack([np.ones((len(profile.isi_ms), 1)), gradient_mv(profile.isi_ms, parameters[1:])])
    return np.asarray(gradient * np.sqrt(profile.weights)[:, None])


def _with_one_more(profile: _Profile, parameters: FloatArray) -> FloatArray:
    """The best of several searches for one more Gaussian, each from where the others miss the profile most."""
    missed_mv = profile.mep_mv - _mean_mv(parameters, profile.isi_ms)
    begun = []
    for sd_ms in _START_SDS_MS:
        bells = np.exp(-0.5 * ((profile.isi_ms[:, None] - profile.isi_ms) / sd_ms) ** 2)
        smooth_mv = bells @ missed_mv / bells.sum(1)
        most = np.abs(smooth_mv).argmax()
        begun.append(np.concatenate([parameters, [smooth_mv[most], profile.isi_ms[most], sd_ms]]))
    found = [_least_squares(profile, start) for start in begun]
    return min(found, key=lambda x: float((_residuals(x, profile) ** 2).sum()))


def _least_squares(profile: _Profile, start: FloatArray) -> FloatArray:
    first_ms, last_ms = profile.isi_ms[0], profile.isi_ms[-1]
    narrowest_ms, range_ms = float(np.diff(profile.isi_ms).min()), last_ms - first_ms
    gaussians = len(start) // 3
    low = np.concatenate([[-np.inf], np.tile([-np.inf, first_ms - range_ms, 0.5 * narrowest_ms], gaussians)])
    high = np.concatenate([[np.inf], np.tile([np.inf, last_ms + range_ms, 2.0 * range_ms], gaussians)])
    inside = np.clip(start, low, high)
    found = scipy.optimize.least_squares(
        _residuals, inside, jac=_jacobian, bounds=(low, high), x_scale="jac", max_nfev=200, args=(profile,)
    )
    return np.asarray(found.x)


def _spline(profile: _Profile) -> ProfileFit:
    """The smoothing spline whose stiffness has the smallest AICc."""
    unit = np.eye(len(profile.isi_ms))
    fits = []
    for stiffness in _STIFFNESSES:
        hat = scipy.interpolate.make_smoothing_spline(profile.isi_ms, unit, w=profile.weights, lam=stiffness)(
            profile.isi_ms
        )
        curve = scipy.interpolate.make_smoothing_spline(
            profile.isi_ms, profile.mep_mv, w=profile.weights, lam=stiffness
        )
        fits.append(_scored("smoothing spline", profile, curve, float(np.trace(hat)) + 1.0, np.empty((0, 3))))
    return min(fits, key=lambda fit: fit.aicc)


def _scored(
    name: str, profile: _Profile, curve: Callable[[FloatArray], FloatArray], parameters: float, gaussians: FloatArray
) -> ProfileFit:
    """A curve with its criteria, for normal residuals of unknown variance."""
    isis = len(profile.isi_ms)
    residuals_mv = profile.mep_mv - curve(profile.isi_ms)
    variance = max(float((profile.weights * residuals_mv**2).mean()), np.finfo(float).tiny)
    deviance, free = isis * math.log(variance), isis - parameters - 1.0
    correction = 2.0 * parameters * (parameters + 1.0) / free if free > 0 else math.inf
    return ProfileFit(
        name=name,
        parameters=parameters,
        aicc=deviance + 2.0 * parameters + correction,
        rms_mv=math.sqrt(variance),
        gaussians=gaussians,
        _curve=curve,
    )
