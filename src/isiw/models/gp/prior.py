"""Hyperparameters of the Gaussian process: their prior, the grid on which they are weighed, and the scale of MEPs."""

from __future__ import annotations

import math
import pkgutil
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np

from isiw.checks import Checked, Count, Number, Positive, number
from isiw.errors import InvalidValueError
from isiw.lazy import botorch, gpytorch, torch
from isiw.models.gp.places import Hyperparameters, Places, Tensor, WindowsPrior
from isiw.models.shared.scales import PositiveScale, Scale
from isiw.types import FloatArray

GRID_SD = 2.25
GRID_POINTS = (7, 5, 7)
"""Of length, amplitude and noise, from -GRID_SD to GRID_SD prior SDs."""

LEAST_NOISE = 0.01
"""Noise SDs are at least this share of the unit, so that covariances have a stable Cholesky factor."""


@dataclass(frozen=True)
class HyperparameterPrior(Checked):
    """Log-normal priors, each a median and a log SD without a tail, and the probability of a profile.

    Args:
        length_ms: over which the transformed profile varies [ms]. Windows are 40 to 230 ms wide, which Gaussian
            profiles with SDs of a quarter of that are; logarithms rise and fall within less.
        amplitude: SD of the profile, as a share of the SD of all trials.
        noise: SD of a trial about the profile, as a share of the SD of all trials.
        p_window: probability that the tap changes anything.
    """

    length_ms: PositiveScale = Scale(30.0, 0.5)
    amplitude: PositiveScale = Scale(1.2, 0.3)
    noise: PositiveScale = Scale(0.6, 0.5)
    p_window: Annotated[float, partial(number, above=0, most=1)] = 0.75

    def __post_init__(self) -> None:
        super().__post_init__()
        least = self.noise.median * math.exp(-GRID_SD * self.noise.sd)
        if least < LEAST_NOISE:
            raise InvalidValueError(
                "the prior allows so little noise that covariances become singular",
                got=least,
                expected=f"a median {GRID_SD:g} log SDs above {LEAST_NOISE:g}",
            )

    @property
    def log_hypotheses(self) -> Tensor:
        """Log probability that the tap changes something, and nothing, shape (2,)."""
        return torch.tensor([self.p_window, 1.0 - self.p_window], dtype=torch.float64).log()

    def at(self, z: Tensor) -> Hyperparameters:
        """Hyperparameters some prior SDs from their medians, shape (q, 3)."""
        return Hyperparameters(*(self._medians_and_sds[0] * torch.exp(self._medians_and_sds[1] * z)).unbind(-1))

    def z(self, hyperparameters: Hyperparameters) -> Tensor:
        """Distance of hyperparameters from their medians in prior SDs, shape (q, 3)."""
        medians, sds = self._medians_and_sds
        z: Tensor = (torch.stack(hyperparameters, dim=-1) / medians).log() / sds
        return z

    def grid(self) -> tuple[Hyperparameters, Tensor]:
        """Processes on a grid of equal steps in prior SDs, then those without an amplitude; and their log prior."""
        axes = [torch.linspace(-GRID_SD, GRID_SD, points, dtype=torch.float64) for points in GRID_POINTS]
        present = torch.cartesian_prod(*axes)
        absent = torch.nn.functional.pad(axes[2].unsqueeze(-1), (2, 0))
        shares = [torch.log_softmax(-0.5 * z.square().sum(-1), 0) for z in (present, absent)]
        log_prior = torch.cat([share + log for share, log in zip(shares, self.log_hypotheses, strict=True)])
        processes = self.at(torch.cat((present, absent)))
        has_amplitude = torch.arange(len(log_prior)) < len(present)
        return processes._replace(amplitude=processes.amplitude * has_amplitude), log_prior

    @property
    def _medians_and_sds(self) -> Tensor:
        rows = torch.tensor([self.length_ms, self.amplitude, self.noise], dtype=torch.float64)
        return rows[:, :2].T


@dataclass(frozen=True)
class FixedProcess(Checked):
    """Hyperparameters and a scale that are not learnt.

    Args:
        length_ms: over which the transformed profile varies [ms].
        amplitude: SD of the profile, in units of the scale.
        noise: SD of a trial about it, in units of the scale.
        centre: transformed MEP that is 0 on the scale; the constant is this give or take one unit.
        unit: difference of transformed MEPs that is 1 on the scale.
    """

    length_ms: Positive
    amplitude: Positive
    noise: Positive
    centre: Number
    unit: Positive = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.noise < LEAST_NOISE * self.amplitude:
            raise InvalidValueError(
                "so little noise makes covariances singular", got=self.noise, expected=f"{LEAST_NOISE:g} amplitudes"
            )


