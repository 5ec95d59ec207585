"""Pulses of TMS alone before and after an intervention, from simulated people."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

from isiw.studies import Intervened, InterventionPlan, intervene
from isiw.subjects import Drift, PeakProfile, Plasticity, SimulatedSubject, cohort

BEST_MS = 90.0


@cache
def _people() -> list[SimulatedSubject]:
    return cohort("hand", 40, 7)


def person(number: int) -> SimulatedSubject:
    """A person with a hand's recruitment curve, whose best ISI is `BEST_MS` after the impact."""
    return replace(_people()[number], profile=PeakProfile(BEST_MS - 40.0, 80.0), hit_delay_sd_ms=0.0)


@cache
def visit(
    number: int, factor: float = 1.0, drift: Drift | None = None, plan: InterventionPlan | None = None
) -> Intervened:
    """An intervention that changes a person's gain by a factor, which stays."""
    subject = replace(person(number), drift=drift, plasticity=Plasticity(math.log(factor), 2.0))
    return intervene(subject, BEST_MS, "impact", plan or InterventionPlan(pairs=50), seed=number)
