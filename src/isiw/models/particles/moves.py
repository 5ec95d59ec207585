"""Markov chain moves of particles that leave the posterior of the trials so far unchanged.

Half of the particles move at a time, by differences within the other half (ter Braak, Stat. Comput. 16, 2006), or jump
to another kind of profile, of noise, or to and from "no window", the latents concerned drawn anew from the prior.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch

from isiw.design import DesignSpace
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.prior import PROFILE_BLOCKS, RESPONSE_BLOCKS, Latents, Prior, latents_of, used_by
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History

__all__ = ["Mover"]

JUMP_PROBABILITY = 0.3
PART_PROBABILITY = (0.35, 0.35, 0.30)
"""How often a difference moves all latents, those of the profile alone, and those of the response alone."""

JUMPS = {"form": 0.25, "noise": 0.2, "window": 0.35, "place": 0.12, "response": 0.08}
"""Shares of the jumps. They draw anew: the profile's kind and form; the noise's kind and all that belongs to it;
whether there is a window, and all of it; where and how wide it is; what belongs to the noise's kind."""

BLUR = 0.02
"""SD of what is added to a difference, as a share of the usual SD of each latent."""


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
        # A jump draws from the prior, so that its density cancels.
        densities = (self.prior.log_density(each.values, self.space) for each in (proposal, mine))
        prior_ratio = next(densities) - next(densities)
        proposed = total_log_likelihood(self.prior.person(proposal), self.history)
        log_ratio = proposed - log_likelihood + torch.where(jumps, 0.0, prior_ratio)
        accept = torch.log(self._uniform(mine.present)) < log_ratio
        moved = Latents(*(_choose(accept, a, b) for a, b in zip(proposal, mine, strict=True)))
        return moved, torch.where(accept, proposed, log_likelihood)

    def _shift(self, mine: Latents, theirs: Latents) -> Latents:
        """Add a scaled difference of two of the others, in those latents that mean anything to the particle."""
        people, size, _ = mine.values.shape
        first, second = (
            torch.gather(
                theirs.values, 1, self._pick(people, size, theirs.values.shape[1]).unsqueeze(-1).expand_as(mine.values)
            )
            for _ in range(2)
        )
        part = _drawn(PART_PROBABILITY, self._uniform(mine.present)).unsqueeze(-1)
        of_profile = latents_of(*PROFILE_BLOCKS, device=mine.values.device)
        moves = (part == 0) | ((part == 1) & of_profile) | ((part == 2) & ~of_profile)
        moves = moves & used_by(mine.noise, mine.present)
        scale = torch.where(self._uniform(mine.present) < 0.1, 1.0, 0.15 + 0.7 * self._uniform(mine.present))
        blur = BLUR * self.prior.spreads.to(mine.values) * self._normal(mine.values)
        return mine._replace(values=mine.values + moves * (scale.unsqueeze(-1) * (first - second) + blur))

    def _jump(self, mine: Latents) -> Latents:
        """Draw some kinds, and the latents that go with them, anew from the prior."""
        people, size = mine.present.shape
        fresh = self.prior.sample(people, size, self.generator, self.space)
        jump = _drawn(tuple(JUMPS.values()), self._uniform(mine.present))
        form, noise, window, place, response = (jump == number for number in range(len(JUMPS)))
        drawn = {
            ("form",): form,
            RESPONSE_BLOCKS: noise | response,
            PROFILE_BLOCKS: window,
            ("start", "width"): place,
        }
        redraw = torch.zeros_like(mine.values, dtype=torch.bool)
        for blocks, who in drawn.items():
            redraw |= who.unsqueeze(-1) & latents_of(*blocks, device=mine.values.device)
        return Latents(
            values=torch.where(redraw, fresh.values, mine.values),
            shape=torch.where(form | window, fresh.shape, mine.shape),
            noise=torch.where(noise, fresh.noise, mine.noise),
            present=torch.where(window, fresh.present, mine.present),
        )

    def _uniform(self, like: Tensor) -> Tensor:
        return torch.rand(like.shape, generator=self.generator, device=like.device)

    def _normal(self, like: Tensor) -> Tensor:
        return torch.randn(like.shape, generator=self.generator, device=like.device)

    def _pick(self, people: int, size: int, of: int) -> Tensor:
        return torch.randint(of, (people, size), generator=self.generator, device=self.generator.device)


def _drawn(probabilities: tuple[float, ...], uniform: Tensor) -> Tensor:
    """Which of some alternatives is drawn at each quantile, same shape."""
    ends = torch.tensor(probabilities, device=uniform.device).cumsum(0)[:-1]
    return torch.bucketize(uniform, ends)


def _choose(condition: Tensor, yes: Tensor, no: Tensor) -> Tensor:
    return torch.where(condition.unsqueeze(-1) if yes.dim() > condition.dim() else condition, yes, no)


def _replace(old: Tensor, part: slice, new: Tensor) -> Tensor:
    result = old.clone()
    result[:, part] = new
    return result
