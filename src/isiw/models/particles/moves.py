"""Markov chain moves of particles that leave the posterior of the trials so far unchanged.

Half of the particles move at a time, by differences within the other half (ter Braak, Stat. Comput. 16, 2006), or jump:
some of their kinds and the latents that go with them are drawn anew from the prior.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from isiw.lazy import torch
from isiw.models.particles.latents import Latents
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.mixture import drawn
from isiw.models.particles.prior import Person
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.native.engine import Tables
from isiw.types import FloatArray

JUMP_PROBABILITY = 0.4
PART_PROBABILITY = (0.25, 0.30, 0.25, 0.20)
"""How often a difference moves all latents, those of the profile alone, those of the response alone, and place, floor
and size alone: particles whose floor is far off have another window and gain as well, and leave that with all three."""

RECENT = 0.8
"""How often the trial of another change is proposed among those so far."""

NEARLY, A_LITTLE = 2.0, 0.3
"""SDs of the moves of a change: by how many trials, and at most by what size."""

OF_STEPS, STEP_SD = 0.7, 0.3
"""How often a size is proposed near the step of the amplitudes at its trial, and how near, natural log."""

ANOTHER_KIND = 0.25
"""How often a change that moves a little becomes one of another kind."""

BLUR = 0.02
"""SD of what is added to a difference, as a share of the usual SD of each latent."""


class Target(Protocol):
    """Whose posterior particles move under: a prior over people, and what may be drawn anew at once."""

    @property
    def spreads(self) -> Tensor:
        """Usual SD of each latent, shape (d,)."""

    def person(self, latents: Latents) -> Person:
        """What particles mean."""

    def tables(self) -> Tables:
        """What the engine knows of the prior and of what moves may do."""

    def log_prior(self, latents: Latents) -> Tensor:
        """Log prior density of their latents but for a constant, shape (b, p)."""

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of, but for a constant, shape (b, p)."""

    def shifted(self, latents: Latents, part: Tensor) -> Tensor:
        """Which latents a difference moves: those of a part that mean anything to the particle, shape (b, p, d)."""

    def jumped(self, latents: Latents, generator: torch.Generator, steps: Tensor) -> tuple[Latents, Tensor]:
        """Particles some of whose kinds and latents are drawn anew from the prior, or near where the trials so far are.

        With them comes the log ratio of prior to proposal, after the jump and before; 0 for draws from the prior. The
        steps are those of `steps_of` for the person of each particle.
        """


class Moved(NamedTuple):
    """Particles after sweeps of moves."""

    latents: Latents  # fields of shape (b, p)
    log_likelihood: Tensor  # of the history under each of them, (b, p)
    shifts: Tensor  # share that was accepted, (b,); NaN where there were none
    jumps: Tensor  # likewise


class _Weighed(NamedTuple):
    """Particles, the log likelihood of the history under each, and their log prior density; all (b, p)."""

    latents: Latents
    log_likelihood: Tensor
    log_prior: Tensor

    def part(self, which: slice) -> _Weighed:
        latents = self.latents.each(lambda field: field[:, which])
        return _Weighed(latents, self.log_likelihood[:, which], self.log_prior[:, which])


