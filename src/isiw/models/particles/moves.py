"""Markov chain moves of particles that leave the posterior of the trials so far unchanged.

Half of the particles move at a time, by differences within the other half (ter Braak, Stat. Comput. 16, 2006), or jump:
some of their kinds and the latents that go with them are drawn anew from the prior.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, Protocol, Self, TypeVar

from isiw.lazy import torch
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.mixture import drawn
from isiw.models.particles.prior import Person
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History

JUMP_PROBABILITY = 0.3
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


class Fields(Protocol):
    """Particles as a named tuple of tensors of shape (b, p), and of the values of their latents, (b, p, d)."""

    @property
    def values(self) -> Tensor:
        """Values of the latents, shape (b, p, d)."""

    def __iter__(self) -> Iterator[Tensor]:
        """All fields."""

    def _replace(self, *, values: Tensor) -> Self: ...


L = TypeVar("L", bound=Fields)


def remade(latents: L, fields: Iterable[Tensor]) -> L:
    """Particles with other fields, in the same order."""
    made: Callable[..., L] = type(latents)
    return made(*fields)


class Target(Protocol[L]):
    """Whose posterior particles move under: a prior over people, and what may be drawn anew at once."""

    @property
    def spreads(self) -> Tensor:
        """Usual SD of each latent, shape (d,)."""

    def person(self, latents: L) -> Person:
        """What particles mean."""

    def log_prior(self, latents: L) -> Tensor:
        """Log prior density of their latents but for a constant, shape (b, p)."""

    def log_usual(self, latents: L) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of, but for a constant, shape (b, p)."""

    def shifted(self, latents: L, part: Tensor) -> Tensor:
        """Which latents a difference moves: those of a part that mean anything to the particle, shape (b, p, d)."""

    def jumped(self, latents: L, generator: torch.Generator, steps: Tensor) -> tuple[L, Tensor]:
        """Particles some of whose kinds and latents are drawn anew from the prior, or near where the trials so far are.

        With them comes the log ratio of prior to proposal, after the jump and before; 0 for draws from the prior. The
        steps are those of `steps_of` for the person of each particle.
        """


class Moved(NamedTuple, Generic[L]):
    """Particles after sweeps of moves."""

    latents: L  # fields of shape (b, p)
    log_likelihood: Tensor  # of the history under each of them, (b, p)
    shifts: Tensor  # share that was accepted, (b,); NaN where there were none
    jumps: Tensor  # likewise


class _Weighed(NamedTuple, Generic[L]):
    """Particles, the log likelihood of the history under each, and their log prior density; all (b, p)."""

    latents: L
    log_likelihood: Tensor
    log_prior: Tensor

    def part(self, which: slice) -> _Weighed[L]:
        latents = remade(self.latents, (field[:, which] for field in self.latents))
        return _Weighed(latents, self.log_likelihood[:, which], self.log_prior[:, which])


@dataclass(frozen=True)
class Mover(Generic[L]):
    """Moves particles under the posterior of a history."""

    target: Target[L]
    history: History
    generator: torch.Generator

    @cached_property
    def steps(self) -> Tensor:
        """By how much amplitudes are larger from each trial on; see `steps_of`."""
        return steps_of(self.history)

    def sweeps(self, number: int, latents: L, log_likelihood: Tensor) -> Moved[L]:
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
        both = remade(latents, (torch.cat(halves, dim=1) for halves in zip(first.latents, second.latents, strict=True)))
        shifts, shifted, jumps, jumped = counts
        log_likelihood = torch.cat((first.log_likelihood, second.log_likelihood), dim=1)
        return Moved(both, log_likelihood, shifted / shifts, jumped / jumps)

    def _step(self, mine: _Weighed[L], theirs: L, counts: Tensor) -> _Weighed[L]:
        jumps = self._uniform(mine.log_prior) < JUMP_PROBABILITY
        where = jumps.nonzero(as_tuple=True)
        shifted = self._shift(mine.latents, theirs)
        jumped, favour = self.target.jumped(
            remade(mine.latents, (field[where] for field in mine.latents)), self.generator, self.steps[where[0]]
        )
        proposal = remade(shifted, (a.index_put(where, b) for a, b in zip(shifted, jumped, strict=True)))
        log_likelihood = total_log_likelihood(self.target.person(proposal), self.history)
        log_prior = self.target.log_prior(proposal)
        # A jump draws from the prior, so that its density cancels, where what it leads to is possible at all.
        possible = torch.where(log_prior.isneginf(), log_prior, 0.0).index_put(where, favour, accumulate=True)
        prior_ratio = torch.where(jumps, possible, log_prior - mine.log_prior)
        accept = torch.log(self._uniform(log_prior)) < log_likelihood - mine.log_likelihood + prior_ratio
        counts += torch.stack([~jumps, accept & ~jumps, jumps, accept & jumps]).sum(-1)
        return _Weighed(
            remade(mine.latents, (_choose(accept, a, b) for a, b in zip(proposal, mine.latents, strict=True))),
            torch.where(accept, log_likelihood, mine.log_likelihood),
            torch.where(accept, log_prior, mine.log_prior),
        )

    def _shift(self, mine: L, theirs: L) -> L:
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


def steps_of(history: History) -> Tensor:
    """By how much the mean log MEP is larger from each trial on than before it, and 0 for all and none, (b, n + 1)."""
    log_mep = torch.where(history.log_mep.isfinite(), history.log_mep, history.log_mep_high).nan_to_num(0.0, 0.0, 0.0)
    before = torch.nn.functional.pad(log_mep.cumsum(-1), (1, 0))
    trials = before.shape[-1] - 1
    count = torch.arange(trials + 1, device=before.device)
    steps = (before[:, -1:] - before) / (trials - count).clamp_min(1) - before / count.clamp_min(1)
    return torch.where((count > 0) & (count < trials), steps, 0.0)


def _choose(condition: Tensor, yes: Tensor, no: Tensor) -> Tensor:
    return torch.where(condition.unsqueeze(-1) if yes.dim() > condition.dim() else condition, yes, no)
