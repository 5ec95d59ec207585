"""Hyperparameters of the Gaussian process, and how well each of a few of them explains the trials.

The transformed MEP is a constant, a Gaussian process of the ISI, and Gaussian noise; trials of TMS alone are constant
and noise. Two hypotheses share that prior: the process has an amplitude, or it has none and the tap changes nothing.
Their hyperparameters lie on a grid of equal steps in prior SDs, weighted by prior times marginal likelihood (Rasmussen
and Williams, Gaussian Processes for Machine Learning, 2006, equation 2.30). So the probability that there is a profile
at all is a ratio of marginal likelihoods, in which a process that could explain anything pays for it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import torch
from botorch.models import SingleTaskGP
from gpytorch.constraints import Positive
from gpytorch.kernels import ConstantKernel, Kernel, MaternKernel, RBFKernel, ScaleKernel
from gpytorch.likelihoods import GaussianLikelihood
from gpytorch.means import ConstantMean
from scipy.optimize import minimize

from isiw.errors import InvalidValueError
from isiw.models.gp_noise import EQUAL_NOISE, NoiseProfile, leave_one_out, noise_profile
from isiw.models.gp_scale import Scale
from isiw.models.protocol import Tensor
from isiw.models.told import PersonTrials
from isiw.types import FloatArray

__all__ = ["Fit", "FixedProcess", "Hyperparameters", "HyperparameterPrior", "KernelName", "Trials", "fit", "fixed_fit"]

KernelName: TypeAlias = Literal["rbf", "matern"]

GRID_SD = 2.25
GRID_POINTS = (7, 5, 7)
"""Of length, amplitude and noise, from -GRID_SD to GRID_SD prior SDs."""


MAX_EVALUATIONS = 150

LEAST_NOISE = 0.01
"""Noise SDs are at least this share of the unit, so that covariances have a stable Cholesky factor."""

LEVEL_SD = 1.0
"""Prior SD of the constant about the mean of all trials, in standardised units."""


class Hyperparameters(NamedTuple):
    """Of q processes, amplitudes and noise in standardised units, shape (q,).

    Args:
        length_ms: over which the profile varies [ms].
        amplitude: SD of the profile; 0 where a tap changes nothing.
        noise: SD of a trial about the profile, where the relative noise variance is 1.
    """

    length_ms: Tensor
    amplitude: Tensor
    noise: Tensor

    def picked(self, picks: Tensor) -> Hyperparameters:
        """Some of them."""
        return Hyperparameters(*(field[picks] for field in self))


@dataclass(frozen=True)
class HyperparameterPrior:
    """Log-normal priors, each a median and a log SD, and the probability of a profile.

    Args:
        length_ms: over which the transformed profile varies [ms]. Windows are 40 to 230 ms wide, which Gaussian
            profiles with SDs of a quarter of that are; their logarithm varies faster at the flanks.
        amplitude: SD of the profile, as a share of the SD of all trials.
        noise: SD of a trial about the profile, as a share of the SD of all trials.
        p_window: probability that the tap changes anything.
    """

    length_ms: tuple[float, float] = (40.0, 0.5)
    amplitude: tuple[float, float] = (1.2, 0.3)
    noise: tuple[float, float] = (0.6, 0.5)
    p_window: float = 0.75

    def __post_init__(self) -> None:
        for name in ("length_ms", "amplitude", "noise"):
            pair = getattr(self, name)
            if len(pair) != 2 or not all(math.isfinite(x) and x > 0 for x in pair):
                raise InvalidValueError(f"{name} is a median and a log SD, both positive", got=pair)
            object.__setattr__(self, name, (float(pair[0]), float(pair[1])))
        if not 0.0 < self.p_window <= 1.0:
            raise InvalidValueError("p_window is a probability above 0", got=self.p_window)
        least = self.noise[0] * math.exp(-GRID_SD * self.noise[1])
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
        """How many prior SDs from their medians hyperparameters are, shape (q, 3)."""
        medians, sds = self._medians_and_sds
        return (torch.stack(hyperparameters, dim=-1) / medians).log() / sds

    @property
    def _medians_and_sds(self) -> Tensor:
        return torch.tensor([self.length_ms, self.amplitude, self.noise], dtype=torch.float64).T


@dataclass(frozen=True)
class FixedProcess:
    """Hyperparameters and a scale that are not learnt.

    Args:
        length_ms: over which the transformed profile varies [ms].
        amplitude: SD of the profile, in units of the scale.
        noise: SD of a trial about it, in units of the scale.
        centre: transformed MEP that is 0 on the scale; the constant is this give or take one unit.
        unit: difference of transformed MEPs that is 1 on the scale.

    Raises:
        InvalidValueError: a number that is not finite or not positive, or too little noise.
    """

    length_ms: float
    amplitude: float
    noise: float
    centre: float
    unit: float = 1.0

    def __post_init__(self) -> None:
        positive = (self.length_ms, self.amplitude, self.noise, self.unit)
        if not all(math.isfinite(x) and x > 0 for x in positive) or not math.isfinite(self.centre):
            raise InvalidValueError("length, amplitude, noise and unit are positive, the centre finite", got=self)
        if self.noise < LEAST_NOISE * self.amplitude:
            raise InvalidValueError(
                "so little noise makes covariances singular", got=self.noise, expected=f"{LEAST_NOISE:g} amplitudes"
            )


class Trials(NamedTuple):
    """Trials of one person on a scale: ISIs [ms], standardised MEPs, those of TMS alone; shapes (n,), (n,), (m,)."""

    isi_ms: Tensor
    values: Tensor
    alone: Tensor


@dataclass(frozen=True, eq=False)
class Fit:
    """A few processes, and how believable each is.

    Args:
        prior: of the hyperparameters.
        kernel: the kernel's name.
        scale: the scale of amplitudes.
        told: the trials as told.
        processes: the hyperparameters, shape (q,).
        log_prior: what each one's log marginal likelihood is added to, shape (q,).
        noise: how the noise depends on the ISI.
        trouble: what went wrong, and what stands in for it.
    """

    prior: HyperparameterPrior
    kernel: KernelName
    scale: Scale
    told: PersonTrials
    processes: Hyperparameters
    log_prior: Tensor
    noise: NoiseProfile = EQUAL_NOISE
    trouble: str | None = None

    @cached_property
    def trials(self) -> Trials:
        """The trials on the scale of the process."""
        told, scaled = self.told, self.scale.standardised
        return Trials(torch.as_tensor(told.isi_ms), scaled(told.mep_mv), scaled(told.baseline_mv))

    @cached_property
    def log_joint(self) -> Tensor:
        """Log prior and log marginal likelihood of each process, shape (q,)."""
        return self.log_prior + self.log_marginal(self.processes, self.noise.log_variance(self.trials.isi_ms))

    @property
    def log_evidence(self) -> float:
        """Log marginal likelihood of the trials, as a density of log amplitudes [nat]."""
        told = np.concatenate((self.told.mep_mv, self.told.baseline_mv))
        return float(self.log_joint.logsumexp(0)) + self.scale.log_jacobian(told)

    @property
    def log_totals(self) -> Tensor:
        """Log joint probability of the trials and of "the tap changes something", and "nothing", shape (2,)."""
        present = self.processes.amplitude > 0
        return torch.stack([self.log_joint[which].logsumexp(0) for which in (present, ~present)])

    @property
    def best(self) -> int:
        """The most believable process that has an amplitude."""
        return int(torch.where(self.processes.amplitude > 0, self.log_joint, -torch.inf).argmax())

    def log_marginal(self, processes: Hyperparameters, log_variance: Tensor) -> Tensor:
        """Log marginal likelihood of the standardised trials, shape (q,); -inf where their covariance is singular.

        Args:
            processes: hyperparameters, shape (q,).
            log_variance: relative log variance of the noise at the trials, shape (n,).
        """
        values = torch.cat((self.trials.values, self.trials.alone))
        factor, failed = torch.linalg.cholesky_ex(self._covariance(processes, log_variance))
        white = torch.linalg.solve_triangular(factor, values.unsqueeze(-1), upper=False).squeeze(-1)
        log_density = -0.5 * white.square().sum(-1) - factor.diagonal(dim1=-2, dim2=-1).log().sum(-1)
        constant = 0.5 * len(values) * math.log(2 * math.pi)
        return torch.where(failed == 0, log_density - constant, -torch.inf).nan_to_num(-torch.inf)

    def _covariance(self, processes: Hyperparameters, log_variance: Tensor) -> Tensor:
        """Of all values, those of TMS alone behind the others, shape (q, n + m, n + m)."""
        trials = self.trials
        lengths, which = processes.length_ms.unique(return_inverse=True)
        isi_ms = trials.isi_ms.unsqueeze(-1)
        correlation = _kernel(self.kernel, lengths)(isi_ms).to_dense().detach()[which]
        padded = torch.nn.functional.pad(correlation, (0, len(trials.alone)) * 2)
        shared = LEVEL_SD**2 + processes.amplitude.square()[:, None, None] * padded
        # Where a tap changes nothing, it does not change the noise either.
        changed = log_variance * (processes.amplitude > 0).unsqueeze(-1)
        log_relative = torch.nn.functional.pad(changed, (0, len(trials.alone)))
        return shared + torch.diag_embed(processes.noise.square().unsqueeze(-1) * log_relative.exp())

    def surprise(self, log_variance: Tensor) -> Tensor:
        """Leave-one-out residuals of the trials with a tap under the best process [SD], shape (n,)."""
        best = self.processes.picked(torch.tensor([self.best]))
        values = torch.cat((self.trials.values, self.trials.alone))
        return leave_one_out(self._covariance(best, log_variance)[0], values)[: len(log_variance)]

    def level(self, noise: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and variance of the constant given the trials of TMS alone, of the shape of their noise SD."""
        alone = self.trials.alone
        variance = 1.0 / (LEVEL_SD**-2 + len(alone) / noise.square())
        return variance * alone.sum() / noise.square(), variance

    def conditioned(self, told: PersonTrials) -> Fit:
        """The same processes on other trials; their hyperparameters, scale and noise profile stay."""
        return _sound(replace(self, told=told))

    def regression(self, picks: Tensor) -> SingleTaskGP:
        """Some of the processes as BoTorch models, from ISIs [ms] to standardised MEPs.

        Args:
            picks: which, each with an amplitude; of the models' batch shape.
        """
        chosen, trials = self.processes.picked(picks), self.trials
        level, level_variance = self.level(chosen.noise)
        isi_ms = trials.isi_ms.unsqueeze(-1).expand(*picks.shape, -1, 1)
        relative = self.noise.log_variance(trials.isi_ms).exp().unsqueeze(-1)
        # Without any trial BoTorch cannot tell the noise of the next one from theirs.
        untold = None if len(trials.isi_ms) else _likelihood(chosen.noise)
        return SingleTaskGP(
            isi_ms,
            trials.values.unsqueeze(-1).expand_as(isi_ms),
            None if untold else chosen.noise.square()[..., None, None] * relative,
            likelihood=untold,
            mean_module=_mean(level),
            covar_module=_with_level(_kernel(self.kernel, chosen.length_ms), chosen.amplitude, level_variance),
            outcome_transform=None,
        )


