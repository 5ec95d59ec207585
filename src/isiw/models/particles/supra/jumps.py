"""What moves may do to particles with both kinds of segment: what a shift moves, and what a jump draws anew."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.mixture import drawn
from isiw.models.particles.prior import Person
from isiw.models.particles.supra.prior import BLOCKS, LATENTS, SupraLatents, SupraPrior
from isiw.models.protocol import Tensor

__all__ = ["SupraTarget"]

JUMPS: Final = {
    "enhanced": 0.2,
    "depressed": 0.25,
    "place": 0.15,
    "depressed place": 0.15,
    "both places": 0.15,
    "curve": 0.1,
}
"""Shares of the jumps. They draw anew: whether there is a segment, and all of it; where and how wide one is, or both
are; the curve."""

REDRAWN: Final = {
    "enhanced": BLOCKS["enhanced"],
    "depressed": BLOCKS["depressed"],
    "place": BLOCKS["enhanced"][:2],
    "depressed place": BLOCKS["depressed"][:2],
    "both places": (*BLOCKS["enhanced"][:2], *BLOCKS["depressed"][:2]),
    "curve": BLOCKS["curve"],
}
"""The latents that each jump draws anew."""


@dataclass(frozen=True)
class SupraTarget:
    """People with an enhanced segment, a depressed one, both or none; see `isiw.models.particles.moves.Target`.

    Args:
        prior: the prior.
        space: the design space.
    """

    prior: SupraPrior
    space: DesignSpace

    @property
    def spreads(self) -> Tensor:
        """Usual SD of each latent, shape (d,)."""
        return self.prior.spreads

    def person(self, latents: SupraLatents) -> Person:
        """What particles mean."""
        return self.prior.person(latents)

    def log_prior(self, latents: SupraLatents) -> Tensor:
        """Log prior density of their latents but for a constant, -inf where the segments overlap, shape (b, p)."""
        return self.prior.log_density(latents.values, self.space)

    def shifted(self, latents: SupraLatents, part: Tensor) -> Tensor:
        """Which latents a difference moves, shape (b, p, d)."""
        enhanced, depressed = (_latents(*BLOCKS[name], device=part.device) for name in ("enhanced", "depressed"))
        used = (~enhanced | latents.enhanced.unsqueeze(-1)) & (~depressed | latents.depressed.unsqueeze(-1))
        return _shifted(part.device)[part] & used

    def jumped(self, latents: SupraLatents, generator: torch.Generator) -> SupraLatents:
        """Particles (n,) with some latents, and whether their segment is there, drawn anew."""
        fresh = self.prior.draw(1, len(latents.enhanced), generator, self.space)
        uniform = torch.rand(latents.enhanced.shape, generator=generator, dtype=torch.float32, device=generator.device)
        jump = drawn(tuple(JUMPS.values()), uniform)
        enhanced, depressed, *_ = (jump == number for number in range(len(JUMPS)))
        return SupraLatents(
            values=torch.where(_redrawn(jump.device)[jump], fresh.values[0], latents.values),
            enhanced=torch.where(enhanced, fresh.enhanced[0], latents.enhanced),
            depressed=torch.where(depressed, fresh.depressed[0], latents.depressed),
        )


@cache
def _latents(*names: str, device: torch.device) -> Tensor:
    """Which latents have some names, shape (d,)."""
    return torch.tensor([name in names for name in LATENTS], device=device)


@cache
def _shifted(device: torch.device) -> Tensor:
    """Which latents a difference moves by its part, those of the segments being the profile's, shape (parts, d)."""
    of_segments = _latents(*BLOCKS["enhanced"], *BLOCKS["depressed"], device=device)
    return torch.stack([torch.ones_like(of_segments), of_segments, ~of_segments])


@cache
def _redrawn(device: torch.device) -> Tensor:
    """Which latents each of `JUMPS` draws anew, shape (jumps, d)."""
    return torch.stack([_latents(*names, device=device) for names in REDRAWN.values()])
