"""When particles no longer represent the posterior."""

from __future__ import annotations

import math

import numpy as np
import pytest

import isiw
from isiw.models.particles.swarm import Health, distinct_share, trouble_of
from isiw.subjects.cohorts import cohort


def trouble(*, ess: float = 0.5, shifts: float = 0.3, distinct: float = 0.9) -> str | None:
    *health, shares = (np.array([0.5, value]) for value in (ess, shifts, 0.2, distinct))
    return trouble_of(Health(*health), shares)


def test_copies_of_a_particle_count_once() -> None:
    assert distinct_share(np.array([[-1.0, -2.0, -1.0, -1.0]], dtype=np.float32)).tolist() == [0.5]


def test_sound_particles_are_no_trouble() -> None:
    assert trouble() is None
    assert trouble(shifts=math.nan) is None


@pytest.mark.parametrize(
    ("bad", "said"),
    [({"ess": 0.001}, "contradicts"), ({"shifts": 0.001}, "hardly move"), ({"distinct": 0.1}, "too much alike")],
)
def test_each_trouble_of_any_person_is_said(bad: dict[str, float], said: str) -> None:
    assert said in (trouble(**bad) or "")


@pytest.mark.filterwarnings("ignore:The last 3 amplitudes are")
@pytest.mark.parametrize("seed", range(3))
def test_an_amplifier_whose_unit_changes_is_told_as_a_contradiction(seed: int) -> None:
    # 20 MEPs of some 10 µV, then a thousand times as large ones. The first may be a large MEP of a hand, five are not.
    rng, strategy = np.random.default_rng(seed), isiw.make_strategy(seed=seed)
    for isi_ms in np.linspace(120, 460, 20).tolist():
        strategy.tell(isi_ms, 0.01 * math.exp(0.2 * rng.standard_normal()))
        assert strategy.trouble is None
    troubles = []
    for isi_ms in (250.0, 400.0, 150.0, 300.0, 450.0):
        strategy.tell(isi_ms, 10.0 * math.exp(0.2 * rng.standard_normal()))
        troubles.append(strategy.trouble or "")
    assert any("contradicts the estimate before it" in trouble for trouble in troubles)


@pytest.mark.parametrize("name", ["recruitment", "outliers", "nonresponder"])
def test_people_as_they_are_cause_no_trouble(name: str) -> None:
    strategy, responder = isiw.make_strategy(seed=2), cohort(name, 1, 3)[0].begin(1)
    for _ in range(15):
        isi_ms = strategy.ask()
        strategy.tell(isi_ms, responder.respond(isi_ms, "valve").mep_mv)
        assert strategy.trouble is None
