"""Who computes with particles: torch, or compiled loops on one processor; both have the same law.

The same seed leads to other draws with each, so that a log states which it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, TypeAlias

import numpy as np

from isiw.compiled import AVAILABLE, first_of
from isiw.lazy import torch
from isiw.models.particles.kernels.likelihood import likelihoods, room_for
from isiw.models.particles.kernels.moves import UNKNOWN, log_usual, records, scratch_for, sweeps
from isiw.models.particles.kernels.records import columns_of, trial_records
from isiw.models.particles.kernels.target import KINDS, Tables
from isiw.models.particles.latents import Latents
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.moves import Moved, Mover, Target, steps_of
from isiw.models.particles.prior import Person
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.types import FloatArray, IntArray

EngineName: TypeAlias = Literal["compiled", "torch"]


class Engine(Protocol):
    """What particles are weighed and moved by."""

    def meaning(self, latents: Latents, trials: int) -> Person | FloatArray:
        """What particles mean after so many trials, as torch or as kernels have it."""

    def log_likelihood(self, latents: Latents, history: History) -> Tensor:
        """Log likelihood of a history under each particle, shape (b, p)."""

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of, but for a constant, shape (b, p)."""

    def sweeps(
        self, numbers: Tensor, latents: Latents, log_likelihood: Tensor, history: History, generator: torch.Generator
    ) -> Moved:
        """Move every particle under the posterior of a history, those of each person so many times (b,)."""


def engine_for(name: EngineName, target: Target, device: str = "cpu") -> Engine:
    """The engine that is wanted, where it can be had; else torch."""
    if name == "torch" or not AVAILABLE or device != "cpu":
        return TorchEngine(target)
    return Compiled(target)


@dataclass(frozen=True)
class TorchEngine:
    """Torch, on any device: what the kernels are tested against."""

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
    """Compiled loops on one processor."""

    target: Target

    @cached_property
    def tables(self) -> Tables:
        """What the kernels know of the target."""
        return self.target.tables()

    def meaning(self, latents: Latents, trials: int) -> FloatArray:
        """Records of particles; see `Engine`."""
        with first_of("view of particles"):
            particles: FloatArray = records(self.tables, *self._arrays(latents), trials)
        return particles

    def log_likelihood(self, latents: Latents, history: History) -> Tensor:
        """Log likelihood of a history under each particle; see `Engine`."""
        with first_of("view of particles"):
            return log_likelihood_of(records(self.tables, *self._arrays(latents), -1), history)

    def log_usual(self, latents: Latents) -> Tensor:
        """Log prior density of what ISIs are chosen with another law of; see `Engine`."""
        found, (parts, *_) = np.empty(latents.values.shape[:2], dtype=np.float32), scratch_for(self.tables)
        with first_of("prior"):
            log_usual(self.tables, *self._arrays(latents), self._log_blocks(latents), parts, found)
        return torch.from_numpy(found)

    def sweeps(
        self, numbers: Tensor, latents: Latents, log_likelihood: Tensor, history: History, generator: torch.Generator
    ) -> Moved:
        """Move every particle some times; see `Engine`."""
        people = len(log_likelihood)
        values, kinds, log_blocks = (array.copy() for array in (*self._arrays(latents), self._log_blocks(latents)))
        found, steps = log_likelihood.numpy().copy(), steps_of(history)
        dice = torch.randint(2**63 - 1, (people, 1), generator=generator).numpy().view(np.uint64)
        counts = np.zeros((people, 4), dtype=np.float32)
        with first_of("moves"):
            told, state = trial_records(columns_of(history)), (values, kinds, found, log_blocks, np.zeros(KINDS, int))
            rooms = room_for(told[0]), scratch_for(self.tables)
            sweeps(numbers.numpy(), self.tables, told, steps, state, dice, rooms, counts)
        shifts, shifted, jumps, jumped = torch.from_numpy(counts).T
        moved = Latents(*(torch.from_numpy(array) for array in (values, kinds, log_blocks)))
        return Moved(moved, torch.from_numpy(found), shifted / shifts, jumped / jumps)

    def _arrays(self, latents: Latents) -> tuple[FloatArray, IntArray]:
        return latents.values.contiguous().numpy(), latents.kinds.contiguous().numpy()

    def _log_blocks(self, latents: Latents) -> FloatArray:
        if latents.log_blocks is None:
            return np.full((*latents.values.shape[:2], len(self.tables.first)), UNKNOWN)
        log_blocks: FloatArray = latents.log_blocks.numpy()
        return log_blocks


def log_likelihood_of(particles: FloatArray, history: History) -> Tensor:
    """Log likelihood of a history under each of some particles as kernels have them, shape (b, p)."""
    found = np.empty(particles.shape[:2], dtype=np.float32)
    trials, sizes = trial_records(columns_of(history))
    likelihoods(particles, trials, sizes, room_for(trials), found)
    return torch.from_numpy(found)
