"""Markov chain moves of particles that leave the posterior of the trials so far unchanged.

Half of the particles move at a time, by differences within the other half (ter Braak, Stat. Comput. 16, 2006), or jump
to another kind of profile, of noise, or to and from "no window", the latents concerned drawn anew from the prior.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final, NamedTuple

import torch

from isiw.design import DesignSpace
from isiw.models.particles.latents import PROFILE_BLOCKS, RESPONSE_BLOCKS, Latents, latents_of, used_by
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.mixture import drawn
from isiw.models.particles.prior import Prior
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History

__all__ = ["Moved", "Mover"]

JUMP_PROBABILITY = 0.3
PART_PROBABILITY = (0.35, 0.35, 0.30)
"""How often a difference moves all latents, those of the profile alone, and those of the response alone."""

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
"""The blocks of latents that each jump draws anew."""

BLUR = 0.02
"""SD of what is added to a difference, as a share of the usual SD of each latent."""


class Moved(NamedTuple):
    """Particles after sweeps of moves.

    Args:
        latents: the particles, fields of shape (b, p).
        log_likelihood: of the history under each of them, shape (b, p).
        shifts: share of the shifts that were accepted, shape (b,); NaN where there were none.
        jumps: share of the jumps that were accepted, shape (b,); NaN where there were none.
    """

    latents: Latents
    log_likelihood: Tensor
    shifts: Tensor
    jumps: Tensor


class _Weighed(NamedTuple):
    """Particles, the log likelihood of the history under each, and their log prior density; all (b, p)."""

    latents: Latents
    log_likelihood: Tensor
    log_prior: Tensor

    def part(self, which: slice) -> _Weighed:
        latents = Latents(*(field[:, which] for field in self.latents))
        return _Weighed(latents, self.log_likelihood[:, which], self.log_prior[:, which])


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

    def sweeps(self, number: int, latents: Latents, log_likelihood: Tensor) -> Moved:
        """Move every particle some times.

        Args:
            number: how often.
            latents: particles, fields of shape (b, p); whatever weights they have, they keep.
            log_likelihood: of the history under each of them, shape (b, p).
        """
        if not number:
            return Moved(latents, log_likelihood, *torch.full((2, len(log_likelihood)), torch.nan))
        half = latents.present.shape[-1] // 2
        everyone = _Weighed(latents, log_likelihood, self.prior.log_density(latents.values, self.space))
        first, second = everyone.part(slice(0, half)), everyone.part(slice(half, None))
        counts = torch.zeros(4, len(log_likelihood), device=log_likelihood.device)
        for _ in range(number):
            first = self._step(first, second.latents, counts)
            second = self._step(second, first.latents, counts)
        latents = Latents(*(torch.cat(halves, dim=1) for halves in zip(first.latents, second.latents, strict=True)))
        shifts, shifted, jumps, jumped = counts
        log_likelihood = torch.cat((first.log_likelihood, second.log_likelihood), dim=1)
        return Moved(latents, log_likelihood, shifted / shifts, jumped / jumps)

    def _step(self, mine: _Weighed, theirs: Latents, counts: Tensor) -> _Weighed:
        like = mine.log_likelihood
        jumps = self._uniform(like) < JUMP_PROBABILITY
        shifted, jumped = self._shift(mine.latents, theirs), self._jump(mine.latents, jumps)
        proposal = Latents(*(a.index_put((jumps,), b) for a, b in zip(shifted, jumped, strict=True)))
        log_likelihood = total_log_likelihood(self.prior.person(proposal), self.history)
        log_prior = self.prior.log_density(proposal.values, self.space)
        # A jump draws from the prior, so that its density cancels.
        prior_ratio = torch.where(jumps, 0.0, log_prior - mine.log_prior)
        accept = torch.log(self._uniform(like)) < log_likelihood - mine.log_likelihood + prior_ratio
        counts += torch.stack([who.sum(-1) for who in (~jumps, accept & ~jumps, jumps, accept & jumps)])
        return _Weighed(
            Latents(*(_choose(accept, a, b) for a, b in zip(proposal, mine.latents, strict=True))),
            torch.where(accept, log_likelihood, mine.log_likelihood),
            torch.where(accept, log_prior, mine.log_prior),
        )

    def _shift(self, mine: Latents, theirs: Latents) -> Latents:
        """Add a scaled difference of two of the others, in those latents that mean anything to the particle."""
        people, size, _ = mine.values.shape
        who = torch.arange(people, device=mine.values.device).unsqueeze(-1)
        first, second = (theirs.values[who, self._pick(people, size, theirs.values.shape[1])] for _ in range(2))
        part = drawn(PART_PROBABILITY, self._uniform(mine.present))
        moves = _shifted(mine.values.device)[part] & used_by(mine.noise, mine.present)
        scale = torch.where(self._uniform(mine.present) < 0.1, 1.0, 0.15 + 0.7 * self._uniform(mine.present))
        blur = BLUR * self.prior.spreads.to(mine.values) * self._normal(mine.values)
        return mine._replace(values=mine.values + moves * (scale.unsqueeze(-1) * (first - second) + blur))

    def _jump(self, mine: Latents, who: Tensor) -> Latents:
        """Some of the particles, some of their kinds and the latents that go with them drawn anew from the prior.

        Args:
            mine: particles, fields of shape (b, p).
            who: which of them jump, shape (b, p).

        Returns:
            Those who jump, fields of shape (n,).
        """
        before = Latents(*(field[who] for field in mine))
        fresh = self.prior.sample(1, len(before.present), self.generator, self.space)
        jump = drawn(tuple(JUMPS.values()), self._uniform(before.present))
        form, noise, window, _, _ = (jump == number for number in range(len(JUMPS)))
        redraw = _redrawn(mine.values.device)[jump]
        return Latents(
            values=torch.where(redraw, fresh.values[0], before.values),
            shape=torch.where(form | window, fresh.shape[0], before.shape),
            noise=torch.where(noise, fresh.noise[0], before.noise),
            present=torch.where(window, fresh.present[0], before.present),
        )

    def _uniform(self, like: Tensor) -> Tensor:
        return torch.rand(like.shape, generator=self.generator, device=like.device)

    def _normal(self, like: Tensor) -> Tensor:
        return torch.randn(like.shape, generator=self.generator, device=like.device)

    def _pick(self, people: int, size: int, of: int) -> Tensor:
        return torch.randint(of, (people, size), generator=self.generator, device=self.generator.device)


@cache
def _shifted(device: torch.device) -> Tensor:
    """Which latents a difference moves by its part, shape (parts, d)."""
    of_profile = latents_of(*PROFILE_BLOCKS, device=device)
    return torch.stack([torch.ones_like(of_profile), of_profile, ~of_profile])


@cache
def _redrawn(device: torch.device) -> Tensor:
    """Which latents each of `JUMPS` draws anew, shape (jumps, d)."""
    return torch.stack([latents_of(*REDRAWN[jump], device=device) for jump in JUMPS])


def _choose(condition: Tensor, yes: Tensor, no: Tensor) -> Tensor:
    return torch.where(condition.unsqueeze(-1) if yes.dim() > condition.dim() else condition, yes, no)
