"""Particles of priors and random trials, for the engine and for the reference."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.models.particles import jumps, latents
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.compiled import Law
from isiw.models.particles.latents import Latents
from isiw.models.particles.levels import CARRIED
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.places import Place
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.supra import jumps as supra_jumps
from isiw.models.particles.supra import prior as supra_prior
from isiw.models.shared.history import Circumstances, History
from isiw.models.shared.scales import Scale
from isiw.native import engine
from isiw.native.engine import COLUMNS, RESPONSE_LEVELS
from isiw.types import IntArray, Singles
from native import reference

PLACES: Final = ProfilePrior(
    places=(Place(0.5, Scale(230.0, 12.0), Scale(80.0, 0.3)), Place(0.2, Scale(90.0, 9.0), Scale(60.0, 0.2)))
)


OF_LEVELS: Final = tuple(f"level_{name}_{level}" for name in ("at", "mean", "sd") for level in range(RESPONSE_LEVELS))


class Case(NamedTuple):
    """A prior in a space."""

    prior: Any
    space: DesignSpace
    by_levels: bool = False  # whether particles may have a law by levels

    @property
    def supra(self) -> bool:
        """Whether it is that of TMS above the motor threshold."""
        return isinstance(self.prior, supra_prior.SupraPrior)

    @property
    def law(self) -> Law:
        """The prior as the engine has it."""
        if self.supra:
            return supra_jumps.law_of(self.prior, self.space)
        return jumps.law_of(self.prior, self.space, by_levels=self.by_levels)

    def drawn(self, particles: int, seed: int, people: int = 1) -> Latents:
        """Particles of the prior; levels are any."""
        made = Latents(*self.law.draws(particles, seeds(seed, people)))
        if self.by_levels:
            rng, shape = np.random.default_rng(seed), (people, particles, RESPONSE_LEVELS)
            places, sds = np.cumsum(rng.uniform(0.5, 9.0, shape), -1) - 4.0, rng.uniform(0.1, 1.2, shape)
            made.values[..., -CARRIED:] = np.concatenate((places, rng.normal(-3.5, 1.0, shape), sds), axis=-1)
        return made

    def of_all_kinds(self, particles: int, seed: int) -> Latents:
        """Particles of one person, all kinds of them as often."""
        rng, made = np.random.default_rng(seed), self.drawn(particles, seed)
        kinds = {"shape": 4, "noise": len(NoiseKind) - (not self.by_levels), "present": 2, "change": len(ChangeKind)}
        for name, number in ({"present": 2, "depressed": 2} if self.supra else kinds).items():
            made = made.with_kind(name, rng.integers(number, size=(1, particles)))
        return made

    def particles(self, made: Latents, person: int = 0) -> list[reference.Particle]:
        """One person's particles as the reference has them."""
        names = supra_prior.LATENTS if self.supra else (*latents.LATENTS, *(OF_LEVELS if self.by_levels else ()))
        each = zip(made.values[person].tolist(), made.kinds[person].tolist(), strict=True)
        return [reference.Particle.of(names, values, kinds) for values, kinds in each]

    def fields(self, made: Latents, trials: int = -1) -> Singles:
        """The particles as the engine has them after so many trials, or with their changes, (b, p, fields)."""
        return self.law.meanings(*made, trials)


CASES: Final = {
    "default": Case(Prior(), VALVE_SPACE),
    "places": Case(Prior(PLACES), VALVE_SPACE),
    "by levels": Case(Prior(), VALVE_SPACE, by_levels=True),
    "supra": Case(supra_prior.SupraPrior(), DesignSpace(0, 200, reference="impact")),
}


def seeds(seed: int, people: int = 1) -> Any:
    """Of the engine's draws for each person, (b,)."""
    return np.random.default_rng(seed).integers(2**64, size=people, dtype=np.uint64)


