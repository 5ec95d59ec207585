"""Markov chain moves of particles with both kinds of segment; as `isiw.models.particles.moves`, with other jumps.

Half of the particles move at a time, by differences within the other half [terBraak2006], or draw a segment, its place,
both places or the recruitment curve anew from the prior.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final, NamedTuple

import torch

from isiw.design import DesignSpace
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.mixture import drawn
from isiw.models.particles.moves import BLUR, JUMP_PROBABILITY, PART_PROBABILITY
from isiw.models.particles.supra.prior import BLOCKS, LATENTS, SupraLatents, SupraPrior
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History

__all__ = ["SupraMoved", "SupraMover"]

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


class SupraMoved(NamedTuple):
    """Particles after sweeps of moves; see `isiw.models.particles.moves.Moved`.

    Args:
        latents: the particles, fields of shape (b, p).
        log_likelihood: of the history under each of them, shape (b, p).
        shifts: share of the shifts that were accepted, shape (b,); NaN where there were none.
        jumps: share of the jumps that were accepted, shape (b,); NaN where there were none.
    """

    latents: SupraLatents
    log_likelihood: Tensor
    shifts: Tensor
    jumps: Tensor


class _Weighed(NamedTuple):
    """Particles, the log likelihood of the history under each, and their log prior density; all (b, p)."""

    latents: SupraLatents
    log_likelihood: Tensor
    log_prior: Tensor

    def part(self, which: slice) -> _Weighed:
        latents = SupraLatents(*(field[:, which] for field in self.latents))
        return _Weighed(latents, self.log_likelihood[:, which], self.log_prior[:, which])


@dataclass(frozen=True)
class SupraMover:
    """Moves particles under the posterior of a history.

    Args:
        prior: the prior.
        space: the design space.
        history: the trials so far.
        generator: source of randomness.
    """

    prior: SupraPrior
    space: DesignSpace
    history: History
    generator: torch.Generator

    def sweeps(self, number: int, latents: SupraLatents, log_likelihood: Tensor) -> SupraMoved:
        """Move every particle some times.

        Args:
            number: how often.
            latents: particles, fields of shape (b, p); whatever weights they have, they keep.
            log_likelihood: of the history under each of them, shape (b, p).
        """
        if not number:
            return SupraMoved(latents, log_likelihood, *torch.full((2, len(log_likelihood)), torch.nan))
        log_prior = self.prior.log_density(latents.values, self.space)
        everyone, half = _Weighed(latents, log_likelihood, log_prior), log_prior.shape[-1] // 2
        first, second = everyone.part(slice(0, half)), everyone.part(slice(half, None))
        counts = torch.zeros(4, len(log_likelihood), device=log_likelihood.device)
        for _ in range(number):
            first = self._step(first, second.latents, counts)
            second = self._step(second, first.latents, counts)
        both = SupraLatents(*(torch.cat(fields, dim=1) for fields in zip(first.latents, second.latents, strict=True)))
        shifts, shifted, jumps, jumped = counts
        likelihood = torch.cat((first.log_likelihood, second.log_likelihood), dim=1)
        return SupraMoved(both, likelihood, shifted / shifts, jumped / jumps)

    def _step(self, mine: _Weighed, theirs: SupraLatents, counts: Tensor) -> _Weighed:
        like = mine.log_likelihood
        jumps = self._uniform(like) < JUMP_PROBABILITY
        proposal = _chosen(jumps, self._jump(mine.latents), self._shift(mine.latents, theirs))
        log_likelihood = total_log_likelihood(self.prior.person(proposal), self.history)
        log_prior = self.prior.log_density(proposal.values, self.space)
        # A jump draws from the prior, so that its density cancels, but for segments that then overlap.
        possible = torch.where(log_prior.isneginf(), -torch.inf, 0.0)
        prior_ratio = torch.where(jumps, possible, log_prior - mine.log_prior)
        accept = torch.log(self._uniform(like)) < log_likelihood - mine.log_likelihood + prior_ratio
        counts += torch.stack([who.sum(-1) for who in (~jumps, accept & ~jumps, jumps, accept & jumps)])
        return _Weighed(
            _chosen(accept, proposal, mine.latents),
            torch.where(accept, log_likelihood, mine.log_likelihood),
            torch.where(accept, log_prior, mine.log_prior),
        )

    def _shift(self, mine: SupraLatents, theirs: SupraLatents) -> SupraLatents:
        """Add a scaled difference of two of the others, in those latents that mean anything to the particle."""
        people, size, _ = mine.values.shape
        who = torch.arange(people, device=mine.values.device).unsqueeze(-1)
        first, second = (theirs.values[who, self._pick(people, size, theirs.values.shape[1])] for _ in range(2))
        part = drawn(PART_PROBABILITY, self._uniform(mine.enhanced))
        moves = _parts(mine.values.device)[part] & _used(mine)
        scale = torch.where(self._uniform(mine.enhanced) < 0.1, 1.0, 0.15 + 0.7 * self._uniform(mine.enhanced))
        noise = torch.randn(mine.values.shape, generator=self.generator, device=mine.values.device)
        blur = BLUR * self.prior.spreads.to(mine.values) * noise
        return mine._replace(values=mine.values + moves * (scale.unsqueeze(-1) * (first - second) + blur))

    def _jump(self, mine: SupraLatents) -> SupraLatents:
        """Draw some latents, and whether their segment is there, anew from the prior."""
        people, size = mine.enhanced.shape
        fresh = self.prior.draw(people, size, self.generator, self.space)
        jump = drawn(tuple(JUMPS.values()), self._uniform(mine.enhanced))
        redraw = torch.stack([_latents(*names, device=mine.values.device) for names in REDRAWN.values()])[jump]
        return SupraLatents(
            values=torch.where(redraw, fresh.values, mine.values),
            enhanced=torch.where(jump == 0, fresh.enhanced, mine.enhanced),
            depressed=torch.where(jump == 1, fresh.depressed, mine.depressed),
        )

    def _uniform(self, like: Tensor) -> Tensor:
        return torch.rand(like.shape, generator=self.generator, device=like.device)

    def _pick(self, people: int, size: int, of: int) -> Tensor:
        return torch.randint(of, (people, size), generator=self.generator, device=self.generator.device)


@cache
def _latents(*names: str, device: torch.device) -> Tensor:
    """Which latents have some names, shape (d,)."""
    return torch.tensor([name in names for name in LATENTS], device=device)


@cache
def _parts(device: torch.device) -> Tensor:
    """Which latents a difference moves by its part: all, those of the segments, and all others, shape (parts, d)."""
    of_segments = _latents(*BLOCKS["enhanced"], *BLOCKS["depressed"], device=device)
    return torch.stack([torch.ones_like(of_segments), of_segments, ~of_segments])


def _used(latents: SupraLatents) -> Tensor:
    """Which latents mean anything to particles, shape (b, p, d); all others are as the prior draws them."""
    enhanced, depressed = (_latents(*BLOCKS[name], device=latents.values.device) for name in ("enhanced", "depressed"))
    return (~enhanced | latents.enhanced.unsqueeze(-1)) & (~depressed | latents.depressed.unsqueeze(-1))


def _chosen(condition: Tensor, yes: SupraLatents, no: SupraLatents) -> SupraLatents:
    """The one or the other of each particle."""
    return SupraLatents(
        torch.where(condition.unsqueeze(-1), yes.values, no.values),
        torch.where(condition, yes.enhanced, no.enhanced),
        torch.where(condition, yes.depressed, no.depressed),
    )
