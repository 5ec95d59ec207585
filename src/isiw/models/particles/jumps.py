"""What moves may do to particles of the default model: which latents a shift moves, and which kinds a jump draws anew.

A jump leads to another kind of profile, of noise, or to and from "no window".
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from functools import cache
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.kernels.building import prior_tables
from isiw.models.particles.kernels.target import Tables
from isiw.models.particles.latents import LATENTS, PROFILE_BLOCKS, RESPONSE_BLOCKS, Latents, latents_of, used_by
from isiw.models.particles.mixture import drawn
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.places import mixture_of
from isiw.models.particles.prior import Person, Prior
from isiw.models.protocol import Tensor

JUMPS: Final = {"form": 0.25, "noise": 0.2, "window": 0.35, "place": 0.12, "response": 0.08}
"""Shares of the jumps. They draw anew: the profile's kind and form; the noise's kind and all that belongs to it;
whether there is a window, and all of it; where and how wide it is; what belongs to the noise's kind."""

REDRAWN: Final = {
    "form": ("form",),
    "noise": RESPONSE_BLOCKS,
    "window": PROFILE_BLOCKS,
    "place": ("start", "width"),
    "response": RESPONSE_BLOCKS,
}
"""The blocks of latents that each jump draws again."""

KINDS: Final = ("shape", "noise", "present", "depressed")
"""The kinds of a particle as the kernels have them."""

_RENEWED: Final = {"form": {"shape"}, "noise": {"noise"}, "window": {"shape", "present"}, "place": (), "response": ()}
"""Which kinds each jump draws again."""


@dataclass(frozen=True)
class WindowTarget:
    """People with a window or none; see `isiw.models.particles.moves.Target`.

    Args:
        prior: the prior.
        space: the design space.
    """

    prior: Prior
    space: DesignSpace

    @property
    def spreads(self) -> Tensor:
        """Usual SD of each latent, shape (d,)."""
        return self.prior.spreads

    def person(self, latents: Latents) -> Person:
        """What particles mean."""
        return self.prior.person(latents)

    def tables(self) -> Tables:
        """What kernels know of the prior and of what moves may do."""
        profile = self.prior.profile
        known, absent = torch.ones(len(NoiseKind), dtype=torch.long), torch.zeros(len(NoiseKind), dtype=torch.long)
        used = [used_by(torch.arange(len(NoiseKind)), present.bool()) for present in (absent, known)]
        moves = {
            "apart": False,
            "states": np.array([0, 1, len(NoiseKind), 0]),
            "shifted": _shifted(torch.device("cpu")) & torch.cat(used).unsqueeze(1),
            "jumps": tuple(JUMPS.values()),
            "redrawn": _redrawn(torch.device("cpu")),
            "renewed": np.array([[kind in kinds for kind in KINDS] for kinds in _RENEWED.values()]),
            "of_profile": np.array([jump in {"form", "place"} for jump in JUMPS]),
            "kinds": (astuple(profile.shapes), astuple(self.prior.noise), _no_and_yes(profile.p_window), (1.0,)),
        }
        return prior_tables(
            self.space,
            profile.start,
            list(self.prior.mixtures.values()),
            starts=1,
            places=(profile.p_place, mixture_of(profile.places)) if profile.p_place else None,
            at=range(len(LATENTS)),
            spreads=self.spreads,
            moves=moves,
        )

    def kinds(self, latents: Latents) -> Tensor:
        """The kinds of particles, integers of shape (b, p, k); there is no depression."""
        present = latents.present.long()
        return torch.stack((latents.shape, latents.noise, present, torch.zeros_like(present)), dim=-1)

    def latents(self, values: Tensor, kinds: Tensor) -> Latents:
        """Particles from their latents (b, p, d) and kinds (b, p, k)."""
        return Latents(values, kinds[..., 0], kinds[..., 1], kinds[..., 2].bool())

    def log_prior(self, latents: Latents) -> Tensor:
        """Log prior density of their latents but for a constant, shape (b, p)."""
        return self.prior.log_density(latents.values, self.space)

    def log_place(self, latents: Latents) -> Tensor:
        """Log prior density of start and width, shape (b, p)."""
        return self.prior.log_place(latents.values, self.space)

    def shifted(self, latents: Latents, part: Tensor) -> Tensor:
        """Which latents a difference moves, shape (b, p, d)."""
        return _shifted(part.device)[part] & used_by(latents.noise, latents.present)

    def jumped(self, latents: Latents, generator: torch.Generator) -> Latents:
        """Particles (n,) with some kinds and latents drawn anew."""
        fresh = self.prior.sample(1, len(latents.present), generator, self.space)
        uniform = torch.rand(latents.present.shape, generator=generator, dtype=torch.float32, device=generator.device)
        jump = drawn(tuple(JUMPS.values()), uniform)
        form, noise, window, _, _ = (jump == number for number in range(len(JUMPS)))
        return Latents(
            values=torch.where(_redrawn(jump.device)[jump], fresh.values[0], latents.values),
            shape=torch.where(form | window, fresh.shape[0], latents.shape),
            noise=torch.where(noise, fresh.noise[0], latents.noise),
            present=torch.where(window, fresh.present[0], latents.present),
        )


def _no_and_yes(probability: float) -> tuple[float, float]:
    return 1.0 - probability, probability


@cache
def _shifted(device: torch.device) -> Tensor:
    """Which latents a difference moves by its part, shape (parts, d)."""
    of_profile = latents_of(*PROFILE_BLOCKS, device=device)
    return torch.stack([torch.ones_like(of_profile), of_profile, ~of_profile])


@cache
def _redrawn(device: torch.device) -> Tensor:
    """Which latents each of `JUMPS` draws anew, shape (jumps, d)."""
    return torch.stack([latents_of(*REDRAWN[jump], device=device) for jump in JUMPS])
