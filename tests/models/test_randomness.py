"""Streams of random numbers, and picks of weighted samples."""

from __future__ import annotations

import math

import numpy as np

from isiw.models.shared.draws import SIMULATED, seeds, stream, systematic


def draw(seed: int, step: int) -> list[float]:
    return [*stream(seed, step).random(4).tolist(), *seeds(seed, step, 2).tolist()]


def test_each_seed_and_step_has_a_stream_of_its_own_that_is_the_same_again() -> None:
    assert draw(1, 2) == draw(1, 2)
    streams = {tuple(draw(seed, step)) for seed in (0, 1, 2) for step in (0, 1, 2, SIMULATED)}
    assert len(streams) == 12


def test_a_particle_is_picked_in_proportion_to_its_weight() -> None:
    log_weights = np.log([[0.5, 1e-300, 0.3, 0.2], [0.25] * 4])
    picks = systematic(log_weights, 20)
    assert np.bincount(picks[0], minlength=4).tolist() == [10, 0, 6, 4]
    assert np.bincount(picks[1], minlength=4).tolist() == [5] * 4
    assert (np.diff(picks) >= 0).all()


def test_weights_that_rounding_leaves_short_of_one_pick_nothing_beyond_the_last() -> None:
    log_weights = np.full((1, 3), -math.inf)
    log_weights[0, 2] = 0.0
    assert systematic(log_weights, 7).tolist() == [[2] * 7]
