"""Models that are wrong on purpose: what a claim is worth that holds for them as well.

A claim that counts as reproduced has to fail for one of them, which is really run on the people of the base.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction import initial, particles
from benchmarks.reduction.comparison import PEOPLE_OF_KIM, WORDS
from benchmarks.reduction.guess import FIXED, UNRELATED
from benchmarks.reduction.readings import BASE, PEOPLE
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size

__all__ = ["FIXED", "MISREAD", "MISREAD_SETTINGS", "OTHER_NOISE", "RANDOM", "UNRELATED", "of_part", "sessions"]

RANDOM: Final = "random ISIs"
"""Behind the initial ones, instead of those that the method asks for; the particle filter has its own."""

MISREAD: Final = "the stopping rule misread"
"""The 50 ms² of the edges as an SD of 50 ms; the particles' SD of 25 ms as a variance of 25 ms²."""

OTHER_NOISE: Final = "other noise (people of recruitment)"
"""The noise of people at large, near threshold; run for the comparison anyway."""

MISREAD_SETTINGS: Final[Mapping[str, tuple[tuple[str, Any], ...]]] = {
    **dict.fromkeys(("nr", "svmr", "gpr"), (("stop_variance_ms2", 2500.0),)),
    "pf": (("stop_sd_ms", 5.0),),
}


FEWEST: Final = 2
"""Where so few people have each number of initial ISIs and particles, none has it under a wrong model."""


def sessions(size: Size, seed: int) -> list[Session]:
    """The methods side by side under each wrong model, and the numbers of initial ISIs and particles under one."""
    people = range(min(size.kim, PEOPLE_OF_KIM))
    side_by_side = [
        session
        for method, accelerometer in itertools.product(text.METHODS, WORDS)
        for person in people
        for session in _wrong(Session(method, PEOPLE, person, seed, accelerometer=accelerometer))
    ]
    once = replace(size, sweep=min(size.sweep, PEOPLE_OF_KIM))
    others = (*initial.sessions(once, seed), *particles.sessions(once, seed)) if size.sweep > FEWEST else ()
    return [*side_by_side, *(replace(one, wrong=UNRELATED) for one in others if one.cohort == PEOPLE)]


def _wrong(session: Session) -> list[Session]:
    """A session under every wrong model that there is of its method."""
    found = [
        replace(session, wrong=UNRELATED),
        replace(session, wrong=MISREAD, settings=MISREAD_SETTINGS[session.method]),
    ]
    if session.method == "pf":
        return found
    random = replace(session, wrong=RANDOM, reading=replace(BASE, acquisition="random"))
    return [*found, random, replace(session, wrong=FIXED)]


def of_part(rows: pd.DataFrame, wrong: str, part: str) -> pd.DataFrame:
    """The sessions of a wrong model that belong to a part.

    Args:
        rows: as `sessions` plans them.
        wrong: the wrong model.
        part: "comparison", "initial" or "particles".
    """
    chosen = rows[rows["wrong"] == wrong]
    chosen = chosen.reindex(columns=list(dict.fromkeys((*chosen.columns, "initial", "particles"))))
    if part in chosen:
        return chosen[chosen[part].notna()]
    return chosen[chosen["initial"].isna() & chosen["particles"].isna()]
