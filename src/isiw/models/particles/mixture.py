"""Mixtures of components for blocks of latents: what is usual of them, and what else may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

from isiw.lazy import torch
from isiw.models.protocol import Tensor
from isiw.types import FloatArray


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of normal components with independent latents."""

    shares: Tensor  # of the components, summing to 1, (k,)
    means: Tensor  # of the latents in each, (k, d)
    sds: Tensor  # likewise, (k, d)

    @classmethod
    def of(cls, components: list[tuple[float, list[tuple[float, float]]]]) -> Mixture:
        """A mixture of components."""
        shares = torch.tensor([share for share, _ in components], dtype=torch.float32)
        laws = torch.tensor([latents for _, latents in components], dtype=torch.float32)
        return cls(shares / shares.sum(), laws[..., 0], laws[..., 1])

    def log_parts(self, x: Tensor) -> Tensor:
        """Log density of each component times its share at x (..., d), shape (..., k)."""
        shares, means, sds = (law.to(x.device) for law in (self.shares, self.means, self.sds))
        z = (x.unsqueeze(-2) - means) / sds
        scale = sds.log().sum(-1) + 0.5 * math.log(2.0 * math.pi) * sds.shape[-1]
        return shares.log() - scale - 0.5 * z.square().sum(-1)

    def log_density(self, x: Tensor) -> Tensor:
        """Log density at x (..., d), shape (...)."""
        density: Tensor = torch.logsumexp(self.log_parts(x), dim=-1)
        return density

    def usual(self, x: Tensor) -> Tensor:
        """Probability that x (..., d) is of the component that is most probable beforehand, shape (...)."""
        share: Tensor = torch.softmax(self.log_parts(x), dim=-1)[..., self.shares.argmax()]
        return share

    def component(self, x: Tensor) -> Tensor:
        """The component that most probably explains x (..., d), shape (...)."""
        squares, lines, constants = self._squares
        latents = x.cpu().numpy()
        return torch.from_numpy((latents**2 @ squares + latents @ lines + constants).argmax(-1)).to(x.device)

    @cached_property
    def _squares(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Factors of x² and of x, each (d, k), and constants (k,), whose sum is the log density of each component."""
        precisions = self.sds.double().square().reciprocal()
        lines, spent = precisions * self.means, (0.5 * precisions * self.means.double().square()).sum(-1)
        constants = self.shares.double().log() - self.sds.double().log().sum(-1) - spent
        return (-0.5 * precisions).T.float().numpy(), lines.T.float().numpy(), constants.float().numpy()


class JointMixture:
    """Independent mixtures of several blocks of latents, computed at once."""

    def __init__(self, blocks: Sequence[Mixture]) -> None:
        most = max(len(block.shares) for block in blocks)
        # Missing components have no share, and the law of the first, so that nothing is infinite but their log share.
        filled = [torch.arange(most).where(torch.arange(most) < len(block.shares), 0) for block in blocks]
        shares = torch.stack([torch.nn.functional.pad(b.shares, (0, most - len(b.shares))) for b in blocks])
        means, sds = (
            torch.cat([getattr(block, law)[rows] for block, rows in zip(blocks, filled, strict=True)], dim=-1)
            for law in ("means", "sds")
        )
        sizes = torch.tensor([block.means.shape[-1] for block in blocks])
        block = torch.repeat_interleave(torch.arange(len(blocks)), sizes)
        several = torch.tensor([len(block.shares) > 1 for block in blocks])
        plain, mixed = (which.nonzero().squeeze(-1) for which in (~several[block], several[block]))
        belongs = torch.nn.functional.one_hot(block[mixed], len(blocks)).float().T[several]
        log_shares = shares[several].log().T.unsqueeze(-1) - belongs @ sds[:, mixed].log().unsqueeze(-1)
        below, plain_scale = shares.cumsum(-1)[:, :-1], -sds[0, plain].log().sum()
        tables = _Tables(means, sds, block, plain, plain_scale, mixed, belongs, below, log_shares)
        self._tables = {torch.device("cpu"): tables}

    def sample(self, size: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Draws, shape (*size, d)."""
        tables = self._on(generator.device)
        uniform = torch.rand(
            (*size, len(tables.below)), generator=generator, dtype=torch.float32, device=generator.device
        )
        component = (uniform.unsqueeze(-1) > tables.below).sum(-1)[..., tables.block].flatten(0, -2)
        normal = torch.randn(
            (*size, len(tables.block)), generator=generator, dtype=torch.float32, device=generator.device
        )
        means, sds = (law.gather(0, component).view_as(normal) for law in (tables.means, tables.sds))
        return torch.addcmul(means, sds, normal)

    def log_density(self, x: Tensor) -> Tensor:
        """Log density but for a constant at x (..., d), shape (...)."""
        tables = self._on(x.device)
        # With the particles last, every step runs along memory.
        latents = x.flatten(0, -2).T
        density = tables.plain_scale - 0.5 * tables.squares(latents, tables.plain, components=1).sum((0, 1))
        if len(tables.mixed):
            squares = tables.squares(latents, tables.mixed, components=len(tables.means))
            parts = torch.matmul(tables.belongs, squares).mul_(-0.5).add_(tables.log_shares)
            density += torch.logsumexp(parts, dim=0).sum(0)
        return density.view(x.shape[:-1])

    def _on(self, device: torch.device) -> _Tables:
        if device not in self._tables:
            self._tables[device] = _Tables(*(table.to(device) for table in self._tables[torch.device("cpu")]))
        return self._tables[device]


class _Tables(NamedTuple):
    """What is computed with, on one device."""

    means: Tensor  # (k, d)
    sds: Tensor  # (k, d)
    block: Tensor  # of each latent, (d,)
    plain: Tensor  # the latents of blocks with one component, (d - m,)
    plain_scale: Tensor  # minus the sum of the logs of their SDs, ()
    mixed: Tensor  # those of blocks with several, (m,)
    belongs: Tensor  # which of these blocks they are of, (mixed blocks, m)
    below: Tensor  # sums of the shares of earlier components, (blocks, k - 1)
    log_shares: Tensor  # minus the logs of the SDs, (k, mixed blocks, 1)

    def squares(self, latents: Tensor, which: Tensor, components: int) -> Tensor:
        """Squared distances of some latents (d, n) from the means of the first components, in SDs, shape (k, m, n)."""
        means, sds = (law[:components, which].unsqueeze(-1) for law in (self.means, self.sds))
        return ((latents[which] - means) / sds).square_()


def drawn(shares: tuple[float, ...], quantile: Tensor) -> Tensor:
    """Which of some alternatives is drawn at each quantile, same shape."""
    return torch.bucketize(quantile, _inner_edges(shares, quantile.device))


@cache
def _inner_edges(shares: tuple[float, ...], device: torch.device) -> Tensor:
    return torch.tensor(shares, dtype=torch.float32, device=device).cumsum(0)[:-1]