def fit(
    prior: HyperparameterPrior,
    kernel: KernelName,
    scale: Scale,
    told: PersonTrials,
    *,
    marginalised: bool = True,
    noise_by_isi: bool = False,
) -> Fit:
    """Weigh processes by one person's trials.

    Args:
        prior: of the hyperparameters.
        kernel: the kernel's name.
        scale: the scale of amplitudes.
        told: the trials.
        marginalised: all of the grid; else the most likely process stands for all that have an amplitude.
        noise_by_isi: whether the noise depends on the ISI.
    """
    found = _sound(Fit(prior, kernel, scale, told, *_grid(prior)))
    if found.trouble:
        return found
    if noise_by_isi and len(told.isi_ms):
        profile = noise_profile(found.trials.isi_ms, found.surprise)
        found = _with_same_totals(found, replace(found, noise=profile))
    return found if marginalised else _most_likely(found)


def fixed_fit(prior: HyperparameterPrior, kernel: KernelName, scale: Scale, told: PersonTrials, fixed: FixedProcess) -> Fit:
    """One process of given hyperparameters, and the same without an amplitude."""
    present = torch.tensor([[fixed.length_ms, fixed.amplitude, fixed.noise]], dtype=torch.float64)
    both = torch.cat((present, present * torch.tensor([1.0, 0.0, 1.0])))
    return _sound(Fit(prior, kernel, scale, told, Hyperparameters(*both.unbind(-1)), prior.log_hypotheses))


