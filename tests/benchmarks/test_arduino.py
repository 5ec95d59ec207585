"""Pairs at the pins of a board beside the trials of a log."""

from __future__ import annotations

import pytest
from benchmarks.arduino import compared
from benchmarks.simulated_board import HZ, Edge, pairs_of

from isiw.trials import Status, Stimulus, Trial


def given(*isi_ms: float) -> list[tuple[Edge, Edge]]:
    edges: list[Edge] = []
    for second, each_ms in enumerate(isi_ms):
        edges += [Edge(second * HZ, "valve", 1), Edge(second * HZ + round(each_ms * HZ / 1000), "trigger", 1)]
    return pairs_of(edges)


def accepted(isi_ms: float) -> Trial:
    return Trial(0, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=0.1)


def unknown(isi_ms: float) -> Trial:
    return Trial.unknown(Stimulus(0, isi_ms))


@pytest.mark.parametrize(
    ("pairs", "trials", "faults"),
    [
        ((40.0, 50.0), [accepted(40.0), accepted(50.0)], (0, 0)),
        ((40.0,), [unknown(40.0), accepted(40.0)], (0, 0)),
        ((40.0, 40.0), [unknown(40.0), accepted(40.0)], (0, 0)),
        ((40.0, 45.0, 50.0), [accepted(40.0), accepted(50.0)], (1, 0)),
        ((40.0,), [accepted(40.0), accepted(50.0)], (0, 1)),
        ((40.0, 40.0), [accepted(40.0)], (1, 0)),
    ],
)
def test_a_pair_without_a_trial_and_a_trial_without_its_pair_are_found(
    pairs: tuple[float, ...], trials: list[Trial], faults: tuple[int, int]
) -> None:
    assert compared(given(*pairs), trials) == faults
