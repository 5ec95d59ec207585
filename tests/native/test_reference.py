"""The engine has the law of the reference in plain NumPy: log likelihoods of random particles and histories."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from isiw.design import VALVE_SPACE
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.engine import Compiled
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import LATENTS, Latents
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Prior
from isiw.models.particles.shapes import ShapeKind
from isiw.native.engine import COLUMNS, log_likelihoods
from native import reference

TARGET = WindowTarget(Prior(), VALVE_SPACE)


def particles(number: int, seed: int) -> Latents:
    """Particles of the prior, all kinds of them as often."""
    drawn = TARGET.prior.sample(1, number, torch.Generator().manual_seed(seed), VALVE_SPACE)
    rng = np.random.default_rng(seed)
    kinds = {"shape": len(ShapeKind), "noise": len(NoiseKind), "present": 2, "change": len(ChangeKind)}
    return Latents.of(
        drawn.values, **{k: torch.from_numpy(rng.integers(n, size=(1, number))) for k, n in kinds.items()}
    )


def trials(number: int, rng: np.random.Generator) -> list[reference.Trial]:
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
                log_offset=rng.choice([0.0, 0.2]),
                shift_pct_rmt=rng.choice([0.0, -5.0]),
                enhancement=rng.choice([1.0, 0.6]),
            )
        )
    return found


def columns(told: list[reference.Trial]) -> np.ndarray:
    """The trials as the engine has them, (1, n, columns)."""
    made = np.array(
        [
            [
                *(trial.isi_ms, trial.isi_sd_ms, trial.low, trial.high, trial.order, trial.known_mv, trial.known_sd_mv),
                *(0.0, trial.log_offset, trial.shift_pct_rmt, trial.enhancement),
            ]
            for trial in told
        ]
    )
    return made.astype(np.float32).reshape(1, -1, COLUMNS)


def furthest(number: int, seed: int) -> float:
    """By how much log likelihoods of so many particles and as many histories differ, at most [nat]."""
    drawn, rng, apart = particles(number, seed), np.random.default_rng(seed), 0.0
    fields = Compiled(TARGET).meaning(drawn, -1)
    for i in range(number):
        told, (shape, noise, present, _, change) = trials(int(rng.integers(1, 6)), rng), drawn.kinds[0, i].tolist()
        one = reference.Particle(
            dict(zip(LATENTS, drawn.values[0, i].tolist(), strict=True)), shape, noise, present, change
        )
        got = log_likelihoods(fields[:, i : i + 1].copy(), columns(told)).item()
        apart = max(apart, abs(got - reference.log_likelihood(one, told)))
    return apart


def test_the_engine_has_the_law_of_the_reference() -> None:
    assert furthest(150, 1) < 1e-3


@pytest.mark.slow
def test_the_engine_has_the_law_of_the_reference_for_ten_thousand_particles() -> None:
    assert furthest(10_000, 2) < 1e-3
