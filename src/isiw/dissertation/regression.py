"""Regression of the MEP on the ISI, again after each trial, as NR, SVMR and GPR share it; and the latter two [Kim2020].

The window is where the curve that is fitted above the floor has at least 0.135 of its maximum (4.3). With kernels, GPR
has one noise for all ISIs, and SVMR support vectors; `isiw.models.gp` is what one would choose today.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import Annotated, Any, Final, Literal, Protocol

import numpy as np
from threadpoolctl import ThreadpoolController

from isiw.checks import Checked, Count, NonNegative, Number, Positive, number, whole
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.excess import EDGE_LEVEL, least_excess_mv
from isiw.lazy import scipy, sklearn
from isiw.models.protocol import Observation
from isiw.models.shared.history import AmplitudeHistory, FloorTreatment, OfAmplitudes
from isiw.types import Array, BoolArray, FloatArray, IntArray, Singles
from isiw.window import Window

Segments = Literal["peak", "all"]


@dataclass(frozen=True, eq=False)
class FittedCurve:
    """The expected MEP above the floor, by ISI, as one fit has it."""

    grid_ms: FloatArray
    mean_mv: FloatArray
    sd_mv: FloatArray  # standard error of the curve
    samples_mv: FloatArray  # curves that would fit as well, (s, t)
    noise_sd_mv: float  # SD of one MEP about the curve
    dof: float = math.inf  # of that SD
    trouble: str | None = None  # and what stands in, in sentences
    amplitudes_mv: tuple[float, ...] = ()  # of its Gaussians, largest first
    fitted: bool = True  # else a curve stands in that says nothing of a window

    def confidence_mv(self, level: float) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the expected MEP with this confidence [mV], each shape (t,)."""
        return self._about_mean(self.sd_mv, level)

    def prediction_mv(self, level: float) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the next MEP with this probability [mV], each shape (t,)."""
        return self._about_mean(np.hypot(self.sd_mv, self.noise_sd_mv), level)

    def _about_mean(self, sd_mv: FloatArray, level: float) -> tuple[FloatArray, FloatArray]:
        reach = float(scipy.special.stdtrit(self.dof, 0.5 + 0.5 * level)) * sd_mv
        return self.mean_mv - reach, self.mean_mv + reach


def curve_masks(
    curves_mv: FloatArray, floor_mv: float, segments: Segments = "peak", level: float = EDGE_LEVEL
) -> BoolArray:
    """Which grid points lie in the windows of some curves, by the rule of `isiw.excess.window_from_excess`."""
    peak = curves_mv.max(axis=-1, keepdims=True)
    masks: BoolArray = curves_mv >= least_excess_mv(peak, floor_mv, level)
    if segments == "all":
        return masks
    gaps_before = (~masks).cumsum(axis=-1)
    at_peak = np.take_along_axis(gaps_before, curves_mv.argmax(axis=-1)[..., None], axis=-1)
    return np.asarray(masks & (gaps_before == at_peak))


OUTCOMES = 24
"""Values of the next MEP on which predictive distributions live."""


class RegressionMethod(Protocol):
    """A settings object that fits a curve."""

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the MEPs of one person; a fit that fails says so and answers with what stands in for it."""


@dataclass(frozen=True)
class RegressionModel(Checked):
    """A regression as a model: fits all trials again after each.

    Args:
        method: what fits the curve.
        floor: what is subtracted before.
        segments: if the curve crosses its edges' level more than twice: the window is `"all"` that lies above it,
            or the segment that holds the `"peak"`, since a single distribution is expected (4.2.1, 5.4.1).
    """

    method: RegressionMethod = field(metadata={"spread": True})
    floor: FloorTreatment = field(default_factory=FloorTreatment, metadata={"spread": True})
    segments: Segments = "peak"

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> RegressionPosterior:
        """The posterior before the first trial."""
        return self._fitted(space, seed, AmplitudeHistory.nothing(people))

    def update(self, posterior: RegressionPosterior, observation: Observation) -> RegressionPosterior:
        """The posterior after one more trial."""
        return self._fitted(posterior.space, posterior.seed, posterior.told.appended(observation))

    def _fitted(self, space: DesignSpace, seed: int, told: AmplitudeHistory) -> RegressionPosterior:
        people = [told.person(person) for person in range(told.people)]
        rng = np.random.default_rng([seed, told.trials])
        floors_mv = np.array([self.floor.level_mv(one) for one in people])
        curves = tuple(
            self.method.fit(one.isi_ms, self.floor.excess_mv(one.mep_mv, floor_mv), space, rng)
            for one, floor_mv in zip(people, floors_mv, strict=True)
        )
        return RegressionPosterior(self, space, seed, told, curves, floors_mv)