KernelName: TypeAlias = Literal["rbf", "matern"]
NoiseKind: TypeAlias = Literal["equal", "by-isi"]
ProfileKind: TypeAlias = Literal["window", "anywhere"]


@dataclass(frozen=True)
class ProcessSettings(Checked):
    """The Gaussian process itself.

    Args:
        kernel: `"rbf"`, the squared exponential, or `"matern"` with smoothness 5/2.
        noise: `"equal"` at all ISIs, or `"by-isi"`. Whether there is a profile at all is judged under equal noise.
        hyperparameters: `"marginalised"` over a grid, or `"map"`, the most likely ones.
        prior: prior of the hyperparameters of profiles that may be anywhere.
        fixed: hyperparameters and scale that are not learnt, for equal noise.
        max_evaluations: evaluations after which the search for the most likely hyperparameters gives up.
        profile: `"window"`: it leaves its constant within one window, which lies where windows can, in the log MEP; or
            `"anywhere"`, in either direction.
        windows: prior of profiles that are a window's.

    Raises:
        InvalidValueError: an unknown choice, fixed hyperparameters with noise that depends on the ISI, or a window's
            profile whose hyperparameters are not averaged over.
    """

    kernel: KernelName = "matern"
    noise: NoiseKind = "equal"
    hyperparameters: Literal["marginalised", "map"] = "marginalised"
    prior: HyperparameterPrior = field(default_factory=HyperparameterPrior)
    fixed: FixedProcess | None = None
    max_evaluations: Count = 150
    profile: ProfileKind = "anywhere"
    windows: WindowsPrior = field(default_factory=WindowsPrior)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.fixed is not None and self.noise != "equal":
            raise InvalidValueError("fixed hyperparameters are of equal noise", got=self.noise, expected="equal")
        if self.profile == "window" and (self.fixed is not None or self.hyperparameters != "marginalised"):
            raise InvalidValueError(
                "the hyperparameters of a window's profile are averaged over",
                got="fixed" if self.fixed is not None else self.hyperparameters,
                expected="marginalised",
                remedy='Set profile to "anywhere", or leave the hyperparameters as they are.',
            )


def correlations(kernel: KernelName, length_ms: Tensor, isi_ms: Tensor) -> Tensor:
    """Correlation of a profile's values at some ISIs, (q, n, n) [Rasmussen2006, equations 4.9 and 4.17]."""
    # As GPyTorch's kernels have it, several times as quickly.
    steps = (isi_ms.unsqueeze(-1) - isi_ms).abs() / length_ms[:, None, None]
    if kernel == "rbf":
        return torch.exp(-0.5 * steps.square())
    steps = math.sqrt(5.0) * steps
    return (1.0 + steps + steps.square() / 3.0) * torch.exp(-steps)


def regression(
    kernel: KernelName,
    process: Hyperparameters,
    level: tuple[Tensor, Tensor],
    isi_ms: Tensor,
    values: Tensor,
    relative_variance: Tensor,
    *,
    places: Places | None = None,
) -> botorch.models.SingleTaskGP:
    """Processes about constants of a mean and a variance, given trials, as a BoTorch model of their batch shape."""
    inputs = isi_ms.unsqueeze(-1).expand(*process.length_ms.shape, -1, 1)
    noise_variance = process.noise.square()
    variance = noise_variance[..., None, None] * relative_variance.unsqueeze(-1)
    mean_module, covar_module = _modules(kernel, process, level, places)
    return botorch.models.SingleTaskGP(
        inputs,
        values.unsqueeze(-1).expand_as(inputs),
        variance if len(values) else None,
        # Without a trial, BoTorch cannot take the next one's noise from theirs.
        likelihood=None if len(values) else _likelihood(noise_variance),
        mean_module=mean_module,
        covar_module=covar_module,
        outcome_transform=None,
    )


def _kernel(name: KernelName, length_ms: Tensor) -> gpytorch.kernels.Kernel:
    # By default GPyTorch's Matérn kernel has a smoothness of 5/2.
    kind = gpytorch.kernels.MaternKernel if name == "matern" else gpytorch.kernels.RBFKernel
    return kind(batch_shape=length_ms.shape).double().initialize(lengthscale=length_ms[..., None, None])


