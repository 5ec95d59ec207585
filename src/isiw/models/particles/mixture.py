"""Mixtures of components for a few named latents: what is usual of them, and what else may be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch

from isiw.models.protocol import Tensor

__all__ = ["Mixture"]


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of normal components with independent latents.

    Args:
        shares: of the components, summing to 1, shape (k,).
        means: of the latents in each, shape (k, d).
        sds: their SDs, shape (k, d).
    """

    shares: Tensor
    means: Tensor
    sds: Tensor

    @classmethod
    def of(cls, components: list[tuple[float, list[tuple[float, float]]]], device: torch.device | str) -> Mixture:
        """A mixture of components, each a share and the (mean, SD) of every latent."""
        shares = torch.tensor([share for share, _ in components], device=device)
        laws = torch.tensor([latents for _, latents in components], device=device)
        return cls(shares / shares.sum(), laws[..., 0], laws[..., 1])

    def sample(self, size: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Draws, shape (*size, d)."""
        normal = torch.randn((*size, self.means.shape[-1]), generator=generator, device=generator.device)
        if len(self.shares) == 1:
            return self.means[0] + self.sds[0] * normal
        uniform = torch.rand(size, generator=generator, device=generator.device)
        which = torch.bucketize(uniform, self.shares.cumsum(0)[:-1])
        return self.means[which] + self.sds[which] * normal

    def log_parts(self, x: Tensor) -> Tensor:
        """Log density of each component times its share at x (..., d), shape (..., k)."""
        z = (x.unsqueeze(-2) - self.means) / self.sds
        scale = self.sds.log().sum(-1) + 0.5 * math.log(2.0 * math.pi) * self.sds.shape[-1]
        return self.shares.log() - scale - 0.5 * z.square().sum(-1)

    def log_density(self, x: Tensor) -> Tensor:
        """Log density at x (..., d), shape (...)."""
        density: Tensor = torch.logsumexp(self.log_parts(x), dim=-1)
        return density

    def component(self, x: Tensor) -> Tensor:
        """The component that most probably explains x (..., d), shape (...)."""
        return self.log_parts(x).argmax(-1)