@dataclass(frozen=True, eq=False)
class RegressionPosterior(OfAmplitudes):
    """The curve that was fitted to the trials of each of b people, and the floor that it is above [mV], shape (b,)."""

    model: RegressionModel
    space: DesignSpace
    seed: int
    told: AmplitudeHistory
    curves: tuple[FittedCurve, ...]
    floors_mv: FloatArray

    @property
    def trouble(self) -> str | None:
        """The trouble of the last fits; see `ReportsTrouble`."""
        return " ".join(dict.fromkeys(curve.trouble for curve in self.curves if curve.trouble)) or None

    @cached_property
    def _samples_mv(self) -> Singles:
        """Sampled curves above the floor, shape (b, s, t)."""
        return np.stack([curve.samples_mv for curve in self.curves], dtype=np.float32, casting="same_kind")

    @cached_property
    def _masks(self) -> Singles:
        """Their windows as 0 or 1, shape (b, s, t)."""
        pairs = zip(self.curves, self.floors_mv, strict=True)
        masks = [curve_masks(curve.samples_mv, floor_mv, self.model.segments) for curve, floor_mv in pairs]
        return np.stack(masks).astype(np.float32)

    def _nearest(self, isi_ms: Array) -> IntArray:
        """Indices of the nearest grid points, shape (t,)."""
        nearest: IntArray = np.abs(isi_ms[:, None] - self.space.grid_ms.astype(isi_ms.dtype)).argmin(-1)
        return nearest

    def window_masks(self, isi_ms: Array) -> Singles:
        """Sampled windows; see `SamplesWindows`."""
        return self._masks[..., self._nearest(isi_ms)]

    def profiles_mv(self, isi_ms: Array) -> Singles:
        """Sampled profiles; see `SamplesProfiles`."""
        return self._samples_mv[..., self._nearest(isi_ms)] + self.baselines_mv()[..., None]

    def baselines_mv(self) -> Singles:
        """The floor, which a fit does not sample; see `SamplesProfiles`."""
        return np.broadcast_to(self.floors_mv.astype(np.float32)[:, None], self._samples_mv.shape[:2])

    def outcome_mass(self, isi_ms: Array) -> Singles:
        """Gaussian predictions about each sampled curve; see `PredictsOutcomes`."""
        expected = self._samples_mv[..., self._nearest(isi_ms), None]
        noise = np.array([curve.noise_sd_mv for curve in self.curves], dtype=np.float32)[:, None, None, None]
        low, high = expected.min((1, 2, 3), keepdims=True), expected.max((1, 2, 3), keepdims=True)
        share = np.linspace(0.0, 1.0, OUTCOMES, dtype=np.float32)
        values = (low - 3.0 * noise) + share * (high - low + 6.0 * noise)
        # Noise finer than the grid of values would fall between two of them.
        spread = np.maximum(np.maximum(noise, np.diff(values, axis=-1)[..., :1]), 1e-9)
        mass: Singles = scipy.special.softmax(-0.5 * np.square((values - expected) / spread), axis=-1)
        return mass

    def condition(self, isi_ms: Array, mep_mv: Array) -> RegressionPosterior:
        """The fit with an imagined trial as well; see `Conditions`."""
        return self.model.update(self, Observation.of(isi_ms, mep_mv))

    def prediction_mv(self, level: float = 0.95, person: int = 0) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the next MEP with this probability [mV], at each ISI of the grid (4.3)."""
        low, high = self.curves[person].prediction_mv(level)
        return low + self.floors_mv[person], high + self.floors_mv[person]

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person; there is no answer yet if no curve is fitted."""
        if not self.curves[person].fitted:
            return WindowEstimate(probability=None, window=None)
        curve, floor_mv = self.curves[person], float(self.floors_mv[person])
        low, high = curve.confidence_mv(0.9)
        return WindowEstimate(
            probability=None,
            window=Window.from_mask(curve.grid_ms, curve_masks(curve.mean_mv[None], floor_mv, self.model.segments)[0]),
            grid_ms=curve.grid_ms,
            profile_quantiles_mv=np.stack((low, curve.mean_mv, high)) + floor_mv,
        )


LEAST_SCALE_MV = 1e-3
"""Amplitudes are fitted in units of the largest excess, or of this if that is smaller [mV]."""

SUPPORT_MS = 5.0
"""Distance of the ISIs at which curves are drawn; the kernel is smooth in between."""


