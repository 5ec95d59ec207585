"""A method with a person, step by step: what was told, believed and reported after each trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

import isiw
from benchmarks.reduction.guess import UNRELATED, unrelated
from benchmarks.reduction.wrong import MISREAD, MISREAD_SETTINGS
from benchmarks.waveform_loop import Pair, robot, session_of
from isiw.design import IMPACT_SPACE, DesignSpace
from isiw.subjects import SimulatedSubject
from isiw.trials import Trial
from isiw.types import FloatArray
from isiw.window import Window

__all__ = ["GENERATION", "INITIAL", "SPACE", "Course", "live", "online"]

SPACE: Final = DesignSpace(0, 500, 5.0, reference="valve")
INITIAL: Final = 7
GENERATION: Final = 30
"""Particles of the filter (4.3.2)."""

Answer = Callable[[float], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Course:
    """One session of a method with a person.

    Args:
        person: index in the cohort.
        told: ISI [ms] and MEP [mV] of each trial.
        profiles_mv: expected MEP on the grid after each trial from the seventh on [mV].
        windows: the reported windows after the same trials.
        spread: PF only: after each generation, its particles' mean and SD [ms].
        particles_ms: PF only: the last complete generation [ms].
        amplitudes_mv: of the fitted Gaussians [mV].
    """

    person: int
    told: list[tuple[float, float]]
    profiles_mv: list[FloatArray]
    windows: list[Window | None]
    spread: list[tuple[float, float]]
    particles_ms: FloatArray
    amplitudes_mv: tuple[float, ...]

    @property
    def iterations(self) -> int:
        """How many fits there were, from the seven initial ISIs on."""
        return len(self.told) - INITIAL + 1


def live(method: str, people: Sequence[SimulatedSubject], person: int, seed: int, wrong: str = "") -> Course:
    """One session of a method, ISIs from the valve command.

    Args:
        method: a named strategy.
        people: of a cohort.
        person: which of them.
        seed: of the session; the person's number is added.
        wrong: which model that is wrong on purpose, `UNRELATED` or `MISREAD`; empty: none.
    """
    responder = people[person].begin(seed + person)
    settings = dict(MISREAD_SETTINGS["nr" if method == "nr2" else method]) if wrong == MISREAD else {}
    strategy = isiw.make_strategy(method, SPACE, seed + person, **settings)

    def answer(isi_ms: float) -> tuple[float, float]:
        response = responder.respond(isi_ms, "valve")
        return isi_ms if response.isi_ms is None else response.isi_ms, response.mep_mv

    asked = unrelated(answer, SPACE, seed + person) if wrong == UNRELATED else answer
    return _followed(strategy, _asked(strategy, asked), person)


def _asked(strategy: isiw.Strategy, answer: Answer) -> Iterator[tuple[float, float]]:
    """The trials of a session until the strategy stops, each told to it."""
    while not strategy.decision().stop:
        answered = answer(strategy.ask())
        strategy.tell(*answered)
        yield answered


def _learnt(strategy: isiw.Strategy, trials: Iterable[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """The trials of a session that is over, each learnt by the strategy."""
    for trial in trials:
        strategy.learn(Trial.of(*trial))
        yield trial


def _followed(strategy: isiw.Strategy, trials: Iterable[tuple[float, float]], person: int) -> Course:
    """The estimates of a strategy after each of the trials."""
    course = Course(person, [], [], [], [], np.array([]), ())
    generation: list[float] = []
    for answered in trials:
        course.told.append(answered)
        estimate = strategy.estimate()
        generation.append(answered[0])
        if estimate.spread_ms is not None and (window := estimate.window) is not None and len(generation) == GENERATION:
            course.spread.append((0.5 * (window.start_ms + window.end_ms), estimate.spread_ms))
            course = replace(course, particles_ms=np.array(generation))
            generation = []
        if len(course.told) >= INITIAL:
            band = estimate.profile(strategy.space.grid_ms)
            course.profiles_mv.append(np.array([]) if band is None else band.median_mv)
            course.windows.append(estimate.window)
    curves = getattr(strategy.posterior, "curves", ())
    return replace(course, amplitudes_mv=curves[0].amplitudes_mv if curves else ())


def online(people: Sequence[SimulatedSubject], person: int, seed: int) -> Course:
    """One session of NR on the robot's waveforms, ISIs from the impact.

    Args:
        people: of a cohort.
        person: which of them.
        seed: of the session; the person's number is added.
    """
    pair = Pair("impact", "open-loop", seed, person, seed + person, 0)
    played = session_of(robot(people[person], pair), isiw.make_strategy("nr", IMPACT_SPACE, seed + person))
    told = [(trial.isi_ms, trial.mep_mv) for trial in played.trials if trial.reason is None and not trial.tap_alone]
    # Once more, on what the session measured: a session does not keep its profiles.
    again = isiw.make_strategy("nr", IMPACT_SPACE, seed + person)
    return _followed(again, _learnt(again, told), person)