def _modules(
    kernel: KernelName, process: Hyperparameters, level: tuple[Tensor, Tensor], places: Places | None
) -> tuple[Any, Any]:
    """Mean and covariance of processes before the trials, as modules of GPyTorch's."""
    mean, level_variance = level
    shape = process.amplitude.shape
    profile = gpytorch.kernels.ScaleKernel(_kernel(kernel, process.length_ms), batch_shape=shape).double()
    profile = profile.initialize(outputscale=process.amplitude.square())
    constant = gpytorch.kernels.ConstantKernel(batch_shape=shape).double().initialize(constant=level_variance)
    flat = gpytorch.means.ConstantMean(batch_shape=mean.shape).double().initialize(constant=mean)
    if places is None:
        return flat, profile + constant
    # Their classes are GPyTorch's, which is imported only when it is used.
    risen, within = (pkgutil.resolve_name(f"isiw.models.gp.modules:{name}") for name in ("RisenMean", "WithinWindow"))
    return risen(flat, places), within(profile, places) + constant


def _likelihood(noise_variance: Tensor) -> gpytorch.likelihoods.GaussianLikelihood:
    likelihood = gpytorch.likelihoods.GaussianLikelihood(
        batch_shape=noise_variance.shape, noise_constraint=gpytorch.constraints.Positive()
    ).double()
    return likelihood.initialize(noise=noise_variance.unsqueeze(-1))


Transform: TypeAlias = Literal["log", "sqrt", "none"]

LOG_SCALE_MV = 0.012
"""The floor of an amplitude is this give or take a factor of e, where windows' profiles are on a scale of their own
[mV]."""

USUAL_MEP_MV = 0.02
"""About so large amplitudes are taken to be before the first trial [mV]."""

USUAL_SPREAD: dict[Transform, float] = {"log": 1.0, "sqrt": 0.5, "none": 1.0}
"""SD of transformed amplitudes over ISIs and trials: of the log [nat], or as a share of their mean."""


@dataclass(frozen=True)
class Standardisation:
    """Standardisation of transformed amplitudes, by the centre that becomes 0 and the difference that becomes 1."""

    transform: Transform
    least_mv: float  # smaller amplitudes are taken for it, so that 0 has a logarithm
    centre: float
    unit: float

    def standardised(self, mep_mv: FloatArray) -> Tensor:
        """Amplitudes [mV] on this scale, same shape."""
        return torch.as_tensor((transformed(mep_mv, self.transform, self.least_mv) - self.centre) / self.unit)

    def log_jacobian(self, mep_mv: FloatArray) -> float:
        """The term that makes a log density on this scale one of log amplitudes [nat], summed over them."""
        power = {"log": 0.0, "sqrt": 0.5, "none": 1.0}[self.transform]
        log_mep = np.log(np.maximum(mep_mv, self.least_mv))
        return float(power * log_mep.sum() + len(mep_mv) * math.log((power or 1.0) / self.unit))


def transformed(mep_mv: FloatArray, transform: Transform, least_mv: float) -> FloatArray:
    """Transformed amplitudes, same shape."""
    known = np.maximum(mep_mv, least_mv)
    if transform == "none":
        return known
    return np.log(known) if transform == "log" else np.sqrt(known)


def scale_of(mep_mv: FloatArray, transform: Transform, least_mv: float) -> Standardisation:
    """The scale of mean 0 and SD 1, as if one more amplitude had the usual spread, which keeps equal ones apart."""
    values = transformed(mep_mv if len(mep_mv) else np.array([USUAL_MEP_MV]), transform, least_mv)
    centre = float(values.mean())
    usual = USUAL_SPREAD[transform] * (1.0 if transform == "log" else centre)
    return Standardisation(
        transform, least_mv, centre, math.sqrt((usual**2 + ((values - centre) ** 2).sum()) / len(values))
    )


def expected_mep_mv(level: Tensor, noise_sd: Tensor, transform: Transform) -> Tensor:
    """Expected MEP [mV] if transformed MEPs are Gaussian, broadcast shape."""
    if transform == "log":
        return torch.exp(level + 0.5 * noise_sd.square())
    # A path may run below zero where amplitudes do not.
    positive = level.clamp_min(0.0)
    return positive.square() + noise_sd.square() if transform == "sqrt" else positive