@dataclass(frozen=True)
class GaussianProcessRegression(Checked):
    """scikit-learn's Gaussian process with a squared-exponential kernel and white noise, about the floor.

    The text gives neither kernel nor hyperparameters, only that the covariance is near 1 for close ISIs and 0 for
    distant ones, which the kernel is. Signal and noise variance, and the length, maximise the marginal likelihood.

    Args:
        length_ms: the kernel's length where the search for it starts [ms].
        min_length_ms: shortest length that is searched [ms].
        max_length_ms: longest length that is searched [ms].
        noise: noise SD where the search starts, as a share of the largest excess.
        max_fit_iterations: iterations after which the search gives up.
        samples: how many curves are drawn.
    """

    length_ms: Number = 40.0
    min_length_ms: Positive = 25.0
    max_length_ms: Number = 100.0
    noise: Annotated[float, partial(number, above=0, below=1)] = 0.3
    max_fit_iterations: Count = 40
    samples: Annotated[int, partial(whole, least=2)] = 64

    def __post_init__(self) -> None:
        super().__post_init__()
        number("GaussianProcessRegression.length_ms", self.length_ms, least=self.min_length_ms)
        number("GaussianProcessRegression.max_length_ms", self.max_length_ms, least=self.length_ms)

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the Gaussian process; see `RegressionMethod`."""
        scale_mv = max(float(np.abs(excess_mv).max(initial=0.0)), LEAST_SCALE_MV)
        grid = space.grid_ms
        support = np.linspace(space.low_ms, space.high_ms, round((space.high_ms - space.low_ms) / SUPPORT_MS) + 1)
        # Matrices this small gain nothing from several threads, and lose a lot if the machine is busy.
        with _blas().limit(limits=1, user_api="blas"):
            process, noise, trouble = self._process(isi_ms[:, None], excess_mv / scale_mv)
            mean, covariance = process.predict(support[:, None], return_cov=True)
            values, vectors = np.linalg.eigh(covariance - noise**2 * np.eye(len(support)))
            drawn = mean + rng.standard_normal((self.samples, len(support))) @ (vectors * np.sqrt(values.clip(0.0))).T
            mean, sd = process.predict(grid[:, None], return_std=True)
        return FittedCurve(
            grid_ms=grid,
            mean_mv=mean * scale_mv,
            sd_mv=np.sqrt((sd**2 - noise**2).clip(0.0)) * scale_mv,
            samples_mv=np.stack([np.interp(grid, support, curve) for curve in drawn]) * scale_mv,
            noise_sd_mv=noise * scale_mv,
            trouble=trouble,
            fitted=len(isi_ms) > 0,
        )

    def _process(self, isi: FloatArray, scaled: FloatArray) -> tuple[Any, float, str | None]:
        """The process at its best hyperparameters, its noise SD, and what went wrong."""
        signal = sklearn.gaussian_process.kernels.ConstantKernel(1.0, (0.01, 10.0))
        kernel = signal * sklearn.gaussian_process.kernels.RBF(
            self.length_ms, (self.min_length_ms, self.max_length_ms)
        ) + sklearn.gaussian_process.kernels.WhiteKernel(self.noise**2, (1e-4, 1.0))
        process = sklearn.gaussian_process.GaussianProcessRegressor(kernel, optimizer=None)
        if not len(isi):
            return process, self.noise, "There are no trials to fit yet: the Gaussian process before any stands in."
        process.fit(isi, scaled)
        found = scipy.optimize.minimize(
            partial(_cost, process),
            kernel.theta,
            jac=True,
            method="L-BFGS-B",
            bounds=kernel.bounds,
            options={"maxiter": self.max_fit_iterations, "ftol": 1e-5},
        )
        process = sklearn.gaussian_process.GaussianProcessRegressor(
            kernel.clone_with_theta(found.x), optimizer=None
        ).fit(isi, scaled)
        gave_up = f"The kernel did not converge in {self.max_fit_iterations} iterations: its best parameters stand in."
        return process, math.exp(0.5 * found.x[-1]), None if found.success else gave_up


_blas: Final = cache(ThreadpoolController)
"""The controller of the libraries that are loaded at its first call; looking for them takes longer than a fit."""


def _cost(process: Any, theta: FloatArray) -> tuple[float, FloatArray]:
    value, gradient = process.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False)
    return -float(value), -gradient


@dataclass(frozen=True)
class SupportVectorRegression(Checked):
    """scikit-learn's SVR, and a committee of it on bootstrapped trials.

    A support vector regression has no uncertainty of its own: the spread of the committee stands in for it. The text
    gives no hyperparameters.

    Args:
        c: cost of a residual, per MEP.
        epsilon: residual that costs nothing, as a share of the largest excess.
        length_ms: SD of the kernel [ms]; scikit-learn's gamma is 1 / (2 length²).
        committee: how many regressions on bootstrapped trials.
    """

    c: Positive = 1.0
    epsilon: NonNegative = 0.1
    length_ms: Positive = 50.0
    committee: Annotated[int, partial(whole, least=2)] = 10

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the regression and its committee; see `RegressionMethod`."""
        grid = space.grid_ms
        if not len(isi_ms):
            flat = np.zeros(len(grid))
            trouble = "There are no trials to fit yet: a flat curve stands in."
            return FittedCurve(grid, flat, flat, np.tile(flat, (self.committee, 1)), 0.0, trouble=trouble, fitted=False)
        scale_mv = max(float(np.abs(excess_mv).max()), LEAST_SCALE_MV)
        regression = sklearn.svm.SVR(C=self.c, epsilon=self.epsilon, gamma=0.5 / self.length_ms**2)
        isi, scaled = isi_ms[:, None], excess_mv / scale_mv
        picks = rng.integers(len(isi), size=(self.committee, len(isi)))
        members_mv = np.stack([regression.fit(isi[i], scaled[i]).predict(grid[:, None]) for i in picks]) * scale_mv
        regression.fit(isi, scaled)
        return FittedCurve(
            grid_ms=grid,
            mean_mv=regression.predict(grid[:, None]) * scale_mv,
            sd_mv=members_mv.std(axis=0),
            samples_mv=members_mv,
            noise_sd_mv=float(np.sqrt(np.mean((regression.predict(isi) - scaled) ** 2))) * scale_mv,
        )