def trials(number: int, rng: np.random.Generator, *, known_log_sd: float = 0.0) -> list[reference.Trial]:
    """Trials with points and intervals, TMS alone, uncertain ISIs, known parts and other pulses."""
    found = []
    for order in range(number):
        low = rng.normal(-3.0, 1.2)
        high = low + rng.choice([0.0, 0.0, 0.3, math.inf])
        if rng.random() < 0.1:
            low, high = -math.inf, low
        known_mv = rng.choice([0.0, 0.0, 0.03])
        found.append(
            reference.Trial(
                order=order,
                isi_ms=math.nan if rng.random() < 0.15 else rng.uniform(0.0, 500.0),
                low=low,
                high=high,
                isi_sd_ms=rng.choice([0.0, 3.0]),
                known_mv=known_mv,
                known_sd_mv=0.5 * known_mv,
                known_log_sd=known_log_sd * rng.random(),
                shift_pct_rmt=rng.choice([0.0, -5.0]),
                log_by_curves=rng.choice([math.nan, math.nan, -1.3]),
                counts=rng.choice([1.0, 0.3]),
            )
        )
    return found


def columns(told: list[reference.Trial]) -> Singles:
    """The trials as the engine has them, (1, n, columns)."""
    made = [
        [
            *(trial.isi_ms, trial.isi_sd_ms, trial.low, trial.high, trial.order, trial.known_mv, trial.known_sd_mv),
            *(trial.known_log_sd, trial.shift_pct_rmt, trial.log_by_curves, trial.counts),
        ]
        for trial in told
    ]
    return np.array(made, dtype=np.float32).reshape(1, -1, COLUMNS)


def history(people: int, number: int, seed: int, **around: float) -> History:
    """Random trials of each person that nothing else bears on, unless some of `Circumstances` are given."""
    rng = np.random.default_rng(seed)
    made = np.concatenate([columns(trials(number, rng)) for _ in range(people)])
    made[..., COLUMNS - len(Circumstances._fields) :] = Circumstances(**around)
    return History(made)


def sweeps(
    law: Law, numbers: IntArray, columns: Singles, dice: Any, state: tuple[Singles, IntArray, Singles, Singles]
) -> Singles:
    """Move each person's particles so many times (b,), in place; the counts of their moves, (b, 4).

    Args:
        law: the prior and the moves.
        numbers: how often each person's particles move, (b,).
        columns: the trials, (b, n, columns).
        dice: seeds, which move on, (b,).
        state: latents, kinds, log likelihood and log densities of blocks of the particles, which change.

    Returns:
        Shifts, those that were accepted, jumps, and those that were accepted, (b, 4).
    """
    (people, particles, latents), trials = state[0].shape, columns.shape[1]
    assert latents == law.latents
    counts, of = np.zeros((people, 4), dtype=np.float32), (people, particles)
    arrays: list[tuple[Any, Any, tuple[int, ...]]] = [
        (numbers, engine.WHOLE, (people,)),
        (columns, engine.SINGLE, (people, trials, engine.COLUMNS)),
        (dice, engine.NATURAL, (people,)),
        (state[0], engine.SINGLE, (*of, latents)),
        (state[1], engine.WHOLE, (*of, engine.KINDS)),
        (state[2], engine.SINGLE, of),
        (state[3], engine.SINGLE, (*of, law.blocks + 1)),
        (counts, engine.SINGLE, (people, 4)),
    ]
    at = (engine.address(array, dtype, *shape) for array, dtype, shape in arrays)
    engine.call("sweeps", law._at, people, particles, trials, *at)  # noqa: SLF001 - only tests move alone
    return counts


ELEMENTARY = ("exp", "exp2", "log", "per", "per_root", "between")


def elementary(name: str, x: Singles, y: Singles | None = None) -> Singles:
    """One of the elementary functions that the engine is made of, of some numbers (n,).

    `between` is the probability that a standard normal variable is between x and y.
    """
    found = np.empty(len(x), dtype=np.float32)
    arrays = (engine.address(array, engine.SINGLE, len(x)) for array in (x, x if y is None else y, found))
    engine.call("elementary", ELEMENTARY.index(name), len(x), *arrays)
    return found
