"""The hierarchical law, with people whose posterior given the usual prior is known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from isiw.priors.population import HyperPrior, LatentBlock, Law, People, Population, learnt
from isiw.types import FloatArray

USUAL_SD, ERROR_SD = 8.0, 0.7
HYPER = HyperPrior(np.zeros(1), np.full(1, USUAL_SD), np.full(1, 3.0))
KINDS = np.array([0.5, 0.3, 0.2])


def population_of(values: Any, *, kinds: Any = None, used: Any = True) -> Population:
    """What is learnt of people whose value was measured with an error; the usual prior is N(0, 8)."""
    rng = np.random.default_rng(1)
    measured = np.asarray(values) + ERROR_SD * rng.standard_normal(len(values))
    shrunk = USUAL_SD**2 / (USUAL_SD**2 + ERROR_SD**2)
    particles = shrunk * measured[:, None] + np.sqrt(shrunk) * ERROR_SD * rng.standard_normal((len(values), 300))
    block = LatentBlock(
        particles[..., None], stats.norm.logpdf(particles, scale=USUAL_SD), np.full(particles.shape, fill_value=used)
    )
    kind = np.zeros(particles.shape, dtype=np.int64) if kinds is None else kinds
    return learnt(People({"x": block}, {"kind": kind}), {"x": HYPER}, {"kind": KINDS}, np.random.default_rng(2))


def law_of(values: Any) -> Law:
    return population_of(values).laws["x"]


def people_at(mean: float, count: int, sd: float = 1.0) -> np.ndarray:
    return mean + sd * stats.norm.ppf((np.arange(count) + 0.5) / count)


@pytest.mark.slow
def test_the_law_of_many_people_is_theirs() -> None:
    law = law_of(people_at(6.0, 100))
    assert law.mean[0] == pytest.approx(6.0, abs=0.3)
    assert law.sd[0] == pytest.approx(1.0, abs=0.35)
    assert law.members > 90


@pytest.mark.slow
def test_fewer_people_leave_a_wider_law() -> None:
    spreads = [law_of(people_at(6.0, count)).sd[0] for count in (2, 10, 60)]
    assert spreads[0] > 1.15 * spreads[1] > 1.15**2 * spreads[2]
    assert spreads[0] > 2.0


@pytest.mark.slow
def test_one_odd_person_does_not_bend_the_law() -> None:
    without, with_one = law_of(people_at(6.0, 12)), law_of([*people_at(6.0, 12), -18.0])
    assert with_one.mean[0] == pytest.approx(without.mean[0], abs=0.5)
    assert with_one.sd[0] < 1.3 * without.sd[0]
    assert with_one.members < 12.5


@pytest.mark.usefixtures("few_sweeps")
def test_nobody_teaches_a_law_of_what_their_particles_do_not_use() -> None:
    assert population_of(people_at(6.0, 10), used=False).laws["x"].members == 0


@pytest.mark.slow
def test_kinds_that_come_often_are_expected_more() -> None:
    kinds = np.tile(np.array([2, 2, 2, 1]), (8, 75))
    shares = population_of(people_at(6.0, 8), kinds=kinds).shares["kind"]
    assert shares.sum() == pytest.approx(1.0)
    assert shares[2] > 0.45
    assert 0.05 < shares[0] < 0.25


@pytest.mark.slow
def test_kinds_that_mean_nothing_to_a_particle_teach_nothing() -> None:
    shares = population_of(people_at(6.0, 8), kinds=np.full((8, 300), -1)).shares["kind"]
    assert shares == pytest.approx(KINDS, abs=0.03)


def shares_after_nothing(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    values, kinds = USUAL_SD * rng.standard_normal((12, 500)), rng.choice(3, size=(12, 500), p=KINDS)
    used = kinds != 2  # the third kind has no such latent, as who has no window has no start
    people = People(
        {"x": LatentBlock(values[..., None], stats.norm.logpdf(values, scale=USUAL_SD), used)}, {"kind": kinds}
    )
    return learnt(people, {"x": HYPER}, {"kind": KINDS}, rng).shares["kind"]


@pytest.mark.slow
def test_people_of_whom_nothing_is_known_teach_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    # Seeds differ by .11 (SD) with so few, and their mean lies within .004.
    monkeypatch.setattr("isiw.priors.population.SWEEPS", 400)
    monkeypatch.setattr("isiw.priors.population.BURN_IN", 100)
    found = [shares_after_nothing(seed) for seed in range(12)]
    assert np.mean(found, axis=0) == pytest.approx(KINDS, abs=0.06)
