"""What moves may do to particles with both kinds of segment: what a shift moves, and what a jump draws again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.building import prior_tables
from isiw.models.particles.latents import LATENTS as DEFAULT_LATENTS
from isiw.models.particles.latents import Latents
from isiw.models.particles.mixture import drawn
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Person
from isiw.models.particles.supra.prior import BLOCKS, LATENTS, SupraPrior
from isiw.models.protocol import Tensor
from isiw.native.engine import Tables

JUMPS: Final = {
    "enhanced": 0.2,
    "depressed": 0.25,
    "place": 0.15,
    "depressed place": 0.15,
    "both places": 0.15,
    "curve": 0.1,
}
"""Shares of the jumps. They draw again: whether there is a segment, and all of it; where and how wide one is, or both
are; the curve."""

REDRAWN: Final = {
    "enhanced": BLOCKS["enhanced"],
    "depressed": BLOCKS["depressed"],
    "place": BLOCKS["enhanced"][:2],
    "depressed place": BLOCKS["depressed"][:2],
    "both places": (*BLOCKS["enhanced"][:2], *BLOCKS["depressed"][:2]),
    "curve": BLOCKS["curve"],
}
"""The latents that each jump draws again."""

_PLACES_AND_SIZES: Final = (*REDRAWN["both places"], "log_floor_mv", "log_ceiling")

_OF_A_DEPRESSION: Final = ("depressed_start_ms", "depressed_log_width_ms", "depressed_log_shift")
_AS_THE_DEFAULT: Final = tuple("log_shift" if n == "log_boost" else n for n in (*DEFAULT_LATENTS, *_OF_A_DEPRESSION))
"""What the engine knows latents by, in their order."""


@dataclass(frozen=True)
class SupraTarget:
    """People with an enhanced segment, a depressed one, both or none; see `isiw.models.particles.moves.Target`."""

    prior: SupraPrior
    space: DesignSpace

    @property
    def spreads(self) -> Tensor:
        """Usual SD of each latent, shape (d,)."""
        return self.prior.spreads

    def person(self, latents: Latents) -> Person:
        """What particles mean."""
        return self.prior.person(latents)

    def tables(self) -> Tables:
        """What the engine knows of the prior and of what moves may do."""
        cpu, prior = torch.device("cpu"), self.prior
        of_enhanced, of_depressed = (_latents(*BLOCKS[name], device=cpu) for name in ("enhanced", "depressed"))
        there = ((False, False), (True, False), (False, True), (True, True))
        used = torch.stack([(~of_enhanced | up) & (~of_depressed | down) for up, down in there])
        moves = {
            "apart": True,
            "state_of": np.array([0, 0, 1, 2, 0]),
            "shifted": _shifted(cpu) & used.unsqueeze(1),
            "jumps": tuple(JUMPS.values()),
            "redrawn": _redrawn(cpu),
            "renewed": np.array([[False, False, jump == "enhanced", jump == "depressed", False] for jump in JUMPS]),
            "of_profile": np.zeros(len(JUMPS), dtype=bool),
            "kinds": (
                (1.0,),
                (1.0,),
                *((1.0 - p, p) for p in (prior.enhanced.probability, prior.depressed.probability)),
                (1.0,),
            ),
        }
        at = [LATENTS.index(name) if name in LATENTS else -1 for name in _AS_THE_DEFAULT]
        return prior_tables(
            self.space, prior.start, prior.mixtures, starts=2, places=None, at=at, spreads=self.spreads, moves=moves
        )

    def log_prior(self, latents: Latents) -> Tensor:
        """Log prior density of their latents but for a constant, -inf where the segments overlap, shape (b, p)."""
        return self.prior.log_density(latents.values, self.space)

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of the latents, as ISIs are chosen with the same law, shape (b, p)."""
        return self.log_prior(latents)

    def shifted(self, latents: Latents, part: Tensor) -> Tensor:
        """Which latents a difference moves, shape (b, p, d)."""
        enhanced, depressed = (_latents(*BLOCKS[name], device=part.device) for name in ("enhanced", "depressed"))
        used = (~enhanced | latents.present.unsqueeze(-1)) & (~depressed | latents.depressed.unsqueeze(-1))
        return _shifted(part.device)[part] & used

    def jumped(
        self,
        latents: Latents,
        generator: torch.Generator,
        steps: Tensor,  # noqa: ARG002 - nothing changes with time
    ) -> tuple[Latents, Tensor]:
        """Particles (n,) with some latents, and whether their segment is there, drawn again from the prior."""
        fresh = self.prior.draw(1, len(latents.present), generator, self.space)
        uniform = torch.rand(latents.present.shape, generator=generator, dtype=torch.float32, device=generator.device)
        jump = drawn(tuple(JUMPS.values()), uniform)
        enhanced, depressed, *_ = (jump == number for number in range(len(JUMPS)))
        after = Latents.of(
            torch.where(_redrawn(jump.device)[jump], fresh.values[0], latents.values),
            noise=NoiseKind.RECRUITMENT,
            present=torch.where(enhanced, fresh.present[0], latents.present),
            depressed=torch.where(depressed, fresh.depressed[0], latents.depressed),
        )
        return after, torch.zeros_like(latents.values[:, 0])


@cache
def _latents(*names: str, device: torch.device) -> Tensor:
    """Which latents have some names, shape (d,)."""
    return torch.tensor([name in names for name in LATENTS], device=device)


@cache
def _shifted(device: torch.device) -> Tensor:
    """Which latents a difference moves by its part, those of the segments being the profile's, shape (parts, d)."""
    of_segments = _latents(*BLOCKS["enhanced"], *BLOCKS["depressed"], device=device)
    sizes = _latents(*_PLACES_AND_SIZES, device=device)
    return torch.stack([torch.ones_like(of_segments), of_segments, ~of_segments, sizes])


@cache
def _redrawn(device: torch.device) -> Tensor:
    """Which latents each of `JUMPS` draws again, shape (jumps, d)."""
    return torch.stack([_latents(*names, device=device) for names in REDRAWN.values()])
