"""Nonlinear least squares of one Gaussian or two: the dissertation's NR [Kim2020, 4.3, 4.4.8, 5.4.2]."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal, NamedTuple

import numpy as np

from isiw.checks import Checked, Count, NonNegative, Number, Positive, choice, number, whole
from isiw.design import DesignSpace
from isiw.dissertation.regression import FittedCurve
from isiw.lazy import scipy
from isiw.types import FloatArray

Start = Literal["even", "unequal", "random"]

LEAST_AMPLITUDE_MV = 1e-3
"""The amplitude to start from if it is not known and all MEPs are at the floor."""

LEAST_NOISE_MV = 1e-6
"""The noise that a fit without residuals is taken to have."""

MAX_CONDITION = 1e10
"""Condition number of the parameters' information above which it counts as singular."""


def gaussians_mv(isi_ms: FloatArray, parameters: FloatArray) -> FloatArray:
    """A sum of Gaussians."""
    amplitude, mean, sd = (parameters[..., i::3, None] for i in range(3))
    return np.asarray((amplitude * np.exp(-0.5 * ((isi_ms - mean) / sd) ** 2)).sum(axis=-2))


def gradient_mv(isi_ms: FloatArray, parameters: FloatArray) -> FloatArray:
    """Derivatives of a sum of Gaussians with respect to its parameters, shape (t, 3 k)."""
    amplitude, mean, sd = (parameters[i::3] for i in range(3))
    z = (isi_ms[:, None] - mean) / sd
    bell = np.exp(-0.5 * z**2)
    return np.stack((bell, amplitude * bell * z / sd, amplitude * bell * z**2 / sd), axis=-1).reshape(len(isi_ms), -1)


class _Known(NamedTuple):
    """Start values, SDs and bounds of the parameters, each of shape (3 k,)."""

    start: FloatArray
    sd: FloatArray
    low: FloatArray
    high: FloatArray


class _Estimate(NamedTuple):
    """The result of least squares: parameters (3 k,), their covariance, and the noise."""

    parameters: FloatArray
    covariance: FloatArray
    noise_sd_mv: float
    dof: float = math.inf
    trouble: str | None = None
    fitted: bool = True


