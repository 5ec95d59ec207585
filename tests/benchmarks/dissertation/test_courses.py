from __future__ import annotations

import numpy as np
import pytest
from benchmarks.dissertation.courses import GENERATION, INITIAL, SPACE, live, online

from isiw.subjects import cohort

PEOPLE = cohort("kim11", 5, 5)


@pytest.mark.slow
def test_a_course_has_a_profile_and_a_window_for_each_iteration() -> None:
    course = live("gpr", PEOPLE, 1, seed=5)
    assert course.iterations == len(course.told) - INITIAL + 1 == len(course.profiles_mv) == len(course.windows)
    assert all(len(profile_mv) == len(SPACE.grid_ms) for profile_mv in course.profiles_mv)
    initial_ms = [isi_ms for isi_ms, _ in course.told[:INITIAL]]
    np.testing.assert_allclose(initial_ms, np.linspace(0, 500, INITIAL), atol=2.5)  # on the 5 ms grid


@pytest.mark.slow
def test_a_filter_has_one_spread_for_each_generation_and_its_last_particles() -> None:
    course = live("pf", PEOPLE, 1, seed=5)
    assert len(course.told) == GENERATION * len(course.spread)
    assert course.particles_ms.tolist() == [isi_ms for isi_ms, _ in course.told[-GENERATION:]]
    assert course.spread[-1][1] <= 25.0 < course.spread[0][1]


@pytest.mark.slow
def test_two_gaussians_have_two_amplitudes() -> None:
    high, low = live("nr2", PEOPLE, 0, seed=5).amplitudes_mv
    assert high >= low >= 0


@pytest.mark.slow
def test_online_the_isis_count_from_the_impact_and_come_from_waveforms() -> None:
    course = online(PEOPLE, 4, seed=5)
    isi_ms, mep_mv = np.array(course.told).T
    assert isi_ms.min() >= 0
    assert isi_ms.max() <= 320 + 10
    assert (mep_mv > 0).all()
    assert not np.array_equal(isi_ms, isi_ms.round())  # measured, not commanded
