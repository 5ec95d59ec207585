"""The distribution of a person's MEPs as Pyro has it; the one module that needs Pyro to be imported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from pyro.distributions.torch_distribution import TorchDistribution
from torch.distributions import constraints

from isiw.lazy import torch
from isiw.models.parametric.law import Likelihood, Unknowns, draw_log_mep, levels, log_likelihood
from isiw.models.parametric.tensors import Tensor, averaged_over_isi


class MepLaw(TorchDistribution):
    """Distribution of the natural logs of one person's MEPs [mV], as intervals that are points where one is known.

    Args:
        unknowns: fields of shape (m,) or ().
        isi_ms: ISIs [ms], NaN for TMS alone, shape (n,).
        isi_sd_ms: SDs of the ISIs [ms], shape (n,).
        likelihood: the likelihood.
        present: whether there is a window at all.
    """

    arg_constraints: ClassVar[dict[str, Any]] = {}
    support = constraints.independent(constraints.real, 1)

    def __init__(
        self, unknowns: Unknowns, isi_ms: Tensor, isi_sd_ms: Tensor, likelihood: Likelihood, *, present: bool = True
    ) -> None:
        self.unknowns, self.isi_ms, self.isi_sd_ms = unknowns, isi_ms, isi_sd_ms
        self.likelihood, self.present = likelihood, present
        # An interval may reach to infinity, which the support of Pyro's checks cannot express.
        super().__init__(torch.Size((*unknowns.start_ms.shape, len(isi_ms))), torch.Size((2,)), validate_args=False)

    def log_prob(self, value: Tensor) -> Tensor:
        """Log density of each log MEP, or log probability of its interval (n, 2), shape (m, n)."""
        if not self.present:
            nowhere = torch.zeros_like(self.unknowns.start_ms).unsqueeze(-1)
            return log_likelihood(self.unknowns, nowhere, value, self.likelihood)

        def at(isi_ms: Tensor) -> Tensor:
            return log_likelihood(self.unknowns, levels(self.unknowns, isi_ms), value, self.likelihood)

        return averaged_over_isi(at, self.isi_ms, self.isi_sd_ms)

    def sample(self, sample_shape: Sequence[int] = ()) -> Tensor:
        """Log MEPs as points, shape (..., m, n, 2)."""
        unknowns = Unknowns(*(x.expand((*sample_shape, *x.shape)) for x in self.unknowns))
        level = levels(unknowns, self.isi_ms + self.isi_sd_ms * torch.randn_like(self.isi_sd_ms))
        log_mep = draw_log_mep(unknowns, level if self.present else torch.zeros_like(level), self.likelihood)
        return torch.stack((log_mep, log_mep), dim=-1)
