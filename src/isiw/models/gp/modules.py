"""Mean and kernel of processes that leave their constant within a window, as modules of GPyTorch's."""

from __future__ import annotations

from typing import Any

import gpytorch

from isiw.models.gp.places import Places, Tensor


def _share(places: Places, inputs: Tensor) -> Tensor:
    """The share of each input (..., n, 1), shape (..., n)."""
    steps = (inputs.squeeze(-1) - places.middle_ms.unsqueeze(-1)) / places.sd_ms.unsqueeze(-1)
    return (-0.5 * steps.square()).exp()


class RisenMean(gpytorch.means.Mean):  # type: ignore[misc] # GPyTorch states no types
    """A constant, and the rise of a window."""

    def __init__(self, constant: gpytorch.means.Mean, places: Places) -> None:
        super().__init__()
        self.constant, self.places = constant, places

    def forward(self, x: Tensor) -> Tensor:
        """The mean at inputs [ms] of shape (..., n, 1)."""
        mean: Tensor = self.constant(x) + self.places.rise.unsqueeze(-1) * _share(self.places, x)
        return mean


class WithinWindow(gpytorch.kernels.Kernel):  # type: ignore[misc] # GPyTorch states no types
    """A kernel and a common rise, both times the share of an ISI."""

    def __init__(self, base: gpytorch.kernels.Kernel, places: Places) -> None:
        super().__init__(batch_shape=places.rise.shape)
        self.base, self.places = base, places

    def forward(self, x1: Tensor, x2: Tensor, diag: bool = False, **params: Any) -> Tensor:  # noqa: FBT001, FBT002
        """The covariance of inputs [ms] of shapes (..., n, 1) and (..., m, 1)."""
        one, other = _share(self.places, x1), _share(self.places, x2)
        rise = self.places.rise_sd.square().unsqueeze(-1)
        if diag:
            own: Tensor = (self.base(x1, x2, diag=True, **params) + rise) * one * other
            return own
        shared: Tensor = self.base(x1, x2, **params).to_dense() + rise.unsqueeze(-1)
        return shared * one.unsqueeze(-1) * other.unsqueeze(-2)