@dataclass(frozen=True)
class NonlinearRegression(Checked):
    """Least squares of Gaussians, with start values from prior knowledge.

    The text starts the mean at mid-range and takes width and amplitude from prior knowledge (5.4.2), whose values it
    does not give; two Gaussians start a quarter of the window's width to either side of it. Amplitudes are not
    negative, and means stay in the range.

    Args:
        peaks: how many Gaussians, 1 or 2.
        width_ms: width of a window before anything is known [ms]; a Gaussian's SD is a quarter of it. Table 4.1: 108.
        min_width_ms: the narrowest window that is fitted [ms]; Table 4.1 has 60–220, and no bounds.
        max_width_ms: the widest [ms].
        amplitude_mv: amplitude before anything is known [mV]; the text's figures have 0.03–0.3 mV. 0: as much as the
            largest MEP so far, if nothing is known.
        max_evaluations: evaluations after which the search gives up.
        samples: how many curves are drawn from the parameters' asymptotic distribution.
        start: where the search starts: `"even"` as above; `"unequal"`: the second Gaussian with a tenth of the first's
            amplitude, which stays at mid-range; `"random"`: anywhere in the range and with any share of the amplitude,
            drawn again for each fit.
    """

    peaks: Annotated[int, partial(choice, known=(1, 2))] = 1
    width_ms: Number = 108.0
    min_width_ms: Positive = 40.0
    max_width_ms: Number = 250.0
    amplitude_mv: NonNegative = 0.05
    max_evaluations: Count = 100
    samples: Annotated[int, partial(whole, least=2)] = 64
    start: Start = "even"

    def __post_init__(self) -> None:
        super().__post_init__()
        number("NonlinearRegression.width_ms", self.width_ms, least=self.min_width_ms)
        number("NonlinearRegression.max_width_ms", self.max_width_ms, least=self.width_ms, above=self.min_width_ms)

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the Gaussians; see `RegressionMethod`."""
        amplitude_mv = self.amplitude_mv or max(float(excess_mv.max(initial=0.0)), LEAST_AMPLITUDE_MV)
        sd = [amplitude_mv, (space.high_ms - space.low_ms) / math.sqrt(12.0), self.width_ms / 8.0]
        low = [0.0, space.low_ms, 0.25 * self.min_width_ms]
        high = [math.inf, space.high_ms, 0.25 * self.max_width_ms]
        start = np.ravel(self.starts(space, amplitude_mv, rng))
        known = _Known(start, *(np.tile(values, self.peaks) for values in (sd, low, high)))
        estimate = self._least_squares(isi_ms, excess_mv, known)
        values, vectors = np.linalg.eigh(estimate.covariance)
        root = vectors * np.sqrt(values.clip(0.0))
        drawn = estimate.parameters + rng.standard_normal((self.samples, len(root))) @ root.T
        grid = space.grid_ms
        return FittedCurve(
            grid_ms=grid,
            mean_mv=gaussians_mv(grid, estimate.parameters),
            sd_mv=np.linalg.norm(gradient_mv(grid, estimate.parameters) @ root, axis=-1),
            samples_mv=gaussians_mv(grid, np.clip(drawn, known.low, known.high)),
            noise_sd_mv=estimate.noise_sd_mv,
            dof=estimate.dof,
            trouble=estimate.trouble,
            amplitudes_mv=tuple(sorted(estimate.parameters[::3].tolist(), reverse=True)),
            fitted=estimate.fitted,
        )

    def starts(self, space: DesignSpace, amplitude_mv: float, rng: np.random.Generator) -> list[list[float]]:
        """Amplitude [mV], mean and SD [ms] from which the search for each Gaussian starts."""
        middle_ms, sd_ms = 0.5 * (space.low_ms + space.high_ms), self.width_ms / 4.0
        apart_ms = min(sd_ms, 0.25 * (space.high_ms - space.low_ms))  # inside a range that is narrower than a window
        if self.start == "random":
            draws = rng.uniform((0.0, space.low_ms), (amplitude_mv, space.high_ms), (self.peaks, 2)).tolist()
            return [[share_mv, mean_ms, sd_ms] for share_mv, mean_ms in draws]
        if self.peaks == 1:
            return [[amplitude_mv, middle_ms, sd_ms]]
        if self.start == "unequal":
            return [[amplitude_mv, middle_ms, sd_ms], [0.1 * amplitude_mv, middle_ms + apart_ms, sd_ms]]
        return [[amplitude_mv, middle_ms + side * apart_ms, sd_ms] for side in (-1, 1)]

    def _least_squares(self, isi_ms: FloatArray, excess_mv: FloatArray, known: _Known) -> _Estimate:
        """The best parameters and their asymptotic covariance; prior knowledge if the trials do not give them."""
        free = len(isi_ms) - len(known.start)
        if free < 1:
            flat = known.start * np.tile([0.0, 1.0, 1.0], self.peaks)
            trouble = f"{len(isi_ms)} trials do not determine {len(flat)} parameters: a flat curve stands in."
            return _Estimate(flat, np.diag(known.sd**2), float(known.sd[0]), trouble=trouble, fitted=False)

        def residuals_mv(parameters: FloatArray) -> FloatArray:
            return gaussians_mv(isi_ms, parameters) - excess_mv

        found = scipy.optimize.least_squares(
            residuals_mv,
            known.start,
            jac=partial(gradient_mv, isi_ms),
            bounds=(known.low, known.high),
            x_scale=known.sd,
            ftol=1e-6,
            xtol=1e-6,
            max_nfev=self.max_evaluations,
        )
        noise_mv = max(math.sqrt(2.0 * found.cost / free), LEAST_NOISE_MV)
        covariance, doubt = _covariance(gradient_mv(isi_ms, found.x) / noise_mv, known.sd)
        gave_up = f"The fit did not converge in {self.max_evaluations} evaluations: its best curve stands in."
        trouble = " ".join(filter(None, ("" if found.success else gave_up, doubt)))
        return _Estimate(found.x, covariance, noise_mv, free, trouble or None)


def _covariance(gradient: FloatArray, prior_sd: FloatArray) -> tuple[FloatArray, str | None]:
    """Covariance of the parameters from the gradient in noise SDs; what stands in if that is singular."""
    scaled = gradient * prior_sd
    information = scaled.T @ scaled
    trouble = None
    if np.linalg.cond(information) > MAX_CONDITION:
        information = information + np.eye(len(information))
        trouble = "The MEPs do not determine every parameter: what was known before the first trial stands in."
    return np.linalg.inv(information) * np.outer(prior_sd, prior_sd), trouble