@dataclass(frozen=True)
class Mover:
    """Moves particles under the posterior of a history."""

    target: Target
    history: History
    generator: torch.Generator

    @cached_property
    def steps(self) -> Tensor:
        """By how much amplitudes are larger from each trial on; see `steps_of`."""
        return torch.from_numpy(steps_of(self.history)).to(self.history.log_mep.device)

    def sweeps(self, number: int, latents: Latents, log_likelihood: Tensor) -> Moved:
        """Move every particle some times."""
        if not number:
            return Moved(latents, log_likelihood, *log_likelihood.new_full((2, len(log_likelihood)), torch.nan))
        half = log_likelihood.shape[-1] // 2
        everyone = _Weighed(latents, log_likelihood, self.target.log_prior(latents))
        first, second = everyone.part(slice(0, half)), everyone.part(slice(half, None))
        counts = log_likelihood.new_zeros((4, len(log_likelihood)))
        for _ in range(number):
            first = self._step(first, second.latents, counts)
            second = self._step(second, first.latents, counts)
        both = first.latents.each(lambda *halves: torch.cat(halves, dim=1), second.latents)
        shifts, shifted, jumps, jumped = counts
        log_likelihood = torch.cat((first.log_likelihood, second.log_likelihood), dim=1)
        return Moved(both, log_likelihood, shifted / shifts, jumped / jumps)

    def _step(self, mine: _Weighed, theirs: Latents, counts: Tensor) -> _Weighed:
        jumps = self._uniform(mine.log_prior) < JUMP_PROBABILITY
        where = jumps.nonzero(as_tuple=True)
        shifted = self._shift(mine.latents, theirs)
        jumping = mine.latents.each(lambda field: field[where])
        jumped, favour = self.target.jumped(jumping, self.generator, self.steps[where[0]])
        proposal = shifted.each(lambda field, after: field.index_put(where, after), jumped)
        log_likelihood = total_log_likelihood(self.target.person(proposal), self.history)
        log_prior = self.target.log_prior(proposal)
        # A jump draws from the prior, so that its density cancels, where what it leads to is possible at all.
        possible = torch.where(log_prior.isneginf(), log_prior, 0.0).index_put(where, favour, accumulate=True)
        prior_ratio = torch.where(jumps, possible, log_prior - mine.log_prior)
        accept = torch.log(self._uniform(log_prior)) < log_likelihood - mine.log_likelihood + prior_ratio
        counts += torch.stack([~jumps, accept & ~jumps, jumps, accept & jumps]).sum(-1)
        return _Weighed(
            proposal.each(lambda after, before: torch.where(accept.unsqueeze(-1), after, before), mine.latents),
            torch.where(accept, log_likelihood, mine.log_likelihood),
            torch.where(accept, log_prior, mine.log_prior),
        )

    def _shift(self, mine: Latents, theirs: Latents) -> Latents:
        """Add a scaled difference of two of the others."""
        like, dice, device = mine.values[..., 0], self.generator, self.generator.device
        who = torch.arange(len(like), device=like.device).unsqueeze(-1)
        picks = (torch.randint(theirs.values.shape[1], like.shape, generator=dice, device=device) for _ in range(2))
        first, second = (theirs.values[who, pick] for pick in picks)
        moves = self.target.shifted(mine, drawn(PART_PROBABILITY, self._uniform(like)))
        scale = torch.where(self._uniform(like) < 0.1, 1.0, 0.15 + 0.7 * self._uniform(like))
        normal = torch.randn(mine.values.shape, generator=dice, dtype=like.dtype, device=device)
        blur = BLUR * self.target.spreads.to(mine.values) * normal
        return mine._replace(values=mine.values + moves * (scale.unsqueeze(-1) * (first - second) + blur))

    def _uniform(self, like: Tensor) -> Tensor:
        return torch.rand(like.shape, generator=self.generator, dtype=like.dtype, device=like.device)


def steps_of(history: History) -> FloatArray:
    """By how much the mean log MEP is larger from each trial on than before it, and 0 for all and none, (b, n + 1)."""
    log_mep, high = history.log_mep.cpu().numpy(), history.log_mep_high.cpu().numpy()
    log_mep = np.where(np.isfinite(log_mep), log_mep, np.where(np.isfinite(high), high, 0.0))
    people, trials = log_mep.shape
    before, count = np.zeros((people, trials + 1), dtype=np.float32), np.arange(trials + 1)
    before[:, 1:] = log_mep.cumsum(-1, dtype=float)
    later, earlier = (np.maximum(n, 1).astype(np.float32) for n in (trials - count, count))
    steps: FloatArray = (before[:, -1:] - before) / later - before / earlier
    steps[:, 0] = steps[:, -1] = 0.0
    return steps
