"""Gaussian processes as BoTorch models, with kernels from GPyTorch."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

from isiw.lazy import botorch, gpytorch
from isiw.models.protocol import Tensor

KernelName: TypeAlias = Literal["rbf", "matern"]


class Process(NamedTuple):
    """Processes about an uncertain constant, fields of shape (...).

    Args:
        length_ms: over which the profile varies [ms].
        amplitude: SD of the profile.
        level: mean of the constant.
        level_variance: its variance.
        noise_variance: variance of a trial about the profile, where the relative variance is 1.
    """

    length_ms: Tensor
    amplitude: Tensor
    level: Tensor
    level_variance: Tensor
    noise_variance: Tensor


def correlations(kernel: KernelName, length_ms: Tensor, isi_ms: Tensor) -> Tensor:
    """Correlation of a profile's values at some ISIs."""
    matrices: Tensor = _kernel(kernel, length_ms)(isi_ms.unsqueeze(-1)).to_dense().detach()
    return matrices


def regression(
    kernel: KernelName, process: Process, isi_ms: Tensor, values: Tensor, relative_variance: Tensor
) -> botorch.models.SingleTaskGP:
    """Processes given some trials, as a BoTorch model whose batch shape is theirs."""
    inputs = isi_ms.unsqueeze(-1).expand(*process.length_ms.shape, -1, 1)
    variance = process.noise_variance[..., None, None] * relative_variance.unsqueeze(-1)
    return botorch.models.SingleTaskGP(
        inputs,
        values.unsqueeze(-1).expand_as(inputs),
        variance if len(values) else None,
        # Without a trial, BoTorch cannot take the next one's noise from theirs.
        likelihood=None if len(values) else _likelihood(process.noise_variance),
        mean_module=gpytorch.means.ConstantMean(batch_shape=process.level.shape)
        .double()
        .initialize(constant=process.level),
        covar_module=_covariance(kernel, process),
        outcome_transform=None,
    )


def _kernel(name: KernelName, length_ms: Tensor) -> gpytorch.kernels.Kernel:
    shape = length_ms.shape
    kernel = (
        gpytorch.kernels.MaternKernel(nu=2.5, batch_shape=shape)
        if name == "matern"
        else gpytorch.kernels.RBFKernel(batch_shape=shape)
    )
    return kernel.double().initialize(lengthscale=length_ms[..., None, None])


def _covariance(kernel: KernelName, process: Process) -> gpytorch.kernels.Kernel:
    shape = process.amplitude.shape
    profile = gpytorch.kernels.ScaleKernel(_kernel(kernel, process.length_ms), batch_shape=shape).double()
    constant = gpytorch.kernels.ConstantKernel(batch_shape=shape).double()
    return profile.initialize(outputscale=process.amplitude.square()) + constant.initialize(
        constant=process.level_variance
    )


def _likelihood(noise_variance: Tensor) -> gpytorch.likelihoods.GaussianLikelihood:
    likelihood = gpytorch.likelihoods.GaussianLikelihood(
        batch_shape=noise_variance.shape, noise_constraint=gpytorch.constraints.Positive()
    ).double()
    return likelihood.initialize(noise=noise_variance.unsqueeze(-1))
