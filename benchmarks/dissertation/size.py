"""How much is run."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FEW", "FULL", "Size"]


@dataclass(frozen=True)
class Size:
    """How much is run.

    Args:
        taps: taps for each ISI of the precision study; the event table has the text's numbers, or these where fewer.
        sweeps: sweeps over ISIs whose responses are counted, for each kind of stimulation.
        runs: runs of the example methods with each of the eleven people.
        people: people whose excitability their pairs change.
    """

    taps: int
    sweeps: int
    runs: int
    people: int


FULL = Size(taps=100, sweeps=40, runs=3, people=20)
FEW = Size(taps=30, sweeps=5, runs=1, people=2)
