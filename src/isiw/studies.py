"""Studies: strategies × cohorts × people, each a simulated session, to one table.

Every strategy meets the same people with the same trial noise, so that differences can be read pairwise.
"""

from __future__ import annotations

import itertools
import math
import multiprocessing
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from typing import Any, Protocol

import pandas as pd
import torch

from isiw.catalogue import make_strategy
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.metrics import covers, f1
from isiw.subjects import SimulatedSubject, cohort
from isiw.window import Window, WindowEstimate

__all__ = ["Player", "SimulatedSession", "paired_sessions", "play", "run_study", "simulate"]


class Player(Protocol):
    """What proposes ISIs in a simulated session: a strategy, or a benchmark's yardstick."""

    def ask(self) -> float:
        """The next ISI [ms]."""

    def tell(self, isi_ms: float | None, mep_mv: float | None = None, *, isi_sd_ms: float = 0.0) -> None:
        """Learn from one trial."""

    def estimate(self) -> WindowEstimate | Window | None:
        """What is believed about the window now."""


@dataclass(frozen=True)
class SimulatedSession:
    """One session of a study.

    Args:
        strategy: a named strategy.
        cohort: a named cohort.
        person: which person of it, from 0.
        seed: seed of the cohort; trial noise and strategy use `seed + person`.
        trials: how many trials to run, whatever the stopping rule says.
        marks: after which trials the estimate is recorded.
        space: the design space.
        settings: settings of the strategy, as (name, value) pairs.
    """

    strategy: str
    cohort: str
    person: int
    seed: int
    trials: int
    marks: tuple[int, ...]
    space: DesignSpace = VALVE_SPACE
    settings: tuple[tuple[str, Any], ...] = field(default=())

    def __post_init__(self) -> None:
        if self.trials < 1 or self.person < 0:
            raise InvalidValueError("a session needs a trial and a person", got=(self.trials, self.person))

    def subject(self) -> SimulatedSubject:
        """The simulated person."""
        return cohort(self.cohort, self.person + 1, self.seed)[self.person]


def simulate(session: SimulatedSession) -> pd.DataFrame:
    """Run one session with its named strategy; columns as in `run_study`."""
    torch.set_num_threads(1)
    strategy = make_strategy(session.strategy, session.space, session.seed + session.person, **dict(session.settings))
    return play(session, strategy)


def play(session: SimulatedSession, player: Player) -> pd.DataFrame:
    """Run one session with any player; columns as in `run_study`."""
    subject = session.subject()
    truth = subject.window(session.space)
    responder = subject.begin(session.seed + session.person)
    rows = []
    for trial in range(1, session.trials + 1):
        began_s = time.perf_counter()
        isi_ms = player.ask()
        asked_s = time.perf_counter()
        response = responder.respond(isi_ms, session.space.reference)
        answered_s = time.perf_counter()
        player.tell(response.isi_ms, response.mep_mv, isi_sd_ms=response.isi_sd_ms)
        told_s = time.perf_counter()
        if trial in session.marks:
            times = {"ask_ms": 1e3 * (asked_s - began_s), "tell_ms": 1e3 * (told_s - answered_s)}
            rows.append({"trial": trial} | _judged(player.estimate(), truth, session.space) | times)
    return pd.DataFrame(rows).assign(strategy=session.strategy, cohort=session.cohort, person=session.person)


def _judged(estimate: WindowEstimate | Window | None, truth: Window | None, space: DesignSpace) -> dict[str, Any]:
    posterior = estimate if isinstance(estimate, WindowEstimate) else None
    reported = posterior.window if posterior is not None else estimate
    covered = None if posterior is None or truth is None else covers(posterior, truth, space)
    return {
        "f1": f1(estimate, truth, space),
        "true_window": truth is not None,
        "reported_window": reported is not None,
        "probability": math.nan if posterior is None or posterior.probability is None else posterior.probability,
        "start_covered": math.nan if covered is None else float(covered[0]),
        "end_covered": math.nan if covered is None else float(covered[1]),
    }


def run_study(
    sessions: Sequence[SimulatedSession],
    *,
    workers: int = 1,
    run: Callable[[SimulatedSession], pd.DataFrame] = simulate,
    on_done: Callable[[SimulatedSession], None] = lambda _session: None,
) -> pd.DataFrame:
    """Run sessions, in this process or in several.

    Args:
        sessions: the sessions.
        workers: how many processes; 1 runs them here.
        run: runs one session; importable where it is to run in another process.
        on_done: called after each session, for progress.

    Returns:
        One row a mark of each session: strategy, cohort, person, trial, f1, whether there is and was reported a
        window, its probability, whether the 90 % intervals cover start and end (NaN where there are none), and the
        time of the last ask and tell [ms]; sorted.

    Raises:
        InvalidValueError: fewer than one worker.
    """
    if workers < 1:
        raise InvalidValueError("a study needs at least one worker", got=workers)
    tables = []
    for session, table in _results(sessions, run, workers):
        tables.append(table)
        on_done(session)
    keys = ["strategy", "cohort", "person", "trial"]
    return pd.concat(tables, ignore_index=True).sort_values(keys, ignore_index=True)


def _results(
    sessions: Iterable[SimulatedSession], run: Callable[[SimulatedSession], pd.DataFrame], workers: int
) -> Iterator[tuple[SimulatedSession, pd.DataFrame]]:
    if workers == 1:
        yield from ((session, run(session)) for session in sessions)
        return
    # Forked children would inherit torch's thread pool in an undefined state.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(run, session): session for session in sessions}
        for future in as_completed(running):
            yield running[future], future.result()


def paired_sessions(
    strategies: Iterable[str],
    cohorts: Iterable[str],
    people: int,
    *,
    seed: int,
    trials: int,
    marks: tuple[int, ...],
    space: DesignSpace = VALVE_SPACE,
) -> list[SimulatedSession]:
    """Every strategy with the same people of every cohort."""
    return [
        SimulatedSession(strategy, name, person, seed, trials, marks, space)
        for strategy, name, person in itertools.product(strategies, cohorts, range(people))
    ]