def _grid(prior: HyperparameterPrior) -> tuple[Hyperparameters, Tensor]:
    """Processes on a grid of equal steps in prior SDs, then those without an amplitude; and their log prior."""
    axes = [torch.linspace(-GRID_SD, GRID_SD, points, dtype=torch.float64) for points in GRID_POINTS]
    present = torch.cartesian_prod(*axes)
    absent = torch.nn.functional.pad(axes[2].unsqueeze(-1), (2, 0))
    shares = [torch.log_softmax(-0.5 * z.square().sum(-1), 0) for z in (present, absent)]
    log_prior = torch.cat([share + log for share, log in zip(shares, prior.log_hypotheses, strict=True)])
    processes = prior.at(torch.cat((present, absent)))
    return processes._replace(amplitude=processes.amplitude * (torch.arange(len(log_prior)) < len(present))), log_prior


def _sound(found: Fit) -> Fit:
    """The fit, or the prior's medians where none of its processes has a likelihood."""
    if bool(found.log_joint.isfinite().any()):
        return found
    medians = found.prior.at(torch.zeros((2, 3), dtype=torch.float64))
    return replace(
        found,
        processes=medians._replace(amplitude=medians.amplitude * torch.tensor([1.0, 0.0])),
        log_prior=found.prior.log_hypotheses,
        noise=EQUAL_NOISE,
        trouble="The covariance of the trials is singular under all hyperparameters. "
        "The medians of their priors, with the same noise at all ISIs, stand in for them.",
    )


