"""Who computes with particles: torch, or the compiled engine on one processor; both have the same law.

The same seed leads to other draws with each, so that a log states which it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, TypeAlias

import numpy as np

from isiw.lazy import torch
from isiw.models.particles.latents import Latents
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.moves import Moved, Mover, Target, steps_of
from isiw.models.particles.prior import Person
from isiw.models.particles.records import columns_of
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.native.engine import UNKNOWN, Law, log_likelihoods
from isiw.types import FloatArray, IntArray

EngineName: TypeAlias = Literal["compiled", "torch"]


class Engine(Protocol):
    """What particles are weighed and moved by."""

    def meaning(self, latents: Latents, trials: int) -> Person | FloatArray:
        """What particles mean after so many trials, as torch or as the engine has it."""

    def log_likelihood(self, latents: Latents, history: History) -> Tensor:
        """Log likelihood of a history under each particle, shape (b, p)."""

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of, but for a constant, shape (b, p)."""

    def sweeps(
        self, numbers: Tensor, latents: Latents, log_likelihood: Tensor, history: History, generator: torch.Generator
    ) -> Moved:
        """Move every particle under the posterior of a history, those of each person so many times (b,)."""


def engine_for(name: EngineName, target: Target, device: str = "cpu") -> Engine:
    """The engine that is wanted; torch alone computes on other devices than the CPU."""
    if name == "torch" or device != "cpu":
        return TorchEngine(target)
    return Compiled(target)


@dataclass(frozen=True)
class TorchEngine:
    """Torch, on any device: what the compiled engine is tested against."""

    target: Target

    def meaning(self, latents: Latents, trials: int) -> Person:
        """What particles mean; see `Engine`."""
        return self.target.person(latents).after(trials)

    def log_likelihood(self, latents: Latents, history: History) -> Tensor:
        """Log likelihood of a history under each particle; see `Engine`."""
        return total_log_likelihood(self.target.person(latents), history)

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of; see `Engine`."""
        return self.target.log_usual(latents)

    def sweeps(
        self, numbers: Tensor, latents: Latents, log_likelihood: Tensor, history: History, generator: torch.Generator
    ) -> Moved:
        """Move every particle some times; see `Engine`."""
        values, kinds, found = (field.clone() for field in (latents.values, latents.kinds, log_likelihood))
        accepted = found.new_empty((2, len(found)))
        for number in sorted(set(numbers.tolist())):  # those who move equally often, side by side
            who = numbers == number
            some = Latents(values[who], kinds[who])
            moved = Mover(self.target, history.of_people(who), generator).sweeps(number, some, found[who])
            values[who], kinds[who], found[who] = *moved.latents[:2], moved.log_likelihood
            accepted[:, who] = torch.stack((moved.shifts, moved.jumps))
        return Moved(Latents(values, kinds), found, *accepted)


@dataclass(frozen=True)
class Compiled:
    """The compiled engine, on one processor."""

    target: Target

    @cached_property
    def law(self) -> Law:
        """The target as the engine has it."""
        return Law(self.target.tables())

    def meaning(self, latents: Latents, trials: int) -> FloatArray:
        """Fields of particles; see `Engine`."""
        return self.law.meanings(*_arrays(latents), trials)

    def log_likelihood(self, latents: Latents, history: History) -> Tensor:
        """Log likelihood of a history under each particle; see `Engine`."""
        return log_likelihood_of(self.meaning(latents, -1), history)

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of; see `Engine`."""
        return torch.from_numpy(self.law.log_usual(*_arrays(latents), self._log_blocks(latents)))

    def sweeps(
        self, numbers: Tensor, latents: Latents, log_likelihood: Tensor, history: History, generator: torch.Generator
    ) -> Moved:
        """Move every particle some times; see `Engine`."""
        arrays = (*_arrays(latents), log_likelihood.contiguous().numpy(), self._log_blocks(latents))
        values, kinds, found, log_blocks = state = tuple(array.copy() for array in arrays)
        dice = torch.randint(2**63 - 1, (len(found),), generator=generator).numpy().view(np.uint64)
        counts = self.law.sweeps(numbers.numpy(), columns_of(history), steps_of(history), dice, state)
        shifts, shifted, jumps, jumped = torch.from_numpy(counts).T
        moved = Latents(*(torch.from_numpy(array) for array in (values, kinds, log_blocks)))
        return Moved(moved, torch.from_numpy(found), shifted / shifts, jumped / jumps)

    def _log_blocks(self, latents: Latents) -> FloatArray:
        if latents.log_blocks is None:
            return np.full((*latents.values.shape[:2], self.law.blocks), UNKNOWN)
        log_blocks: FloatArray = latents.log_blocks.contiguous().numpy()
        return log_blocks


def _arrays(latents: Latents) -> tuple[FloatArray, IntArray]:
    return latents.values.contiguous().numpy(), latents.kinds.contiguous().numpy()


def log_likelihood_of(fields: FloatArray, history: History) -> Tensor:
    """Log likelihood of a history under each of some particles as the engine has them, shape (b, p)."""
    return torch.from_numpy(log_likelihoods(fields, columns_of(history)))
