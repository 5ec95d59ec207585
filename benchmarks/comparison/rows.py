"""What is compared, in parts that are run one after the other: named strategies, and models × acquisition functions.

A part is a study. Within a part all rows have the same people; between parts the first people are the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import isiw
from isiw.acquisition.registry import ACQUISITIONS
from isiw.errors import StrategyError
from isiw.studies import StudyStrategy

EVEN: Final = "even"
GUESS: Final = "guess"
"""The fixed window that is best for other people, the same for everybody."""

FAMILIES: Final[Mapping[str, str]] = {"particles": "default", "gp": "gp-straddle", "parametric": "parametric-mi"}
"""By what a row of the matrix is called, a named strategy with that family's model."""

BOTORCH: Final = "benchmarks.comparison.botorch_rows:gaussian_process"
BOTORCH_FUNCTIONS: Final = ("ei", "nipv", "jes")
NUTS: Final = "parametric-mi+nuts"


@dataclass(frozen=True)
class Part:
    """Rows that are run together.

    Args:
        name: what it is called, also as a folder.
        strategies: its rows.
        people: of each cohort at most; 0 for all.
        batch: people side by side.
        cohorts: the cohorts that it is restricted to; none for all.
    """

    name: str
    strategies: tuple[StudyStrategy, ...]
    people: int = 0
    batch: int = 25
    cohorts: tuple[str, ...] = ()


def parts(slow_people: int, reference_people: int, rows: int = 0) -> tuple[Part, ...]:
    """All parts, the quick and most important ones first.

    Args:
        slow_people: people of each cohort for the rows of BoTorch and of the parametric family, which are slow.
        reference_people: of `recruitment` for the reference by NUTS, which takes half a minute a trial.
        rows: of each part but the first at most, for a quick look; 0 for all.
    """
    botorch = tuple(StudyStrategy(BOTORCH, {"function": name}, f"gp+botorch-{name}") for name in BOTORCH_FUNCTIONS)
    nuts = StudyStrategy("parametric-mi", {"method": "nuts"}, NUTS)
    every = (
        Part("named", _named("default", EVEN, "random", "particles-window", "particles-mi", "nr", "pf", "incremental")),
        Part("regressions", _named("gpr", "svmr", "nr2")),
        Part("particles", matrix("particles")),
        Part("gp", (*_named("gp-straddle", "gp-variance", "gp-ei"), *matrix("gp")), batch=10),
        Part("supra", _named("supra-threshold"), batch=10),
        Part("botorch", botorch, slow_people, 10),
        Part("parametric", (*_named("parametric-mi", "parametric-window"), *matrix("parametric")), slow_people, 10),
        Part("nuts", (nuts,), reference_people, 1, ("recruitment",)),
    )
    return (every[0], *(replace(part, strategies=part.strategies[: rows or None]) for part in every[1:]))


def _named(*names: str) -> tuple[StudyStrategy, ...]:
    return tuple(map(StudyStrategy, names))


def matrix(family: str) -> tuple[StudyStrategy, ...]:
    """A family's model with each acquisition function that it can be asked by, but those that a named strategy is.

    Args:
        family: one of `FAMILIES`.
    """
    name = FAMILIES[family]
    named = [isiw.make_strategy(each).recipe for each in isiw.list_strategies()]
    return tuple(
        StudyStrategy(name, {"acquisition": acquisition}, f"{family}+{acquisition}")
        for acquisition, settings in _settings_of(name)
        if settings not in [recipe.settings for recipe in named]
    )


def _settings_of(name: str) -> Iterator[tuple[str, Mapping[str, object]]]:
    """The acquisition functions that work with a named strategy's model, and all settings with each."""
    for acquisition in ACQUISITIONS:
        try:
            recipe = isiw.make_strategy(name, acquisition=acquisition).recipe
        except StrategyError:  # the model's posterior has not what it needs
            continue
        yield acquisition, recipe.settings


def chosen(every: Sequence[Part], names: Sequence[str]) -> tuple[Part, ...]:
    """The parts of some names; without names all.

    Args:
        every: all parts.
        names: of those that are wanted.

    Raises:
        ValueError: an unknown name.
    """
    if unknown := set(names) - {part.name for part in every}:
        raise ValueError(f"no such parts: {', '.join(sorted(unknown))}; there are {', '.join(p.name for p in every)}")
    return tuple(part for part in every if not names or part.name in names)
