"""The engine has the law of the reference in plain NumPy: log likelihoods of random particles and histories."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import torch
from hatch_build import SOURCES

from isiw.design import VALVE_SPACE
from isiw.models.particles import records
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.engine import Compiled
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import LATENTS, Latents
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Prior
from isiw.models.particles.shapes import ShapeKind
from isiw.models.shared.history import Circumstances, History
from isiw.native.engine import COLUMNS, FIELDS, log_likelihoods
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
                log_by_curves=rng.choice([math.nan, math.nan, -1.3]),
            )
        )
    return found


def columns(told: list[reference.Trial]) -> np.ndarray:
    """The trials as the engine has them, (1, n, columns)."""
    made = np.array(
        [
            [
                *(trial.isi_ms, trial.isi_sd_ms, trial.low, trial.high, trial.order, trial.known_mv, trial.known_sd_mv),
                *(0.0, trial.log_offset, trial.shift_pct_rmt, trial.enhancement, trial.log_by_curves),
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


@pytest.mark.parametrize(("first", "last", "names"), [("NOISE", "FIELDS", "field"), ("ISI", "COLUMNS", "column")])
def test_fields_and_columns_have_the_order_of_the_c_header(first: str, last: str, names: str) -> None:
    header = (SOURCES / "people.h").read_text("utf-8")
    (listed,) = re.findall(rf"enum \{{\n    ({first},.*?)\n    {last}\n", header, re.DOTALL)
    in_c = re.findall(r"^\s*([A-Z_]+),", listed, re.MULTILINE)
    if names == "field":
        assert [getattr(records, name) for name in in_c] == list(range(FIELDS))
    else:
        assert len(in_c) == COLUMNS == len(History.empty(1, torch.device("cpu")).columns) + len(Circumstances._fields)
