"""Markov chain moves of particles that leave the posterior of the trials so far unchanged.

Half of the particles move at a time, by differences within the other half (ter Braak, Stat. Comput. 16, 2006), or jump
to another kind of profile, of noise, or to and from "no window", the latents concerned drawn anew from the prior.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from isiw.design import DesignSpace
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.prior import Latents, Prior, block
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History

__all__ = ["Mover"]

JUMP_PROBABILITY = 0.3
BLOCK_PROBABILITY = (0.35, 0.35, 0.30)
"""How often a difference moves all latents, those of the profile alone, and those of the response alone."""

FORM_JUMPS, NOISE_JUMPS = 0.30, 0.25
"""Shares of the jumps that draw the profile's kind and form, and the noise's kind; the others draw window or none."""


@dataclass(frozen=True)
class Mover:
    """Moves particles under the posterior of a history.

    Args:
        prior: the prior.
        space: the design space.
        history: the trials so far.
        generator: source of randomness.
    """

    prior: Prior
    space: DesignSpace
    history: History
    generator: torch.Generator

    def sweep(self, latents: Latents, log_likelihood: Tensor) -> tuple[Latents, Tensor]:
        """Move every particle once.

        Args:
            latents: particles, fields of shape (b, p); whatever weights they have, they keep.
            log_likelihood: of the history under each of them, shape (b, p).
        """
        half = latents.present.shape[-1] // 2
        for own, other in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
            mine, theirs = (Latents(*(field[:, part] for field in latents)) for part in (own, other))
            moved, likelihood = self._step(mine, theirs, log_likelihood[:, own])
            latents = Latents(*(_replace(old, own, new) for old, new in zip(latents, moved, strict=True)))
            log_likelihood = _replace(log_likelihood, own, likelihood)
        return latents, log_likelihood

    def _step(self, mine: Latents, theirs: Latents, log_likelihood: Tensor) -> tuple[Latents, Tensor]:
        jumps = self._uniform(mine.present) < JUMP_PROBABILITY
        shifted, jumped = self._shift(mine, theirs), self._jump(mine)
        proposal = Latents(*(_choose(jumps, a, b) for a, b in zip(jumped, shifted, strict=True)))
        prior_ratio = 0.5 * (mine.z.square() - proposal.z.square()).sum(-1)
        proposed = total_log_likelihood(self.prior.person(proposal, self.space), self.history)
        log_ratio = proposed - log_likelihood + torch.where(jumps, 0.0, prior_ratio)
        accept = torch.log(self._uniform(mine.present)) < log_ratio
        moved = Latents(*(_choose(accept, a, b) for a, b in zip(proposal, mine, strict=True)))
        return moved, torch.where(accept, proposed, log_likelihood)

    def _shift(self, mine: Latents, theirs: Latents) -> Latents:
        """Add a scaled difference of two of the others, in a block of latents."""
        people, size, _ = mine.z.shape
        first, second = (
            torch.gather(theirs.z, 1, self._pick(people, size, theirs.z.shape[1]).unsqueeze(-1).expand_as(mine.z))
            for _ in range(2)
        )
        part = torch.bucketize(
            self._uniform(mine.present), torch.tensor(BLOCK_PROBABILITY, device=mine.z.device).cumsum(0)[:-1]
        ).unsqueeze(-1)
        of_profile = block("place", "form", device=mine.z.device)
        moves = (part == 0) | ((part == 1) & of_profile) | ((part == 2) & ~of_profile)
        scale = torch.where(self._uniform(mine.present) < 0.1, 1.0, 0.15 + 0.7 * self._uniform(mine.present))
        blur = 0.02 * self._normal(mine.z)
        return mine._replace(z=mine.z + moves * (scale.unsqueeze(-1) * (first - second) + blur))

    def _jump(self, mine: Latents) -> Latents:
        """Draw a kind, and the latents that it gives a meaning to, anew from the prior."""
        shape, noise, present = self.prior.sample_kinds(tuple(mine.present.shape), self.generator)
        fresh = self._normal(mine.z)
        which = self._uniform(mine.present)
        new_form, new_window = which < FORM_JUMPS, which >= FORM_JUMPS + NOISE_JUMPS
        new_noise = ~(new_form | new_window)
        redraw = (
            (new_form.unsqueeze(-1) & block("form", device=mine.z.device))
            | (new_noise.unsqueeze(-1) & block("noise", device=mine.z.device))
            | (new_window.unsqueeze(-1) & block("place", "form", device=mine.z.device))
        )
        return Latents(
            z=torch.where(redraw, fresh, mine.z),
            shape=torch.where(new_form | new_window, shape, mine.shape),
            noise=torch.where(new_noise, noise, mine.noise),
            present=torch.where(new_window, present, mine.present),
        )

    def _uniform(self, like: Tensor) -> Tensor:
        return torch.rand(like.shape, generator=self.generator, device=like.device)

    def _normal(self, like: Tensor) -> Tensor:
        return torch.randn(like.shape, generator=self.generator, device=like.device)

    def _pick(self, people: int, size: int, of: int) -> Tensor:
        return torch.randint(of, (people, size), generator=self.generator, device=self.generator.device)


def _choose(condition: Tensor, yes: Tensor, no: Tensor) -> Tensor:
    return torch.where(condition.unsqueeze(-1) if yes.dim() > condition.dim() else condition, yes, no)


def _replace(old: Tensor, part: slice, new: Tensor) -> Tensor:
    result = old.clone()
    result[:, part] = new
    return result
