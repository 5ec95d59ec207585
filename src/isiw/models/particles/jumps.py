"""What moves may do to particles of the default model: which latents a shift moves, and which kinds a jump draws again.

A jump leads to another kind of profile, of noise, or to and from "no window".
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from functools import cache
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.building import prior_tables
from isiw.models.particles.latents import (
    KINDS,
    LATENTS,
    PLACE_AND_SIZES,
    PROFILE_BLOCKS,
    RESPONSE_BLOCKS,
    Latents,
    latents_of,
    used_by,
)
from isiw.models.particles.mixture import drawn
from isiw.models.particles.moves import A_LITTLE, ANOTHER_KIND, NEARLY, OF_STEPS, RECENT, STEP_SD
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Person, Prior
from isiw.models.protocol import Tensor
from isiw.native.engine import Tables

JUMPS: Final = {
    "form": 0.09,
    "noise": 0.17,
    "window": 0.22,
    "place": 0.07,
    "response": 0.05,
    "change": 0.30,
    "time or window": 0.10,
}
"""Shares of the jumps. They draw again: the profile's kind and form; the noise's kind and all that belongs to it;
whether there is a window, and all of it; where and how wide it is; what belongs to the noise's kind; what changes in
the session, and when; that and the window at once."""

REDRAWN: Final = {
    "form": ("form",),
    "noise": RESPONSE_BLOCKS,
    "window": PROFILE_BLOCKS,
    "place": ("start", "width"),
    "response": RESPONSE_BLOCKS,
    "change": (),
    "time or window": PROFILE_BLOCKS,
}
"""The blocks of latents that each jump draws again from the prior; see `_changed` for those of a change."""

_RENEWED: Final = {
    "form": {"shape"},
    "noise": {"noise"},
    "window": {"shape", "present"},
    "place": (),
    "response": (),
    "change": {"change"},
    "time or window": {"shape", "present", "change"},
}
"""Which kinds each jump draws again."""


@dataclass(frozen=True)
class WindowTarget:
    """People with a window or none; see `isiw.models.particles.moves.Target`."""

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
        """What the engine knows of the prior and of what moves may do."""
        profile = self.prior.profile
        joint = profile.joint(self.space)
        change, present, noise = torch.meshgrid(
            torch.arange(len(ChangeKind)), torch.arange(2), torch.arange(len(NoiseKind)), indexing="ij"
        )
        used = used_by(noise.flatten(), present.flatten().bool(), change.flatten())
        moves = {
            "apart": False,
            "state_of": np.array([0, 1, len(NoiseKind), 0, 2 * len(NoiseKind)]),
            "shifted": _shifted(torch.device("cpu")) & used.unsqueeze(1),
            "jumps": tuple(JUMPS.values()),
            "redrawn": _redrawn(torch.device("cpu")),
            "renewed": np.array([[kind in kinds for kind in KINDS] for kinds in _RENEWED.values()]),
            "of_profile": np.array([jump in {"form", "place"} for jump in JUMPS]),
            "kinds": (
                astuple(profile.shapes),
                astuple(self.prior.noise),
                (1.0 - profile.p_window, profile.p_window),
                (1.0,),
                self.prior.changes.shares,
            ),
        }
        return prior_tables(
            self.space,
            profile.start,
            list(self.prior.mixtures.values()),
            starts=1,
            places=None if joint is None else (joint.share, joint.mixture),
            at=range(len(LATENTS)),
            spreads=self.spreads,
            moves=moves,
        )

    def log_prior(self, latents: Latents) -> Tensor:
        """Log prior density of their latents but for a constant, shape (b, p)."""
        return self.prior.log_density(latents.values, self.space)

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of start and width of those with a window, and of curve, drift and change, shape (b, p)."""
        place = self.prior.log_place(latents.values, self.space)
        return torch.where(latents.present, place, 0.0) + self.prior.log_beside(latents)

    def shifted(self, latents: Latents, part: Tensor) -> Tensor:
        """Which latents a difference moves, shape (b, p, d)."""
        return _shifted(part.device)[part] & used_by(latents.noise, latents.present, latents.change)

    def jumped(self, latents: Latents, generator: torch.Generator, steps: Tensor) -> tuple[Latents, Tensor]:
        """Particles (n,) with some kinds and latents drawn again, and the log ratio of what that favours, (n,)."""
        fresh = self.prior.sample(1, len(latents.present), generator, self.space)
        uniform = torch.rand(latents.present.shape, generator=generator, dtype=torch.float32, device=generator.device)
        jump = drawn(tuple(JUMPS.values()), uniform)
        form, noise, window, _, _, change, both = (jump == number for number in range(len(JUMPS)))
        window = window | both
        after = Latents.of(
            torch.where(_redrawn(jump.device)[jump], fresh.values[0], latents.values),
            shape=torch.where(form | window, fresh.shape[0], latents.shape),
            noise=torch.where(noise, fresh.noise[0], latents.noise),
            present=torch.where(window, fresh.present[0], latents.present),
            change=latents.change,
        )
        return self._changed(after, fresh, change | both, generator, steps)

    def _changed(
        self, latents: Latents, fresh: Latents, which: Tensor, generator: torch.Generator, steps: Tensor
    ) -> tuple[Latents, Tensor]:
        """Let some particles (n,) have another change, or none; half keep theirs, and move it a little or far."""
        like, trials, shares = latents.values[:, 0], max(1, steps.shape[-1] - 1), self.prior.changes.shares
        uniform = torch.rand((7, *like.shape), generator=generator, dtype=like.dtype, device=like.device)
        normal = torch.randn((2, *like.shape), generator=generator, dtype=like.dtype, device=like.device)
        columns = [LATENTS.index(name) for name in ("log_changed_after", "change_size")]
        old, new = latents.values[:, columns], fresh.values[0][:, columns]
        some = drawn(shares, shares[0] + (1.0 - shares[0]) * uniform[2])
        kind = torch.where(uniform[1] < 0.5, 0, some)
        recent = (kind > 0) & (uniform[3] < RECENT)
        new[:, 0] = torch.where(recent, (trials * uniform[4]).clamp_min(1e-3).log(), new[:, 0])
        near = _step_at(new[:, 0], steps) + STEP_SD * normal[1]
        new[:, 1] = torch.where(recent & (uniform[6] < OF_STEPS), near, new[:, 1])
        ratio = self._favour(new, kind, steps) - self._favour(old, latents.change, steps)
        kept = (latents.change > 0) & (uniform[0] < 0.5)
        after, anywhere = old[:, 0].exp(), uniform[1] < 0.5
        after = torch.where(
            anywhere, torch.where(after < trials, trials * uniform[4], after), after + NEARLY * normal[0]
        )
        moved = torch.stack((after.clamp_min(1e-6).log(), old[:, 1] + A_LITTLE * uniform[5] ** 2 * normal[1]), dim=-1)
        by_moving = torch.where(after > 0, self._log_density(moved) - self._log_density(old), -torch.inf)
        as_another = torch.where(uniform[3] < ANOTHER_KIND, some, latents.change)
        kind, new, ratio = (
            torch.where(kept.view(-1, *(1 for _ in a.shape[1:])), a, b)
            for a, b in ((as_another, kind), (moved, new), (by_moving, ratio))
        )
        values = latents.values.clone()
        values[:, columns] = torch.where(which.unsqueeze(-1), new, old)
        after_all = Latents(values, latents.kinds).with_kind("change", torch.where(which, kind, latents.change))
        return after_all, torch.where(which, ratio, 0.0)

    def _log_density(self, change: Tensor) -> Tensor:
        """Log prior density of the trial, not of its log, and the size of a change (n, 2), shape (n,)."""
        when, size = (self.prior.mixtures[name] for name in ("changed", "change"))
        return when.log_density(change[:, :1]) + size.log_density(change[:, 1:]) - change[:, 0]

    def _favour(self, change: Tensor, kind: Tensor, steps: Tensor) -> Tensor:
        """Log of the prior of a change (n, 2), or of none, by how `_changed` proposes it, shape (n,)."""
        none, trials = self.prior.changes.shares[0], max(1, steps.shape[-1] - 1)
        when, size = (self.prior.mixtures[name] for name in ("changed", "change"))
        among = change[:, 0] - math.log(trials)
        apart = (change[:, 1] - _step_at(change[:, 0], steps)) / STEP_SD
        near = -0.5 * apart.square() - math.log(STEP_SD * math.sqrt(2.0 * math.pi)) - size.log_density(change[:, 1:])
        density = torch.exp(among - when.log_density(change[:, :1])) * (1.0 - OF_STEPS + OF_STEPS * near.exp())
        proposed = RECENT * torch.where(among < 0, density, 0.0) + 1.0 - RECENT
        return torch.where(kind > 0, math.log(1.0 - none) - proposed.log(), math.log(2.0 * none))


def _step_at(log_after: Tensor, steps: Tensor) -> Tensor:
    """The step of the amplitudes (n, trials + 1) at the trial before which a change comes, shape (n,)."""
    after = log_after.exp().ceil().clamp_max(steps.shape[-1] - 1).long()
    return steps.gather(-1, after.unsqueeze(-1)).squeeze(-1)


@cache
def _shifted(device: torch.device) -> Tensor:
    """Which latents a difference moves by its part, shape (parts, d)."""
    of_profile, changed = (latents_of(*blocks, device=device) for blocks in (PROFILE_BLOCKS, ("changed",)))
    sizes = torch.tensor([name in PLACE_AND_SIZES for name in LATENTS], device=device)
    return torch.stack([~changed, of_profile, ~of_profile & ~changed, sizes])


@cache
def _redrawn(device: torch.device) -> Tensor:
    """Which latents each of `JUMPS` draws again, shape (jumps, d)."""
    return torch.stack([latents_of(*REDRAWN[jump], device=device) for jump in JUMPS])