def _most_likely(found: Fit) -> Fit:
    """The most likely process in place of all that have an amplitude, and as believable as they are together."""
    log_variance = found.noise.log_variance(found.trials.isi_ms)

    def loss(z: FloatArray) -> float:
        point = torch.as_tensor(z).unsqueeze(0)
        return float(0.5 * point.square().sum() - found.log_marginal(found.prior.at(point), log_variance)[0])

    start = found.prior.z(found.processes.picked(torch.tensor([found.best])))[0]
    simplex = start + torch.nn.functional.pad(0.5 * torch.eye(3), (0, 0, 1, 0))
    options = {"initial_simplex": simplex.numpy(), "xatol": 0.05, "fatol": 0.02, "maxfev": MAX_EVALUATIONS}
    result = minimize(loss, start.numpy(), method="Nelder-Mead", options=options)
    trouble = None
    if not result.success:
        trouble = (
            f"The search for the most likely hyperparameters has not ended after {MAX_EVALUATIONS} evaluations. "
            "The best ones that it met stand in for them."
        )
    flat = torch.where(found.processes.amplitude == 0, found.log_joint, -torch.inf).argmax()
    chosen = (found.prior.at(torch.as_tensor(result.x).unsqueeze(0)), found.processes.picked(flat.unsqueeze(0)))
    processes = Hyperparameters(*(torch.cat(pair) for pair in zip(*chosen, strict=True)))
    return _with_same_totals(found, replace(found, processes=processes, log_prior=torch.zeros(2), trouble=trouble))


def _with_same_totals(before: Fit, after: Fit) -> Fit:
    """Another fit, in which "the tap changes something" and "nothing" are as believable together as they were."""
    totals = before.log_totals - after.log_totals
    return _sound(replace(after, log_prior=after.log_prior + torch.where(after.processes.amplitude > 0, *totals)))


def _kernel(name: KernelName, length_ms: Tensor) -> Kernel:
    """Kernels of unit variance, one a length [ms], shape (l,)."""
    batch = length_ms.shape
    kernel = MaternKernel(nu=2.5, batch_shape=batch) if name == "matern" else RBFKernel(batch_shape=batch)
    return kernel.double().initialize(lengthscale=length_ms[..., None, None])


def _with_level(kernel: Kernel, amplitude: Tensor, level_variance: Tensor) -> Kernel:
    """The covariance of profiles about an uncertain constant; amplitudes and variances of shape (k,)."""
    profile = ScaleKernel(kernel, batch_shape=amplitude.shape).double().initialize(outputscale=amplitude.square())
    constant = ConstantKernel(batch_shape=amplitude.shape).double()
    return profile + constant.initialize(constant=level_variance)


def _mean(level: Tensor) -> ConstantMean:
    """Constant means, shape (k,)."""
    return ConstantMean(batch_shape=level.shape).double().initialize(constant=level)


def _likelihood(noise: Tensor) -> GaussianLikelihood:
    """Of Gaussian noise with these SDs, shape (k,)."""
    likelihood = GaussianLikelihood(batch_shape=noise.shape, noise_constraint=Positive()).double()
    return likelihood.initialize(noise=noise.square().unsqueeze(-1))
